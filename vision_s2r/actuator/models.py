"""Simulators of a drive: as it is believed to be, or identified, diagnosed or learnt from minutes of its log."""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.actuator.config import PAPER_HISTORY, ActuatorConfig, DriveConfig
from vision_s2r.actuator.drive import MotorDrive, NetworkDrive, nominal
from vision_s2r.actuator.log import DriveLog, LooseLoop, record
from vision_s2r.actuator.network import ActuatorNetwork
from vision_s2r.actuator.policy import World
from vision_s2r.actuator.references import sweeps
from vision_s2r.actuator.training import fit
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.files import write
from vision_s2r.identify.identify import identify
from vision_s2r.progress import tracked
from vision_s2r.recording import JointRecording, from_arrays
from vision_s2r.report.reading import diagnosed, values

ANALYTIC, IDENTIFIED, DIAGNOSED = "analytic", "identified", "diagnosed"
PAPER, LONG, ITSELF = "paper", "long", "drive"


@dataclass(frozen=True)
class MotorModel:
    """What stands for the motor, and how many minutes of log it was made from."""

    name: str
    minutes: float = 0.0

    def __str__(self) -> str:
        return f"{self.name}-{self.minutes:g}" if self.minutes else self.name


def models(cfg: ActuatorConfig) -> list[MotorModel]:
    """All that are compared, the drive itself last."""
    found = [MotorModel(ANALYTIC)]
    for minutes in cfg.logs.minutes:
        names = (IDENTIFIED, DIAGNOSED, PAPER, LONG) if minutes <= cfg.logs.diagnosed else (PAPER, LONG)
        found += [MotorModel(name, minutes) for name in names]
    return [*found, MotorModel(ITSELF)]


def worlds(cfg: ActuatorConfig, out: Path) -> dict[MotorModel, list[World]]:
    """A simulator for each model and seed, made unless it is in the folder already."""
    every = models(cfg)
    jobs = [(model, cfg.seed + k) for k in range(cfg.seeds) for model in every]
    longest = cache(partial(_longest, cfg))
    found: dict[MotorModel, list[World]] = {model: [] for model in every}
    for model, seed in tracked(jobs, len(jobs), "simulators"):
        found[model].append(_world(cfg, model, seed, out, longest))
    return found


def log(cfg: ActuatorConfig, motions: int, seed: int, stream: int) -> DriveLog:
    """The drive under motions of the family that networks learn from, each with a loose outer loop of its own."""
    rng = np.random.default_rng([seed, stream])
    references = sweeps(cfg.logs, motions, cfg.drive.sample_time, rng)
    loop = LooseLoop(rng.uniform(0, cfg.logs.position_gain, motions), rng.uniform(0, cfg.logs.velocity_gain, motions))
    return record(MotorDrive(cfg.drive, references.payload, rng), references, loop)


def _longest(cfg: ActuatorConfig, seed: int) -> DriveLog:
    return log(cfg, _motions(cfg, cfg.logs.minutes[-1]), seed, 3)


def _motions(cfg: ActuatorConfig, minutes: float) -> int:
    return max(1, round(60 * minutes / cfg.logs.seconds))


def _world(cfg: ActuatorConfig, model: MotorModel, seed: int, out: Path, longest: Callable[[int], DriveLog]) -> World:
    if model.name == ITSELF:
        return partial(MotorDrive, cfg.drive)
    limit = {"torque_saturation": {"limit": cfg.drive.torque_limit}}
    if model.name == ANALYTIC:
        return partial(MotorDrive, cfg.drive, effects=limit)
    if model.name in (PAPER, LONG):
        return partial(NetworkDrive, cfg.drive, network=_network(cfg, model, seed, out, longest))
    path = out / f"effects-{model}-{seed}.json"
    if not path.exists():
        recording = as_recording(cfg.drive, longest(seed).first(_motions(cfg, model.minutes)))
        start = time.perf_counter()
        effects = _effects(model.name, recording)
        seconds = round(time.perf_counter() - start, 1)
        write(path, json.dumps({"effects": effects, "seconds": seconds}, indent=1) + "\n")
    return partial(MotorDrive, cfg.drive, effects=limit | json.loads(path.read_text())["effects"])


def network_path(out: Path, model: MotorModel, seed: int) -> Path:
    """Where a network is kept."""
    return out / f"network-{model}-{seed}.safetensors"


def _network(
    cfg: ActuatorConfig, model: MotorModel, seed: int, out: Path, longest: Callable[[int], DriveLog]
) -> ActuatorNetwork:
    """The network of a model and seed, trained unless it is in the folder already."""
    path = network_path(out, model, seed)
    history = PAPER_HISTORY if model.name == PAPER else tuple(cfg.history)
    if not path.exists():
        seen = longest(seed).first(_motions(cfg, model.minutes))
        start = time.perf_counter()
        trained = fit(seen, history, cfg.drive.sample_time, cfg.training, seed)
        trained.save(path, {"steps": cfg.training.steps, "seconds": round(time.perf_counter() - start, 1)})
    return ActuatorNetwork.load(path, history)


def _effects(name: str, recording: JointRecording) -> dict[str, dict[str, float]]:
    """Effects by name: the nominal parameters alone, or what a diagnosis says that the motor has."""
    if name == IDENTIFIED:
        return {effect: dict(given) for effect, given in identify(recording).values.items()}
    return values(diagnosed(diagnose(recording).to_dict()))


def as_recording(cfg: DriveConfig, seen: DriveLog) -> JointRecording:
    """A log as a joint's recording: what the inner controller asked of the motor, and what came of it.

    The payload is told, as the torque sensor, which a network learns from, is not.
    """
    asked = np.clip(cfg.stiffness * seen.error - cfg.damping * seen.velocity, -cfg.torque_limit, cfg.torque_limit)
    known: dict[str, Any] = vars(nominal(cfg))
    wanted = ("inertia", "viscous_damping", "coulomb_friction")
    return from_arrays(
        nominal={name: known[name] for name in wanted},
        sample_time=cfg.sample_time,
        torque=asked,
        position=seen.position,
        velocity=seen.velocity,
        external=np.repeat(seen.payload[:, None], asked.shape[1], axis=1),
    )
