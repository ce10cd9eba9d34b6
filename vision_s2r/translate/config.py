"""The configuration of a translator."""

from dataclasses import dataclass
from typing import Any

from vision_s2r.errors import UserError
from vision_s2r.networks.unet import NetworkConfig
from vision_s2r.options import option, validate
from vision_s2r.training import TrainingConfig
from vision_s2r.training import config as training_config

PICTURES = ("randomized", "real")
ADVERSARIAL_FORMS = ("hinge", "least_squares")
PICTURE_TERMS = ("image", "gradient", "ssim", "adversarial", "perceptual", "vgg")  # what the picture is learnt from


@dataclass
class DiscriminatorConfig:
    """The patch discriminator; built only where the adversarial loss has a weight."""

    width: int = option(32, "Channels of its first layer; each next has twice.", above=0)
    layers: int = option(3, "Halvings of the resolution.", above=0)
    learning_rate: float = option(2e-4, "Its highest learning rate.", above=0)


@dataclass
class LossConfig:
    """Weight of each term of the loss; 0 leaves it, and what only it needs, out."""

    image: float = option(1.0, "Absolute error of the canonical picture.", low=0)
    gradient: float = option(
        0.0,
        "Absolute error of its differences between neighbouring pixels: edges. It is least without an edge where an "
        "edge's place is not known.",
        low=0,
    )
    ssim: float = option(0.0, "1 - structural similarity.", low=0)
    segmentation: float = option(0.5, "Cross-entropy of the five classes.", low=0)
    depth: float = option(0.2, "Absolute error of the depth, in parts of its range.", low=0)
    rectification: float = option(
        1.0, "Absolute error of where the rectifier samples the picture, in tenths of half its side.", low=0
    )
    adversarial: float = option(0.0, "What the patch discriminator finds unlike a canonical picture.", low=0)
    perceptual: float = option(
        0.0,
        "Absolute difference of a frozen policy's activations at random grasps in the translated and the true "
        "canonical picture (Johnson et al. 2016). Above 0: needs q_function.",
        low=0,
    )
    vgg: float = option(
        0.0,
        "The same of the pictures as VGG-16 sees them. Above 0: needs torchvision's weights in torch's hub cache.",
        low=0,
    )
    adversarial_form: str = option("hinge", "Form of the adversarial loss.", choices=ADVERSARIAL_FORMS)
    focus: float = option(
        2.0, "How much more object pixels count in image, gradient and depth: 1 + focus times.", low=0
    )


@dataclass
class CameraAdrConfig:
    """Automatic domain randomization of the camera that trains; without limits there is none.

    Performance is the share of its accuracy that the translator keeps: its error without a camera over its error under
    one, both of the canonical pictures of the same held-out views. Training draws lie within the ranges; at their
    boundaries it is only measured.
    """

    limits: dict[str, dict[str, Any]] = option(
        {}, "By effect and parameter: [low, high], up to which its range may widen from no effect. Empty: none widens."
    )
    every: int = option(4, "Steps between measurements.", above=0)
    probes: int = option(16, "Validation views of a measurement, each at a boundary drawn anew.", above=0)
    buffer: int = option(12, "Results at a boundary from which a decision is made.")
    threshold_high: float = option(
        0.9, "Mean performance at a boundary from which on it moves outwards; 1: as good as without a camera."
    )
    threshold_low: float = option(0.85, "And down from which it moves inwards.")
    step: float = option(0.05, "How far it moves, as a share of its limits.")


@dataclass
class TranslateConfig:
    """A translator: from any look of a scene to its canonical one, learnt from pairs."""

    network: NetworkConfig = option(NetworkConfig(composed=True), "The U-Net.")
    discriminator: DiscriminatorConfig = option(DiscriminatorConfig, "The patch discriminator.")
    loss: LossConfig = option(LossConfig, "The weight of each term of the loss.")
    training: TrainingConfig = option(
        TrainingConfig(
            max_steps=20_000, learning_rate=2e-3, muon=4e-3, metric="object_iou", mode="max", precision="auto"
        ),
        "The training loop; metrics: l1, object_l1, psnr, ssim, object_iou, depth_error, q_difference, auc.",
    )
    shuffle_colours: bool = option(
        True,
        "Whether red, green and blue of a training picture change places: where textures and light are drawn alike for "
        "each, that is a picture as likely, and six times as many.",
    )
    adr: CameraAdrConfig = option(CameraAdrConfig, "Automatic domain randomization of the camera that trains.")
    q_function: str = option(
        "",
        "A released canonical policy (best.safetensors) that judges translations: the perceptual loss, and what "
        "validation says of the chances that it gives to grasps (q_difference, auc). Empty: none does.",
    )
    start: str = option(
        "",
        "A released checkpoint (best.safetensors) that training begins with, fine-tuning: its network takes the place "
        "of the keys that shape one. Empty: fresh weights.",
    )
    validate_on: str = option(
        "randomized",
        "What the validation camera looks at. The real look is one that is tested: nothing is chosen by it.",
        choices=PICTURES,
    )
    pictures: int = option(6, "Validation scenes in the picture grid.", above=0)


@dataclass
class BenchmarkConfig:
    """How the translator is measured against the network of the literature (`vision-s2r benchmark translate`)."""

    minutes: float = option(3.0, "Wall-clock minutes of training of each network; there are three.", above=0)
    slices: int = option(12, "In which their trainings take turns; each ends with a validation.", above=0)
    width: int = option(64, "Channels of the first level of the literature's network; as published, 64.", above=0)
    learning_rate: float = option(
        1e-3,
        "Its highest; everything else in training is as the translator's. Of 2e-4 (published), 1e-3 and 2e-3 (the "
        "translator's) the one that brought it farthest in half a minute.",
        above=0,
    )


def check(cfg: TranslateConfig) -> None:
    """Raises UserError where a value is out of its range, or two contradict each other."""
    validate(cfg, "translate")
    training_config.check(cfg.training)
    if not any(getattr(cfg.loss, name) for name in PICTURE_TERMS):
        raise UserError(f"translate.loss: {', '.join(PICTURE_TERMS)} are all 0: expected one of them above 0")
    if cfg.loss.perceptual > 0 and not cfg.q_function:
        raise UserError(
            f"translate.loss.perceptual = {cfg.loss.perceptual}, but translate.q_function is empty: "
            "expected a policy's best.safetensors"
        )
