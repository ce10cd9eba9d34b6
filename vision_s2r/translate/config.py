"""The configuration of a translator, as configs/translate/*.yaml has it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from vision_s2r.errors import UserError, nearest
from vision_s2r.networks.unet import NetworkConfig
from vision_s2r.training import TrainingConfig
from vision_s2r.training import config as training_config

PICTURES = ("randomized", "real")
ADVERSARIAL_FORMS = ("hinge", "least_squares")
PICTURE_TERMS = ("image", "gradient", "ssim", "adversarial", "perceptual", "vgg")  # what the picture is learnt from


@dataclass
class DiscriminatorConfig:
    """The patch discriminator; built only where the adversarial loss has a weight."""

    width: int = 32  # channels of its first layer; each next has twice
    layers: int = 3  # halvings of the resolution
    learning_rate: float = 2e-4


@dataclass
class LossConfig:
    """Weight of each term of the loss; 0 leaves it, and what only it needs, out."""

    image: float = 1.0  # absolute error of the canonical picture
    gradient: float = 1.0  # absolute error of its differences between neighbouring pixels: edges
    ssim: float = 0.0  # 1 - structural similarity
    segmentation: float = 0.1  # cross-entropy of the classes
    depth: float = 0.2  # absolute error of the depth, in parts of its range
    rectification: float = 1.0  # absolute error of where the rectifier samples the picture
    adversarial: float = 0.0  # against the patch discriminator
    perceptual: float = 0.0  # absolute difference of the frozen Q-network's activations at random grasps
    vgg: float = 0.0  # of VGG-16's, pretrained on ImageNet
    adversarial_form: str = "hinge"  # hinge | least_squares
    focus: float = 2.0  # how much more object pixels count in image, gradient and depth than all others


@dataclass
class CameraAdrConfig:
    """When the camera's ranges widen by themselves; without limits they do not, and the rest is not read.

    Performance is the share of its accuracy that the translator keeps: its error without a camera over its error under
    one, both of the canonical pictures of the same held-out views.
    """

    # By effect and parameter: [low, high], up to which its range may widen from the neutral value.
    limits: dict[str, dict[str, Any]] = field(default_factory=dict)
    every: int = 4  # steps between measurements
    probes: int = 16  # validation views of a measurement, each at a boundary drawn anew
    buffer: int = 12  # results at a boundary from which a decision is made
    threshold_high: float = 0.9  # mean performance at a boundary from which on it moves outwards
    threshold_low: float = 0.85  # and down from which it moves inwards
    step: float = 0.05  # of a boundary, as a share of its limits


@dataclass
class TranslateConfig:
    """A translator: its networks, losses and training."""

    network: NetworkConfig = field(default_factory=NetworkConfig)
    discriminator: DiscriminatorConfig = field(default_factory=DiscriminatorConfig)
    loss: LossConfig = field(default_factory=LossConfig)
    training: TrainingConfig = field(
        default_factory=lambda: TrainingConfig(max_steps=20_000, batch_size=32, metric="l1", mode="min")
    )
    adr: CameraAdrConfig = field(default_factory=CameraAdrConfig)
    q_function: str = ""  # a released canonical policy that judges translations; empty: none does
    start: str = ""  # a released checkpoint whose weights training begins with; empty: fresh ones
    validate_on: str = "real"  # randomized | real: what the validation camera looks at
    pictures: int = 6  # validation scenes shown in the grid


@dataclass
class BenchmarkConfig:
    """How the translator is measured against the network of the literature."""

    minutes: float = 3.0  # of training of each network
    slices: int = 12  # in which they take turns; each ends with a validation
    width: int = 64  # channels of the first level of the literature's network
    learning_rate: float = 1e-3  # its highest


def check(cfg: TranslateConfig) -> None:
    """Raises UserError where a value is out of its range."""
    training_config.check(cfg.training)
    check_sizes("translate", {"network": cfg.network, "discriminator": cfg.discriminator})
    check_weights("translate", asdict(cfg.loss))
    if not any(getattr(cfg.loss, name) for name in PICTURE_TERMS):
        raise UserError(f"translate.loss: {', '.join(PICTURE_TERMS)} are all 0: expected one of them above 0")
    if cfg.loss.perceptual > 0 and not cfg.q_function:
        raise UserError(
            f"translate.loss.perceptual = {cfg.loss.perceptual}, but translate.q_function is empty: "
            "expected a policy's best.safetensors"
        )
    for key in ("every", "probes"):
        if getattr(cfg.adr, key) <= 0:
            raise UserError(f"translate.adr.{key} = {getattr(cfg.adr, key)}: expected a number above 0")
    if cfg.validate_on not in PICTURES:
        raise UserError(f"translate.validate_on = '{cfg.validate_on}': {nearest(cfg.validate_on, PICTURES)}")
    if cfg.pictures <= 0:
        raise UserError(f"translate.pictures = {cfg.pictures}: expected a number above 0")


def check_sizes(where: str, networks: Mapping[str, NetworkConfig | DiscriminatorConfig]) -> None:
    """Raises UserError where a size of a network, by its key below `where`, is none."""
    for name, network in networks.items():
        for key, value in asdict(network).items():
            if value <= 0 and (key not in ("rectifier", "residual") or value < 0):
                raise UserError(f"{where}.{name}.{key} = {value}: expected a number above 0")


def check_weights(where: str, loss: Mapping[str, Any]) -> None:
    """Raises UserError where a weight of the loss below `where` is negative, or its adversarial form unknown."""
    for key, value in loss.items():
        if key != "adversarial_form" and value < 0:
            raise UserError(f"{where}.loss.{key} = {value}: expected a weight of 0 or more")
    form = loss["adversarial_form"]
    if form not in ADVERSARIAL_FORMS:
        raise UserError(f"{where}.loss.adversarial_form = '{form}': {nearest(form, ADVERSARIAL_FORMS)}")


def check_benchmark(cfg: BenchmarkConfig) -> None:
    """Raises UserError where a value is out of its range."""
    for key, value in asdict(cfg).items():
        if value <= 0:
            raise UserError(f"benchmark.{key} = {value}: expected a number above 0")
