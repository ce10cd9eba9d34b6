"""What closing the loop is told."""

from dataclasses import dataclass, field

from vision_s2r.errors import UserError


@dataclass
class CloseGapConfig:
    """Cameras, what is trained under them, and from where."""

    withheld: int = 5  # cameras drawn where no recording is given
    frames: int = 16  # pairs in the recording of a withheld camera
    truth: str = ""  # the true camera of the recording (YAML), where it is known: the oracle, and the judge
    translator: str = "outputs/cpu/translator-0/best.safetensors"
    policy: str = "outputs/cpu/policy-0/best.safetensors"
    steps: int = 1200  # of fine-tuning
    learning_rate: float = 1e-3  # of fine-tuning, at its highest
    everything: str = "harsh"  # camera of configs/camera: what randomizing it all means
    effects: list[str] = field(default_factory=list)  # that withheld cameras may have; empty: all


def check(cfg: CloseGapConfig) -> None:
    """UserError unless every value can be."""
    for key, least in (("withheld", 1), ("frames", 4), ("steps", 1)):
        if getattr(cfg, key) < least:
            raise UserError(f"close_gap.{key} is {getattr(cfg, key)}, expected {least} or more")
    if cfg.learning_rate <= 0:
        raise UserError(f"close_gap.learning_rate is {cfg.learning_rate}, expected above 0")
