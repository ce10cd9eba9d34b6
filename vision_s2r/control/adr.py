"""The experiment: automatic domain randomization against hand-picked ranges (OpenAI et al. 2019, section 5)."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r import files, results
from vision_s2r.control import pictures, report
from vision_s2r.control.config import ControlConfig, check, episode_samples
from vision_s2r.control.effects import CONTROL_EFFECTS
from vision_s2r.control.machines import AdrRanges, Controller, DrawnMachines, Given, Values
from vision_s2r.control.policy import Policy
from vision_s2r.control.progress import machines_of
from vision_s2r.control.realities import targets
from vision_s2r.control.teacher import taught
from vision_s2r.control.tracking import track
from vision_s2r.control.training_jobs import (
    Source,
    box_of,
    drawn,
    folder,
    nominal_of,
    nominal_values,
    reality_of,
    trained_on,
)
from vision_s2r.control.trials import summary, tried
from vision_s2r.errors import UserError, nearest
from vision_s2r.randomize import AdrConfig, AutomaticDomainRandomization, dimensions, sample_at
from vision_s2r.randomize.coverage import covered_of_box

AUTOMATIC, AFRESH, RIVAL = "automatic", "afresh in its ranges", "hand-picked"
SETS = ("reality", "outside the hand-picked ranges")


def adr(cfg: ControlConfig) -> Path:
    """Train under ranges that adr, afresh in those they end with, and under hand-picked ones; compare.

    Each training is as long. A policy that began on one joint remembers: what the ranges are worth by themselves, one
    that was trained in them from the first step on tells. Returns the picture's path.

    adr.json: `ranges` [seeds] of each parameter in the end, beside the `hand_picked` and `reality`'s; `steps`,
    `entropy` (nats per dimension, null while a range is a point), `coverage` of reality's ranges and `performance`
    (targets reached within the ranges) at each of them, [seeds, times]; `table`, by policy and set of machines what
    follow.json has of a reality.
    """
    check(cfg)
    if cfg.adr.rival not in cfg.policies:
        raise UserError(f"adr.rival: no policy '{cfg.adr.rival}', {nearest(cfg.adr.rival, cfg.policies)}")
    rival = cfg.policies[cfg.adr.rival]
    # What counts as reached in training is the ranges' own affair; what is reported is the task's.
    training = replace(cfg, task=replace(cfg.task, tolerance=cfg.adr.tolerance))
    sources = {
        AUTOMATIC: Source(lambda seed: adr_ranges(training, seed), cfg.adr.history, "imitation", recurrent=True),
        RIVAL: drawn(cfg, replace(rival, history=cfg.adr.history, method="imitation", recurrent=True)),
    }
    policies = trained_on(training, sources, cfg.seeds, cfg.adr.steps)
    histories = [machines_of(folder(cfg, AUTOMATIC, cfg.seed + k))["history"] for k in range(cfg.seeds)]
    found_ranges = [box_of(cfg, history[-1]["ranges"]) for history in histories]
    afresh = Source(
        lambda seed: DrawnMachines(found_ranges[seed - cfg.seed]), cfg.adr.history, "imitation", recurrent=True
    )
    policies |= trained_on(training, {AFRESH: afresh}, cfg.seeds, cfg.adr.steps)
    rows = _table(cfg, policies)
    found = {
        "hand_picked": rival.effects,
        "reality": cfg.adr.reality,
        "ranges": [history[-1]["ranges"] for history in histories],
        "steps": [_update(cfg) * each["update"] for each in histories[0]],
        "performance": [[each["performance"] for each in history] for history in histories],
        "entropy": files.finite([[each["entropy"] for each in history] for history in histories]),
        "coverage": [[_coverage(cfg, each["ranges"]) for each in history] for history in histories],
        "hand_picked_coverage": _coverage(cfg, rival.effects),
        "table": rows,
    }
    found |= report.adr(cfg, found)
    out = Path(cfg.out)
    files.write(out / "adr.json", json.dumps(found, indent=1))
    results.show(found)
    return pictures.adr(out / "adr.png", found)


def _table(cfg: ControlConfig, policies: Mapping[str, list[Policy]]) -> dict[str, dict[str, Any]]:
    count = cfg.adr.machines
    wanted = targets(cfg.task, count, cfg.seed)
    rows: dict[str, dict[str, Any]] = {name: {} for name in (*policies, report.CEILING)}
    for title, effects in zip(SETS, (cfg.adr.reality, cfg.adr.outside), strict=True):
        machines = Given(sample_at(reality_of(cfg, effects), cfg.seed, range(count)))
        for name, some in policies.items():
            rows[name][title] = summary(cfg, tried(cfg, some, machines, wanted))
        best = taught(cfg.task, nominal_of(cfg), machines, wanted, cfg.imitation.effort, cfg.seed)
        rows[report.CEILING][title] = summary(cfg, best[None])
    return rows


def _coverage(cfg: ControlConfig, ranges: Mapping[str, Mapping[str, Any]]) -> float:
    """The share of reality's box that ranges cover; what they leave out is nominal."""
    return covered_of_box(box_of(cfg, ranges), reality_of(cfg, cfg.adr.reality))


def _update(cfg: ControlConfig) -> int:
    """Environment steps between two words to the machines."""
    return cfg.imitation.envs * episode_samples(cfg.task)


def adr_ranges(cfg: ControlConfig, seed: int) -> AdrRanges:
    """Machines that get harder while a policy reaches enough targets on those at a boundary."""

    nominal = nominal_of(cfg)

    def reached(policy: Controller, values: Values, update: int) -> np.ndarray:
        """Of a whole episode, by the share of what can be reached at all: no policy turns a motor that is too weak."""
        wanted = targets(cfg.task, cfg.adr.evaluations, update)
        machines = Given(values)
        errors = track(policy, cfg.task, nominal, machines, wanted, update)
        least = taught(cfg.task, nominal, machines, wanted, cfg.imitation.effort, update)
        own, best = (np.abs(each) < cfg.task.tolerance for each in (errors, least))
        return cfg.task.targets * (own & best).sum(axis=1) / np.maximum(best.sum(axis=1), 1)

    last = round(cfg.adr.until * cfg.adr.steps / _update(cfg))
    return AdrRanges(automatic(cfg, seed), reached, cfg.adr.evaluations, cfg.adr.every, last)


def automatic(cfg: ControlConfig, seed: int) -> AutomaticDomainRandomization:
    """Ranges that begin at the nominal joint; UserError for limits that cannot be."""
    keys = ("buffer", "threshold_high", "threshold_low", "step", "boundary_probability")
    return AutomaticDomainRandomization(
        dimensions(cfg.adr.limits, CONTROL_EFFECTS, nominal_values(cfg), "adr.limits"),
        CONTROL_EFFECTS,
        AdrConfig(**{key: getattr(cfg.adr, key) for key in keys}),
        seed,
    )
