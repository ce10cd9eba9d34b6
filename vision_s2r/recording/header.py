"""recording.yaml: keys, choices and numbers, each checked where it is taken."""

import math
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml

from vision_s2r.errors import UserError, nearest

FORMAT = "vision-s2r/recording/1"
LARGEST = 1 << 20  # bytes: a header is a page, not a data set


def load(folder: Path) -> dict[str, Any]:
    """The keys of FOLDER/recording.yaml, every value as text: each key's own reader says what it should be.

    Raises UserError where there is none, or it is no mapping, or of another format.
    """
    path = folder / "recording.yaml"
    if not os.path.isdir(folder):  # noqa: PTH112  # Path raises where the name is too long for one
        raise UserError(f"{folder}: no such folder, expected a recording")
    if not path.is_file():
        state = "an empty folder" if not any(folder.iterdir()) else "no recording.yaml in it"
        raise UserError(f"{folder}: {state}, expected a recording")
    content = _parse(path)
    if not isinstance(content, dict) or not all(isinstance(key, str) for key in content):
        raise UserError(f"{path}: expected keys and values, as in 'kind: joint'")
    if content.get("format") != FORMAT:
        raise UserError(f"{path}: format is {content.get('format', 'missing')!r}, expected '{FORMAT}'")
    return content


def mapping(content: Mapping[str, Any], key: str, where: str) -> dict[str, Any]:
    """The value of `key`, which is keys and values itself."""
    value = content[key]
    if not isinstance(value, dict) or not all(isinstance(each, str) for each in value):
        raise UserError(f"{where}: {key} is {_short(value)}, expected keys and values")
    return value


def number(content: Mapping[str, Any], key: str, where: str, low: float, high: float, inclusive: bool = True) -> float:
    """The value of `key` as a finite float from `low` (itself excluded unless `inclusive`) to `high`."""
    try:
        value = float(content[key])
    except (TypeError, ValueError):
        value = math.nan
    if math.isfinite(value) and low <= value <= high and (inclusive or value != low):
        return value
    bound = "" if math.isinf(low) else f" from {low:g}" if inclusive else f" above {low:g}"
    raise UserError(f"{where}: {key} is {_short(content[key])}, expected a number{bound}")


def choice(content: Mapping[str, Any], key: str, choices: Iterable[str], where: str, default: str | None = None) -> str:
    """The value of `key`, one of `choices`; `default` where it is absent."""
    value = content.get(key, default)
    choices = list(choices)
    if not isinstance(value, str) or value not in choices:
        raise UserError(f"{where}: {key} is {_short(value)}, {nearest(str(value), choices)}")
    return value


def _parse(path: Path) -> Any:
    try:
        if path.stat().st_size > LARGEST:
            raise UserError(f"{path}: of {path.stat().st_size} bytes, expected a page of keys and values")
        # BaseLoader keeps scalars as text: YAML 1.1 would make 1e-3 a text anyway, and no a truth.
        return yaml.load(path.read_text(encoding="utf-8-sig"), yaml.BaseLoader)
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark else ""
        raise UserError(f"{path}{where}: is not YAML ({_reason(error)})") from error


def _reason(error: Exception) -> str:
    if isinstance(error, RecursionError):
        return "nested too deeply"
    return _printable(str(getattr(error, "problem", None) or str(error).splitlines()[0]))


def _short(value: Any) -> str:
    text = "missing" if value is None else f"{value!r}" if isinstance(value, str) else "a list or a mapping"
    return text if len(text) <= 60 else f"{text[:57]}…"


def _printable(text: str) -> str:
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())
