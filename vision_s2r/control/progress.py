"""How a training stands: a line in progress.csv after each episode, and a state to resume from."""

import logging
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r import files
from vision_s2r.training import checkpoint

log = logging.getLogger(__name__)

STATE = "state.pt"


class Progress:
    """Of the training in `out`, from where it stood; `state` is None where it has not begun."""

    def __init__(self, out: Path) -> None:
        self.out = out
        path = out / STATE
        self.state: dict[str, Any] | None = checkpoint.load_state(path) if path.exists() else None
        self.rows: list[list[float]] = self.state["rows"] if self.state else []
        if self.state:
            log.info("%s: goes on at step %d", out, self.steps)

    @property
    def steps(self) -> int:
        """Environment steps up to the last episode's end."""
        return int(self.rows[-1][0]) if self.rows else 0

    def episode(self, steps: int, errors: np.ndarray, tolerance: float, state: dict[str, Any]) -> None:
        """An episode ended after so many steps, with these errors [N, T], in this state."""
        self.rows.append([steps, float(np.mean(np.abs(errors) < tolerance)), float(np.median(np.abs(errors)))])
        lines = [",".join(f"{value:g}" for value in row) for row in self.rows]
        files.write(self.out / "progress.csv", "\n".join(["step,reached,median_error", *lines, ""]))
        checkpoint.save_state(self.out / STATE, {**state, "rows": self.rows})


def machines_of(out: Path) -> dict[str, Any]:
    """The `state` of the machines that the training in `out` ended with."""
    state: dict[str, Any] = checkpoint.load_state(out / STATE)["machines"]
    return state
