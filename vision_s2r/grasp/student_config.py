"""The configuration of a student."""

from dataclasses import dataclass

from vision_s2r.errors import UserError
from vision_s2r.options import option, validate
from vision_s2r.training import TrainingConfig
from vision_s2r.training import config as training_config


@dataclass
class StudentConfig:
    """The grasps of each scene that a student is asked about, and its training.

    What it learns at each is the chance that the canonical policy gives it in the true canonical picture.
    """

    start: str = option(
        "",
        "A released policy, or a checkpoint, that the student begins as. Empty: the one that was trained before it.",
    )
    random: int = option(9, "Grasps anywhere in the bin.", low=0)
    near_best: int = option(8, "Grasps around the canonical policy's best of the candidates.", low=0)
    own: int = option(8, "Grasps around the student's own best of them, where its mistakes are.", low=0)
    candidates: int = option(48, "Random grasps a scene that both rate.", low=1)
    shuffle_colours: bool = option(
        True, "Whether red, green and blue of a randomized picture change places, as translate's."
    )
    training: TrainingConfig = option(
        TrainingConfig(max_steps=400, learning_rate=5e-4, metric="auc", mode="max", validate_every=100),
        "The training loop; metrics: bce, auc, best_of_scene, chance_difference.",
    )


def check(cfg: StudentConfig) -> None:
    """Raises UserError where a value is out of its range, or two contradict each other."""
    validate(cfg, "student")
    training_config.check(cfg.training)
    for key in ("random", "near_best", "own"):
        if getattr(cfg, key) > cfg.candidates:
            raise UserError(
                f"student.{key} = {getattr(cfg, key)}: expected at most student.candidates {cfg.candidates}"
            )
    if not cfg.random + cfg.near_best + cfg.own:
        raise UserError("student: random, near_best and own are all 0: expected one of them above 0")
