"""A cell of the table, one training seed of one row in one column: its grasps and what became of them, on disk."""

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.files import write
from vision_s2r.scene import Outcome


@dataclass(frozen=True)
class Cell:
    """Grasps [N, 3] (x, y in metres, yaw in radians), Q of each [N], and their outcomes, one for each scene."""

    grasps: np.ndarray
    q: np.ndarray
    outcomes: list[Outcome]

    @property
    def success(self) -> np.ndarray:
        """bool [N]."""
        return np.array([outcome.success for outcome in self.outcomes])

    def save(self, path: Path, fingerprint: str) -> None:
        """Write as JSON, whole or not at all. Raises UserError where that cannot be."""
        data = {
            "fingerprint": fingerprint,
            "grasps": self.grasps.tolist(),
            "q": self.q.tolist(),
            "outcomes": [asdict(outcome) for outcome in self.outcomes],
        }
        write(path, json.dumps(data))

    @classmethod
    def load(cls, path: Path, fingerprint: str) -> "Cell | None":
        """What `save` wrote; None where there is nothing, or what is there came of other inputs or is damaged."""
        try:
            data = json.loads(path.read_text())
            if data["fingerprint"] != fingerprint:
                return None
            outcomes = [Outcome(**outcome) for outcome in data["outcomes"]]
            return cls(np.array(data["grasps"]).reshape(-1, 3), np.array(data["q"]), outcomes)
        except (OSError, ValueError, KeyError, TypeError):
            return None


def fingerprint(*inputs: Any) -> str:
    """SHA-256 of JSON-able values: all that a cell depends on."""
    return hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()


def cell_path(folder: Path, row: str, column: str, seed: int) -> Path:
    """Where the cell of the row's training seed in the column lies in the folder of an evaluation."""
    return folder / "cells" / row / column / f"{seed}.json"
