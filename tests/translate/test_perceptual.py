"""What frozen networks see in translations: a policy, as loss and in validation, and VGG-16."""

from dataclasses import asdict, replace
from pathlib import Path

import pytest
import torch
from test_rcan import CAMERA, SIZE, TINY, Rectangles

from vision_s2r.camera import CameraConfig
from vision_s2r.errors import UserError
from vision_s2r.grasp import FrozenQ, GraspConfig
from vision_s2r.grasp.forms import build
from vision_s2r.training import Inputs
from vision_s2r.training.checkpoint import Checkpoint, load, save
from vision_s2r.translate import TranslateConfig, losses, train_translator
from vision_s2r.translate.config import LossConfig
from vision_s2r.translate.perceptual import VGG_WEIGHTS, Vgg, _vgg_layers

ALONE = LossConfig(image=0, segmentation=0, depth=0, perceptual=1)


class Labelled(Rectangles):
    """With grasps whose labels are drawn."""

    def __init__(self, scenes: int, seed: int):
        super().__init__(scenes, seed)
        generator = torch.Generator().manual_seed(seed)
        self._tensors["grasps"] = 0.2 * torch.rand(scenes, 6, 3, generator=generator, dtype=torch.float64) - 0.1
        self._tensors["success"] = torch.randint(2, (scenes, 6), generator=generator, dtype=torch.uint8)
        self.names = set(self._tensors)


def inputs(scenes: int, held_out: int) -> Inputs:
    return Inputs(Labelled(scenes, 0), Labelled(held_out, 1), CAMERA, CameraConfig())


def policy(path: Path, cfg: GraspConfig | None = None, size: int = SIZE) -> str:
    """A checkpoint of a policy with random weights."""
    cfg = cfg or GraspConfig(width=8)
    torch.manual_seed(0)
    tensors = {f"q_function.{name}": value for name, value in build(cfg).state_dict().items()}
    save(path, Checkpoint("q_function", asdict(cfg), {"size": size}, {}, tensors))
    return str(path)


def run(out: Path, path: str, steps: int, loss: LossConfig = ALONE) -> dict[str, float]:
    """Metrics of a translator that the policy at `path` judges."""
    training = replace(TINY.training, max_steps=steps, validate_every=steps, metric="q_difference")
    cfg = replace(TINY, loss=loss, training=training, q_function=path)
    best = train_translator(cfg, inputs(48, 16), out, 3, FrozenQ.load(path))
    metrics: dict[str, float] = load(best, "translator").training["metrics"]
    return metrics


@pytest.mark.parametrize("form", ["crop", "trunk", "dense"])
def test_equal_pictures_cost_nothing_and_gradients_reach_pictures_alone(form: str) -> None:
    cfg = GraspConfig(form=form, width=8)
    q_function = build(cfg)
    frozen_q, views = FrozenQ(q_function, cfg, SIZE), Labelled(4, 0)
    true = views.batch("canonical", torch.arange(4)).movedim(-1, 1) / 255
    made = (true + 0.1 * torch.rand(true.shape)).clamp(0, 1).requires_grad_()
    where = [views.batch(name, torch.arange(4)) for name in ("intrinsics", "extrinsics")]
    grasps = frozen_q.grasps(4, torch.Generator().manual_seed(0))
    assert (grasps[..., :2].abs() <= 0.115).all() and grasps.shape == (4, 8, 3)
    ours, theirs = (frozen_q.activations(pictures, *where, grasps) for pictures in (made, true))
    assert losses.perceptual(theirs, theirs) == 0
    losses.perceptual(ours, theirs).backward()
    assert made.grad is not None and made.grad.abs().sum() > 0
    assert all(each.grad is None for each in q_function.parameters())


@pytest.mark.slow
def test_the_perceptual_loss_alone_brings_what_the_policy_sees_nearer(tmp_path: Path) -> None:
    path = policy(tmp_path / "policy.safetensors")
    before, after = (run(tmp_path / str(steps), path, steps) for steps in (1, 80))
    assert after["q_difference"] < 0.6 * before["q_difference"]
    assert 0 < after["auc"] < 1


def test_a_judge_watches_without_a_word_in_training(tmp_path: Path) -> None:
    path, loss = policy(tmp_path / "policy.safetensors"), LossConfig()
    judged = run(tmp_path / "judged", path, 2, loss)
    cfg = replace(TINY, loss=loss, training=replace(TINY.training, max_steps=2, validate_every=2))
    alone = train_translator(cfg, inputs(48, 16), tmp_path / "alone", 3)
    plain = load(alone, "translator").training["metrics"]
    assert {name: value for name, value in judged.items() if name not in ("q_difference", "auc")} == plain


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"q_function": ""}, r"loss\.perceptual = 1, but translate\.q_function is empty: expected a policy's"),
        ({"loss": replace(ALONE, perceptual=0, rectification=1)}, "are all 0: expected one of them above 0"),
        ({"loss": replace(ALONE, vgg=-1)}, r"translate\.loss\.vgg = -1"),
    ],
)
def test_a_loss_that_cannot_be_is_one_line(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    cfg: TranslateConfig = replace(TINY, **({"loss": ALONE, "q_function": "policy"} | changes))
    with pytest.raises(UserError, match=message):
        train_translator(cfg, inputs(8, 8), tmp_path, 3)


def test_a_policy_that_cannot_judge_is_named(tmp_path: Path) -> None:
    of_sources = policy(tmp_path / "sources", GraspConfig(width=8, picture="randomized", validate_on="real"))
    with pytest.raises(UserError, match="looks at source pictures"):
        FrozenQ.load(of_sources)
    with pytest.raises(UserError, match="judges pictures of 64 px: the views have 32 px"):
        run(tmp_path / "out", policy(tmp_path / "large", size=64), 1)


def test_vgg_wants_weights_that_are_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.hub, "get_dir", lambda: str(tmp_path))
    with pytest.raises(UserError, match=rf"{VGG_WEIGHTS} is not there"):
        Vgg()
    (tmp_path / "checkpoints").mkdir()
    weights = {f"features.{name}": value for name, value in _vgg_layers()[:16].state_dict().items()}
    torch.save(weights, tmp_path / "checkpoints" / VGG_WEIGHTS)
    pictures = torch.rand(2, 3, 16, 16)
    assert [tuple(each.shape[1:]) for each in Vgg()(pictures)] == [(64, 16, 16), (128, 8, 8), (256, 4, 4)]
    torch.save({"features.0.weight": torch.zeros(1)}, tmp_path / "checkpoints" / VGG_WEIGHTS)
    with pytest.raises(UserError, match="no weights of VGG-16"):
        Vgg()
