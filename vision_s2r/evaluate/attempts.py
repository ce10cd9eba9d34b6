"""Grasps tried in simulation, in parallel, each distinct one once."""

from collections.abc import Callable, Iterable

import numpy as np

from vision_s2r import parallel
from vision_s2r.evaluate.scenes import Scenes
from vision_s2r.scene import Outcome, attempt


class Attempts:
    """What became of grasps in the scenes; remembers every grasp it tried."""

    def __init__(self, scenes: Scenes, backend: str, workers: int) -> None:
        self._scenes, self._backend, self._workers = scenes, backend, workers
        self._known: dict[tuple[int, bytes], Outcome] = {}

    def remember(self, grasps: np.ndarray, outcomes: Iterable[Outcome]) -> None:
        """Outcomes of an earlier run, one for each scene's grasp [N, 3]."""
        for key, outcome in zip(_keys(grasps), outcomes, strict=True):
            self._known[key] = outcome

    def __call__(self, grasps: np.ndarray, advance: Callable[[int], None]) -> list[Outcome]:
        """The outcome of one grasp (x, y, yaw) a scene, float64 [N, 3]; `advance` hears how many more are decided."""
        keys = _keys(grasps)
        new = [key for key in keys if key not in self._known]
        advance(len(keys) - len(new))
        calls = ((self._scenes.cfg, self._scenes.states[scene], grasps[scene]) for scene, _ in new)
        outcomes = parallel.run(attempt, calls, self._workers, self._backend)
        for key, outcome in zip(new, outcomes, strict=True):
            self._known[key] = outcome
            advance(1)
        return [self._known[key] for key in keys]


def _keys(grasps: np.ndarray) -> list[tuple[int, bytes]]:
    return [(scene, grasp.tobytes()) for scene, grasp in enumerate(np.asarray(grasps, np.float64))]
