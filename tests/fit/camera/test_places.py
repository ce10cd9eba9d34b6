"""Where a camera's gap lies: the axis put first is that of the effect, not that of what pictures show."""

import pytest

from tests.fit.camera.test_camera_case import opened, recorded
from vision_s2r.diagnose.locate import where
from vision_s2r.fit.case import NOMINAL, Hypothesis


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


@pytest.mark.parametrize(
    ("effect", "values", "at"),
    [
        ("gamma", {"gamma": 0.85}, "51 to 102"),  # a power of tones leaves black and white as they are
        ("shot_noise", {"full_well": 500.0}, "51 to 102"),
        ("chromatic_aberration", {"red": 0.01, "blue": 0.0}, "red"),
    ],
)
def test_what_a_named_effect_does_is_placed_by_what_it_changes(effect: str, values: dict[str, float], at: str) -> None:
    """A report had no place for a gamma: of the whole gap no brightness has far more than of the pixels."""
    case = opened(recorded(defocus_blur={"radius": 1.6}, **{effect: values}))
    moved = case.moved(Hypothesis({effect: values, "defocus_blur": {"radius": 1.6}}), effect)
    assert moved is not None
    assert at in [place["at"] for place in where(moved, 0, lift=0.0)[:2]]
