"""Robots that nobody has seen: drawn, recorded by code that is not the diagnosis', and kept aside."""

import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import yaml

from vision_s2r import files
from vision_s2r.close_gap.config import SOURCES, CloseGapConfig
from vision_s2r.errors import UserError
from vision_s2r.gapbench.generate import camera_effects as studio
from vision_s2r.gapbench.generate import contact as tossing
from vision_s2r.gapbench.generate.base import Answer
from vision_s2r.gapbench.generate.body import TossedBody
from vision_s2r.gapbench.generate.drive import DriveModel, PositionLoop, run
from vision_s2r.recording import CameraRecording, JointRecording, write
from vision_s2r.recording.header import FORMAT
from vision_s2r.render import Views
from vision_s2r.scene import SceneConfig
from vision_s2r.scene.drives import NOMINAL
from vision_s2r.scene.machine import Machine, registry_of, source_of

CAMERA_EFFECTS = 2  # of each robot
DRIVE_EFFECTS = 2  # likewise, of different drives
# Strong enough to cost grasps; px are meant for pictures of 64.
CAMERA: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "camera_pose_offset": {"yaw": (0.02, 0.04), "pitch": (-0.04, -0.02), "roll": (0.03, 0.08)},
    "uneven_illumination": {"strength": (0.5, 0.9), "angle": (-180, 180)},
    "cast_shadow": {"strength": (0.5, 0.8), "offset": (-10, 10), "angle": (-180, 180), "softness": (1, 4)},
    "lens_distortion": {"k1": (-0.5, -0.3), "k2": (0.0, 0.05)},
    "chromatic_aberration": {"red": (0.02, 0.04), "blue": (-0.04, -0.02)},
    "vignetting": {"strength": (0.7, 0.95)},
    "defocus_blur": {"radius": (1.8, 3.2)},
    "motion_blur": {"length": (4.0, 8.0), "angle": (-90, 90)},
    "low_resolution": {"factor": (1.7, 2.5)},
    "exposure": {"stops": (-2.0, -1.2)},
    "shot_noise": {"full_well": (80, 300)},
    "read_noise": {"sigma": (0.015, 0.035)},
    "white_balance": {"red": (1.4, 1.8), "blue": (0.4, 0.6)},
    "gamma": {"gamma": (1.6, 2.2)},
    "jpeg_compression": {"quality": (10, 25)},
}


# Of drives (rad, or m for the lift, as its nominal values) and contact likewise: ranges of the one parameter.
DRIVES: Mapping[str, Mapping[str, tuple[str, tuple[float, float]]]] = {
    "shoulder": {"coulomb_friction": ("value", (8.0, 14.0)), "viscous_damping": ("value", (80.0, 160.0))},
    "elbow": {"coulomb_friction": ("value", (3.0, 5.0)), "viscous_damping": ("value", (30.0, 60.0))},
    "lift": {"latency": ("delay", (0.1, 0.2)), "viscous_damping": ("value", (400.0, 800.0))},
    "wrist": {"coulomb_friction": ("value", (0.6, 1.4))},
}
FRICTION = (0.2, 0.35)  # between objects and fingers
DRAWS = 12  # robots, to find one whose leading source costs enough
SMALL = 0.1  # of their size, that effects have of sources which do not lead
FIELDS = ("coulomb_friction", "viscous_damping")  # of one value, by the benchmark's drive's names
STEP, SAMPLE = 1e-4, 0.01  # s, of the integrator and of rows
EPISODES, SECONDS = 6, 4.0
REACH = {"shoulder": 0.4, "elbow": 0.4, "lift": 0.06, "wrist": 0.5}  # rad or m, of what is commanded
NOISE = 1e-4  # rad or m, of an encoder
PLATE = (0.03, 0.025, 0.02)  # m, half extents of the object that is tossed onto a plate of the fingers' material


@dataclass(frozen=True)
class Withheld:
    """A robot's recording, and the file with what the diagnosis is not told."""

    name: str
    recording: Path
    truth: Path | None


def comparable(views: Views) -> Views:
    """Views, whose source and canonical pictures a diagnosis can compare. Raises UserError for others."""
    if views.source_size != views.size:
        raise UserError(
            f"validation views have source pictures of {views.source_size} px and canonical ones of {views.size}: "
            "expected one size to diagnose cameras on (data.validation.source_scale=1)"
        )
    return views


def withhold(
    views: Views,
    scene: SceneConfig,
    cfg: CloseGapConfig,
    seed: int,
    out: Path,
    cost: Callable[[Machine, str], float],
) -> list[Withheld]:
    """`cfg.withheld` robots, each with pictures of real looks in `views`, logs of its drives, and tosses.

    What is there already stays: a seed always draws the same robots. `cost` is the share of grasps that a source of a
    robot costs, and asked where one leads.
    """
    robots = []
    for k in range(cfg.withheld):
        folder = out / f"robot-{k}"
        recording, truth = folder / "recording", folder / "truth.yaml"
        if not truth.exists():
            rng = np.random.default_rng([seed, k])
            source = cfg.sources[k % len(cfg.sources)]
            robot = leading(source, scene, cfg, rng, cost) if cfg.leading else drawn(rng, cfg.sources)
            _record(views, scene, cfg, robot, rng, recording)
            robot.save(truth)
        robots.append(Withheld(folder.name, recording, truth))
    return robots


def _record(
    views: Views, scene: SceneConfig, cfg: CloseGapConfig, robot: Machine, rng: np.random.Generator, folder: Path
) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    parts: dict[str, str | list[str]] = {}
    if "camera" in cfg.sources:
        parts["camera"] = "camera"
        write(_recording(views, cfg.frames, robot.parts["camera"], rng), folder / "camera")
    if "drives" in cfg.sources:
        parts["joints"] = [f"joints/{name}" for name in NOMINAL]
        for name in NOMINAL:
            write(log_of(name, robot.parts.get(name, {}), rng), folder / "joints" / name)
    if "contact" in cfg.sources:
        parts["contact"] = "contact"
        _toss(scene, cfg.tosses, robot.contact["lateral_friction"]["value"], rng, folder / "contact")
    head = {"format": FORMAT, "kind": "robot", "parts": parts}
    files.write(folder / "recording.yaml", yaml.safe_dump(head, sort_keys=False))


def drawn(rng: np.random.Generator, sources: Sequence[str] = SOURCES) -> Machine:
    """A robot with effects of these sources."""
    names = sorted(rng.choice(list(CAMERA), CAMERA_EFFECTS, replace=False), key=studio.EFFECTS.index)
    camera = {str(name): {key: float(rng.uniform(*ends)) for key, ends in CAMERA[name].items()} for name in names}
    if "jpeg_compression" in camera:
        camera["jpeg_compression"]["quality"] = float(round(camera["jpeg_compression"]["quality"]))
    drives = {}
    for name in rng.choice(list(DRIVES), DRIVE_EFFECTS, replace=False):
        effect = str(rng.choice(list(DRIVES[name])))
        key, ends = DRIVES[name][effect]
        drives[str(name)] = {effect: {key: float(rng.uniform(*ends))}}
    contact = {"lateral_friction": {"value": float(rng.uniform(*FRICTION))}}
    of = {"camera": {"camera": camera}, "drives": drives, "contact": {"contact": contact}}
    return Machine({part: effects for source in sources for part, effects in of[source].items()})


def leading(
    source: str,
    scene: SceneConfig,
    cfg: CloseGapConfig,
    rng: np.random.Generator,
    cost: Callable[[Machine, str], float],
) -> Machine:
    """A robot that a source leads, at the cost that is asked for; of as many as are drawn the one that costs most."""
    most, costs = Machine(), -np.inf
    for _ in range(DRAWS):
        robot = led(drawn(rng, cfg.sources), source, scene)
        if (here := cost(robot, source)) > costs:
            most, costs = robot, here
        if costs >= cfg.leading:
            break
    return most


def led(robot: Machine, source: str, scene: SceneConfig) -> Machine:
    """The robot with small effects but for one source's, so that which source costs most is another each time."""
    parts: dict[str, dict[str, dict[str, float]]] = {}
    for part, name in robot.keys:
        values = dict(robot.parts[part][name])
        if source_of((part, name)) != source:
            values = _smaller(part, name, values, scene)
        parts.setdefault(part, {})[name] = values
    return Machine(parts)


def _smaller(part: str, name: str, values: Mapping[str, float], scene: SceneConfig) -> dict[str, float]:
    """Parameters nearer to where the effect does nothing; those that it has whatever its size stay."""
    smaller = dict(values)
    for parameter in registry_of(part)[name].parameters:
        value, nothing = values[parameter.name], getattr(NOMINAL.get(part), name, parameter.neutral)
        if name == "lateral_friction":
            nothing = scene.physics.object_friction * scene.physics.finger_friction
        if nothing is not None:
            endless = np.isinf(nothing)  # a full well, or a quality, which is a whole number
            nearer = float(round(value / SMALL)) if endless else nothing + SMALL * (value - nothing)
            smaller[parameter.name] = min(nearer, parameter.high)
    return smaller


def everything(count: int, seed: int) -> list[Machine]:
    """Robots whose drives and contact are drawn blindly: all of the effects at once, each up to its largest."""
    rng = np.random.default_rng([seed, count])
    robots = []
    for _ in range(count):
        parts: dict[str, dict[str, dict[str, float]]] = {}
        for name, effects in DRIVES.items():
            for effect, (key, ends) in effects.items():
                believed = getattr(NOMINAL[name], effect, 0.0)
                far = max(ends, key=lambda end: abs(end - believed))
                value = believed + rng.uniform(0, 1) * (far - believed)
                parts.setdefault(name, {})[effect] = {key: float(value)}
        friction = {"lateral_friction": {"value": float(rng.uniform(FRICTION[0], 1.0))}}
        robots.append(Machine({**parts, "contact": friction}))
    return robots


def log_of(name: str, effects: Mapping[str, Mapping[str, float]], rng: np.random.Generator) -> JointRecording:
    """Steps and sines that a drive was sent, and what it did."""
    nominal = NOMINAL[name]
    given = {effect: values["value"] for effect, values in effects.items() if effect in FIELDS}
    # The law acts inside the integrator: one that held its torque for 0.2 ms was late enough to be named a damping.
    drive = DriveModel(
        *(1.0, nominal.inertia, nominal.viscous_damping, nominal.coulomb_friction),
        proportional_gain=nominal.proportional_gain or 0.0,
        derivative_gain=nominal.derivative_gain,
        command_limit=nominal.command_limit,
        delay=effects.get("latency", {"delay": 0.0})["delay"],
    )._replace(**given)
    rows = round(SECONDS / SAMPLE)
    nothing = np.zeros((rows, 2))
    target, position = np.empty((EPISODES, rows)), np.empty((EPISODES, rows))
    for e in range(EPISODES):
        target[e] = _sent(rows, rng) * REACH[name]
        motion, _ = run(drive, PositionLoop(target[e], nothing, nothing), nothing[0], SAMPLE, STEP)
        position[e] = motion[:, 0]
    return JointRecording(
        nominal={key: value for key, value in asdict(nominal).items() if value is not None},
        sample_time=SAMPLE,
        units="linear" if name == "lift" else "rotary",
        command=target,
        position=position + rng.normal(0, NOISE, position.shape),
        velocity=None,
        lengths=np.full(EPISODES, rows),
        episodes=tuple(range(EPISODES)),
    )


def _sent(rows: int, rng: np.random.Generator) -> np.ndarray:
    """Targets [rows] from -1 to 1, from 0 on: three sines that swell, and steps that are held."""
    t = np.arange(rows) * SAMPLE
    frequency, phase = np.exp(rng.uniform(np.log(0.2), np.log(2.0), 3)), rng.uniform(0, 2 * np.pi, 3)
    waves = (np.sin(2 * np.pi * frequency * t[:, None] + phase) - np.sin(phase)).mean(axis=1) / 2
    steps = np.repeat(rng.uniform(-0.5, 0.5, -(-rows // 80)), 80)[:rows]
    steps[:80] = 0.0
    return np.asarray(waves + steps)


def _toss(scene: SceneConfig, tosses: int, friction: float, rng: np.random.Generator, folder: Path) -> None:
    """An object's tosses onto a plate of the fingers' material."""
    half = np.array(PLATE)
    points = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * half
    physics = scene.physics
    nominal = TossedBody(physics.object_mass, physics.object_friction * physics.finger_friction, 0.0)
    setting = tossing.Setting(
        nominal=nominal,
        shape={"shape": "box", "half_extents": list(PLATE)},
        points=points,
        radius=0.0,
        inertia=np.diag((half**2).sum() - half**2) / 3,
        size=float(half.min()),
        first=tossing.tosses(tosses, points, 0.0, rng),
        samples=120,
        sample_time=1 / 150,
        noise=(2e-4, 2e-3),
        velocity_noise=None,
    )
    folder.mkdir(parents=True)
    tossing.recorded(setting, nominal._replace(friction=friction), Answer("dynamics"), rng).write(folder)


def _recording(views: Views, frames: int, values: studio.Values, rng: np.random.Generator) -> CameraRecording:
    chosen = rng.choice(len(views), min(frames, len(views)), replace=False)
    canvas = views.all("real").numpy()[chosen] / 255
    fx, fy, cx, cy = views.all("intrinsics").numpy()[chosen[0]]
    geometry = studio.Geometry(views.size, views.size, fx, fy, cx, cy, views.margin)
    real = studio.photograph(canvas, values, geometry, studio.Sensor(), rng)
    names = tuple(f"{i:04d}" for i in range(len(chosen)))
    return CameraRecording(
        pairing="paired",
        encoding="srgb",
        sim=geometry.crop(canvas).astype(np.float32),
        real=(real / 255).astype(np.float32),
        labels=None,
        mask=None,
        intrinsics=np.array([fx, fy, cx, cy]),
        bits=8,
        grey=False,
        names=names,
        real_names=names,
    )
