"""The configuration of an import, as configs/import.yaml has it."""

from dataclasses import dataclass
from pathlib import Path

from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError
from vision_s2r.imports.convert import import_recording
from vision_s2r.imports.table import ImportOptions
from vision_s2r.options import option, validate


@dataclass
class ImportConfig(ImportOptions):
    """Everything that `vision-s2r import` reads."""

    source: str = option("csv", "Whose log it is.", choices=("sage", "bam", "lerobot", "csv"))
    path: str = option("", "The file or folder.")
    out: str = option("recordings/imported", "Folder of the recording; of several joints, each gets a folder in it.")


ConfigStore.instance().store("import_schema", node=ImportConfig)


def import_all(cfg: ImportConfig) -> list[Path]:
    """Write the recordings of cfg's log, print what was read of each; returns their folders."""
    validate(cfg)
    if not cfg.path:
        raise UserError("path is missing, expected path=FILE or path=DIR, the log to import")
    found = import_recording(cfg.source, cfg.path, cfg.out, cfg)
    for each in found:
        print(each)
    return [each.folder for each in found]
