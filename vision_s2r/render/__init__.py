"""Scene states in, sharded paired views on disk out, and back.

A folder holds manifest.json and shard-00000.safetensors, …; each shard, for its N scenes with V randomized views and
G grasps a scene, S pixels a side of a canonical picture, R (`source_scale` times S) of a source picture and m of its
margin:

| tensor | type and shape | what |
| --- | --- | --- |
| randomized | uint8 [N, V, R+2m, R+2m, 3] | source pictures |
| real | uint8 [N, R+2m, R+2m, 3] | the real appearance, where asked for |
| canonical | uint8 [N, S, S, 3] | the canonical look, from the nominal camera, no margin |
| depth | float32 [N, S, S] | of the canonical view, metres along the optical axis |
| segmentation, instance | uint8 [N, S, S] | of the canonical view: class ids; 0 none, k + 1 the k-th object |
| intrinsics, extrinsics | float64 [N, 4], [N, 4, 4] | of the canonical view: fx, fy, cx, cy; world to camera |
| grasps, origin, success | float64 [N, G, 3], uint8 [N, G] | x, y (m), yaw (rad); how proposed; held after the lift |
| the rest | | the scene state |
"""

from vision_s2r.render.config import RenderConfig
from vision_s2r.render.render import render
from vision_s2r.render.seen import Recorded
from vision_s2r.render.views import Views

__all__ = ["Recorded", "RenderConfig", "Views", "render"]
