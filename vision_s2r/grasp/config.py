"""The configuration of a grasp policy, as configs/grasp/*.yaml has it: metres, radians."""

from dataclasses import dataclass, field

from vision_s2r.errors import UserError, nearest
from vision_s2r.networks.unet import NetworkConfig
from vision_s2r.training import TrainingConfig
from vision_s2r.training import config as training_config

FORMS = ("crop", "trunk", "dense")
PICTURES = ("canonical", "randomized", "seen")
VALIDATION_PICTURES = ("canonical", "randomized", "real", "seen")


@dataclass
class CropConfig:
    """The window of the bin that is cut out around each grasp."""

    window: list[float] = field(default_factory=lambda: [0.12, 0.08])  # along and across the closing axis
    resolution: list[int] = field(default_factory=lambda: [24, 16])  # its pixels, in the same order


@dataclass
class DenseConfig:
    """The map from above that all grasps of a picture are looked up in."""

    cells: int = 48  # a side; the map covers the search area at any yaw
    yaw_bins: int = 16  # over half a turn


@dataclass
class CemConfig:
    """The cross-entropy method."""

    samples: int = 64  # grasps an iteration
    elites: float = 0.1  # part of them that the next iteration's samples are drawn around
    iterations: int = 4
    position_spread: float = 0.02  # standard deviation around an elite in the second iteration
    yaw_spread: float = 0.4
    shrink: float = 0.5  # of both spreads, from an iteration to the next
    scenes: int = 4  # searched at once; few fit a CPU's caches, many fill a GPU


@dataclass
class AugmentationConfig:
    """What canonical pictures suffer in training, so that Q bears a translator's errors; each picture its own."""

    blur: float = 0.6  # largest standard deviation of a Gaussian, px
    noise: float = 0.02  # largest standard deviation of noise of each pixel and channel
    brightness: float = 0.1  # largest gain of the picture, up or down
    colour: float = 0.05  # largest gain of each channel, up or down
    mirror: bool = True  # half of the scenes as in a mirror, with camera and grasps


@dataclass
class GraspConfig:
    """A policy: the form of Q, what it looks at, how it is trained and searched."""

    form: str = "crop"  # crop | trunk | dense
    width: int = 32  # channels of Q's first layers
    plane_height: float = 0.02  # of the plane on which pictures are measured, over the floor
    area: list[float] = field(default_factory=lambda: [0.115, 0.115])  # grasps are searched in |x| ≤, |y| ≤
    picture: str = "canonical"  # that Q learns on: canonical | randomized (through the training camera) | seen
    start: str = ""  # a released checkpoint whose weights training begins with; empty: fresh ones
    translations: float = 0.0  # part of the canonical pictures in training that a translator made of randomized ones
    with_source: bool = False  # Q also sees the picture that the canonical one was made from
    validate_on: str = "canonical"  # canonical | seen | randomized | real (the last two through the validation camera)
    front: NetworkConfig | None = None  # a U-Net before Q, trained with it
    rectification: float = 0.0  # weight of the error of where the front's rectifier samples the picture
    negatives: int = 0  # grasps a scene that close on nothing, as failures beside the labelled ones
    crop: CropConfig = field(default_factory=CropConfig)
    dense: DenseConfig = field(default_factory=DenseConfig)
    cem: CemConfig = field(default_factory=CemConfig)
    augmentation: AugmentationConfig = field(default_factory=AugmentationConfig)
    training: TrainingConfig = field(
        default_factory=lambda: TrainingConfig(
            max_steps=4000, batch_size=32, learning_rate=2e-3, metric="auc", mode="max"
        )
    )


def check(cfg: GraspConfig) -> None:
    """Raises UserError where a value is out of its range, or two contradict each other."""
    training_config.check(cfg.training)
    known = {"form": FORMS, "picture": PICTURES, "validate_on": VALIDATION_PICTURES}
    for key, names in known.items():
        if getattr(cfg, key) not in names:
            raise UserError(f"grasp.{key} = '{getattr(cfg, key)}': {nearest(getattr(cfg, key), names)}")
    for key, pair in {"area": cfg.area, "crop.window": cfg.crop.window}.items():
        if len(pair) != 2 or min(pair) <= 0:
            raise UserError(f"grasp.{key} = {list(pair)}: expected two lengths above 0")
    resolution = list(cfg.crop.resolution)
    if len(resolution) != 2 or any(n < 8 or n % 4 for n in resolution):
        raise UserError(f"grasp.crop.resolution = {resolution}: expected two multiples of 4, from 8 on")
    if cfg.width < 8 or cfg.width % 8:
        raise UserError(f"grasp.width = {cfg.width}: expected a multiple of 8")
    if cfg.dense.cells < 16 or cfg.dense.cells % 4 or cfg.dense.yaw_bins < 2:
        raise UserError("grasp.dense: expected cells a multiple of 4 from 16 on, and 2 yaw_bins or more")
    if cfg.with_source and (cfg.front or cfg.picture != "canonical"):
        raise UserError("grasp.with_source: expected picture=canonical and front=null, the source comes beside it")
    if cfg.front is not None and cfg.front.levels < 1:
        raise UserError(f"grasp.front.levels = {cfg.front.levels}: expected at least 1")
    if not 0 <= cfg.translations <= 1 or (cfg.translations and (cfg.with_source or cfg.picture != "canonical")):
        raise UserError(
            f"grasp.translations = {cfg.translations}: expected 0 to 1, above 0 with canonical pictures alone"
        )
    if cfg.negatives < 0:
        raise UserError(f"grasp.negatives = {cfg.negatives}: expected 0 or more")
    told = cfg.picture == "randomized" and cfg.front is not None and cfg.front.rectifier > 0
    if cfg.rectification < 0 or (cfg.rectification and not told):
        raise UserError(
            f"grasp.rectification = {cfg.rectification}: expected 0 or more, above 0 only with picture=randomized and "
            "a rectifier in front"
        )
    reads_source = cfg.with_source or cfg.picture == "randomized"
    looked_at = ("randomized", "real") if reads_source else (cfg.picture,)
    if cfg.validate_on not in looked_at:
        expected = " or ".join(looked_at)
        raise UserError(f"grasp.validate_on = {cfg.validate_on}: expected {expected}, as the policy looks at that")
    _check_cem(cfg.cem)
    for key in ("blur", "noise", "brightness", "colour"):
        if not 0 <= getattr(cfg.augmentation, key) < 4:
            raise UserError(f"grasp.augmentation.{key} = {getattr(cfg.augmentation, key)}: expected 0 to 4")


def _check_cem(cfg: CemConfig) -> None:
    for key in ("samples", "iterations", "scenes"):
        if getattr(cfg, key) < 1:
            raise UserError(f"grasp.cem.{key} = {getattr(cfg, key)}: expected at least 1")
    for key in ("elites", "shrink"):
        if not 0 < getattr(cfg, key) <= 1:
            raise UserError(f"grasp.cem.{key} = {getattr(cfg, key)}: expected a part, above 0 and up to 1")
    for key in ("position_spread", "yaw_spread"):
        if getattr(cfg, key) <= 0:
            raise UserError(f"grasp.cem.{key} = {getattr(cfg, key)}: expected a number above 0")
