"""What is fine-tuned, on how many real grasps."""

from dataclasses import dataclass, field

from vision_s2r.errors import UserError
from vision_s2r.training import TrainingConfig
from vision_s2r.training import config as training_config

SCRATCH = "from_scratch"


@dataclass
class FinetuneConfig:
    """The curve: starts, numbers of real grasps, and how long each training is."""

    counts: list[int] = field(default_factory=lambda: [0, 50, 200, 1000, 5000])
    starts: list[str] = field(default_factory=list)  # rows of the comparison
    seeds: int = 3  # of the policy that learns from real grasps alone
    epochs: float = 30.0
    least_steps: int = 60
    most_steps: int = 1500
    scratch_steps: int = 3000  # of the policy that learns from real grasps alone, at most
    cameras: list[str] = field(default_factory=lambda: ["webcam", "industrial", "phone", "harsh"])
    limit: int = 125
    training: TrainingConfig = field(
        default_factory=lambda: TrainingConfig(max_steps=1, batch_size=16, learning_rate=3e-4, metric="bce")
    )


def check(cfg: FinetuneConfig) -> None:
    """Raises UserError where a value is out of its range."""
    training_config.check(cfg.training)
    if not cfg.counts or min(cfg.counts) < 0 or sorted(set(cfg.counts)) != list(cfg.counts):
        raise UserError(f"finetune.counts = {list(cfg.counts)}: expected numbers of grasps, 0 or more, rising")
    for key in ("seeds", "epochs", "least_steps", "most_steps", "scratch_steps"):
        if getattr(cfg, key) <= 0:
            raise UserError(f"finetune.{key} = {getattr(cfg, key)}: expected a number above 0")
    if SCRATCH in cfg.starts:
        raise UserError(f"finetune.starts.{SCRATCH}: the name is taken by the policy without a start")
