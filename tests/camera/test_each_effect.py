"""Each effect against an independent implementation, and what holds for all of them."""

import json
import math

import cv2
import numpy as np
import pytest
import torch
from recordings import EXAMPLES
from references import REFERENCES
from scipy.stats import poisson
from torch import Tensor

from vision_s2r.camera import CAMERA_EFFECTS, Camera, CameraParameters
from vision_s2r.camera.effects.shot_noise import poisson_quantile
from vision_s2r.camera.resample import convolve
from vision_s2r.images import to_float, to_uint8

NAMES = [effect.name for effect in CAMERA_EFFECTS]
NOISE = ["shot_noise", "read_noise"]

# A second setting beside the moderate one of each effect, where another branch or direction may hide a mistake.
SETTINGS = [(name, CAMERA_EFFECTS[name].moderate()) for name in REFERENCES] + [
    ("camera_pose_offset", {"yaw": -0.03, "pitch": 0.05, "roll": 0.0}),
    ("lens_distortion", {"k1": 0.15, "k2": 0.1}),
    ("defocus_blur", {"radius": 0.8}),
    ("defocus_blur", {"radius": 3.3}),
    ("motion_blur", {"length": 1.7, "angle": -110.0}),
    ("low_resolution", {"factor": 2.7}),
    ("exposure", {"stops": 1.3}),
    ("jpeg_compression", {"quality": 80.0}),
]


def a_picture(height: int = 60, width: int = 76, seed: int = 0) -> np.ndarray:
    """Float64 [H, W, 3] in [0, 1] at 8 bits: soft blobs, a few hard edges, black and white in places."""
    rng = np.random.default_rng(seed)
    blobs = cv2.GaussianBlur(rng.standard_normal((height, width, 3)), (0, 0), 3)
    edges = cv2.GaussianBlur(np.sign(rng.standard_normal((6, 6, 3))), (0, 0), 0.1)
    edges = cv2.resize(edges, (width, height), interpolation=cv2.INTER_NEAREST)
    picture = cv2.GaussianBlur(0.5 + 2.5 * blobs + 0.15 * edges, (0, 0), 0.6)
    return np.round(np.clip(picture, 0, 1) * 255) / 255


def batch_of(*pictures: np.ndarray) -> Tensor:
    return torch.from_numpy(np.stack(pictures)).movedim(-1, 1).float()


def rms_grey_levels(a: Tensor | np.ndarray, b: Tensor | np.ndarray) -> float:
    return float(np.sqrt(np.mean((np.asarray(a) - np.asarray(b)) ** 2)) * 255)


def test_a_picture_is_blurred_alone_as_among_others() -> None:
    picture = batch_of(a_picture(61, 76))
    kernel = torch.rand(1, 7, 7, generator=torch.Generator().manual_seed(0))
    kernel = kernel + kernel.flip(1, 2)
    many = convolve(picture.expand(5, 3, 61, 76), kernel.expand(5, 7, 7))
    assert torch.equal(convolve(picture, kernel).expand_as(many), many)


def test_a_disk_smaller_than_its_pixel_leaves_the_picture_as_it_is() -> None:
    picture = batch_of(a_picture()).expand(4, -1, -1, -1)
    radius = torch.tensor([0.001, 0.05, 0.2, 0.5], dtype=torch.float64)
    got = Camera()(picture, CameraParameters.of({"defocus_blur": {"radius": radius}}, 4))
    torch.testing.assert_close(got, picture)


@pytest.mark.parametrize(("name", "values"), SETTINGS, ids=lambda v: v if isinstance(v, str) else "")
def test_agrees_with_an_independent_implementation(name: str, values: dict[str, float]) -> None:
    picture, intrinsics = a_picture(), np.array([80.0, 84.0, 35.0, 31.5])
    expected = np.clip(REFERENCES[name](picture, intrinsics, **values), 0, 1)
    got = Camera()(
        batch_of(picture), CameraParameters.of({name: values}, 1), intrinsics=torch.from_numpy(intrinsics)[None]
    )
    assert rms_grey_levels(picture, expected) > 1.5  # the setting shows
    # OpenCV's warps know 32 positions between two pixels; the disk's rim is a quarter of a pixel wide here.
    assert rms_grey_levels(got[0].movedim(0, -1), expected) < 0.35


@pytest.mark.parametrize("quality", [10.0, 50.0, 95.0])
@pytest.mark.parametrize("size", [(64, 48), (60, 76), (61, 75)])
def test_differentiable_jpeg_is_libjpegs(size: tuple[int, int], quality: float) -> None:
    picture = a_picture(*size)
    expected = REFERENCES["jpeg_compression"](picture, None, quality)
    parameters = CameraParameters.of({"jpeg_compression": {"quality": quality}}, 1)
    got = Camera(jpeg="differentiable")(batch_of(picture), parameters)[0].movedim(0, -1)
    # All but a few coefficients are quantized alike; kornia 0.9's form leaves 2 to 9 grey levels.
    assert rms_grey_levels(picture, expected) > 3 * rms_grey_levels(got, expected)
    assert rms_grey_levels(got, expected) < 0.9


@pytest.mark.parametrize("name", NAMES)
def test_neutral_samples_keep_every_bit(name: str) -> None:
    effect = CAMERA_EFFECTS[name]
    images = batch_of(*(a_picture(32, 40, seed) for seed in range(3)))
    values = {
        p.name: torch.tensor([p.moderate, p.moderate if p.neutral is None else p.neutral, p.moderate])
        for p in effect.parameters
    }
    out = Camera()(images, CameraParameters.of({name: values}, 3), margin=4)
    inside = images[:, :, 4:-4, 4:-4]
    assert torch.equal(out[1], inside[1])
    assert not torch.equal(out[0], inside[0]) and not torch.equal(out[2], inside[2])


@pytest.mark.parametrize("name", ["exposure", "shot_noise", "read_noise", "vignetting"])
def test_linear_encoding_is_the_light_itself(name: str) -> None:
    images = torch.full((1, 3, 8, 8), 0.25)
    parameters = CameraParameters.of({name: CAMERA_EFFECTS[name].moderate()}, 1)
    raw = Camera(encoding="linear")(images, parameters)
    through_srgb = Camera()(torch.full_like(images, 0.537099), parameters)  # codes the light 0.25
    assert torch.allclose(((through_srgb + 0.055) / 1.055) ** 2.4, raw, atol=1e-4)
    assert not torch.equal(raw, images)


def test_read_noise_is_white_in_linear_light() -> None:
    images = torch.full((1, 3, 128, 128), 0.5)
    out = Camera(encoding="linear")(images, CameraParameters.of({"read_noise": {"sigma": 0.05}}, 1))
    noise = (out - images)[0]
    assert abs(noise.mean()) < 1e-3
    assert math.isclose(noise.std(), 0.05, rel_tol=0.02)
    for other in (noise.roll(1, -1), noise.roll(1, -2), noise.roll(1, 0)):
        assert abs((noise * other).mean()) / 0.05**2 < 0.02


@pytest.mark.parametrize("mean", [0.0, 0.02, 0.3, 1.0, 3.0, 20.0, 300.0])
def test_shot_noise_counts_as_poisson(mean: float) -> None:
    normal = torch.randn(400_000, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    counts = poisson_quantile(torch.full_like(normal, mean), normal).numpy().astype(int)
    values = np.arange(counts.max() + 50)
    frequency = np.bincount(counts, minlength=len(values)) / len(counts)
    assert np.abs(frequency - poisson.pmf(values, mean)).sum() / 2 < 0.025
    assert np.isclose(counts.mean(), mean, rtol=0.02)


def test_shot_noise_varies_with_the_light() -> None:
    images = torch.tensor([0.1, 0.4, 0.8])[:, None, None, None].expand(3, 3, 96, 96).contiguous()
    out = Camera(encoding="linear")(images, CameraParameters.of({"shot_noise": {"full_well": 400.0}}, 3))
    assert torch.allclose(out.var((1, 2, 3)), torch.tensor([0.1, 0.4, 0.8]) / 400, rtol=0.05)


@pytest.mark.parametrize("example", ["camera_defocus_blur", "camera_lens_distortion", "camera_no_gap"])
def test_reproduces_the_recorded_examples(example: str) -> None:
    folder = EXAMPLES / example
    effects = json.loads((folder / "answer.json").read_text())["effects"]

    def read(which: str) -> Tensor:
        pictures = [cv2.imread(str(path))[..., ::-1] for path in sorted((folder / which).glob("*.png"))]
        return torch.from_numpy(np.stack(pictures))

    simulated, real = read("sim"), read("real")
    intrinsics = torch.tensor([140.0, 140.0, 63.5, 63.5]).expand(len(real), 4)
    got = Camera()(to_float(simulated), CameraParameters.of(effects, len(real)), intrinsics=intrinsics)
    # Sensor noise and rounding leave 0.57; a bilinear warp of the bicubic lens would leave 2.8.
    assert rms_grey_levels(to_uint8(got).double() / 255, real.double() / 255) < 0.75


def with_gradient(name: str) -> tuple[Tensor, dict[str, Tensor]]:
    """A small double-precision picture away from clipping, and the effect's moderate values, all wanting gradients."""
    generator = torch.Generator().manual_seed(2)
    images = 0.3 + 0.4 * torch.rand(1, 3, 7, 9, generator=generator, dtype=torch.float64)
    values = {
        p.name: torch.tensor([p.moderate * 0.83], dtype=torch.float64, requires_grad=True)
        for p in CAMERA_EFFECTS[name].parameters
    }
    return images.requires_grad_(), values


@pytest.mark.parametrize("name", [n for n in NAMES if n not in ("jpeg_compression", "shot_noise")])
def test_gradients_are_those_of_finite_differences(name: str) -> None:
    images, values = with_gradient(name)

    def camera(images: Tensor, *numbers: Tensor) -> Tensor:
        given = dict(zip(values, numbers, strict=True))
        if name == "low_resolution":
            given = {key: value.detach() for key, value in given.items()}
        return Camera()(images, CameraParameters.of({name: given}, 1))

    inputs = (images,) if name == "low_resolution" else (images, *values.values())
    numbers = tuple(values.values()) if name == "low_resolution" else ()
    assert torch.autograd.gradcheck(lambda *given: camera(*given, *numbers), inputs, atol=1e-5, fast_mode=True)


def test_a_fit_can_start_from_neutral() -> None:
    k1 = torch.zeros(1, dtype=torch.float64, requires_grad=True)
    images = batch_of(a_picture(24, 24)).double()
    Camera()(images, CameraParameters.of({"lens_distortion": {"k1": k1, "k2": 0.0}}, 1)).square().sum().backward()
    assert k1.grad is not None and abs(float(k1.grad)) > 1e-3


def test_shot_noise_passes_the_gradient_of_its_variance() -> None:
    full_well = torch.tensor([200.0], requires_grad=True)
    images = torch.full((1, 3, 128, 128), 0.5)
    noisy = Camera(encoding="linear")(images, CameraParameters.of({"shot_noise": {"full_well": full_well}}, 1))
    (noisy - images).square().mean().backward()
    assert full_well.grad is not None and math.isclose(float(full_well.grad), -0.5 / 200**2, rel_tol=0.1)


def test_differentiable_jpeg_passes_the_gradient_of_the_picture() -> None:
    images, _ = with_gradient("jpeg_compression")
    out = Camera(jpeg="differentiable")(images, CameraParameters.of({"jpeg_compression": {"quality": 50.0}}, 1))
    out.mean().backward()
    assert images.grad is not None and math.isclose(float(images.grad.sum()), 1.0, rel_tol=0.02)
