"""YAML files of keys and values: read with one clear line for what cannot be."""

from pathlib import Path
from typing import Any

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from vision_s2r.errors import UserError


def read(path: Path, what: str) -> dict[Any, Any]:
    """The keys and values of a YAML file; UserError, which says `what` was to be read, where there are none."""
    try:
        content = OmegaConf.to_container(OmegaConf.load(path), resolve=True)
    except (OSError, ValueError, RecursionError, YAMLError, OmegaConfBaseException) as error:
        raise UserError(f"cannot read {what} {path}: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise UserError(f"{what} {path}: expected keys and values")
    return content
