"""Small inputs of every reader that are right, to be spoilt, and how each is read."""

import json
import shutil
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from vision_s2r.camera.config import load_config
from vision_s2r.cli import compose
from vision_s2r.config import Config
from vision_s2r.contact import box
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.grasp import GraspConfig, GraspPolicy
from vision_s2r.grasp.forms import build
from vision_s2r.imports import SOURCES, ImportOptions
from vision_s2r.networks.unet import NetworkConfig, UNet
from vision_s2r.recording import (
    CameraRecording,
    ContactRecording,
    JointRecording,
    from_arrays,
    from_pictures,
    read,
    write,
)
from vision_s2r.recording.robot import read_robot
from vision_s2r.render import RenderConfig, Views, render
from vision_s2r.report import GapReport
from vision_s2r.report.page import html
from vision_s2r.report.reading import FORMAT
from vision_s2r.scene import SceneConfig
from vision_s2r.scene.appearance import palette
from vision_s2r.training import checkpoint
from vision_s2r.translate import Translator

TIMES = np.arange(120) * 0.01
ARM = """<mujoco><worldbody><body><joint name="a" type="hinge" axis="0 1 0" range="-170 170"/>
<geom type="capsule" size="0.02 0.1" mass="0.2"/></body></worldbody></mujoco>
"""
CAMERA = """# A camera
reference_size: 128
interpolation: bilinear
effects:
  lens_distortion:
    # How often
    probability: 0.5
    k1: [-0.16, -0.06]
    k2: 0.01
  jpeg_compression: {quality: [35, 75]}
"""


@dataclass(frozen=True)
class Reader:
    """One way in: `make` writes an input into a folder, `read` reads it; `slow` by how much fewer inputs it gets."""

    make: Callable[[Path], Any]
    read: Callable[[Path], Any]
    slow: int = 1


def a_joint() -> JointRecording:
    """Two episodes of a joint that follows a current."""
    wave = np.sin(np.array([[3.0], [5.0]]) * TIMES)
    nominal = {"torque_constant": 0.5, "inertia": 0.02, "viscous_damping": 0.1, "coulomb_friction": 0.02}
    return from_arrays(nominal=nominal, sample_time=0.01, current=wave, position=0.5 * wave)


def a_camera() -> CameraRecording:
    """Random pictures and what a camera saw of them."""
    pictures = np.random.default_rng(0).integers(0, 255, (2, 4, 20, 24, 3)).astype(np.uint8)
    return from_pictures(pictures[0], pictures[1], intrinsics=(30.0, 30.0, 11.5, 9.5))


def a_contact() -> ContactRecording:
    """Two cubes that fall and stay."""
    position = np.zeros((2, len(TIMES), 3))
    position[..., 2] = np.maximum(1.0 - 9.81 / 2 * TIMES**2, 0.05)
    attitude = np.broadcast_to((0.0, 0.0, 0.0, 1.0), (2, len(TIMES), 4))
    nominal = {"mass": 0.37, "lateral_friction": 0.3, "restitution": 0.2, "gravity": 9.81}
    shape, lengths = box((0.05, 0.05, 0.05)), np.full(2, len(TIMES))
    return ContactRecording(nominal, shape, 0.01, position, attitude, None, lengths, (0, 1))


def _arm(folder: Path) -> None:
    (folder / "arm.xml").write_text(ARM)
    head = {"format": "vision-s2r/recording/1", "kind": "arm", "model": "arm.xml", "sample_time": 0.01}
    drive = {"command": "position", "proportional_gain": 17.8, "viscous_damping": 0.6}
    (folder / "recording.yaml").write_text(json.dumps(head | {"joints": {"a": drive}}))
    rows = [f"0,{t:.3f},{np.sin(3 * t):.6f},{np.sin(3 * t - 0.1):.6f}" for t in TIMES]
    (folder / "arm.csv").write_text("\n".join(["episode,t,command.a,position.a", *rows]) + "\n")


def _robot(folder: Path) -> None:
    write(a_joint(), folder / "joint")
    write(a_camera(), folder / "camera")
    parts = {"joints": ["joint"], "camera": "camera"}
    head = {"format": "vision-s2r/recording/1", "kind": "robot", "parts": parts}
    (folder / "recording.yaml").write_text(json.dumps(head))
    (folder / "outcomes.csv").write_text("episode,success\n0,1\n1,0\n")


def _shards(folder: Path) -> None:
    cfg = RenderConfig(str(folder), scenes=2, size=16, margin=2, views=1, grasps=0, shard_size=1, workers=1)
    render(SceneConfig(), cfg)
    (folder / "contact_sheet.png").unlink()


def _views(folder: Path) -> None:
    views = Views.open(folder)
    views.all("canonical")
    views.states()


def _translator(folder: Path) -> None:
    cfg, heads = NetworkConfig(width=8, levels=2, rectifier=8), {"canonical": 3, "depth": 1}
    network, configuration = UNet(cfg, heads), {"network": asdict(cfg), "heads": heads}
    normalization = {"size": 32, "palette": [list(each) for each in palette()], "depth_range": [0.1, 2.0]}
    tensors = {f"unet.{name}": value for name, value in network.state_dict().items()}
    made = checkpoint.Checkpoint("translator", configuration, normalization, {"step": 1}, tensors)
    checkpoint.save(folder / "best.safetensors", made)


def _policy(folder: Path) -> None:
    cfg = GraspConfig(width=8)
    tensors = {f"q_function.{name}": value for name, value in build(cfg).state_dict().items()}
    made = checkpoint.Checkpoint("q_function", asdict(cfg), {"size": 32}, {"step": 1}, tensors)
    checkpoint.save(folder / "best.safetensors", made)


def _state(folder: Path) -> None:
    checkpoint.save_state(folder / "last.pt", {"step": 3, "networks": {"a": torch.ones(3)}, "configuration": "{}"})


def _report(folder: Path) -> None:
    interval, width = [0.9, 1.0], {"value": 0.031, "unit": "rad", "ci": [0.030, 0.032]}
    gap = {"metric": "velocity_rmse", "unit": "rad/s", "before": 0.61, "after": 0.0052, "floor": 0.005}
    effect = {"name": "backlash", "source": "actuator", "share": 0.97, "ci": interval, "evidence": 812.4}
    report = {
        "format": FORMAT, "kind": "joint", "verdict": "explained",
        "gap": gap | {"shrink": 0.99, "shrink_ci": interval},
        "sources": [{"source": "actuator", "share": 0.97, "ci": interval}],
        "where": [{"axis": "velocity", "at": "slow", "share": 0.71}],
        "effects": [effect | {"parameters": {"width": width}}],
        "candidates": [{"name": "latency", "status": "absent", "evidence": -1.2, "confusable_with": []}],
        "alternatives": [{"effects": ["compliance"], "evidence": 301.2}],
        "unexplained": {"share": 0.01, "ci": [0.0, 0.02], "where": []}, "next_experiment": "",
    }  # fmt: skip
    (folder / "report.json").write_text(json.dumps(report))


def _read_report(folder: Path) -> None:
    report = GapReport.read(folder / "report.json")
    report.summary()
    html(report.to_dict(), {})


def _camera(folder: Path) -> None:
    (folder / "camera.yaml").write_text(CAMERA)


def _overrides(folder: Path) -> None:
    lines = ["experiment=debug", "render.scenes=7", "camera=webcam", "evaluate.cameras=[webcam,harsh]", "seed=3"]
    (folder / "overrides.txt").write_text("\n".join(lines))


def _few_overrides(folder: Path) -> None:
    lines = ["recording=[a,b]", "seed=3", "joint.evidence=4", "withhold=[backlash,latency]", "camera.most=2"]
    (folder / "overrides.txt").write_text("\n".join(lines))


def _compose(schema: type[Any], name: str) -> Callable[[Path], Any]:
    return lambda folder: compose(schema, name, _lines(folder / "overrides.txt"))


def _lines(path: Path) -> list[str]:
    return path.read_text(errors="replace").splitlines() if path.is_file() else []


def _lerobot(folder: Path) -> None:
    from vision_s2r.export.lerobot import LeRobotConfig, export_lerobot

    recording = write(a_joint(), folder / "recording")
    export_lerobot(LeRobotConfig(recording=str(recording), out=str(folder / "dataset")))
    shutil.rmtree(recording)


def _sage(folder: Path) -> None:
    (folder / "joint_list.txt").write_text("Rotation\nJaw\n")
    for name, columns in (("control", "positions"), ("state_motor", "positions,velocities,torques")):
        rows = [f"{name.upper()},{1e6 * t:.0f}" + ',"[0.1, 0.2]"' * (columns.count(",") + 1) for t in TIMES]
        (folder / f"{name}.csv").write_text("\n".join([f"type,timestamp,{columns}", *rows]))


def _bam(folder: Path) -> None:
    entry = {"position": 0.1, "speed": 0.0, "load": 0, "input_volts": 11.4, "temp": 20, "torque_enable": True}
    entries = [entry | {"timestamp": float(t), "goal_position": float(np.sin(t))} for t in TIMES[:20]]
    log = {"mass": 1.0, "length": 0.1, "kp": 16, "vin": 12.0, "motor": "sts3250", "trajectory": "sin"}
    (folder / "a.json").write_text(json.dumps(log | {"entries": entries}))


def _csv(folder: Path) -> None:
    (folder / "log.csv").write_text("\n".join(["t,position,target", *(f"{t:.2f},0.1,0.2" for t in TIMES)]))


def _load(source: str, name: str = "") -> Callable[[Path], Any]:
    return lambda folder: SOURCES[source](folder / name, ImportOptions())


READERS: dict[str, Reader] = {
    "recording of a joint": Reader(lambda folder: write(a_joint(), folder), lambda folder: read(folder, False)),
    "recording of a camera": Reader(lambda folder: write(a_camera(), folder), lambda folder: read(folder, False)),
    "recording of tosses": Reader(lambda folder: write(a_contact(), folder), lambda folder: read(folder, False)),
    "recording of an arm": Reader(_arm, lambda folder: read(folder, False)),
    "recording of a robot": Reader(_robot, read_robot),
    "shards": Reader(_shards, _views),
    "checkpoint of a translator": Reader(_translator, lambda folder: Translator.load(folder / "best.safetensors")),
    "state of a training": Reader(_state, lambda folder: checkpoint.load_state(folder / "last.pt")),
    "report": Reader(_report, _read_report),
    "camera's configuration": Reader(_camera, lambda folder: load_config(folder / "camera.yaml")),
    "log in a table": Reader(_csv, _load("csv", "log.csv")),
    "log of SAGE": Reader(_sage, _load("sage")),
    "log of BAM": Reader(_bam, _load("bam")),
    "data set of LeRobot": Reader(_lerobot, _load("lerobot", "dataset")),
    "checkpoint of a policy": Reader(_policy, lambda folder: GraspPolicy.load(folder / "best.safetensors")),
    "overrides of a diagnosis": Reader(_few_overrides, _compose(DiagnoseConfig, "diagnose"), slow=10),
    "overrides of a training": Reader(_overrides, _compose(Config, "config"), slow=100),
}
