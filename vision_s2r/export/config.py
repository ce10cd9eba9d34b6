"""The configuration of an export, as configs/export.yaml has it."""

from dataclasses import dataclass

from hydra.core.config_store import ConfigStore

from vision_s2r.options import option


@dataclass
class ExportConfig:
    """Everything that `vision-s2r export` reads."""

    checkpoint: str = option("bin-64", "A released checkpoint: a file (.safetensors), or a name in the package.")
    out: str = option("outputs/export", "Folder of what is written.")


ConfigStore.instance().store("export_schema", node=ExportConfig)
