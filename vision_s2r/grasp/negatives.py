"""Failures that need no simulation: grasps that close where the segmentation shows no object.

Few of the labelled attempts are in empty places, and the search looks for any place where Q errs.
"""

import torch
from torch import Tensor

from vision_s2r.geometry import plane_homography
from vision_s2r.grasp.geometry import project, random_grasps, sample, window_points
from vision_s2r.scene import CLASSES, arm
from vision_s2r.training import Batch

OBJECT = CLASSES.index("object")
CLEARANCE = 0.006  # m around the fingers' way; with it none of 1,274 such attempts in 4,000 scenes succeeded
WINDOW = (2 * (arm.MAX_OPENING + CLEARANCE), arm.FINGER_SIZE[1] + 2 * CLEARANCE)  # m along and across
SHAPE = (8, 24)  # points of it that are looked at, rows and columns: under a pixel apart
CANDIDATES = 4  # drawn for each one wanted: a third of random grasps are empty
HEIGHT = 0.02  # m over the floor, of the plane on which they are looked for


def add(batch: Batch, count: int, area: list[float], generator: torch.Generator) -> Batch:
    """The batch with `count` more grasps a scene, random in |x| ≤ area[0], |y| ≤ area[1], as failures.

    They close on nothing; where a scene has not as many such among the candidates, others fill up, whose `weight` is
    0. `batch` has weight, success [B, K], grasps [B, K, 3], segmentation [B, H, W], intrinsics and extrinsics.
    """
    drawn = random_grasps(len(batch["grasps"]), CANDIDATES * count, area, generator).to(batch["grasps"])
    empty = closes_on_nothing(batch["segmentation"], batch["intrinsics"], batch["extrinsics"], drawn).to(drawn)
    weight, chosen = empty.sort(dim=1, descending=True, stable=True)
    weight, chosen = weight[:, :count], chosen[:, :count, None].expand(-1, -1, 3)
    more = {"grasps": drawn.gather(1, chosen), "success": torch.zeros_like(weight), "weight": weight}
    return batch | {name: torch.cat([batch[name], values], 1) for name, values in more.items()}


def closes_on_nothing(segmentation: Tensor, intrinsics: Tensor, extrinsics: Tensor, grasps: Tensor) -> Tensor:
    """Whether no object is seen between the open fingers of grasps [B, K, 3] or close by: bool [B, K]."""
    points = window_points(grasps, WINDOW, SHAPE)
    homography = plane_homography(intrinsics, extrinsics, HEIGHT)
    objects = (segmentation == OBJECT).unsqueeze(1).float()
    found = sample(objects, project(homography, points).flatten(1, 2))
    return found.unflatten(2, (grasps.shape[1], -1)).flatten(3).amax((1, 3)) == 0
