"""What closing the loop is told."""

from dataclasses import dataclass
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.config import Config
from vision_s2r.options import option

SOURCES = ("camera", "drives", "contact")
ROWS = ("everything", "diagnosed", "posterior", "true_effects")


@dataclass
class CloseGapConfig:
    """A diagnosed robot becomes the one that is trained for: robots, what is trained, and from where."""

    withheld: int = option(
        20, "Robots drawn, with effects that the diagnosis is not told, where no recording is given.", low=1
    )
    sources: list[str] = option(
        list(SOURCES), "Of their effects, and of what is recorded of them.", choices=SOURCES, unique=True
    )
    leading: float = option(
        0.0,
        "One source of these after the other leads, so that which one costs most is another from robot to robot: the "
        "effects of the others are a tenth of their size, and robots are drawn until its own cost this share of the "
        "grasps. 0: none leads.",
        low=0,
        high=1,
    )
    rows: list[str] = option(
        list(ROWS),
        "What is trained beside the simulator as it came. []: nothing; the report still says what the robot's effects "
        "cost, and what to mend first.",
        choices=ROWS,
        unique=True,
    )
    frames: int = option(16, "Pairs of pictures in the recording of each of them.", low=4)
    tosses: int = option(16, "Tosses of an object onto the fingers' material in the recording of each.", low=4)
    truth: str = option(
        "",
        "With one recording: the true robot (a YAML file of effects by part), where that is known. Empty: it is not, "
        "and grasps are tried on the diagnosed one.",
    )
    translator: str = option(
        "",
        "The translator as the simulator came: a checkpoint, such as the released bin-64-ideal-camera. Empty: one is "
        "trained from scratch, without camera effects.",
    )
    came_steps: int = option(4000, "Of that training.", low=1)
    came_learning_rate: float = option(2e-3, "Of that, at its highest.", above=0)
    came_muon: float = option(4e-3, "Of that, Muon's at its highest; 0: AdamW alone.", low=0)
    policy: str = option("bin-64", "The policy as the simulator came: a released checkpoint of canonical pictures.")
    steps: int = option(1200, "Of fine-tuning the translator of each row.", low=1)
    learning_rate: float = option(1e-3, "Of that, at its highest.", above=0)
    grasps: int = option(
        2000,
        "Grasps of training and validation scenes that each row tries again on the robot it believes in. 0: none, and "
        "its policy stays as it came.",
        low=0,
    )
    policy_steps: int = option(300, "Of fine-tuning the policy of each row on them.", low=1)
    policy_learning_rate: float = option(2e-4, "Of that, at its highest.", above=0)
    scenes: int = option(0, "Test scenes that every row grasps in, from the first; 0: as the evaluation.", low=0)
    draws: int = option(8, "Robots drawn from a posterior, or from everything, that commands are corrected for.", low=1)
    everything: str = option(
        "harsh",
        "The camera of configs/camera that the rival is fine-tuned under: everything randomized, nothing diagnosed.",
    )


@dataclass
class CloseGapStudyConfig(Config):
    """Everything that `vision-s2r close-gap` reads: the visual pipeline's keys, and what is diagnosed."""

    recording: Any = option(
        None,
        "A recording of a robot or of its camera, or several ([DIR, …]), that is diagnosed; null: withheld robots are "
        "drawn.",
    )
    close_gap: CloseGapConfig = option(CloseGapConfig, "A diagnosed robot becomes the one that is trained for.")


ConfigStore.instance().store(
    "close_gap_schema",
    node={"recording": None, "close_gap": CloseGapConfig()},
)
