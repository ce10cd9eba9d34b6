"""Scenes that were rendered, in another look."""

from collections.abc import Callable

import numpy as np
import torch
from omegaconf import OmegaConf
from torch import Tensor

from vision_s2r.render.views import Views
from vision_s2r.scene import Renderer, SceneConfig, SceneState
from vision_s2r.scene.appearance import Appearance

Look = Callable[[SceneConfig, SceneState], Appearance]


def rendered(views: Views, look: Look) -> Tensor:
    """The views' scenes in a look, by the camera that saw them: uint8 [N, H, W, 3], without the margin.

    The margin is rendered none the less: a picture without one may differ in single pixels.
    """
    scene = OmegaConf.to_object(OmegaConf.merge(OmegaConf.structured(SceneConfig), views.manifest.scene))
    assert isinstance(scene, SceneConfig)
    with Renderer(scene) as renderer:
        pictures = [
            renderer.render(state, look(scene, state), views.source_size, views.margin).rgb for state in views.states()
        ]
    m, size = views.margin, views.source_size
    return torch.from_numpy(np.stack(pictures)[:, m : m + size, m : m + size])
