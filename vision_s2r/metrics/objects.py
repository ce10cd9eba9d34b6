"""What became of the objects of a scene in a translation: kept, moved, dropped, recoloured; and what was invented."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.ndimage import binary_dilation, distance_transform_edt, label

from vision_s2r.scene import CLASSES

OBJECT = CLASSES.index("object")
FOREIGN = tuple(CLASSES.index(name) for name in ("arm", "gripper"))
AROUND = np.ones((3, 3), bool)  # a pixel and its eight neighbours

SMALLEST = 12  # px: smaller instances and components are not judged
KEPT = 1 / 3  # part of an instance's visible pixels that are object in the translation
MARGIN = 2  # px around true objects
REACH = 6  # px from an instance up to which found object pixels can be its own
MOVED = 2.0  # px, from which on an instance counts as moved


class Fate(StrEnum):
    """What became of an instance."""

    KEPT = "kept"
    DROPPED = "dropped"
    RECOLOURED = "recoloured"


@dataclass(frozen=True)
class Content:
    """What became of the instances of a scene that show at least SMALLEST pixels, by their number in the renders."""

    fates: dict[int, Fate]
    displacements: dict[int, float]  # px, of those kept
    invented: list[np.ndarray]  # bool [H, W], the pixels of each

    @property
    def moved(self) -> list[int]:
        """The kept instances that are displaced by more than MOVED."""
        return [k for k, distance in self.displacements.items() if distance > MOVED]

    def measures(self) -> dict[str, tuple[float, float]]:
        """Numerator and denominator of each rate.

        dropped and recoloured: of the instances; moved (share) and displacement (mean, px): of those kept; invented:
        a scene; object_errors: all four errors, an instance.
        """
        count, kept = len(self.fates), len(self.displacements)
        lost = {fate: sum(each == fate for each in self.fates.values()) for fate in Fate}
        errors = count - kept + len(self.moved) + len(self.invented)
        return {
            "dropped": (lost[Fate.DROPPED], count),
            "invented": (len(self.invented), 1),
            "moved": (len(self.moved), kept),
            "displacement": (sum(self.displacements.values()), kept),
            "recoloured": (lost[Fate.RECOLOURED], count),
            "object_errors": (errors, count),
        }


def compare(found: np.ndarray, segmentation: np.ndarray, instance: np.ndarray) -> Content:
    """What became of the true instances in a translation whose pixels are of the classes `found`.

    Class ids [H, W] of the translation and of the truth, and instances [H, W] of the truth (0: none, k + 1: object k).

    recoloured: more than half of the instance's pixels have the colour of the arm or the gripper, where that class is
    not within MARGIN of the instance in truth. (Bin and background surround objects, and shades of theirs meet: an
    object of their colour is dropped.)
    dropped: not recoloured, and less than KEPT of its pixels are object. Else it is kept.
    displacement, of a kept instance: from the centroid of its true pixels to that of the found object pixels to which
    no other instance is nearer and that lie within REACH of it. Pixels on an instance are always its own, so that one
    that it touches, or the loss of that, does not move it; the loss of a part of its own, on one side, does.
    invented: a component (of eight neighbours) of at least SMALLEST found object pixels, of which less than KEPT lie
    within MARGIN (a square) of true objects.
    """
    is_object = found == OBJECT
    numbers = [k for k in range(1, int(instance.max()) + 1) if (instance == k).sum() >= SMALLEST]
    fates = {k: _fate(found, segmentation, instance == k) for k in numbers}
    kept = [k for k in numbers if fates[k] is Fate.KEPT]
    return Content(fates, _displacements(is_object, instance, kept), _invented(is_object, instance > 0))


def _fate(found: np.ndarray, segmentation: np.ndarray, pixels: np.ndarray) -> Fate:
    around = set(np.unique(segmentation[binary_dilation(pixels, AROUND, MARGIN)]))
    colours = found[pixels]
    if any((colours == other).mean() > 1 / 2 for other in FOREIGN if other not in around):
        return Fate.RECOLOURED
    return Fate.KEPT if (colours == OBJECT).mean() >= KEPT else Fate.DROPPED


def _displacements(is_object: np.ndarray, instance: np.ndarray, kept: list[int]) -> dict[int, float]:
    if not kept:
        return {}
    distance, nearest = distance_transform_edt(instance == 0, return_indices=True)
    owner = np.where(is_object & (distance <= REACH), instance[tuple(nearest)], 0)
    return {k: float(np.linalg.norm(_centroid(owner == k) - _centroid(instance == k))) for k in kept}


def _centroid(pixels: np.ndarray) -> np.ndarray:
    centroid: np.ndarray = np.argwhere(pixels).mean(0)
    return centroid


def _invented(is_object: np.ndarray, true: np.ndarray) -> list[np.ndarray]:
    near = binary_dilation(true, AROUND, MARGIN)
    components, count = label(is_object, AROUND)
    found = [components == k for k in range(1, count + 1)]
    return [pixels for pixels in found if pixels.sum() >= SMALLEST and near[pixels].mean() < KEPT]
