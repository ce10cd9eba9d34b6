"""Adaptation without pairs, on bars whose real look is dark and blue: what is released must work in it."""

from dataclasses import asdict, replace
from pathlib import Path

import pytest
import torch
from torch import Tensor

from tests.grasp import bars
from vision_s2r.adapt import AdaptConfig, Adapted, train_adapted
from vision_s2r.adapt.config import AdaptLossConfig
from vision_s2r.adapt.losses import scene_consistency
from vision_s2r.errors import UserError
from vision_s2r.grasp import GraspConfig, GraspPolicy, train_policy
from vision_s2r.grasp.config import AugmentationConfig, CropConfig
from vision_s2r.images import to_float
from vision_s2r.networks.unet import NetworkConfig, UNet
from vision_s2r.render import Recorded
from vision_s2r.scene import CLASSES
from vision_s2r.training import Inputs, TrainingConfig, checkpoint
from vision_s2r.translate import TranslateConfig, Translator
from vision_s2r.translate.config import DiscriminatorConfig, LossConfig
from vision_s2r.translate.rcan import heads_for
from vision_s2r.translate.translator import network_of

NETWORK = NetworkConfig(width=8, levels=2, detail=8, rectifier=0, residual=True)
LOSSES = {
    "cyclegan": AdaptLossConfig(cycle=5.0, rl_scene=0.0),
    "graspgan": AdaptLossConfig(cycle=0.0, segmentation=1.0, task=1.0, rl_scene=0.0),
    "rl_cyclegan": AdaptLossConfig(cycle=5.0, rl_scene=10.0),
}


def dark(pictures: Tensor) -> Tensor:
    """The real look."""
    return (pictures * torch.tensor([0.3, 0.4, 0.7])).to(torch.uint8)


def views(scenes: int, seed: int) -> bars.Bars:
    found = bars.Bars(scenes, seed)
    found.tensors["real"] = dark(found.tensors["real"])
    return found


def recorded(scenes: int = 100) -> Recorded:
    other = views(scenes, 5)
    m = bars.MARGIN
    return Recorded(other, other.tensors["real"][:, m:-m, m:-m])  # type: ignore[arg-type]


def training(steps: int, rate: float, metric: str) -> TrainingConfig:
    return TrainingConfig(
        max_steps=steps,
        batch_size=8,
        learning_rate=rate,
        validate_every=steps,
        metric=metric,
        mode="max",
        accelerator="cpu",
    )


@pytest.fixture(scope="module")
def policy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    cfg = GraspConfig(
        width=16,
        plane_height=0.0,
        area=[bars.AREA] * 2,
        crop=CropConfig([0.08, 0.08], [16, 16]),
        augmentation=AugmentationConfig(blur=0.6),
        training=training(200, 4e-3, "auc"),
    )
    return train_policy(cfg, Inputs(views(300, 0), views(60, 1)), tmp_path_factory.mktemp("policy"), 3)


def adapted(out: Path, policy: Path | str, loss: AdaptLossConfig, steps: int, start: str = "") -> Adapted:
    cfg = AdaptConfig(
        translator=start,
        network=NETWORK,
        discriminator=DiscriminatorConfig(width=16, layers=2, learning_rate=1e-3),
        loss=loss,
        policy=str(policy),
        way_back=loss.cycle > 0,
        q_learning_rate=2e-3,
        negatives=0,
        training=training(steps, 1e-3, "auc_mean"),
    )
    inputs = Inputs(views(200, 0), views(60, 1))
    return train_adapted(cfg, inputs, recorded(), TranslateConfig(network=NETWORK), out, 0)


def real_pictures() -> tuple[Tensor, bars.Bars]:
    held_out = views(60, 1)
    m = bars.MARGIN
    return held_out.tensors["real"][:, m:-m, m:-m], held_out


def success(policy: GraspPolicy, pictures: Tensor, scenes: bars.Bars) -> float:
    frames = (scenes.tensors[name] for name in ("intrinsics", "extrinsics"))
    actions = policy.act(pictures, *frames, torch.arange(len(scenes))).actions
    return float(scenes.succeeds(actions[:, None]).float().mean())


@pytest.mark.parametrize(
    "method", [pytest.param(name, marks=pytest.mark.slow) if "cyclegan" in name else name for name in LOSSES]
)
def test_what_is_released_works_on_real_pictures(method: str, policy: Path, tmp_path: Path) -> None:
    found = adapted(tmp_path, policy, LOSSES[method], 180)
    pictures, scenes = real_pictures()
    assert success(GraspPolicy.load(found.policy), pictures, scenes) > 0.9
    metrics = checkpoint.load(found.policy, "q_function").training["metrics"]
    assert metrics["auc_real"] > 0.97
    assert_looks_real(tmp_path, segments=method == "graspgan")
    if method == "graspgan":
        assert found.translator is None
        return
    assert found.translator is not None
    translated = Translator.load(found.translator)(pictures)
    canonical = scenes.tensors["canonical"].float()
    assert (translated - canonical).abs().mean() < 0.6 * (pictures - canonical).abs().mean()
    assert success(GraspPolicy.load(policy), translated, scenes) > 0.9
    assert {"auc", "q_difference", "l1", "psnr", "ssim", "object_l1"} <= set(metrics)


def assert_looks_real(folder: Path, segments: bool) -> None:
    """The generator makes of canonical pictures what the same scenes look like in reality."""
    generator = UNet(NETWORK, {"picture": 3} | ({"segmentation": len(CLASSES)} if segments else {}))
    checkpoint.load(folder / "best.safetensors", "adaptation").restore("to_real", generator)
    pictures, scenes = real_pictures()
    canonical, real = to_float(scenes.tensors["canonical"]), to_float(pictures)
    with torch.no_grad():
        made = generator(canonical)["picture"]
    assert (made - real).abs().mean() < 0.9 * (canonical - real).abs().mean()


def test_a_translator_that_it_begins_with_brings_its_own_network(policy: Path, tmp_path: Path) -> None:
    """One of another width than the configuration's was refused."""
    wider, heads = replace(NETWORK, width=16, detail=16), heads_for(LossConfig())
    tensors = {f"unet.{name}": tensor for name, tensor in UNet(wider, heads).state_dict().items()}
    start = tmp_path / "translator.safetensors"
    configuration = {"network": asdict(wider), "heads": heads}
    checkpoint.save(start, checkpoint.Checkpoint("translator", configuration, {}, {"step": 0}, tensors))
    found = adapted(tmp_path / "adapted", policy, LOSSES["cyclegan"], 1, str(start)).translator
    assert found is not None and network_of(found) == wider


def test_scene_consistency_is_that_of_the_paper() -> None:
    """Rao et al. 2020, eq. 4: both triples, mean squared differences of all pairs of Q-values."""
    q = torch.rand(6, 4, 3).clamp(0.05, 0.95)
    x, x1, x2, y, y1, y2 = q
    mse = torch.nn.functional.mse_loss
    expected = mse(x, x1) + mse(x1, x2) + mse(x, x2) + mse(y, y1) + mse(y1, y2) + mse(y, y2)
    of_x, of_y = q.logit().split(3)
    torch.testing.assert_close(scene_consistency([tuple(of_x), tuple(of_y)]), expected)
    assert scene_consistency([(x, x, x)]) == 0


def test_bad_input_is_one_line(policy: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"adapt\.policy is empty"):
        adapted(tmp_path, "", LOSSES["cyclegan"], 1)
    with pytest.raises(UserError, match=r"adapt\.loss\.cycle = -1"):
        adapted(tmp_path, policy, replace(LOSSES["cyclegan"], cycle=-1.0), 1)
