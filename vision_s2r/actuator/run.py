"""All of it: log the drive, train networks, tune controllers in every simulator, try them on the drive."""

import json
import time
from dataclasses import asdict
from functools import partial
from pathlib import Path

import numpy as np

from vision_s2r.actuator.analytic import analytic_torque
from vision_s2r.actuator.config import PAPER_HISTORY, ActuatorConfig, check
from vision_s2r.actuator.control import World, attempt, tune
from vision_s2r.actuator.drive import MotorDrive, NetworkDrive
from vision_s2r.actuator.log import GAINS, DriveLog, record
from vision_s2r.actuator.measure import torque_errors, transfer
from vision_s2r.actuator.network import ActuatorNetwork
from vision_s2r.actuator.pictures import draw
from vision_s2r.actuator.references import References, sweeps, tasks
from vision_s2r.actuator.report import show
from vision_s2r.actuator.training import fit, predict
from vision_s2r.errors import UserError
from vision_s2r.files import differing, write
from vision_s2r.progress import tracked

FORMAT = "vision-s2r/actuator/1"
ANALYTIC, PAPER, LONG, ITSELF = "analytic", "paper", "long", "drive"
Networks = dict[str, list[ActuatorNetwork]]


def run(cfg: ActuatorConfig) -> Path:
    """Do, or go on with, what cfg describes; returns the picture's path. Networks and gains that are there stay.

    In `cfg.out`: settings.json, network-NAME-SEED.safetensors, controllers.json, actuator.json, actuator.png.
    Raises UserError for settings that cannot be, or other ones than those of the run in the folder.
    """
    check(cfg)
    out = Path(cfg.out)
    path, settings = out / "settings.json", {key: value for key, value in asdict(cfg).items() if key != "out"}
    if key := differing(path, settings):
        raise UserError(f"{path}: a run with another '{key}' is in this folder: choose another out=DIR or remove it")
    networks = _networks(cfg, out)
    worlds = _worlds(cfg, networks)
    gains = _controllers(cfg, worlds, out / "controllers.json")
    held_out = tasks(cfg.task, cfg.task.tried_on, cfg.drive.sample_time, np.random.default_rng([cfg.seed, 5]))
    own = _attempts(cfg, worlds, gains, held_out)
    drive = _attempts(cfg, dict.fromkeys(worlds, worlds[ITSELF]), gains, held_out)
    validation = _log(cfg, cfg.logs.held_out, 4)
    compared = {"validation": [validation] * cfg.seeds, "policy": drive[LONG]}
    torques = {name: _models(cfg, networks, logs) for name, logs in compared.items()}
    found = {
        "format": FORMAT,
        "settings": asdict(cfg),
        "torque": {name: torque_errors(logs, torques[name], cfg.drive.sample_time) for name, logs in compared.items()},
        "transfer": transfer(own, drive, cfg.task.tolerance, cfg.drive.sample_time),
    }
    write(out / "actuator.json", json.dumps(found, indent=2) + "\n")
    show(found)
    return draw(out / "actuator.png", cfg, compared, torques, held_out, drive)


def _log(cfg: ActuatorConfig, motions: int, stream: int) -> DriveLog:
    """The drive under motions of the family that networks are trained on, each with a loose outer loop of its own."""
    rng = np.random.default_rng([cfg.seed, stream])
    references = sweeps(cfg.logs, motions, cfg.drive.sample_time, rng)
    gains = np.zeros((motions, len(GAINS)))
    gains[:, 0] = rng.uniform(0, cfg.logs.position_gain, motions)
    gains[:, 1] = rng.uniform(0, cfg.logs.velocity_gain, motions)
    return record(MotorDrive(cfg.drive, references.payload, rng), references, gains)


def _networks(cfg: ActuatorConfig, out: Path) -> Networks:
    """By name, a network for each seed, trained unless it is in the folder already."""
    log: DriveLog | None = None
    found: Networks = {PAPER: [], LONG: []}
    for k in range(cfg.seeds):
        for name, history in ((PAPER, PAPER_HISTORY), (LONG, tuple(cfg.history))):
            path = out / f"network-{name}-{cfg.seed + k}.safetensors"
            if not path.exists():
                log = log or _log(cfg, cfg.logs.motions, 3)
                start = time.perf_counter()
                network = fit(log, history, cfg.drive.sample_time, cfg.training, cfg.seed + k)
                network.save(path, {"steps": cfg.training.steps, "seconds": round(time.perf_counter() - start, 1)})
            found[name].append(ActuatorNetwork.load(path, history))
    return found


def _worlds(cfg: ActuatorConfig, networks: Networks) -> dict[str, list[World]]:
    """By name, the simulators of each seed; the last is the drive itself."""
    analytic: World = partial(MotorDrive, cfg.drive, analytic=True)
    itself: World = partial(MotorDrive, cfg.drive)
    simulators: dict[str, list[World]] = {
        name: [partial(NetworkDrive, cfg.drive, network=network) for network in networks[name]] for name in networks
    }
    return {ANALYTIC: [analytic] * cfg.seeds, **simulators, ITSELF: [itself] * cfg.seeds}


def _controllers(cfg: ActuatorConfig, worlds: dict[str, list[World]], path: Path) -> dict[str, list[np.ndarray]]:
    """By simulator, the gains tuned in it with each seed; what the file holds already is not tuned again."""
    kept: dict[str, list[list[float]]] = json.loads(path.read_text()) if path.exists() else {}
    left = [(name, k) for k in range(cfg.seeds) for name in worlds if k >= len(kept.get(name, []))]
    for name, k in tracked(left, cfg.seeds * len(worlds), "controllers", cfg.seeds * len(worlds) - len(left)):
        gains = tune(worlds[name][k], cfg.task, cfg.drive.sample_time, cfg.seed + k)
        kept.setdefault(name, []).append(gains.tolist())
        write(path, json.dumps(kept, indent=2) + "\n")
    return {name: [np.array(gains) for gains in kept[name]] for name in worlds}


def _attempts(
    cfg: ActuatorConfig, worlds: dict[str, list[World]], gains: dict[str, list[np.ndarray]], held_out: References
) -> dict[str, list[DriveLog]]:
    """By simulator, what the controllers that were tuned in it do in `worlds`, each in that of its seed."""
    return {
        name: [attempt(worlds[name][k], held_out, gain, cfg.seed + k) for k, gain in enumerate(gains[name])]
        for name in gains
    }


def _models(cfg: ActuatorConfig, networks: Networks, logs: list[DriveLog]) -> dict[str, list[np.ndarray]]:
    """By model of the motor, the torques [M, T] that it says of the log of each seed."""
    said = {ANALYTIC: [analytic_torque(cfg.drive, log) for log in logs]}
    for name, trained in networks.items():
        said[name] = [predict(network, log) for network, log in zip(trained, logs, strict=True)]
    return said
