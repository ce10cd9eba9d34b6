"""The configuration of an unpaired adaptation."""

from dataclasses import dataclass

from vision_s2r.errors import UserError
from vision_s2r.networks.unet import NetworkConfig
from vision_s2r.options import option, validate
from vision_s2r.training import TrainingConfig
from vision_s2r.training import config as training_config
from vision_s2r.translate.config import ADVERSARIAL_FORMS, DiscriminatorConfig


@dataclass
class AdaptLossConfig:
    """Weight of each term; 0 leaves it, and the networks that only it needs, out."""

    adversarial: float = option(1.0, "What the discriminators find unlike their own look.", low=0)
    adversarial_form: str = option("least_squares", "Form of the adversarial loss.", choices=ADVERSARIAL_FORMS)
    cycle: float = option(1.0, "Absolute error of a picture that went to the other look and back.", low=0)
    identity: float = option(0.0, "Absolute error of a picture translated into the look that it has.", low=0)
    segmentation: float = option(
        0.0,
        "Cross-entropy of a canonical picture's classes, which the generator to real pictures also gives.",
        low=0,
    )
    task: float = option(
        0.0,
        "Q's own loss on translated pictures, for the generators to feel; 0: Q learns of the pictures alone. With "
        "rl_scene they feel it at least in full.",
        low=0,
    )
    paired: float = option(
        0.0,
        "The translator's own loss (translate.loss) on randomized pictures, whose pairs are known.",
        low=0,
    )
    rl_scene: float = option(
        10.0,
        "Mean squared differences of Q's chances between a picture, its translation, and that translated back.",
        low=0,
    )


@dataclass
class AdaptConfig:
    """Unpaired translation between canonical and real pictures, and the Q-functions of both."""

    network: NetworkConfig = option(
        NetworkConfig(width=16, detail=16, rectifier=0, residual=True),
        "The generators, of the translator's size; each begins as the identity.",
    )
    discriminator: DiscriminatorConfig = option(DiscriminatorConfig, "The patch discriminators.")
    loss: AdaptLossConfig = option(AdaptLossConfig, "The weight of each term of the loss.")
    training: TrainingConfig = option(
        TrainingConfig(
            max_steps=20_000,
            batch_size=4,
            learning_rate=5e-4,
            metric="auc_mean",
            mode="max",
            precision="auto",
        ),
        "The training loop: canonical pictures a step, and as many real ones; the learning rate is that of the "
        "generators. Metrics: auc_mean, auc, auc_real, l1, q_difference.",
    )
    way_back: bool = option(
        True,
        "Whether there is a generator from real to canonical pictures, for the canonical policy; without it cycle, "
        "paired and rl_scene are 0.",
    )
    cameras: list[str] = option(
        ["webcam", "industrial", "phone", "harsh"],
        "Cameras (configs/camera) that recorded the real pictures, each its share of them: as many robots.",
    )
    translator: str = option(
        "",
        "A released translator, which the generator to canonical pictures begins as, with its network; empty: as the "
        "identity, or with pairs with the network of translate.",
    )
    policy: str = option("", "A released canonical policy, which both Q-functions begin as.")
    front: NetworkConfig | None = option(
        None, "A U-Net before the Q of real pictures, trained with it; keys as network, null: none."
    )
    q_learning_rate: float = option(5e-4, "Of both Q-functions, at its highest.", above=0)
    grasps: int = option(6, "Random grasps of a real picture, at which Q is compared between its looks.", above=0)
    negatives: int = option(
        8,
        "Failures that each canonical picture gets beside its labelled grasps: random ones that close on nothing.",
        low=0,
    )
    pictures: int = option(6, "Validation scenes in the picture grid.", above=0)


def check(cfg: AdaptConfig) -> None:
    """Raises UserError where a value is out of its range, or two contradict each other."""
    validate(cfg, "adapt")
    training_config.check(cfg.training)
    for key in ("cycle", "rl_scene", "paired"):
        if getattr(cfg.loss, key) > 0 and not cfg.way_back:
            raise UserError(f"adapt.loss.{key} = {getattr(cfg.loss, key)}: expected 0 without adapt.way_back")
    if not cfg.cameras:
        raise UserError("adapt.cameras is empty: expected the names of those that recorded the real pictures")
    if not cfg.policy:
        raise UserError("adapt.policy is empty: expected the checkpoint of a canonical policy, which Q begins as")
