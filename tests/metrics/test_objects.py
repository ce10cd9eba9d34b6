"""An object that is erased, added, moved or painted over counts as that, and as nothing else."""

import numpy as np
import pytest

from vision_s2r.metrics.colours import classes_of
from vision_s2r.metrics.objects import compare
from vision_s2r.scene import CLASSES
from vision_s2r.scene.appearance import CANONICAL_COLOURS

SIDE = 48
# Each of 100 px but the last, of which too few show to be judged; the first two touch.
OBJECTS = {1: (10, 8), 2: (10, 18), 3: (30, 30), 4: (40, 5)}
NOTHING = {"dropped": 0, "invented": 0, "moved": 0, "recoloured": 0}


def scene(objects=OBJECTS):
    """Instances [SIDE, SIDE]: squares of 10 px with their upper left corners there, the last of 3 px."""
    instance = np.zeros((SIDE, SIDE), np.uint8)
    for k, (top, left) in objects.items():
        side = 3 if k == 4 else 10
        instance[top : top + side, left : left + side] = k
    return instance


def segmentation(instance):
    """A bin, with a gripper along the upper edge."""
    classes = np.where(instance > 0, CLASSES.index("object"), CLASSES.index("bin"))
    classes[:4] = CLASSES.index("gripper")
    return classes


def drawn(classes, shade=0.9):
    """The canonical picture of classes, dark towards the right."""
    colours = np.array([CANONICAL_COLOURS[name] for name in CLASSES])[classes]
    fading = np.linspace(shade, 0.35, SIDE)[None, :, None]
    return np.round(255 * np.clip(colours * fading, 0, 1)).astype(np.uint8)


def errors(classes, instance=None):
    """What is counted in the picture of these classes against the scene, or the instances given."""
    true = scene() if instance is None else instance
    found = compare(classes_of(drawn(classes)), segmentation(true), true)
    return {name: found.measures()[name][0] for name in NOTHING}, found


def test_a_true_picture_counts_nothing():
    found, content = errors(segmentation(scene()))
    assert found == NOTHING and len(content.fates) == 3
    assert content.measures()["displacement"] == (0, 3) and content.measures()["object_errors"] == (0, 3)


@pytest.mark.parametrize("erased", [1, 2, 3])
def test_one_erased(erased):
    left = {k: place for k, place in OBJECTS.items() if k != erased}
    found, content = errors(segmentation(scene(left)))
    assert found == NOTHING | {"dropped": 1} and content.fates[erased] == "dropped"


def test_one_added():
    found, content = errors(segmentation(scene(OBJECTS | {5: (26, 8)})))
    assert found == NOTHING | {"invented": 1}
    assert np.array_equal(content.invented[0], scene({5: (26, 8)}) > 0)


@pytest.mark.parametrize(("moved", "place"), [(3, (34, 30)), (3, (30, 26)), (2, (14, 18))])
def test_one_moved(moved, place):
    found, content = errors(segmentation(scene(OBJECTS | {moved: place})))
    assert found == NOTHING | {"moved": 1} and content.moved == [moved]
    assert content.displacements[moved] == pytest.approx(4, abs=0.5)


def test_a_little_is_not_moved():
    found, content = errors(segmentation(scene(OBJECTS | {3: (31, 30)})))
    assert found == NOTHING and content.displacements[3] == pytest.approx(1)


@pytest.mark.parametrize("colour", ["gripper", "arm"])
def test_one_painted_over(colour):
    classes = segmentation(scene())
    classes[scene() == 3] = CLASSES.index(colour)
    found, content = errors(classes)
    assert found == NOTHING | {"recoloured": 1} and content.fates[3] == "recoloured"


def test_under_the_gripper_an_object_is_dropped_not_recoloured():
    below = scene({1: (5, 20)})
    classes = segmentation(below)
    classes[below == 1] = CLASSES.index("gripper")
    assert errors(classes, below)[0] == NOTHING | {"dropped": 1}


def test_a_scene_without_objects_has_no_rates():
    content = compare(*[segmentation(scene({}))] * 2, scene({}))
    assert content.measures()["dropped"] == (0, 0) and content.measures()["invented"] == (0, 1)
