"""The configuration of curves of success against an effect's strength."""

from dataclasses import dataclass

from vision_s2r.camera.effect import CAMERA_EFFECTS
from vision_s2r.errors import UserError
from vision_s2r.options import option, validate
from vision_s2r.scene.changes import CHANGES


@dataclass
class SensitivityConfig:
    """Which rows, effects and strengths are measured, and on how many scenes."""

    rows: list[str] = option([], "Rows of evaluate.rows; empty: all that look at the camera's pictures.")
    effects: list[str] = option([], "Camera effects; empty: all.", unique=True)
    changes: list[str] = option(
        list(CHANGES), "Changes of the real look's light and surfaces.", choices=tuple(CHANGES), unique=True
    )
    strengths: list[float] = option(
        [0.5, 1.0, 2.0],
        "In moderate settings of the effect or change: 0.5 is half way from none.",
        above=0,
        rising=True,
        unique=True,
    )
    limit: int = option(200, "How many of the test scenes, from the first; 0: all.", low=0)


def check(cfg: SensitivityConfig) -> None:
    """Raises UserError where a value is out of its range."""
    validate(cfg, "sensitivity")
    if not cfg.strengths:
        raise UserError("sensitivity.strengths is empty: expected numbers above 0, rising")
    for name in cfg.effects:
        CAMERA_EFFECTS[name]
