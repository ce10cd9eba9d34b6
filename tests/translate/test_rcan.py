"""RCAN end to end on synthetic views: coloured rectangles on textures, their canonical look flat."""

import math
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import asdict, replace
from pathlib import Path

import pytest
import torch
from omegaconf import OmegaConf
from torch import Tensor

from vision_s2r.camera import CameraConfig
from vision_s2r.errors import UserError
from vision_s2r.networks.unet import NetworkConfig
from vision_s2r.scene import CLASSES, nominal_camera, palette
from vision_s2r.scene.config import ViewpointConfig
from vision_s2r.training import Inputs, TrainingConfig, released
from vision_s2r.training.checkpoint import load, load_state, save
from vision_s2r.training.data import ORDERS, Draw
from vision_s2r.translate import TranslateConfig, Translator, train_translator
from vision_s2r.translate.config import DiscriminatorConfig, LossConfig
from vision_s2r.translate.pairs import Pairs

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
SIZE, MARGIN, VIEWS = 32, 2, 2
OBJECT = CLASSES.index("object")
CAMERA = CameraConfig(effects={"exposure": {"stops": [-0.3, 0.3]}})
TINY = TranslateConfig(
    network=NetworkConfig(width=16, levels=2, blocks=1, rectifier=8, composed=True),
    discriminator=DiscriminatorConfig(width=8, layers=2),
    loss=LossConfig(segmentation=0.1, adversarial=0.01),
    training=TrainingConfig(
        max_steps=4, batch_size=8, learning_rate=4e-3, muon=4e-3, validate_every=2, metric="l1", accelerator="cpu"
    ),
    validate_on="randomized",
    pictures=2,
    shuffle_colours=False,  # objects are told by their red
)


class Rectangles:
    """Scenes of two rectangles; sources are textured at random, canonical pictures have a colour a class."""

    size, source_size, margin = SIZE, SIZE, MARGIN

    def __init__(self, scenes: int, seed: int):
        generator = torch.Generator().manual_seed(seed)
        wide = SIZE + 2 * MARGIN
        objects = torch.zeros(scenes, wide, wide, dtype=torch.bool)
        for scene in objects:
            for _ in range(2):
                top, left = torch.randint(2, wide - 14, (2,), generator=generator).tolist()
                scene[top : top + 10, left : left + 12] = True
        colours = torch.rand(scenes, VIEWS, 2, 3, generator=generator)
        colours[..., 0] = 0.3 * colours[..., 0] + torch.tensor([0.1, 0.6])  # objects are told by their red alone
        ids = objects.long()
        sources = torch.stack([colours[torch.arange(scenes)[:, None, None], v, ids] for v in range(VIEWS)], 1)
        sources = (sources + 0.1 * torch.randn(sources.shape, generator=generator)).clamp(0, 1)
        inner = objects[:, MARGIN:-MARGIN, MARGIN:-MARGIN]
        canonical = 0.9 * torch.tensor(palette())[inner.long() * OBJECT]
        camera = nominal_camera(ViewpointConfig(field_of_view=2 * math.atan(SIZE / 2 / 35)))
        self._tensors = {
            "randomized": (255 * sources).to(torch.uint8),
            "canonical": (255 * canonical).to(torch.uint8),
            "segmentation": (inner * OBJECT).to(torch.uint8),
            "depth": 0.7 - 0.05 * inner.float(),
            "intrinsics": torch.tensor([35.0, 35.0, 15.5, 15.5], dtype=torch.float64).expand(scenes, 4),
            "extrinsics": torch.tensor(camera.extrinsics()).expand(scenes, 4, 4),
            "field_of_view": torch.tensor(camera.field_of_view, dtype=torch.float64).expand(scenes),
            "camera_position": torch.tensor(camera.position, dtype=torch.float64).expand(scenes, 3),
            "camera_rotation": torch.tensor(camera.rotation, dtype=torch.float64).expand(scenes, 3, 3),
        }
        self.names = set(self._tensors)

    def __len__(self) -> int:
        return len(self._tensors["depth"])

    def batch(self, name: str, indices: Tensor) -> Tensor:
        return self._tensors[name][indices]

    def pictures(self) -> Tensor:
        return self._tensors["randomized"][:, 0, MARGIN:-MARGIN, MARGIN:-MARGIN]


def run(out: Path, cfg: TranslateConfig = TINY, seed: int = 3) -> Path:
    return train_translator(cfg, Inputs(Rectangles(48, 0), Rectangles(16, 1), CAMERA, CameraConfig()), out, seed)


def with_training(**changes: object) -> TranslateConfig:
    return replace(TINY, training=replace(TINY.training, **changes))


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run(tmp_path_factory.mktemp("trained"), with_training(max_steps=160, validate_every=80))


def test_it_learns_the_canonical_view(trained: Path) -> None:
    held_out = Rectangles(16, 1)
    canonical = held_out.batch("canonical", torch.arange(16)).float() / 255
    identity = (held_out.pictures().float() / 255 - canonical).abs().mean()
    constant = (canonical.mean((0, 1, 2)) - canonical).abs().mean()
    metrics = load(trained, "translator").training["metrics"]
    assert metrics["l1"] < 0.3 * min(identity, constant)
    assert metrics["object_iou"] > 0.8
    assert metrics["depth_error"] < 0.02
    translated = Translator.load(trained)(held_out.pictures()).float() / 255
    # the metric is that of the released translator (whose pictures are rounded to 8 bits here)
    assert float((translated - canonical).abs().mean()) == pytest.approx(metrics["l1"], abs=2e-3)
    assert (trained.parent / "pictures" / "translation-0000160.png").exists()


def test_training_on_keeps_the_network_that_it_begins_with(trained: Path, tmp_path: Path) -> None:
    other = replace(with_training(learning_rate=1e-6, muon=0.0), network=NetworkConfig(width=8, levels=3))
    path = run(tmp_path, replace(other, start=str(trained)))
    assert load(path, "translator").configuration["network"] == asdict(TINY.network)
    assert Translator.load(path)(Rectangles(4, 1).pictures()).shape == (4, SIZE, SIZE, 3)


def test_colours_of_a_training_picture_change_places_and_nothing_else_does() -> None:
    views, draw = Rectangles(48, 0), lambda: Draw(0, 5, 48, 32)
    plain, shuffled = (Pairs(replace(TINY, shuffle_colours=on), MARGIN, (0.6, 0.8)) for on in (False, True))
    before, after = plain.drawn(views, draw()), shuffled.drawn(views, draw())
    assert all(torch.equal(before[name], after[name]) for name in before if name != "source")
    assert torch.equal(before["source"].sort(-1).values, after["source"].sort(-1).values)
    orders = [
        next(k for k, order in enumerate(ORDERS) if torch.equal(one[..., order], other))
        for one, other in zip(before["source"], after["source"], strict=True)
    ]
    assert set(orders) == set(range(len(ORDERS)))
    assert torch.equal(after["source"], shuffled.drawn(views, draw())["source"])


@pytest.mark.slow
def test_a_compiled_network_learns_the_same(tmp_path: Path) -> None:
    small = replace(
        with_training(validate_every=4), network=NetworkConfig(width=8, levels=1, rectifier=8, composed=True)
    )
    plain = run(tmp_path / "plain", small)
    compiled = run(tmp_path / "compiled", replace(small, training=replace(small.training, compile=True)))
    found, expected = (load(path, "translator") for path in (compiled, plain))
    assert found.tensors.keys() == expected.tensors.keys()
    assert found.training["metrics"] == pytest.approx(expected.training["metrics"], rel=0.02)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA here")
def test_a_gpu_trains_what_a_processor_then_uses(tmp_path: Path) -> None:
    noisy = CameraConfig(effects=CAMERA.effects | {"shot_noise": {"full_well": 2000}}, jpeg="differentiable")
    there = with_training(
        max_steps=160, validate_every=80, accelerator="cuda", resident=True, compile=True, precision="bf16-mixed"
    )
    views, held_out = Rectangles(48, 0), Rectangles(16, 1)
    path = train_translator(there, Inputs(views, held_out, noisy, CameraConfig()), tmp_path, 3)
    metrics = load(path, "translator").training["metrics"]
    assert metrics["object_iou"] > 0.8
    canonical = held_out.batch("canonical", torch.arange(16)).float() / 255
    translated = [Translator.load(path, device)(held_out.pictures()).cpu() for device in ("cpu", "cuda")]
    for each in translated:
        assert float((each.float() / 255 - canonical).abs().mean()) == pytest.approx(metrics["l1"], abs=2e-3)


def test_interrupted_and_resumed_equals_uninterrupted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    straight = load(run(tmp_path / "straight"), "translator")
    from vision_s2r.translate.rcan import Rcan

    step_of = Rcan.training_step

    def interrupted(self: Rcan, batch: dict[str, Tensor], step: object) -> dict[str, Tensor]:
        os.kill(os.getpid(), signal.SIGINT)
        return step_of(self, batch, step)  # type: ignore[arg-type]

    monkeypatch.setattr(Rcan, "training_step", interrupted)
    for _ in range(3):
        with pytest.raises(KeyboardInterrupt):
            run(tmp_path / "resumed")
    monkeypatch.undo()
    assert load_state(tmp_path / "resumed" / "last.pt")["step"] == 3
    resumed = load(run(tmp_path / "resumed"), "translator")
    torch.testing.assert_close(resumed.tensors, straight.tensors, rtol=0, atol=0)
    assert resumed.training == straight.training


SCRIPT = f"""
import logging, sys
from dataclasses import replace
from pathlib import Path
sys.path.insert(0, {str(Path(__file__).parent)!r})
from {Path(__file__).stem} import run, with_training
logging.basicConfig(level="INFO")
run(Path(sys.argv[1]), with_training(max_steps=100_000, validate_every=5))
"""


@pytest.mark.slow
def test_ctrl_c_leaves_a_state_to_go_on_from(tmp_path: Path) -> None:
    process = subprocess.Popen([sys.executable, "-c", SCRIPT, tmp_path], stderr=subprocess.PIPE, text=True)
    while not (tmp_path / "last.pt").exists() and process.poll() is None:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    step = load_state(tmp_path / "last.pt")["step"]
    assert f"interrupted at step {step}; run it again to go on" in said
    assert step >= 5 and Translator.load(tmp_path / "best.safetensors").size == SIZE


@pytest.mark.parametrize(
    ("override", "networks", "heads"),
    [
        ("loss.adversarial=0.01", {"unet", "discriminator"}, ["canonical", "segmentation", "depth"]),
        ("loss.adversarial=0", {"unet"}, ["canonical", "segmentation", "depth"]),
        ("loss.depth=0", {"unet"}, ["canonical", "segmentation"]),
    ],
)
def test_an_ablation_is_a_command_line(tmp_path: Path, override: str, networks: set[str], heads: list[str]) -> None:
    schema, file = OmegaConf.structured(TranslateConfig), OmegaConf.load(CONFIGS / "translate" / "rcan.yaml")
    cfg = OmegaConf.to_object(OmegaConf.merge(schema, file, OmegaConf.from_dotlist([override])))
    best = run(tmp_path, replace(with_training(max_steps=1), loss=cfg.loss))
    assert load_state(tmp_path / "last.pt")["networks"].keys() == networks
    assert list(Translator.load(best).predict(torch.rand(1, 3, SIZE, SIZE))) == heads


def test_views_that_do_not_fit_are_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="views of 32 px: expected a multiple of 64"):
        run(tmp_path, replace(TINY, network=replace(TINY.network, levels=6)))
    with pytest.raises(UserError, match="validation views hold no 'real'"):
        run(tmp_path, replace(TINY, validate_on="real"))
    with pytest.raises(UserError, match=r"translate\.loss\.depth = -1"):
        run(tmp_path, replace(TINY, loss=replace(TINY.loss, depth=-1)))


def test_a_translator_keeps_the_form_of_its_pictures(trained: Path) -> None:
    translator, pictures = Translator.load(trained), Rectangles(70, 2).pictures()
    canonical = translator(pictures)
    assert canonical.dtype == torch.uint8 and canonical.shape == pictures.shape
    floats = translator(pictures.movedim(-1, 1) / 255)
    assert floats.dtype == torch.float32 and floats.shape == (70, 3, SIZE, SIZE)
    assert torch.equal((255 * floats).round().to(torch.uint8).movedim(1, -1), canonical)
    assert torch.equal(translator(pictures), canonical)
    everything = translator.predict(pictures)
    assert everything["segmentation"].shape == (70, len(CLASSES), SIZE, SIZE)
    torch.testing.assert_close(everything["segmentation"].sum(1), torch.ones(70, SIZE, SIZE))
    assert 0.6 < float(everything["depth"].mean()) < 0.75  # metres
    torch.testing.assert_close(translator.predict(pictures[5:6])["depth"], everything["depth"][5:6], atol=1e-5, rtol=0)


def test_a_mirrored_translation_is_the_mean_of_both_pictures(trained: Path) -> None:
    translator, images = Translator.load(trained), torch.rand(2, 3, SIZE, SIZE)
    both = translator(images, mirrored=True)
    torch.testing.assert_close(both, (translator(images) + translator(images.flip(-1)).flip(-1)) / 2)
    coded = (images * 255).round().byte().permute(0, 2, 3, 1)
    assert torch.equal(translator(coded.flip(2), mirrored=True).flip(2), translator(coded, mirrored=True))


def test_weights_for_another_look_are_refused(trained: Path, tmp_path: Path) -> None:
    found, other = load(trained, "translator"), tmp_path / "other.safetensors"
    repainted = found.normalization | {"palette": [[0.0, 0.0, 0.0]] * len(CLASSES)}
    save(other, replace(found, normalization=repainted))
    with pytest.raises(UserError, match="its canonical colours are") as error:
        Translator.load(other)
    assert "\n" not in str(error.value)


def test_a_network_that_no_machine_holds_is_refused(trained: Path, tmp_path: Path) -> None:
    found, other = load(trained, "translator"), tmp_path / "other.safetensors"
    endless = found.configuration["network"] | {"blocks": 10**30}  # blocks were built until memory was full
    save(other, replace(found, configuration=found.configuration | {"network": endless}))
    with pytest.raises(UserError, match=r"other\.safetensors: network\.blocks = 10+: expected 1 to 32"):
        Translator.load(other)
    save(other, replace(found, configuration=found.configuration | {"heads": {"canonical": -1}}))
    with pytest.raises(UserError, match=r"other\.safetensors: heads are .*-1.*expected channels, 1 to 64"):
        Translator.load(other)


def test_released_names(trained: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(released, "WEIGHTS", tmp_path)
    (tmp_path / "translator").mkdir()
    shutil.copy(trained, tmp_path / "translator" / "bin-32.safetensors")
    assert Translator.load("bin-32").size == SIZE
    with pytest.raises(UserError, match=r"no released translator 'bin-64', did you mean 'bin-32'\? \(rel"):
        Translator.load("bin-64")
    with pytest.raises(UserError, match=r"no released q_function 'bin-32'.*released: none"):
        load("bin-32", "q_function")


@pytest.mark.parametrize(
    ("images", "message"),
    [
        (torch.zeros(1, 32, 36, 3, dtype=torch.uint8), "expected 32 x 32 px"),
        (torch.zeros(1, 32, 32, 4, dtype=torch.uint8), "expected uint8"),
        (torch.zeros(1, 32, 32, 3), "or float"),
        (torch.zeros(32, 32, 3, dtype=torch.uint8), "expected uint8"),
        (torch.zeros(1, 3, 32, 32, dtype=torch.int64), "torch.int64"),
        (torch.full((1, 3, 32, 32), 200.0), r"outside \[0, 1\]"),
        (torch.full((1, 3, 32, 32), torch.nan), r"outside \[0, 1\]"),
        (torch.zeros(1, 32, 32, 3, dtype=torch.uint8).numpy(), r"expected a torch\.Tensor"),
    ],
)
def test_a_translator_refuses_other_pictures(trained: Path, images: Tensor, message: str) -> None:
    with pytest.raises(UserError, match=message) as error:
        Translator.load(trained)(images)
    assert "\n" not in str(error.value)
