"""Effects added to photographs: the photographs are those of a camera that has them."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.fit.camera.test_camera_case import recorded
from vision_s2r.camera import Camera, CameraParameters
from vision_s2r.hardware.added_pictures import with_effects
from vision_s2r.recording import CameraRecording

NAMELESS = {"effects": []}  # a report
ENCODED = {"effects": [{"name": "jpeg_compression", "parameters": {"quality": {"value": 90.0}}}]}
SMOOTH = ("exposure", "gamma", "vignetting", "uneven_illumination", "cast_shadow", "white_balance")


@pytest.fixture(scope="module")
def photographs() -> CameraRecording:
    return recorded(vignetting={"strength": 0.3})


def test_photographs_with_an_effect_are_what_the_simulators_camera_makes_of_them(photographs) -> None:
    added = {each.effect: each for each in with_effects(photographs, NAMELESS)}
    assert set(SMOOTH) | {"defocus_blur", "shot_noise", "chromatic_aberration"} <= added.keys()
    pictures = torch.from_numpy(photographs.real).permute(0, 3, 1, 2)
    for name in SMOOTH:
        seen = Camera()(pictures, CameraParameters.of({name: dict(added[name].values)}, len(pictures)))
        expected = seen.permute(0, 2, 3, 1).numpy()
        changed = np.abs(expected - photographs.real).mean()
        assert np.abs(added[name].recording.real - expected).mean() < 0.02 * changed + 0.5 / 255, name


def test_photographs_that_were_encoded_are_so_again_and_grey_ones_get_no_colour(photographs) -> None:
    grey = replace(
        photographs, grey=True, intrinsics=None, real=np.repeat(photographs.real.mean(-1, keepdims=True), 3, axis=-1)
    )
    added = {each.effect: each for each in with_effects(grey, ENCODED)}
    assert added["jpeg_compression"].values == {"quality": 22}
    assert not {"white_balance", "chromatic_aberration", "camera_pose_offset"} & added.keys()
    dark = added["exposure"].recording.real
    assert dark.shape == grey.real.shape and np.ptp(dark, axis=-1).max() == 0
    blocks = np.abs(np.diff(added["defocus_blur"].recording.real[..., 0], axis=2)).mean((0, 1))
    assert blocks[7::8].mean() > 1.05 * blocks.mean()  # steps between blocks of eight
