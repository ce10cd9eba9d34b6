"""What is fine-tuned, on how many real grasps."""

from dataclasses import dataclass

from vision_s2r.errors import UserError
from vision_s2r.options import option, validate
from vision_s2r.training import TrainingConfig
from vision_s2r.training import config as training_config

SCRATCH = "from_scratch"


@dataclass
class FinetuneConfig:
    """Few real grasps: policies fine-tuned on the first grasps that robots recorded, and one that knows nothing else.

    The grasps are those of data.real, through adapt.cameras.
    """

    counts: list[int] = option(
        [0, 50, 200, 1000, 5000],
        "Numbers of labelled real grasps; they are taken in whole scenes.",
        low=0,
        rising=True,
        unique=True,
    )
    starts: list[str] = option(
        ["domain_randomization", "rcan", "rl_cyclegan", "rl_cyclegan_policy"],
        "Policies to begin with, rows of the comparison (configs/evaluate/methods.yaml); its trainings are theirs.",
    )
    seeds: int = option(3, "Training seeds of the policy that begins from scratch; its form is that of grasp.", above=0)
    epochs: float = option(20.0, "How often a training sees its grasps; from scratch ten times as often.", above=0)
    least_steps: int = option(60, "Steps of a training, at least.", above=0)
    most_steps: int = option(600, "Steps of a training, at most.", above=0)
    scratch_steps: int = option(2500, "Steps from scratch, at most.", above=0)
    cameras: list[str] = option(
        ["webcam", "industrial", "phone", "harsh"], "Success is measured through each of these (configs/camera)."
    )
    limit: int = option(100, "Over the first so many scenes of data.test.", low=0)
    training: TrainingConfig = option(
        TrainingConfig(max_steps=1, batch_size=16, learning_rate=3e-4, metric="bce"),
        "Of every fine-tuning; max_steps and validate_every follow from the keys above. From scratch the learning rate "
        "is that of grasp. It is validated once, at its end, for the log.",
    )


def check(cfg: FinetuneConfig) -> None:
    """Raises UserError where a value is out of its range."""
    validate(cfg, "finetune")
    training_config.check(cfg.training)
    if not cfg.counts:
        raise UserError("finetune.counts is empty: expected numbers of grasps")
    if SCRATCH in cfg.starts:
        raise UserError(f"finetune.starts.{SCRATCH}: the name is taken by the policy without a start")
