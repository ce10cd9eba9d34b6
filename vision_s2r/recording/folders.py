"""The recordings that a command is given, and where what comes of each goes."""

from pathlib import Path
from typing import Any

from vision_s2r.errors import UserError


def folders(recording: Any) -> list[Path]:
    """The folders that a `recording` key names, one or a list; UserError where there is none."""
    given = [recording] if isinstance(recording, str) else recording
    if not isinstance(given, list) or not given or not all(isinstance(each, str) and each for each in given):
        raise UserError(f"recording is {recording!r}, expected recording=DIR or recording=[DIR,DIR]")
    return [Path(each) for each in given]


def outputs(out: str, folders: list[Path]) -> list[Path]:
    """The folder for what comes of each of `folders`: `out` itself, or one of its name in `out` where there are more.

    Raises UserError where one is there twice.
    """
    return [Path(out) / name for name in _names(folders)] if len(folders) > 1 else [Path(out)]


def _names(folders: list[Path]) -> list[str]:
    """A name for each folder: its own, with as many of its parents as tell it from the others."""
    for depth in range(1, max(len(folder.resolve().parts) for folder in folders) + 1):
        names = ["-".join(folder.resolve().parts[-depth:]).strip("/") for folder in folders]
        if len(set(names)) == len(names):
            return names
    raise UserError(f"recording: the same folder twice among {', '.join(map(str, folders))}")
