"""Where grasps appear in pictures, against pictures that show each point's own place in the world."""

import math

import pytest
import torch
from bars import camera, on_plane
from torch import Tensor

from vision_s2r.grasp import GraspConfig, augment, negatives
from vision_s2r.grasp.config import FORMS, CropConfig
from vision_s2r.grasp.crop import CropQ
from vision_s2r.grasp.dense import DenseQ
from vision_s2r.grasp.forms import build
from vision_s2r.networks.rectifier import displaced
from vision_s2r.training import Batch

SIZE, SCENES, COUNT = 80, 6, 5


def generator(seed: int) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def maps() -> Batch:
    """Pictures through tilted cameras whose red and green are x and y in metres, 0.5 at the origin; grasps."""
    intrinsics, extrinsics = camera(SCENES, generator(0), SIZE)
    place = on_plane(intrinsics, extrinsics, SIZE, 0).float()
    images = torch.cat([0.5 + place, torch.zeros_like(place[..., :1])], -1).movedim(-1, 1)
    grasps = (torch.rand(SCENES, COUNT, 3, generator=generator(1)) - 0.5) * torch.tensor([0.08, 0.08, math.pi])
    return {"images": images, "intrinsics": intrinsics, "extrinsics": extrinsics, "grasps": grasps}


def crops(batch: Batch, window: tuple[float, float] = (0.06, 0.04)) -> Tensor:
    """World places [B, K, 2, rows, columns] that the crops show."""
    q = CropQ(3, 8, CropConfig(list(window), [12, 8]), plane_height=0.0)
    encoding = q.encode(batch["images"], batch["intrinsics"], batch["extrinsics"])
    return q.crops(encoding, batch["grasps"])[:, :, :2] / 2  # from [-1, 1] back to metres


def test_crops_are_centred_on_the_grasp_with_the_closing_axis_along_x() -> None:
    batch = maps()
    places, grasps = crops(batch), batch["grasps"]
    torch.testing.assert_close(places.mean((-2, -1)), grasps[..., :2], atol=2e-4, rtol=0)
    closing = torch.stack([torch.cos(grasps[..., 2]), torch.sin(grasps[..., 2])], -1)
    along_x = (places[..., 1:] - places[..., :-1]).mean((-2, -1)) / (0.06 / 12)
    torch.testing.assert_close(along_x, closing, atol=0.02, rtol=0)
    across = torch.stack([-closing[..., 1], closing[..., 0]], -1)
    upwards = (places[..., :-1, :] - places[..., 1:, :]).mean((-2, -1)) / (0.04 / 8)
    torch.testing.assert_close(upwards, across, atol=0.02, rtol=0)


def test_the_plane_is_at_its_height() -> None:
    """A point 2 cm up is seen by the crop on the plane 2 cm up, where the camera sees it."""
    batch = maps()
    lifted = batch["extrinsics"].clone()
    lifted[:, :3, 3] -= 0.02 * lifted[:, :3, 2]  # the plane that the pictures show is now at z = 0.02
    q = CropQ(3, 8, CropConfig([0.06, 0.04], [12, 8]), plane_height=0.02)
    places = q.crops(q.encode(batch["images"], batch["intrinsics"], lifted), batch["grasps"])[:, :, :2] / 2
    torch.testing.assert_close(places, crops(batch))


def test_turning_the_world_changes_no_crop_but_by_half_turns() -> None:
    batch = maps()
    before, after = crops(batch), crops(augment.turn(batch, generator(2)))
    error = torch.minimum((after - before).abs().amax((2, 3, 4)), (after.flip(3, 4) - before).abs().amax((2, 3, 4)))
    assert float(error.max()) < 1e-4
    assert not torch.allclose(before, after, atol=1e-3)  # some are turned by half: Q sees both


def test_a_mirrored_scene_has_crops_with_the_fingers_swapped() -> None:
    batch = maps()
    mirrored = augment.mirror(batch, generator(4))
    changed = (mirrored["images"] != batch["images"]).any(-1).any(-1).any(-1)
    assert changed.any() and not changed.all()
    before, after = crops(batch), crops(mirrored)
    torch.testing.assert_close(after[~changed], before[~changed])
    torch.testing.assert_close(after[changed], before[changed].flip(4), atol=1e-4, rtol=0)


def test_displacements_are_mirrored_with_the_picture() -> None:
    """Pictures of a place's own x lie mirrored where the mirrored displacements say."""
    batch = maps()
    batch["displacements"] = 0.3 * torch.rand(SCENES, 2, 5, 5, generator=generator(5))
    mirrored = augment.mirror(batch, generator(4))

    def sampled(which: Batch) -> Tensor:
        return displaced(which["images"], which["displacements"])

    changed = (mirrored["images"] != batch["images"]).any(-1).any(-1).any(-1)
    expected = torch.where(changed[:, None, None, None], sampled(batch).flip(-1), sampled(batch))
    torch.testing.assert_close(sampled(mirrored), expected, atol=1e-5, rtol=0)


def test_what_closes_on_nothing() -> None:
    """A grasp is empty beside an object, and not where its fingers reach one along their closing axis."""
    intrinsics, extrinsics = camera(1, generator(0), SIZE)
    place = on_plane(intrinsics, extrinsics, SIZE, 0)
    extrinsics[:, :3, 3] -= negatives.HEIGHT * extrinsics[:, :3, 2]  # the plane is at the height that is looked at
    segmentation = negatives.OBJECT * ((place - torch.tensor([0.03, 0.0])).norm(dim=-1) < 0.01).long()
    grasps = torch.tensor([[[0.03, 0.0, 0.3], [0.0, 0.0, 0.0], [0.0, 0.0, math.pi / 2], [-0.06, 0.0, 0.0]]])
    found = negatives.closes_on_nothing(segmentation, intrinsics, extrinsics, grasps)
    assert found.tolist() == [[False, False, True, True]]


def test_the_dense_map_is_looked_up_where_the_grasp_is() -> None:
    """With a place's x and y for two of its logits, the looked-up ones are the grasp's own."""
    batch = maps()
    q = DenseQ(3, 8, GraspConfig().dense, side=0.2, plane_height=0.0)
    q.fine, q.middle, q.coarse = (torch.nn.Identity() for _ in range(3))
    kept: list[Tensor] = []
    q.fine.register_forward_pre_hook(lambda _, inputs: kept.append(inputs[0]))
    q.middle = torch.nn.AvgPool2d(2)
    q.coarse = torch.nn.AvgPool2d(2)
    q.middle_up = q.fine_up = torch.nn.Identity()
    q.head = torch.nn.Identity()  # type: ignore[assignment]
    encoding = q.encode(batch["images"], batch["intrinsics"], batch["extrinsics"])
    places = kept[0][:, :2] / 2
    for axis in range(2):
        logits = places[:, axis : axis + 1].expand(-1, 16, -1, -1)
        found = q.score(type(encoding)(logits, encoding.homography, encoding.size), batch["grasps"])
        torch.testing.assert_close(found, batch["grasps"][..., axis], atol=5e-4, rtol=0)


@pytest.mark.parametrize("form", FORMS)
def test_half_a_turn_is_the_same_grasp(form: str) -> None:
    batch = maps()
    torch.manual_seed(0)
    q = build(GraspConfig(form=form, width=8))
    logits = q(*batch.values()).logits
    batch["grasps"] = batch["grasps"] + torch.tensor([0, 0, math.pi])
    torch.testing.assert_close(q(*batch.values()).logits, logits, atol=1e-4, rtol=0)
    batch["grasps"] = batch["grasps"] + torch.tensor([0, 0, math.pi / 2])
    assert not torch.allclose(q(*batch.values()).logits, logits, atol=1e-3)
