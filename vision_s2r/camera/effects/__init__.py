"""One camera effect a file. Importing this package registers every file's effect, and those of other packages."""

import importlib
import pkgutil

from vision_s2r.camera.effect import CAMERA_EFFECTS

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")
CAMERA_EFFECTS.load_installed()
