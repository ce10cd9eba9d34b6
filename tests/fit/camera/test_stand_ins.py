"""What only stands in for something unknown: noise that is none, an effect that is not as large everywhere."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch
import torch.nn.functional as F

from tests.fit.camera.test_camera_case import FRAMES, SIZE, opened, recorded, scenes
from vision_s2r.appearance import PICTURE_EFFECTS
from vision_s2r.camera import Camera, CameraParameters
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.fit.camera.area import area_of, seen_behind
from vision_s2r.fit.camera.case import CameraCase
from vision_s2r.fit.camera.consistency import disagreement
from vision_s2r.fit.camera.discrepancy import DISCREPANCIES, RANDOM, told_by
from vision_s2r.fit.camera.grain import OF_ROWS, TOLD
from vision_s2r.fit.case import Hypothesis
from vision_s2r.recording.data import CameraRecording

NOISE = {"read_noise", "shot_noise"}
MANY = 2 * FRAMES


def seen(sim: torch.Tensor, real: torch.Tensor, noise: float = 0.5) -> CameraRecording:
    """Pairs of these pictures [N, 3, H, W], with noise (grey levels), rounded."""
    random = torch.randn(real.shape, generator=torch.Generator().manual_seed(1)) * noise / 255
    pair = [
        each.clamp(0, 1).mul(255).round().permute(0, 2, 3, 1).numpy() / np.float32(255) for each in (sim, real + random)
    ]
    names = tuple(f"{k:04d}" for k in range(len(sim)))
    return replace(recorded(), sim=pair[0], real=pair[1], names=names, real_names=names)


def many() -> torch.Tensor:
    return (torch.cat([scenes(0), scenes(1)]) * 255).round() / 255


def proposed(case: CameraCase) -> set[str]:
    return set().union(*case.proposals())


def left(case: CameraCase) -> float:
    """Mean squared residual of the simulator as it came, in units of the noise."""
    nominal = case.fit(frozenset(), range(case.segments), None)
    return float(case.excess(nominal, range(case.segments)).mean())


@pytest.mark.slow
def test_pixels_with_gains_of_their_own_are_not_noisy() -> None:
    gains = 1 + 0.05 * torch.randn(3, SIZE, SIZE, generator=torch.Generator().manual_seed(2))
    case = opened(seen(many(), many() * gains))
    assert not proposed(case) & NOISE
    assert left(case) > 3
    noisy = Camera()(many(), CameraParameters.of({"shot_noise": {"full_well": 300.0}}, MANY))
    assert proposed(opened(seen(many(), noisy))) & NOISE == {"shot_noise"}


def test_rows_out_of_place_are_not_noise() -> None:
    soft = (F.avg_pool2d(F.pad(many(), (2,) * 4, mode="replicate"), 5, 1) * 255).round() / 255
    moved = soft.clone()
    moved[:, :, 1::2] = moved[:, :, 1::2].roll(2, 3)
    case = opened(seen(soft, moved))
    assert not proposed(case) & NOISE
    assert left(case) > 3


def turned_or_skewed(skew: float, turn: float) -> CameraRecording:
    """Rows displaced by so much a row, and the camera turned (rad)."""
    matrix = torch.tensor([[1.0, skew - turn, 0.0], [turn, 1.0, 0.0]]).expand(MANY, 2, 3)
    grid = F.affine_grid(matrix, [MANY, 3, SIZE, SIZE], align_corners=False)
    real = F.grid_sample(many(), grid, mode="bicubic", padding_mode="border", align_corners=False)
    return seen(many(), real)


@pytest.mark.slow
def test_a_skew_of_rows_is_no_rotation() -> None:
    """Half of it is: upright edges ask for twice the angle that is found, those that lie for none."""
    names = frozenset({"camera_pose_offset"})
    case = opened(turned_or_skewed(0.06, 0.0))
    found = case.fit(names, range(MANY), None)
    assert case.suspicious(found, "camera_pose_offset") and case.contradicted(found, "camera_pose_offset")
    case = opened(turned_or_skewed(0.0, 0.03))
    found = case.fit(names, range(MANY), None)
    assert not case.suspicious(found, "camera_pose_offset") and not case.contradicted(found, "camera_pose_offset")


@pytest.mark.slow
def test_scattered_light_is_no_exposure_and_an_exposure_beside_a_stain_is_one() -> None:
    names = frozenset({"exposure"})
    light = many().clamp(min=1e-4) ** 2.2
    case = opened(seen(many(), (0.8 * light + 0.2 * light.mean((2, 3), keepdim=True).flip(0)) ** (1 / 2.2)))
    assert case.suspicious(case.fit(names, range(MANY), None), "exposure")
    stained = (1.3 * light) ** (1 / 2.2)
    stained[..., 20:30, 20:30] *= 0.5
    case = opened(seen(many(), stained))
    assert not case.suspicious(case.fit(names, range(MANY), None), "exposure")


def of_fields(shift: float) -> CameraRecording:
    """Odd rows were exposed later than even ones, when things had moved by `shift` px."""
    moved = torch.tensor([[1.0, 0.0, -2 * shift / SIZE], [0.0, 1.0, 0.0]]).expand(MANY, 2, 3)
    grid = F.affine_grid(moved, [MANY, 3, SIZE, SIZE], align_corners=False)
    real = many()
    real[:, :, 1::2] = F.grid_sample(many(), grid, padding_mode="border", align_corners=False)[:, :, 1::2]
    return seen(many(), real)


def softened(pictures: torch.Tensor, sigma: float, reach: int) -> torch.Tensor:
    """Blurred by a Gaussian of so many pixels to either side."""
    at = torch.arange(-reach, reach + 1.0)
    line = torch.exp(-(at**2) / 2 / sigma**2)
    kernel = (torch.outer(line, line) / line.sum() ** 2).expand(3, 1, -1, -1)
    return F.conv2d(F.pad(pictures, (reach,) * 4, mode="replicate"), kernel, groups=3)


def of_a_mosaic(sigma: float) -> CameraRecording:
    """Red and blue are interpolated, and softer than green."""
    soft = softened(many(), sigma, 3)
    return seen(many(), torch.stack([soft[:, 0], many()[:, 1], soft[:, 2]], 1))


def of_sites() -> CameraRecording:
    """A pixel has one colour, and the other two from its neighbours."""
    y, x = torch.meshgrid(torch.arange(SIZE), torch.arange(SIZE), indexing="ij")
    own = torch.stack([(y % 2 == 0) & (x % 2 == 0), (y + x) % 2 == 1, (y % 2 == 1) & (x % 2 == 1)]).float()
    tent = torch.tensor([[1.0, 2.0, 1.0], [2.0, 4.0, 2.0], [1.0, 2.0, 1.0]]).expand(3, 1, 3, 3)
    around, known = (F.conv2d(F.pad(each, (1,) * 4), tent, groups=3) for each in (many() * own, own[None]))
    return seen(many(), torch.where(own.bool(), many(), around / known))


@pytest.mark.slow
def test_rows_and_colours_contradict_a_name_and_bear_out_a_true_one() -> None:
    pose, blur = frozenset({"camera_pose_offset"}), frozenset({"defocus_blur"})
    for made, names in ((of_fields(0.5), pose), (of_a_mosaic(0.4), blur), (of_sites(), blur)):
        case = opened(made)
        assert case.contradicted(case.fit(names, range(MANY), None), *names)
    for names, true in ((pose, {"yaw": 0.01, "pitch": 0.0, "roll": 0.0}), (blur, {"radius": 1.2})):
        (name,) = names
        case = opened(seen(many(), Camera()(many(), CameraParameters.of({name: true}, MANY))))
        assert not case.contradicted(case.fit(names, range(MANY), None), name)


def out_of_focus(pictures: torch.Tensor) -> torch.Tensor:
    """Sharp at the centre, and ever less so towards the corners."""
    along = torch.linspace(-1, 1, SIZE).square()
    return torch.lerp(pictures, softened(pictures, 4.0, 12), ((along[:, None] + along) / 2).square())


@pytest.mark.slow
def test_corners_out_of_focus_are_no_lens_and_a_lens_beside_them_is_one() -> None:
    """Where edges are soft, what is fine asks for another lens than what is coarse."""
    lens = frozenset({"lens_distortion"})
    moved = Camera()(many(), CameraParameters.of({"lens_distortion": {"k1": -0.1, "k2": 0.0}}, MANY))
    for pictures, false in ((many(), True), (moved, False)):
        case = opened(seen(many(), out_of_focus(pictures)))
        assert case.contradicted(case.fit(lens, range(MANY), None), *lens) is false


def denoised(pictures: torch.Tensor, share: float = 0.5) -> torch.Tensor:
    """A share of each pixel is the median around it: straight edges stay as they are, textures do not."""
    of_eight_bits = pictures.mul(255).round().byte().permute(0, 2, 3, 1).numpy()
    medians = torch.from_numpy(np.stack([cv2.medianBlur(each, 5) for each in of_eight_bits]))
    return torch.lerp(pictures, medians.permute(0, 3, 1, 2) / 255, share)


def test_what_takes_out_noise_is_no_defocus_and_a_defocus_beside_it_is_one() -> None:
    blur = frozenset({"defocus_blur"})
    field = torch.randn(MANY, 3, SIZE, SIZE, generator=torch.Generator().manual_seed(3))
    textured = (F.avg_pool2d(many(), 3, 1, 1) + 0.15 * F.avg_pool2d(field, 5, 1, 2)).clamp(0, 1)
    soft = Camera()(textured, CameraParameters.of({"defocus_blur": {"radius": 1.5}}, MANY))
    for pictures, false in ((textured, True), (soft, False)):
        case = opened(seen(textured, denoised(pictures)))
        assert case.suspicious(case.fit(blur, range(MANY), None), *blur) is false


def shaken(pictures: torch.Tensor) -> torch.Tensor:
    """Each displaced by half a pixel, another way."""
    turn, moved = 2.4 * torch.arange(MANY), torch.eye(2, 3).repeat(MANY, 1, 1)
    moved[:, :, 2] = torch.stack([turn.cos(), turn.sin()], 1) / SIZE
    grid = F.affine_grid(moved, [MANY, 3, SIZE, SIZE], align_corners=False)
    return F.grid_sample(pictures, grid, mode="bicubic", padding_mode="border", align_corners=False)


@pytest.mark.slow
def test_frames_that_shake_are_not_blurred() -> None:
    """Pixel by pixel a blur is less wrong of them; but they are as sharp as without, wherever one looks."""
    field = torch.randn(MANY, 3, SIZE, SIZE, generator=torch.Generator().manual_seed(3))
    grain = 0.5 + 0.35 * F.avg_pool2d(F.pad(field, (2,) * 4, mode="replicate"), 5, 1)
    found = diagnose(seen(grain, shaken(grain)), DiagnoseConfig()).to_dict()
    assert found["verdict"] == "unexplained" and not found["effects"]
    soft = Camera()(grain, CameraParameters.of({"defocus_blur": {"radius": 1.5}}, MANY))
    found = diagnose(seen(grain, shaken(soft)), DiagnoseConfig()).to_dict()
    assert [each["name"] for each in found["effects"]] == ["defocus_blur"]


def test_an_explained_picture_is_not_explained_by_what_its_rows_contradict() -> None:
    found = diagnose(of_fields(0.12), DiagnoseConfig()).to_dict()
    assert found["verdict"] == "unexplained" and not found["effects"]


def test_what_differs_from_frame_to_frame_is_not_held_against_an_effect() -> None:
    """A stand-in is wrong in the same place of all frames; the light of something else is where a scene has it."""
    change, weight = torch.full((MANY, 3, SIZE, SIZE), 0.1), torch.full((MANY, 1, SIZE, SIZE), 1e4)
    half = torch.zeros(MANY, 3, SIZE, SIZE)
    half[..., : SIZE // 2] = 0.03
    sign = torch.ones(MANY).index_fill(0, torch.arange(0, MANY, 2), -1.0).view(-1, 1, 1, 1)
    assert disagreement(change, half, weight, many())["region"] > 0.08
    assert disagreement(change, half * 2 * sign, weight, many())["region"] < 0.02
    few = 0.7 * half[:6]
    few[0] *= 2.5
    assert disagreement(change[:6], few, weight[:6], many()[:6])["region"] < 0.08  # 0.082 with the frame that is off


def labelled(made: CameraRecording) -> CameraRecording:
    """The left half of one label, the right of another."""
    labels = np.zeros(made.sim.shape[:3], np.uint8)
    labels[:, :, SIZE // 2 :] = 1
    return replace(made, labels=labels)


def banded() -> torch.Tensor:
    """Dark bands across, elsewhere in each frame."""
    phase = 6.28 * torch.rand(MANY, 1, generator=torch.Generator().manual_seed(5))
    return many() - 0.1 * torch.cos(torch.arange(SIZE) / 4 + phase).square()[:, None, :, None]


def test_few_levels_or_pixels_of_their_own_gain_tell_what_is_left_and_nothing_tells_a_grain() -> None:
    field = torch.randn(MANY, 1, SIZE, SIZE, generator=torch.Generator().manual_seed(3))
    grain, counted = 0.15 * F.avg_pool2d(field, 5, 1, 2), torch.ones(MANY, 1, SIZE, SIZE)
    kinds = DISCREPANCIES.keys() - RANDOM
    levels, own, bands, random = (
        told_by(kinds, real - many(), many(), counted)
        for real in ((many() * 24).round() / 24, many() * (1 + grain[:1]), banded(), many() * (1 + grain))
    )
    assert min(levels["levels"], own["fixed_pattern"]) > 0.5 and bands["row_noise"] > OF_ROWS > random.pop("row_noise")
    assert max(random.values()) < TOLD


def test_a_grain_of_few_pixels_is_not_the_pixels_own() -> None:
    """Where a label is, in another place of each frame, pixels' gains could fit an eighth of it."""
    generator, place = torch.Generator().manual_seed(0), torch.zeros(8, 1, SIZE, SIZE)
    for frame in place:
        row, column = torch.randint(0, SIZE - 24, (2,), generator=generator).tolist()
        frame[:, row : row + 24, column : column + 24] = 1
    field = torch.randn(8, 1, SIZE, SIZE, generator=torch.Generator().manual_seed(4))
    left = many()[:8] * 0.15 * F.avg_pool2d(field, 5, 1, 2) * place
    assert told_by({"fixed_pattern"}, left, many()[:8], torch.ones(8, 1, SIZE, SIZE))["fixed_pattern"] < 0.02


@pytest.mark.slow
def test_what_something_tells_is_no_grain() -> None:
    """The frame before, few levels, pixels of gains of their own, rows of a frame's own."""
    texture = Hypothesis({"1.texture": {"amplitude": 0.05, "scale": 3.0}})
    field = torch.randn(MANY, 1, SIZE, SIZE, generator=torch.Generator().manual_seed(3))
    grain = 1 + 0.15 * F.avg_pool2d(field, 5, 1, 2)
    mixed, steps = 0.8 * many() + 0.2 * many().roll(1, 0), (many() * 24).round() / 24
    seen_as = ((mixed, True), (steps, True), (many() * grain[:1], True), (banded(), True), (many() * grain, False))
    for real, told in seen_as:
        made = labelled(seen(many(), real))
        case = CameraCase.open(made, {effect.name: effect for effect in PICTURE_EFFECTS})
        assert case.contradicted(texture, "1.texture") is told
        assert case.suspicious(texture, "1.texture") is told
        fitted = case.fit(frozenset(texture.values), range(MANY), None).values["1.texture"]
        assert (fitted["amplitude"] == 0) is told


def test_what_is_wrong_everywhere_is_no_missing_object() -> None:
    counted, shares = torch.ones(4, 1, SIZE, SIZE, dtype=torch.bool), torch.zeros(4, 1, SIZE, SIZE)
    far = torch.full((4, SIZE, SIZE), 100.0)
    assert area_of(far, counted, shares) is None
    some = torch.zeros_like(far)
    some[:, 10:30, 10:30] = 100
    assert area_of(some, counted, shares) == {"x": 10, "y": 10, "width": 20, "height": 20}


def test_a_thing_that_was_not_drawn_says_nothing_of_a_blur() -> None:
    blurred = Camera()(many(), CameraParameters.of({"motion_blur": {"length": 5.0, "angle": 130.0}}, MANY))
    inside = torch.zeros(SIZE, SIZE, dtype=torch.bool)
    inside[10:32, 10:32] = True
    made = labelled(seen(many(), torch.where(inside, many()[:1].roll(9, 2), blurred)))
    case = CameraCase.open(made, {effect.name: effect for effect in PICTURE_EFFECTS})
    found = case.fit(frozenset({"motion_blur", "missing_object"}), range(MANY), None)
    assert found.values["missing_object"]["width"] > 20
    assert not case.suspicious(found, "motion_blur") and not case.contradicted(found, "motion_blur")


def test_light_upon_a_scene_is_no_thing_before_it() -> None:
    inside = torch.zeros(MANY, 1, SIZE, SIZE, dtype=torch.bool)
    inside[..., 10:40, 10:40] = True
    assert seen_behind(many() * 0.8 + 0.2, many(), inside)
    assert not seen_behind(torch.where(inside, many().roll(7, 2), many()), many(), inside)
    assert not seen_behind(many(), torch.full_like(many(), 0.5), inside)  # nothing was drawn there to be seen
    faint, print_on_it = 0.1 * many(), torch.rand(many().shape, generator=torch.Generator().manual_seed(0))
    assert not seen_behind(print_on_it + faint, faint, inside)  # as like as chance makes what has much of its own


def test_a_picture_that_is_sharper_asks_for_no_blur() -> None:
    soft = F.avg_pool2d(F.pad(many(), (1,) * 4, mode="replicate"), 3, 1)
    case = opened(seen(soft, soft + 0.5 * (soft - F.avg_pool2d(F.pad(soft, (1,) * 4, mode="replicate"), 3, 1))))
    gains = case.screen(case.fit(frozenset(), range(MANY), None), ["defocus_blur", "exposure"])
    assert gains["defocus_blur"] == 0 and case.screen(Hypothesis(), ["defocus_blur"]) == {"defocus_blur": 0}


@pytest.mark.slow
def test_an_effect_beside_something_unknown_is_as_large_as_it_is() -> None:
    """It is fitted to what the unknown leaves, and the unknown to what it leaves."""
    moved = Camera()(many(), CameraParameters.of({"motion_blur": {"length": 4.0, "angle": 30.0}}, MANY))
    found = diagnose(seen(many(), 0.8 * moved + 0.2 * moved.roll((9, 5), (3, 2))), DiagnoseConfig()).to_dict()
    assert [each["name"] for each in found["effects"]] == ["motion_blur"] and found["verdict"] == "partly_explained"
    assert found["effects"][0]["parameters"]["length"]["value"] == pytest.approx(4.0, rel=0.05)


@pytest.mark.slow
def test_few_levels_are_no_noise() -> None:
    found = diagnose(seen(many(), (many() * 20).round() / 20, 0.0), DiagnoseConfig()).to_dict()
    assert not found["effects"] and found["verdict"] == "unexplained"
    assert "fewer levels than the values have bits for" in found["unexplained"]["resembles"]
