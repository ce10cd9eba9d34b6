"""What closing the loop is told."""

from dataclasses import dataclass
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.config import Config
from vision_s2r.options import option


@dataclass
class CloseGapConfig:
    """A diagnosed camera becomes the one that the translator trains under: cameras, what is trained, and from where."""

    withheld: int = option(
        5, "Cameras drawn, with three effects each that the diagnosis is not told, where no recording is given.", low=1
    )
    frames: int = option(16, "Pairs in the recording of each of them.", low=4)
    effects: list[str] = option([], "Effects that they may have, by name; empty: all.")
    truth: str = option(
        "",
        "With one recording: its true camera (a YAML file as in configs/camera), where that is known. Empty: it is "
        "not, and the table looks through the diagnosed one.",
    )
    translator: str = option(
        "outputs/cpu/translator-0/best.safetensors", "The translator as it was: a released checkpoint."
    )
    policy: str = option("outputs/cpu/policy-0/best.safetensors", "The policy that grasps: a released checkpoint.")
    steps: int = option(1200, "Of fine-tuning under each camera.", low=1)
    learning_rate: float = option(1e-3, "Of fine-tuning, at its highest.", above=0)
    everything: str = option(
        "harsh",
        "The camera of configs/camera that the rival is fine-tuned under: everything randomized, nothing diagnosed.",
    )


@dataclass
class CloseGapStudyConfig(Config):
    """Everything that `vision-s2r close-gap` reads: the visual pipeline's keys, and what is diagnosed."""

    recording: Any = option(
        None, "A camera recording, or several ([DIR, …]), that is diagnosed; null: withheld cameras are drawn."
    )
    close_gap: CloseGapConfig = option(CloseGapConfig, "A diagnosed camera becomes the one that trains.")


ConfigStore.instance().store(
    "close_gap_schema",
    node={"recording": None, "close_gap": CloseGapConfig()},
)
