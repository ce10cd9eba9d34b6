"""The files of a benchmark: JSON that two machines write alike."""

import hashlib
import json
from pathlib import Path
from typing import Any

from vision_s2r.errors import UserError
from vision_s2r.files import write


def canonical(value: Any) -> str:
    """JSON of a value in its one canonical form: sorted keys, no spaces, no NaN."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)


def commitment(salt: str, answer: Any) -> str:
    """SHA-256 of the salt followed by the answer's canonical JSON, in hex."""
    return hashlib.sha256((salt + canonical(answer)).encode()).hexdigest()


def write_json(path: Path, value: Any) -> None:
    """Write readable JSON, whole or not at all. Raises UserError where that cannot be."""
    write(path, json.dumps(value, indent=1, sort_keys=True) + "\n")


def read_json(path: Path) -> Any:
    """Read JSON. Raises UserError where there is none."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: cannot be read as JSON ({error})") from error
