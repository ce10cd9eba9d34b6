"""What is unknown of a camera: what its forms can be, and effects beside them."""

import pytest
import torch
import torch.nn.functional as F

from tests.fit.camera.test_camera_case import FRAMES, SIZE, opened, scenes
from tests.fit.camera.test_stand_ins import MANY, denoised, many, out_of_focus, seen
from vision_s2r.camera import Camera, CameraParameters
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.fit.camera.discrepancy import add, fit
from vision_s2r.fit.camera.resampling import KERNELS, resampled


def skewed(pictures: torch.Tensor, slope: float) -> torch.Tensor:
    """Rows displaced by so many px a row, none in the middle."""
    x, y = torch.arange(SIZE).float(), torch.arange(SIZE)[:, None].float()
    return resampled(pictures, (x + slope * (y - SIZE / 2))[None], y.expand(1, SIZE, SIZE), KERNELS[0])


def soft(pictures: torch.Tensor) -> torch.Tensor:
    return F.avg_pool2d(F.pad(pictures, (1,) * 4, mode="replicate"), 3, 1)


def left(name: str, mean: torch.Tensor, real: torch.Tensor) -> float:
    """The share of the squares of what is missing that an unknown does not take away."""
    weight, missing = torch.full((FRAMES, 1, SIZE, SIZE), 255.0**2), real - mean
    taken = add(name, fit(name, missing, mean, weight), mean, missing, weight)
    return float((missing - taken).square().mean() / missing.square().mean())


def test_a_displacement_may_be_of_many_pixels() -> None:
    mean = scenes(3)
    assert left("displacement", mean, skewed(mean, 0.1)) < 0.05  # 3 px at the rim


def test_a_blur_that_grows_from_somewhere_is_none_that_is_the_same_everywhere() -> None:
    mean = scenes(3)
    growing = torch.lerp(mean, soft(mean), torch.linspace(-1, 1, SIZE).square())
    assert left("kernel_field", mean, growing) < 0.3 * left("kernel", mean, growing)
    assert left("kernel", mean, soft(mean)) < 0.01 < left("kernel_field", mean, soft(mean))


def test_how_few_pixels_there_are_is_found_beside_a_blur_that_is_unknown() -> None:
    """Alone they are so few that they make up for it."""
    fewer = Camera()(many(), CameraParameters.of({"low_resolution": {"factor": 1.5}}, MANY))
    case = opened(seen(many(), soft(fewer)))
    alone = case.fit(frozenset({"low_resolution"}), range(MANY), None)
    found = case.fit(frozenset({"low_resolution", "kernel"}), range(MANY), None)
    assert alone.values["low_resolution"]["factor"] > 1.9
    assert found.values["low_resolution"]["factor"] == pytest.approx(1.5, rel=0.1)


def test_frames_mixed_with_those_before_them_have_no_light_of_their_own() -> None:
    dark = Camera()(many(), CameraParameters.of({"vignetting": {"strength": 0.4}}, MANY))
    before = torch.cat([dark[:1], dark[:-1]])
    case = opened(seen(many(), torch.lerp(dark, before, 0.3)))
    assert not case.unsteady
    found = case.fit(frozenset({"vignetting", "mixing"}), range(MANY), None)
    assert found.values["vignetting"]["strength"] == pytest.approx(0.4, rel=0.05)
    assert case.excess(found, range(MANY)).mean() < 1.5


def test_a_blur_beside_corners_out_of_focus_is_as_large_as_it_is() -> None:
    blurred = Camera()(many(), CameraParameters.of({"defocus_blur": {"radius": 1.2}}, MANY))
    case = opened(seen(many(), out_of_focus(blurred)))
    found = case.fit(frozenset({"defocus_blur", "kernel_field"}), range(MANY), None)
    assert found.values["defocus_blur"]["radius"] == pytest.approx(1.2, rel=0.05)
    assert not case.suspicious(found, "defocus_blur")


def test_colours_displaced_beside_rows_that_are_keep_their_name() -> None:
    """Each colour's own displacement is none that all have."""
    coloured = Camera()(many(), CameraParameters.of({"chromatic_aberration": {"red": 0.01, "blue": -0.01}}, MANY))
    case = opened(seen(many(), skewed(coloured, 0.08)))
    found = case.fit(frozenset({"chromatic_aberration", "displacement"}), range(MANY), None)
    assert not case.suspicious(found, "chromatic_aberration")


@pytest.mark.slow
def test_of_two_that_pass_for_each_other_the_one_that_suits_the_unknown_is_named() -> None:
    """Cells of fewer pixels beside a filter that takes out noise: a defocus comes nearer where nothing is unknown."""
    field = torch.randn(MANY, 3, SIZE, SIZE, generator=torch.Generator().manual_seed(3))
    textured = (F.avg_pool2d(many(), 3, 1, 1) + 0.15 * F.avg_pool2d(field, 3, 1, 1)).clamp(0, 1)
    fewer = Camera()(textured, CameraParameters.of({"low_resolution": {"factor": 2.4}}, MANY))
    found = diagnose(seen(textured, denoised(fewer, 0.7)), DiagnoseConfig())
    assert [effect.name for effect in found.effects] == ["low_resolution"]
