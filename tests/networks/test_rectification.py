"""The truth that the rectifier learns is where the scene's own camera and the camera's effects put each pixel."""

import numpy as np
import pytest
import torch

from vision_s2r.camera import Camera, CameraParameters, sources
from vision_s2r.images import to_float
from vision_s2r.networks.rectification import displacements
from vision_s2r.networks.rectifier import displaced
from vision_s2r.render import RenderConfig
from vision_s2r.render.shard import render_scene
from vision_s2r.scene import Renderer, SceneConfig, canonical, sample_state

SIZE, MARGIN = 64, 8


@pytest.mark.parametrize("scale", [1, 2])
@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"camera_pose_offset": {"yaw": 0.03, "pitch": -0.02, "roll": 0.06}},
        {"lens_distortion": {"k1": -0.3, "k2": 0.05}, "camera_pose_offset": {"yaw": 0.0, "pitch": 0.03, "roll": 0.0}},
    ],
)
def test_sampling_there_gives_the_canonical_view(effects, scale):
    cfg = SceneConfig()
    state = sample_state(cfg, 4, 1)
    with Renderer(cfg) as renderer:
        source = renderer.render(state, canonical(state), scale * SIZE, scale * MARGIN).rgb
        row = render_scene(renderer, state, RenderConfig(size=SIZE, views=0, grasps=0))
    wide, target = (torch.from_numpy(np.array(p))[None] for p in (source, row["canonical"]))
    batch = {name: torch.from_numpy(np.array(value))[None] for name, value in row.items()}
    parameters = CameraParameters.of(effects, 1)
    seen = sources.read(Camera(), wide, parameters, scale * MARGIN, batch["intrinsics"], SIZE)
    undone = displaced(seen, displacements(batch, parameters, SIZE, 9))
    inner = (..., slice(6, -6), slice(6, -6))
    before, after = ((p - to_float(target))[inner].abs().mean() for p in (seen, undone))
    assert after < 0.04 and after < 0.6 * before, (before, after)
