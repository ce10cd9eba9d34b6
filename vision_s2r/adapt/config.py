"""The configuration of an unpaired adaptation, as configs/adapt/*.yaml has it."""

from dataclasses import asdict, dataclass, field

from vision_s2r.errors import UserError
from vision_s2r.networks.unet import NetworkConfig
from vision_s2r.training import TrainingConfig
from vision_s2r.training import config as training_config
from vision_s2r.translate.config import DiscriminatorConfig, check_sizes, check_weights


@dataclass
class AdaptLossConfig:
    """Weight of each term; 0 leaves it, and the networks that only it needs, out."""

    adversarial: float = 1.0  # against each domain's patch discriminator
    adversarial_form: str = "least_squares"  # hinge | least_squares
    cycle: float = 10.0  # absolute error of a picture that went to the other domain and back
    identity: float = 0.0  # absolute error of a picture translated into the domain that it is of
    segmentation: float = 0.0  # cross-entropy of a canonical picture's classes, by the head of the generator to real
    task: float = 0.0  # of Q's own loss, as far as generators feel it; 0: Q learns of their pictures, they not of Q
    paired: float = 0.0  # of all that the translator's own loss asks of randomized pictures, whose pairs are known
    rl_scene: float = 0.0  # mean squared differences of Q within each triple of a scene's pictures


@dataclass
class AdaptConfig:
    """Unpaired translation between canonical and real pictures, and the Q-functions of both."""

    network: NetworkConfig = field(default_factory=lambda: NetworkConfig(rectifier=0, residual=True))
    discriminator: DiscriminatorConfig = field(default_factory=DiscriminatorConfig)
    loss: AdaptLossConfig = field(default_factory=AdaptLossConfig)
    training: TrainingConfig = field(
        default_factory=lambda: TrainingConfig(max_steps=20_000, batch_size=4, metric="auc_mean", mode="max")
    )
    way_back: bool = True  # whether there is a generator from real to canonical pictures
    # That recorded the real pictures, names in configs/camera: as many robots.
    cameras: list[str] = field(default_factory=lambda: ["webcam", "industrial", "phone", "harsh"])
    translator: str = ""  # a released one, which the generator to canonical pictures begins as; empty: fresh
    policy: str = ""  # a released canonical policy, which both Q-functions begin as
    front: NetworkConfig | None = None  # a U-Net before the Q of real pictures, trained with it
    q_learning_rate: float = 5e-4  # of both Q-functions, at its highest
    grasps: int = 6  # random ones a real picture, for its triple
    negatives: int = 8  # grasps a canonical picture that close on nothing, as failures beside the labelled ones
    pictures: int = 6  # validation scenes shown in the grid


def check(cfg: AdaptConfig) -> None:
    """Raises UserError where a value is out of its range."""
    training_config.check(cfg.training)
    check_sizes("adapt", {"network": cfg.network, "discriminator": cfg.discriminator})
    check_weights("adapt", asdict(cfg.loss))
    for key in ("q_learning_rate", "grasps", "pictures"):
        if getattr(cfg, key) <= 0:
            raise UserError(f"adapt.{key} = {getattr(cfg, key)}: expected a number above 0")
    if cfg.negatives < 0:
        raise UserError(f"adapt.negatives = {cfg.negatives}: expected 0 or more")
    for key in ("cycle", "rl_scene", "paired"):
        if getattr(cfg.loss, key) > 0 and not cfg.way_back:
            raise UserError(f"adapt.loss.{key} = {getattr(cfg.loss, key)}: expected 0 without adapt.way_back")
    if not cfg.cameras:
        raise UserError("adapt.cameras is empty: expected the names of those that recorded the real pictures")
    if not cfg.policy:
        raise UserError("adapt.policy is empty: expected the checkpoint of a canonical policy, which Q begins as")
