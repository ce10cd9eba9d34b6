"""YAML files of keys and values: read with one clear line for what cannot be."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from vision_s2r.errors import UserError, nearest


def read(path: Path, what: str) -> dict[Any, Any]:
    """The keys and values of a YAML file; UserError, which says `what` was to be read, where there are none."""
    try:
        content = OmegaConf.to_container(OmegaConf.load(path), resolve=True)
    except (OSError, UnicodeDecodeError, YAMLError, OmegaConfBaseException) as error:
        raise UserError(f"cannot read {what} {path}: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise UserError(f"{what} {path}: expected keys and values")
    return content


def check_keys(content: Mapping[Any, Any], known: Iterable[str], where: str) -> None:
    """UserError, which begins with `where`, for a key that is not known."""
    known = list(known)
    for key in content:
        if key not in known:
            raise UserError(f"{where}: no key {key!r}, {nearest(str(key), known)}")
