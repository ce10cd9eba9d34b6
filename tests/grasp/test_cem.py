"""The search, on values whose optimum is known."""

import math

import torch
from torch import Tensor

from vision_s2r.grasp.cem import maximize
from vision_s2r.grasp.config import CemConfig

AREA = [0.1, 0.1]
# Two bumps 12 cm apart; the better one has its yaw where -pi/2 and pi/2 meet.
BUMPS = torch.tensor([[-0.06, 0.02, 0.3], [0.06, -0.04, math.pi / 2]])
HEIGHTS = torch.tensor([0.8, 1.0])


def value(grasps: Tensor) -> Tensor:
    position = (grasps[..., None, :2] - BUMPS[:, :2]).square().sum(-1) / 0.02**2
    yaw = torch.sin(grasps[..., None, 2] - BUMPS[:, 2]).square() / 0.5**2
    return (HEIGHTS * torch.exp(-position / 2 - yaw / 2)).amax(-1)


def search(seeds: list[int], cfg: CemConfig | None = None) -> tuple[Tensor, Tensor]:
    return maximize(value, seeds, AREA, cfg or CemConfig(), torch.device("cpu"))


def test_it_finds_the_optimum_across_the_seam_of_yaw() -> None:
    grasps, q = search(list(range(60)), CemConfig(iterations=6))
    best = HEIGHTS[1]
    assert float((q > 0.97 * best).float().mean()) > 0.9
    found = grasps[q > 0.95 * best]
    assert float((found[:, :2] - BUMPS[1, :2]).norm(dim=1).max()) < 0.01
    assert float(torch.sin(found[:, 2] - BUMPS[1, 2]).abs().max()) < 0.25
    assert found[:, 2].min() < 0 < found[:, 2].max()  # from both sides


def test_what_is_returned_lies_in_the_area_and_is_worth_what_it_says() -> None:
    grasps, q = maximize(lambda g: g[..., 0] + g[..., 1], [1, 2, 3], AREA, CemConfig(), torch.device("cpu"))
    torch.testing.assert_close(q, grasps[:, 0] + grasps[:, 1])
    assert grasps[:, :2].abs().max() <= 0.1
    assert float(q.min()) > 0.195  # the corner
    assert (grasps[:, 2] >= -math.pi / 2).all() and (grasps[:, 2] < math.pi / 2).all()


def test_iterations_gain() -> None:
    seeds = list(range(40))
    assert float(search(seeds)[1].mean()) > float(search(seeds, CemConfig(iterations=1))[1].mean()) + 0.05


def test_a_scene_s_answer_is_its_own() -> None:
    together, alone = search([5, 6, 7]), search([6])
    assert torch.equal(together[0][1:2], alone[0])
    assert torch.equal(search([5, 6, 7])[0], together[0])
    assert not torch.equal(together[0][0], together[0][2])
