"""The configuration of an import, as configs/import.yaml has it."""

from dataclasses import dataclass
from pathlib import Path

from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError
from vision_s2r.imports.convert import import_recording
from vision_s2r.imports.pictures import import_chessboard, import_images
from vision_s2r.imports.table import ImportOptions
from vision_s2r.options import option, validate

PICTURES = ("chessboard", "images")  # sources that become a camera's recording


@dataclass
class ImportConfig(ImportOptions):
    """Everything that `vision-s2r import` reads."""

    source: str = option("csv", "Whose log it is.", choices=("sage", "bam", "lerobot", "bag", "csv", *PICTURES))
    path: str = option("", "The file or folder.")
    real: str = option("", "images: the folder of photographs …")
    sim: str = option("", "… and that of renders.")
    pairing: str = option(
        "",
        "images: paired or unpaired; paired where the names are the same if empty.",
        choices=("", "paired", "unpaired"),
    )
    inner: list[int] = option(
        [], "chessboard: inner corners along and across, [9,6]; common boards are tried if empty."
    )
    out: str = option("recordings/imported", "Folder of the recording; of several joints, each gets a folder in it.")


ConfigStore.instance().store("import_schema", node=ImportConfig)


def import_all(cfg: ImportConfig) -> list[Path]:
    """Write the recordings of cfg's log, print what was read of each; returns their folders."""
    validate(cfg)
    if cfg.source in PICTURES:
        return [_import_pictures(cfg)]
    if not cfg.path:
        raise UserError("path is missing, expected path=FILE or path=DIR, the log to import")
    found = import_recording(cfg.source, cfg.path, cfg.out, cfg)
    for each in found:
        print(each)
    return [each.folder for each in found]


def _import_pictures(cfg: ImportConfig) -> Path:
    """Write the recording of a camera, print what was read; returns its folder."""
    needed = ("path",) if cfg.source == "chessboard" else ("real", "sim")
    for key in needed:
        if not getattr(cfg, key):
            raise UserError(f"{key} is missing, expected {key}=DIR, a folder of pictures")
    if cfg.source == "chessboard":
        found = import_chessboard(Path(cfg.path), Path(cfg.out), cfg.inner)
    else:
        found = import_images(Path(cfg.real), Path(cfg.sim), Path(cfg.out), cfg.pairing)
    print(found)
    return found.folder
