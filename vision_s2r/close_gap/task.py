"""What a robot's effects cost its task: grasps held on the same scenes under any part of them.

Losses are divided among sources as Shapley divides a game's worth among its players (Contributions to the Theory of
Games II, 1953).
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r import parallel
from vision_s2r.camera import CameraConfig
from vision_s2r.config import Config
from vision_s2r.evaluate.cells import Cell, fingerprint
from vision_s2r.evaluate.columns import Column, pictures
from vision_s2r.evaluate.config import RowConfig, through_cameras
from vision_s2r.evaluate.rows import Loaders, Runner, load_rows
from vision_s2r.evaluate.scenes import Scenes
from vision_s2r.pipeline import test_scene
from vision_s2r.scene import attempt
from vision_s2r.scene.drives import Tuning
from vision_s2r.scene.machine import Key, Machine, source_of
from vision_s2r.statistics import interval, shapley

SOURCES = ("appearance", "camera", "drives", "contact")
LOOK: Key = ("appearance", "real")  # beside the effects: what surfaces and light look like


@dataclass(frozen=True)
class Way:
    """How a robot grasps: a translator, a policy (checkpoints), and what its controller knows of its drives."""

    translator: str
    policy: str
    tuning: Tuning = field(default_factory=Tuning)


class Task:
    """The grasping task on the test scenes; every outcome is kept in a folder, and found there again."""

    def __init__(self, cfg: Config, scenes: int, out: Path) -> None:
        """`scenes`: the first so many of the test's; 0: as the evaluation."""
        self._cfg, self._out = cfg, out
        self.scenes = Scenes.open(replace(cfg.evaluate, limit=scenes or cfg.evaluate.limit), test_scene(cfg))
        self._runners: dict[tuple[str, str], Runner] = {}
        self._grasps: dict[str, tuple[np.ndarray, np.ndarray]] = {}  # by what is seen, and by whom

    def success(self, way: Way, robot: Machine, look: str = "real") -> np.ndarray:
        """bool [N]: whether the grasp that this way chooses in each scene holds on a robot.

        The real look, or as training has it (randomized), through the robot's camera.
        """
        runner = self._runner(way)
        column = Column("robot", look, robot.camera if robot.parts.get("camera") else CameraConfig())
        others = {name: robot.parts[name] for name in robot.parts if name != "camera"}
        seen = runner.fingerprint(column, self.scenes, self._cfg.seed)
        key = fingerprint(seen, others, list(way.tuning.believed))
        path = self._out / f"{key[:16]}.json"
        cell = Cell.load(path, key)
        if cell is None:
            if seen not in self._grasps:
                self._grasps[seen] = runner.act(pictures(column, self.scenes.views, self._cfg.seed), self.scenes)
            grasps, q = self._grasps[seen]
            calls = (
                (self.scenes.cfg, state, grasp, robot, way.tuning)
                for state, grasp in zip(self.scenes.states, np.asarray(grasps, np.float64), strict=True)
            )
            cell = Cell(grasps, q, list(parallel.run(attempt, calls, self._cfg.jobs, self._cfg.backend)))
            cell.save(path, key)
        return cell.success

    def _runner(self, way: Way) -> Runner:
        key = way.translator, way.policy
        if key not in self._runners:
            row = {"robot": RowConfig([way.policy], [way.translator])}
            settings = through_cameras(self._cfg.evaluate, row, [], self._out)
            (self._runners[key],) = load_rows(settings, self.scenes.views.size, Loaders())["robot"]
        return self._runners[key]


def losses(task: Task, way: Way, robot: Machine, seed: int) -> dict[str, Any]:
    """What a robot costs its task, as a report has it: success before and after, and the share of each source.

    Success in simulation is that of training's look on a robot without effects. A source (appearance, camera, drives,
    contact) loses its Shapley value over all subsets of them; `gained` is what success would win if it alone were
    mended, and so for every effect. Intervals are 95 %, over scenes.
    """
    sources = {source: [key for key in (LOOK, *robot.keys) if source_of(key) == source] for source in SOURCES}
    players = [source for source, keys in sources.items() if keys]

    def held(keys: Iterable[Key]) -> np.ndarray:
        keys = set(keys)
        return task.success(way, robot.only(keys), "real" if LOOK in keys else "randomized")

    def lost(names: frozenset[str]) -> np.ndarray:
        return -held(key for name in names for key in sources[name]).astype(float)

    parts = shapley(players, lost)
    everything = {LOOK, *robot.keys}
    simulated, real = held(()).astype(float), held(everything).astype(float)
    return {
        "scenes": len(simulated),
        "simulated": float(simulated.mean()),
        "real": float(real.mean()),
        **_estimate("lost", simulated - real, seed),
        "sources": [
            {
                "source": source,
                **_estimate("lost", parts[source], seed),
                **_estimate("gained", held(everything - set(sources[source])) - real, seed),
            }
            for source in players
        ],
        "effects": [
            {"part": part, "name": name, **_estimate("gained", held(everything - {(part, name)}) - real, seed)}
            for part, name in robot.keys
        ],
    }


def cost(task: Task, way: Way, robot: Machine, source: str) -> float:
    """The share of grasps that a source's effects cost beside the others."""
    others = robot.only({key for key in robot.keys if source_of(key) != source})
    return float(task.success(way, others).mean() - task.success(way, robot).mean())


def _estimate(name: str, values: np.ndarray, seed: int) -> dict[str, Any]:
    """The mean over scenes [N] and its 95 % interval."""
    ci = interval(partial(_mean, values), len(values), seed)
    return {name: float(values.mean()), f"{name}_ci": list(ci)}


def _mean(values: np.ndarray, counts: np.ndarray) -> np.ndarray:
    return np.asarray(counts @ values / counts.sum(axis=1))
