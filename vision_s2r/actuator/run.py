"""All of it: log the drive, make simulators of it, train policies in each, try them on the drive."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path

import numpy as np

from vision_s2r.actuator import models
from vision_s2r.actuator.analytic import analytic_torque
from vision_s2r.actuator.config import ActuatorConfig, check
from vision_s2r.actuator.drive import MotorDrive
from vision_s2r.actuator.log import DriveLog
from vision_s2r.actuator.measure import torque_errors, transfer
from vision_s2r.actuator.models import ANALYTIC, LONG, PAPER, MotorModel
from vision_s2r.actuator.network import ActuatorNetwork
from vision_s2r.actuator.pictures import draw
from vision_s2r.actuator.policy import DrivePolicy, World, attempt, learn
from vision_s2r.actuator.references import tasks
from vision_s2r.actuator.report import show, tables
from vision_s2r.actuator.training import predict
from vision_s2r.errors import UserError
from vision_s2r.files import differing, write
from vision_s2r.progress import tracked

FORMAT = "vision-s2r/actuator/2"


def run(cfg: ActuatorConfig) -> Path:
    """Do, or go on with, what cfg describes; returns the picture's path. What is there already stays.

    In `cfg.out`: settings.json; of each model of the motor and seed network-….safetensors or effects-….json, and
    policy-….safetensors; actuator.json, actuator.png. Raises UserError for settings that cannot be, or other ones than
    those of the run in the folder.
    """
    check(cfg)
    out = Path(cfg.out)
    path, settings = out / "settings.json", asdict(cfg)
    del settings["out"], settings["seeds"]  # more seeds may join
    if key := differing(path, settings):
        raise UserError(f"{path}: a run with another '{key}' is in this folder: choose another out=DIR or remove it")
    worlds = models.worlds(cfg, out)
    policies = _policies(cfg, worlds, out)
    references = tasks(cfg.task, cfg.task.tried_on, cfg.drive, np.random.default_rng([cfg.seed, 5]))
    itself = partial(MotorDrive, cfg.drive)

    def tried(where: Mapping[MotorModel, list[World]]) -> dict[MotorModel, list[DriveLog]]:
        return {
            model: [attempt(where[model][k], references, each, cfg.seed + k) for k, each in enumerate(some)]
            for model, some in policies.items()
        }

    own, drive = tried(worlds), tried({model: [itself] * cfg.seeds for model in worlds})
    longest = MotorModel(LONG, cfg.logs.minutes[-1])
    compared = {
        "validation": [models.log(cfg, cfg.logs.held_out, cfg.seed, 4)] * cfg.seeds,
        "policy": drive[longest],
    }
    torques = {name: _torques(cfg, out, logs) for name, logs in compared.items()}
    transferred = transfer(own, drive, cfg.task.tolerance, cfg.drive.sample_time)
    found = {
        "format": FORMAT,
        "settings": asdict(cfg),
        "torque": {name: torque_errors(logs, torques[name], cfg.drive.sample_time) for name, logs in compared.items()},
        "transfer": transferred,
    }
    write(out / "actuator.json", json.dumps(found, indent=1) + "\n")
    for name, table in (named := tables(found)).items():
        write(out / f"{name}.json", json.dumps(table, indent=1) + "\n")
    show(named)
    return draw(out / "actuator.png", cfg, compared, torques, transferred)


def _policies(
    cfg: ActuatorConfig, worlds: dict[MotorModel, list[World]], out: Path
) -> dict[MotorModel, list[DrivePolicy]]:
    """By model, a policy for each seed; what is in the folder already is not trained again."""
    jobs = [(model, k) for k in range(cfg.seeds) for model in worlds]
    found: dict[MotorModel, list[DrivePolicy]] = {model: [] for model in worlds}
    for model, k in tracked(jobs, len(jobs), "policies"):
        path = out / f"policy-{model}-{cfg.seed + k}.safetensors"
        if not path.exists():
            learn(worlds[model][k], cfg.task, cfg.policy, cfg.drive, cfg.seed + k).save(path)
        found[model].append(DrivePolicy.load(path))
    return found


def _torques(cfg: ActuatorConfig, out: Path, logs: list[DriveLog]) -> dict[str, list[np.ndarray]]:
    """The torques [M, T] that the analytic motor, and networks of all minutes, say of the log of each seed."""
    said = {ANALYTIC: [analytic_torque(cfg.drive, log) for log in logs]}
    for name in (PAPER, LONG):
        paths = [
            models.network_path(out, MotorModel(name, cfg.logs.minutes[-1]), cfg.seed + k) for k in range(len(logs))
        ]
        said[name] = [predict(ActuatorNetwork.load(path), log) for path, log in zip(paths, logs, strict=True)]
    return said
