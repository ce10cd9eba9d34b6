"""The pipeline: order, margin, replay, presets, and what it says to a wrong configuration."""

import json
from pathlib import Path
from typing import Any

import pytest
import torch
from omegaconf import OmegaConf
from torch import Tensor

from vision_s2r.camera import CAMERA_EFFECTS, Camera, CameraConfig, CameraParameters, load_config
from vision_s2r.errors import UserError

PRESETS = sorted((Path(__file__).parents[2] / "configs" / "camera").glob("*.yaml"))
# The contract's: "One frame passes them in this order".
ORDER = [
    "camera_pose_offset",
    "uneven_illumination",
    "cast_shadow",
    "lens_distortion",
    "chromatic_aberration",
    "vignetting",
    "defocus_blur",
    "motion_blur",
    "low_resolution",
    "exposure",
    "shot_noise",
    "read_noise",
    "white_balance",
    "gamma",
    "jpeg_compression",
]


def pictures(batch: int, size: int, seed: int = 0) -> Tensor:
    """Smooth random float pictures [B, 3, size, size] in [0, 1]."""
    noise = torch.rand(batch, 3, size // 4, size // 4, generator=torch.Generator().manual_seed(seed))
    return torch.nn.functional.interpolate(noise, size=(size, size), mode="bilinear")


def preset(name: str) -> Camera:
    return Camera.from_config(load_config(next(path for path in PRESETS if path.stem == name)))


def test_a_frame_passes_the_effects_in_the_contracts_order() -> None:
    moderate = {effect.name: effect.moderate() for effect in CAMERA_EFFECTS}
    assert set(moderate) == set(ORDER)
    together = Camera()(pictures(2, 48), CameraParameters.of(moderate, 2))
    by_one = pictures(2, 48)
    for name in ORDER:
        by_one = Camera()(by_one, CameraParameters.of({name: moderate[name]}, 2))
    assert torch.allclose(together, by_one, atol=2.5 / 255)  # JPEG rounds to 8 bits
    assert (together - by_one).abs().mean() < 0.05 / 255


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA here")
def test_a_gpu_makes_the_same_pictures_but_for_noise() -> None:
    camera = preset("augment")
    ranges = {name: drawn for name, drawn in camera.ranges.items() if not name.endswith("_noise")}
    camera = Camera(ranges, jpeg="differentiable", reference_size=camera.reference_size)
    parameters = camera.sample(24, torch.Generator().manual_seed(5), 32, 32)
    here, there = (camera(pictures(24, 48).to(device), parameters, margin=8).cpu() for device in ("cpu", "cuda"))
    # a coefficient of JPEG next to a half may be rounded the other way
    assert (here - there).abs().mean() < 1e-3


def test_replay_is_exact_and_independent_of_the_batch() -> None:
    camera, images = preset("augment"), pictures(24, 48)
    parameters = camera.sample(24, torch.Generator().manual_seed(5), 32, 32)
    out = camera(images, parameters, margin=8)
    stored = json.loads(json.dumps(parameters.to_dict(), allow_nan=False))
    assert torch.equal(out, camera(images, CameraParameters.from_dict(stored), margin=8))
    with torch.autocast("cpu", dtype=torch.bfloat16):  # as in a training step
        assert torch.equal(out, camera(images, parameters, margin=8))
    some = torch.tensor([17, 3])
    alone = camera(images[some], parameters.select(some), margin=8)
    assert torch.allclose(out[some], alone, atol=1.5 / 255) and (out[some] - alone).abs().mean() < 1e-4
    again = camera.sample(24, torch.Generator().manual_seed(5), 32, 32)
    assert again.to_dict() == parameters.to_dict()


def test_noise_of_a_sample_depends_on_its_seed_alone() -> None:
    images, noise = torch.full((3, 3, 16, 16), 0.5), {"read_noise": {"sigma": 0.05}}
    out = Camera()(images, CameraParameters.of(noise, 3, seeds=torch.tensor([7, 8, 7])))
    assert torch.equal(out[0], out[2]) and not torch.equal(out[0], out[1])
    both = {"read_noise": {"sigma": 0.05}, "shot_noise": {"full_well": 500.0}}
    light = Camera(encoding="linear")
    shot = light(images, CameraParameters.of({"shot_noise": both["shot_noise"]}, 3)) - images
    read = light(images, CameraParameters.of({"read_noise": both["read_noise"]}, 3)) - images
    assert abs(torch.corrcoef(torch.stack([shot.flatten(), read.flatten()]))[0, 1]) < 0.1


@pytest.mark.parametrize("effect", [e.name for e in CAMERA_EFFECTS if e.optical])
def test_optics_see_the_margin_and_never_a_black_border(effect: str) -> None:
    parameters = Camera.single(effect).sample(2, torch.Generator(), 32, 32)
    wide = pictures(2, 32 + 2 * 24)
    small = wide[:, :, 12:-12, 12:-12]
    intrinsics = torch.tensor([[36.0, 36.0, 15.0, 16.0]]).expand(2, 4)
    a = Camera()(wide, parameters, margin=24, intrinsics=intrinsics)
    b = Camera()(small, parameters, margin=12, intrinsics=intrinsics)
    assert a.shape == (2, 3, 32, 32) and torch.allclose(a, b, atol=1e-5)
    if not CAMERA_EFFECTS[effect].linear_light:
        flat = Camera()(torch.full((2, 3, 32, 32), 0.7), parameters)
        assert torch.allclose(flat, torch.tensor(0.7), atol=1e-5)


def test_effects_are_drawn_as_often_and_as_far_as_configured() -> None:
    effects = {"defocus_blur": {"probability": 0.3, "radius": [1.0, 2.0]}, "exposure": {"stops": -0.5}}
    camera = Camera.from_config(CameraConfig(effects=effects, reference_size=128))
    drawn = camera.sample(4000, torch.Generator().manual_seed(0), 64, 96)
    on, radius = drawn.on("defocus_blur"), drawn.values["defocus_blur"]["radius"]
    assert abs(on.double().mean() - 0.3) < 0.03 and not drawn.on("gamma").any()
    assert torch.equal(on, radius > 0)
    # Pixels are meant for pictures of 128; these have 64 on the shorter side.
    assert 0.5 <= radius[on].min() < 0.51 and 0.99 < radius[on].max() <= 1.0
    assert torch.all(drawn.values["exposure"]["stops"] == -0.5)


def test_given_values_and_effects_take_the_place_of_drawn_ones_and_disturb_no_others() -> None:
    effects = {"defocus_blur": {"probability": 0.3, "radius": [1.0, 2.0]}, "exposure": {"stops": [-1.0, 1.0]}}
    camera = Camera.from_config(CameraConfig(effects=effects, reference_size=128))
    radius, on = torch.full((100,), 4.0, dtype=torch.float64), torch.arange(100) < 50
    usual = camera.sample(100, torch.Generator().manual_seed(0), 64, 64)
    drawn = camera.sample(
        100, torch.Generator().manual_seed(0), 64, 64, {"defocus_blur": {"radius": radius}}, {"defocus_blur": on}
    )
    present = drawn.on("defocus_blur")
    assert torch.equal(present, usual.on("defocus_blur") | on) and 50 < present.sum() < 100
    assert (drawn.values["defocus_blur"]["radius"][present] == 2.0).all()  # meant for pictures of 128, as ranges are
    assert torch.equal(drawn.values["exposure"]["stops"], usual.values["exposure"]["stops"])


@pytest.mark.parametrize("path", PRESETS, ids=lambda path: path.stem)
def test_presets_make_sane_pictures(path: Path) -> None:
    config = load_config(path)
    structured = OmegaConf.merge(OmegaConf.structured(CameraConfig), OmegaConf.load(path))
    assert OmegaConf.to_object(structured) == config
    camera, images = Camera.from_config(config), pictures(16, 64, seed=1)
    out = camera(images, camera.sample(16, torch.Generator().manual_seed(1), 48, 48), margin=8)
    assert out.shape == (16, 3, 48, 48) and out.min() >= 0 and out.max() <= 1
    inside = images[:, :, 8:-8, 8:-8]
    if path.stem == "none":
        assert torch.equal(out, inside)
        return
    changed = (out - inside).abs().mean((1, 2, 3))
    assert changed.min() > 0.005 or path.stem == "augment"
    assert 0.02 < changed.mean() < 0.3
    assert out.std((1, 2, 3)).min() > 0.02  # something is left to see


def test_the_presets_are_those_that_the_tables_name() -> None:
    names = {path.stem for path in PRESETS}
    assert names >= {"none", "webcam", "industrial", "phone", "harsh", "validation", "augment"}
    assert set(preset("augment").ranges) == set(ORDER)


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"defocus": {"radius": 1.0}}, "did you mean 'defocus_blur'"),
        ({"defocus_blur": {"radus": 1.0}}, "defocus_blur has no parameter 'radus': did you mean 'radius'"),
        ({"motion_blur": {"length": 2.0}}, "motion_blur: missing angle"),
        ({"defocus_blur": {"radius": -1.0}}, "radius is -1, expected 0 to 32 px"),
        ({"defocus_blur": {"radius": [2.0, 1.0]}}, r"radius is \[2, 1\], expected low before high"),
        ({"defocus_blur": {"radius": [2.0]}}, r"expected a number or \[low, high\]"),
        ({"defocus_blur": {"radius": "big"}}, "radius is 'big', expected a number"),
        ({"defocus_blur": {"radius": 1.0, "probability": 1.5}}, "probability is 1.5, expected 0 to 1"),
        ({"shot_noise": {"full_well": [500.0, float("inf")]}}, "expected a finite range"),
        ({"gamma": 2.0}, "gamma is 2.0, expected its parameters"),
    ],
)
def test_configurations_that_cannot_be_are_named(effects: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        Camera.from_config(CameraConfig(effects=effects))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("efects: {}", "unknown key 'efects', did you mean 'effects'"),
        ("jpeg: codek", "jpeg = 'codek': did you mean 'codec'"),
        ("effects: {gama: {gamma: 2}}", "no camera effect is called 'gama': did you mean 'gamma'"),
        ("reference_size: 0", "reference_size = 0: expected at least 1"),
        ("effects: [", "cannot read camera"),
        ("- 1", "expected keys and values"),
    ],
)
def test_files_that_cannot_be_are_named(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(UserError, match=message) as caught:
        load_config(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_pictures_and_parameters_that_do_not_fit_are_named() -> None:
    images, parameters = pictures(2, 32), CameraParameters.of({}, 2)
    for arguments, message in [
        ((images[:1], parameters), "as many as there are parameters"),
        ((images.mul(255).byte(), parameters), "expected float"),
        ((images, parameters, 16), "margin of 16 px"),
        ((images, parameters, 0, torch.ones(4)), "intrinsics"),
    ]:
        with pytest.raises(UserError, match=message):
            Camera()(*arguments)  # type: ignore[arg-type]
    with pytest.raises(UserError, match="one value a picture"):
        CameraParameters.of({"gamma": {"gamma": torch.ones(3)}}, 2)
    with pytest.raises(UserError, match="expected what to_dict wrote"):
        CameraParameters.from_dict({"seeds": [1, 2]})
