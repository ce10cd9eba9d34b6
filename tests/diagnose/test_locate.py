"""Where a gap lies: the axis put first is that which says where other segments have theirs."""

import numpy as np

from vision_s2r.diagnose.locate import where
from vision_s2r.fit.case import Axis, Samples

SEGMENTS, EACH = 8, 600


def samples(colour: np.ndarray, tone: np.ndarray, error: np.ndarray) -> Samples:
    """`error` of EACH samples a segment, by colour (three) and tone (five)."""
    axes = (Axis("colour", ("red", "green", "blue"), colour), Axis("tone", tuple("abcde"), tone))
    segment = np.repeat(np.arange(SEGMENTS), EACH)
    return Samples(error, np.zeros(len(error)), segment, axes)


def test_what_all_bins_of_an_axis_say_counts_not_its_largest_alone() -> None:
    """Two of three colours have all of the gap, and a tone of few samples four times its share."""
    place = np.tile(np.arange(EACH), SEGMENTS)
    colour, tone = place % 3, np.where(place % 40 < 3, 4, place % 4)
    error = (colour != 1) * np.where(tone == 4, 4.0, 0.76)
    found = where(samples(colour, tone, error), 0)
    assert found[0]["axis"] == "colour" and {each["axis"] for each in found} == {"colour", "tone"}


def test_what_one_scene_has_at_a_place_is_not_where_the_gap_lies() -> None:
    """Each segment has all of it at a tone of its own, and a little more of it in red."""
    place, segment = np.tile(np.arange(EACH), SEGMENTS), np.repeat(np.arange(SEGMENTS), EACH)
    colour, tone = place % 3, place % 5
    error = np.where(colour == 0, 3.0, 1.0) * (tone == segment % 5)
    assert where(samples(colour, tone, error), 0)[0]["axis"] == "colour"


def test_a_draw_of_segments_without_any_of_the_gap_is_no_doubt_about_where_it_lies() -> None:
    """Two of eight segments have all of it, in red."""
    place, segment = np.tile(np.arange(EACH), SEGMENTS), np.repeat(np.arange(SEGMENTS), EACH)
    colour, tone = place % 3, place % 5
    found = where(samples(colour, tone, 1.0 * (colour == 0) * (segment % 4 == 0)), 0)
    assert found and found[0]["axis"] == "colour" and found[0]["at"] == "red"


def test_a_place_that_has_more_than_the_whole_gap_has_all_of_it_surely() -> None:
    """Where the rest is better than noise; its interval went from 1.3 to 1."""
    place = np.tile(np.arange(EACH), SEGMENTS)
    found = where(samples(place % 3, place % 5, np.where(place % 3 == 0, 3.0, -0.5)), 0)
    assert found[0]["at"] == "red" and found[0]["share"] == 1.0 and found[0]["ci"] == [1.0, 1.0]


def test_what_has_no_noise_is_placed_where_it_has_but_little_more_than_elsewhere() -> None:
    """Rolling resistance acts where a body rolls, which it may do nine tenths of the time."""
    place = np.tile(np.arange(EACH), SEGMENTS)
    little = samples(place % 3, place % 5, np.where(place % 3 == 0, 1.2, 0.9))
    assert not where(little, 0)
    assert where(little, 0, lift=0.0)[0]["at"] == "red"
