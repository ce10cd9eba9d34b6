"""How fast pairs are rendered, against what the engine allows and against the loop that everybody writes first.

All are measured in one process in turns, so that they share the machine's moods; what counts is their ratio.
"""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.progress import track

from vision_s2r.bullet import pybullet
from vision_s2r.results import publish
from vision_s2r.scene import Renderer, SceneConfig, SceneState, arm, canonical, objects, randomized, sample_state, tray
from vision_s2r.scene.appearance import Appearance, Light
from vision_s2r.scene.renderer import LIGHT_DISTANCE, projection, view_matrix

SCENES = 40
ROUNDS = 5
MEMORY_RENDERS = 20_000


def run(scene: SceneConfig, size: int, margin: int, views: int, seed: int, out: Path) -> Path:
    """Pairs a second of each way, medians over rounds, and memory; printed, and written to render.json, its path.

    `views`: randomized pictures of a scene, as they are rendered for training.
    """
    states = [sample_state(scene, seed, k) for k in track(range(SCENES), "settling scenes")]
    looks = [(randomized(scene, state), canonical(state)) for state in states]
    with Renderer(scene) as renderer:
        ours, many = "ours, a view a scene", f"ours, {views} views a scene"
        ways: dict[str, Callable[[], float]] = {
            ours: lambda: _ours(renderer, states, size, margin, 1),
            many: lambda: _ours(renderer, states, size, margin, views),
            "two bare getCameraImage calls (the limit)": lambda: _limit(renderer, states, looks, size, margin),
            "reset, load, texture, settle, render (the usual loop)": lambda: _usual(
                scene, states[:10], looks, renderer, size, margin
            ),
        }
        _ours(renderer, states, size, margin, 1)  # meshes are made once
        times = {name: [way() for _ in track(range(ROUNDS), name)] for name, way in ways.items()}
        growth = _growth(renderer, states, size, margin)
    speeds = {name: 1 / float(np.median(each)) for name, each in times.items()}
    columns = ["way", "pairs/s", *(f"{name} / it" for name in (ours, many))]
    rows = [[name, speed, *(speeds[each] / speed for each in (ours, many))] for name, speed in speeds.items()]
    rows.append([f"MB that {MEMORY_RENDERS:,} renders added", growth, "", ""])
    return publish(out / "render.json", "vision-s2r benchmark render", columns, rows)


def _ours(renderer: Renderer, states: list[SceneState], size: int, margin: int, views: int) -> float:
    """Seconds a pair: objects placed, looks drawn, pictures, labels with the canonical one, which `views` share."""
    start = time.perf_counter()
    for state in states:
        for view in range(views):
            renderer.render(state, randomized(renderer.cfg, state, view), size, margin)
        renderer.render(state, canonical(state), size, labels=True)
    return (time.perf_counter() - start) / len(states) / views


def _limit(
    renderer: Renderer,
    states: list[SceneState],
    looks: list[tuple[Appearance, Appearance]],
    size: int,
    margin: int,
) -> float:
    """Seconds a pair of the two bare calls, the scene standing ready."""
    total = 0.0
    for state, (source, target) in zip(states, looks, strict=True):
        renderer.render(state, source, size, margin)
        total += _bare(renderer, state, source.light, size, margin, pybullet.ER_NO_SEGMENTATION_MASK)
        renderer.render(state, target, size)
        total += _bare(renderer, state, target.light, size, 0, 0)
    return total / len(states)


def _bare(renderer: Renderer, state: SceneState, light: Light, size: int, margin: int, flags: int) -> float:
    view, lens = view_matrix(state.camera), projection(state.camera, size, margin)
    start = time.perf_counter()
    _shoot(renderer.client, size + 2 * margin, view, lens, light, flags)
    return time.perf_counter() - start


def _shoot(client: int, side: int, view: list[float], lens: list[float], light: Light, flags: int) -> None:
    pybullet.getCameraImage(
        side,
        side,
        view,
        lens,
        lightDirection=light.direction,
        lightColor=light.colour,
        lightDistance=LIGHT_DISTANCE,
        shadow=int(light.shadow),
        lightAmbientCoeff=light.ambient,
        lightDiffuseCoeff=light.diffuse,
        lightSpecularCoeff=light.specular,
        renderer=pybullet.ER_TINY_RENDERER,
        flags=flags,
        physicsClientId=client,
    )


def _usual(
    scene: SceneConfig,
    states: list[SceneState],
    looks: list[tuple[Appearance, Appearance]],
    renderer: Renderer,
    size: int,
    margin: int,
) -> float:
    """Seconds a pair of the usual loop: reset, load everything, texture it, let it settle, take two pictures."""
    client = pybullet.connect(pybullet.DIRECT)
    start = time.perf_counter()
    for state, (source, target) in zip(states, looks, strict=False):
        pybullet.resetSimulation(physicsClientId=client)
        pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
        fixed = [_load_box(client, p.size, p.position, 0.0) for p in tray.PARTS]
        for part in arm.parts(state.arm_joints):
            fixed.append(_load_box(client, arm.SIZES[part.name], part.position, part.yaw))
        moving = [_load_object(client, scene, object_id, k) for k, object_id in enumerate(state.object_ids)]
        for k, body in enumerate(fixed + moving):
            path = renderer.banks["randomized"][(7 * k) % scene.appearance.textures]
            texture = pybullet.loadTexture(str(path), physicsClientId=client)
            pybullet.changeVisualShape(body, -1, textureUniqueId=texture, physicsClientId=client)
        for _ in range(round(1.0 / scene.physics.time_step)):
            pybullet.stepSimulation(physicsClientId=client)
        view = view_matrix(state.camera)
        _shoot(client, size + 2 * margin, view, projection(state.camera, size, margin), source.light, 0)
        for body in fixed + moving:
            pybullet.changeVisualShape(
                body, -1, textureUniqueId=-1, rgbaColor=[0.5, 0.5, 0.5, 1], physicsClientId=client
            )
        _shoot(client, size, view, projection(state.camera, size, 0), target.light, 0)
    elapsed = time.perf_counter() - start
    pybullet.disconnect(physicsClientId=client)
    return elapsed / len(states)


def _load_box(client: int, size: tuple[float, ...], position: tuple[float, ...], yaw: float) -> int:
    half = [edge / 2 for edge in size]
    return pybullet.createMultiBody(
        0,
        pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client),
        pybullet.createVisualShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client),
        position,
        pybullet.getQuaternionFromEuler([0, 0, yaw]),
        physicsClientId=client,
    )


def _load_object(client: int, scene: SceneConfig, object_id: int, k: int) -> int:
    place = [0.05 * (k % 3 - 1), 0.05 * (k // 3 - 0.5), 0.06 + 0.04 * k]
    scale = scene.objects.scale / objects.URDF_SCALE
    return pybullet.loadURDF(str(objects.urdf(object_id)), place, globalScaling=scale, physicsClientId=client)


def _growth(renderer: Renderer, states: list[SceneState], size: int, margin: int) -> float:
    """Megabytes by which the process grew from the first tenth of MEMORY_RENDERS renders to the last."""
    first = 0.0
    for k in track(range(MEMORY_RENDERS), f"{MEMORY_RENDERS} renders"):
        state = states[k % len(states)]
        renderer.render(state, randomized(renderer.cfg, state, k // len(states)), size, margin)
        if k == MEMORY_RENDERS // 10:
            first = _resident()
    return _resident() - first


def _resident() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6
