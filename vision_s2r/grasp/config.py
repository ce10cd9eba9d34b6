"""The configuration of a grasp policy: metres, radians."""

from dataclasses import dataclass

from vision_s2r.errors import UserError
from vision_s2r.networks.unet import NetworkConfig
from vision_s2r.options import option, validate
from vision_s2r.training import TrainingConfig
from vision_s2r.training import config as training_config

FORMS = ("crop", "trunk", "dense")
ACTIVATIONS = ("leaky_relu", "relu")
PICTURES = ("canonical", "randomized", "seen")
VALIDATION_PICTURES = ("canonical", "randomized", "real", "seen")


@dataclass
class CropConfig:
    """The window of the bin that is cut out around each grasp."""

    window: list[float] = option(
        [0.12, 0.08], "Lengths along and across the line on which the fingers close, m.", length=2, above=0
    )
    resolution: list[int] = option([24, 16], "Pixels along and across.", length=2, low=8, high=256, multiple=4)
    activation: str = option(
        "leaky_relu",
        "Of the last hidden layer. Those of relu die where most grasps fail, and leave all good ones one chance.",
        choices=ACTIVATIONS,
    )


@dataclass
class DenseConfig:
    """The map from above that all grasps of a picture are looked up in."""

    cells: int = option(48, "Places a side; the map covers the search area at any yaw.", low=16, high=512, multiple=4)
    yaw_bins: int = option(16, "Yaws over half a turn.", low=2, high=180)


@dataclass
class CemConfig:
    """The cross-entropy method."""

    samples: int = option(
        64, "Grasps scored in each iteration; in the first they are uniform over the area and all yaws.", low=1
    )
    elites: float = option(
        0.1, "Part of all that were scored that the next iteration's samples are drawn around.", above=0, high=1
    )
    iterations: int = option(4, "The first included.", low=1)
    position_spread: float = option(
        0.02, "Standard deviation of places around an elite in the second iteration, m.", above=0
    )
    yaw_spread: float = option(0.4, "Standard deviation of yaws around an elite in the second iteration, rad.", above=0)
    shrink: float = option(0.5, "Factor of both from an iteration to the next.", above=0, high=1)
    scenes: int = option(4, "Scenes searched at once: few fit a CPU's caches, hundreds fill a GPU.", low=1)


@dataclass
class AugmentationConfig:
    """What canonical pictures suffer in training, so that Q bears a translator's errors; each its own, 0: none."""

    blur: float = option(1.2, "Largest standard deviation of a Gaussian blur, pixels.", low=0, below=4)
    noise: float = option(0.02, "Largest standard deviation of noise of each pixel and channel.", low=0, below=4)
    brightness: float = option(0.1, "Largest change of the gain of the picture, up or down.", low=0, below=4)
    colour: float = option(0.05, "Largest change of the gain of each channel, up or down.", low=0, below=4)
    mirror: bool = option(True, "Whether half of the scenes are mirrored, with camera and grasps.")


@dataclass
class GraspConfig:
    """A policy: Q(picture, grasp), learnt from simulated attempts, maximized by the cross-entropy method."""

    form: str = option(
        "crop",
        "Form of Q: crop (a window of the bin in each grasp's frame), trunk (QT-Opt's: the action added to a map of "
        "the picture) or dense (a map of logits over places and yaws).",
        choices=FORMS,
    )
    width: int = option(
        32, "Channels of Q's first layers; as it stands, Q has 0.17 M parameters.", low=8, high=512, multiple=8
    )
    plane_height: float = option(0.02, "Over the bin's floor of the plane on which pictures are measured, m.")
    area: list[float] = option(
        [0.115, 0.115], "Grasps are searched in |x| ≤ the first, |y| ≤ the second, m.", length=2, above=0
    )
    picture: str = option(
        "canonical",
        "Pictures that Q is trained on: canonical, randomized (domain randomization, through the training camera), or "
        "seen (as robots recorded them, or as a translator makes them).",
        choices=PICTURES,
    )
    start: str = option(
        "",
        "A released checkpoint that training begins with, fine-tuning: its network takes the place of the keys that "
        "shape one. Empty: fresh weights.",
    )
    with_source: bool = option(
        False,
        "Whether Q also sees the picture that the canonical one was made from, as RCAN's fine-tuned variant does.",
    )
    validate_on: str = option(
        "canonical",
        "Pictures that the best checkpoint is chosen on: canonical or seen, as picture; where Q looks at sources: "
        "randomized or real, through the validation camera.",
        choices=VALIDATION_PICTURES,
    )
    front: NetworkConfig | None = option(
        None, "A U-Net before Q, from picture to picture, trained with it; keys as translate.network, null: none."
    )
    rectification: float = option(
        0.0,
        "Weight of the error of where the front's rectifier samples the picture, as translate.loss.rectification.",
        low=0,
    )
    negatives: int = option(
        0,
        "Failures that each scene gets in training beside its labelled grasps: random ones that close where the "
        "segmentation shows no object, which needs no simulation (of 1,274 simulated ones none succeeded).",
        low=0,
    )
    crop: CropConfig = option(CropConfig, "The window of form crop.")
    dense: DenseConfig = option(DenseConfig, "The map of form dense.")
    cem: CemConfig = option(CemConfig, "The search.")
    augmentation: AugmentationConfig = option(AugmentationConfig, "What canonical pictures suffer in training.")
    shuffle_colours: bool = option(
        True, "Whether red, green and blue of a randomized picture change places, as translate's."
    )
    training: TrainingConfig = option(
        TrainingConfig(max_steps=4000, learning_rate=2e-3, metric="auc", mode="max"),
        "The training loop; metrics: bce, auc, best_of_scene.",
    )


def check(cfg: GraspConfig) -> None:
    """Raises UserError where a value is out of its range, or two contradict each other."""
    validate(cfg, "grasp")
    training_config.check(cfg.training)
    if cfg.with_source and (cfg.front or cfg.picture != "canonical"):
        raise UserError("grasp.with_source: expected picture=canonical and front=null, the source comes beside it")
    told = cfg.picture == "randomized" and cfg.front is not None and cfg.front.rectifier > 0
    if cfg.rectification and not told:
        raise UserError(
            f"grasp.rectification = {cfg.rectification}: expected 0 without picture=randomized and a rectifier in front"
        )
    reads_source = cfg.with_source or cfg.picture == "randomized"
    looked_at = ("randomized", "real") if reads_source else (cfg.picture,)
    if cfg.validate_on not in looked_at:
        expected = " or ".join(looked_at)
        raise UserError(f"grasp.validate_on = {cfg.validate_on}: expected {expected}, as the policy looks at that")
