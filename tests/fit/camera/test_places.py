"""Where a camera's gap lies: the axis put first is that of the effect, not that of what pictures show."""

import pytest

from tests.fit.camera.test_camera_case import opened, recorded
from vision_s2r.diagnose.locate import where
from vision_s2r.fit.case import NOMINAL


@pytest.mark.parametrize(
    ("effect", "values", "axes"),
    [
        ("defocus_blur", {"radius": 1.2}, {"frequency"}),
        ("uneven_illumination", {"strength": 0.3, "angle": 30.0}, {"region", "grid"}),
        ("vignetting", {"strength": 0.4}, {"radius", "region", "grid"}),
        ("lens_distortion", {"k1": -0.2, "k2": 0.0}, {"radius", "region", "grid"}),
        pytest.param("read_noise", {"sigma": 0.01}, {"brightness"}, marks=pytest.mark.slow),
    ],
)
def test_an_effect_alone_is_placed_on_its_own_axis(effect: str, values: dict[str, float], axes: set[str]) -> None:
    case = opened(recorded(**{effect: values}))
    found = where(case.samples(NOMINAL), 0)
    assert found and found[0]["axis"] in axes
