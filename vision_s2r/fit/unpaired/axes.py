"""Where the gap of two sets lies, in the words of paired pictures: which statistics show it."""

from collections.abc import Sequence

import numpy as np

from vision_s2r.fit.case import Axis
from vision_s2r.fit.unpaired.summary import Statistic

_AXES = {"position": "region", "spectrum": "frequency", "noise": "brightness"}


def axes(statistics: Sequence[Statistic], pictures: int) -> tuple[Axis, ...]:
    """Brightness (of tones, and of noise at a tone), channel, region and frequency; a sample a picture and statistic.

    A gap nowhere in particular would be the same in all statistics of an axis.
    """
    tones = [each.label if each.group == "tone" else "" for each in statistics]
    found = [
        _axis("channel", [each if "/" in each else "" for each in tones], pictures),
        _axis("brightness", ["" if "/" in each else each for each in tones], pictures),
    ]
    for group, name in _AXES.items():
        prefix = "noise, " if group == "noise" else ""
        labels = [prefix + each.label if each.group == group else "" for each in statistics]
        found.append(_axis(name, labels, pictures))
    return tuple(axis for axis in found if axis.labels)  # grey pictures have no channels


def _axis(name: str, labels: Sequence[str], pictures: int) -> Axis:
    """Of the statistics that have a label here."""
    places = tuple(each for each in labels if each)
    bins = [places.index(each) if each else -1 for each in labels]
    return Axis(name, places, np.tile(bins, pictures), usual=tuple(1 / len(places) for _ in places))
