"""Logs of other projects, as recordings: folder or file in, folders that `vision_s2r.recording.read` takes out.

`import_recording(source, path, out)` writes one recording a joint and says of each what was read, what is missing and
what was left out, with a plot. A source is a module with `load(path, options)`, which gives `Table`s; everything behind
that is shared. Photographs are the other way in: `import_chessboard` and `import_images` write recordings of a camera.
"""

from vision_s2r.imports.config import ImportConfig, import_all
from vision_s2r.imports.convert import SOURCES, Imported, import_recording
from vision_s2r.imports.pictures import ImportedPictures, import_chessboard, import_images
from vision_s2r.imports.table import ImportOptions

__all__ = [
    "SOURCES",
    "ImportConfig",
    "ImportOptions",
    "Imported",
    "ImportedPictures",
    "import_all",
    "import_chessboard",
    "import_images",
    "import_recording",
]
