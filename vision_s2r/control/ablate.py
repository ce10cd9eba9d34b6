"""The experiment: what each randomization is worth, one frozen at a time (Peng et al., ICRA 2018, Table III)."""

import json
from dataclasses import replace
from pathlib import Path

from vision_s2r import files, results
from vision_s2r.control import pictures, report
from vision_s2r.control.config import ControlConfig, PolicyConfig, check
from vision_s2r.control.machines import Given
from vision_s2r.control.realities import targets
from vision_s2r.control.training_jobs import reality_of, trained
from vision_s2r.control.trials import summary, tried
from vision_s2r.errors import UserError, nearest
from vision_s2r.randomize import sample_at

ALL, NONE = "everything randomized", "nothing randomized"


def ablate(cfg: ControlConfig) -> Path:
    """Train with everything randomized, each group frozen in turn, and nothing; try all on reality's machines.

    ablate.json has in `table` for each: `reached`, `targets` and `error` as in follow.json; `columns` and `rows`, all
    of this as a table. Returns the picture's path.
    """
    check(cfg)
    policies = {f"ablation {name}": policy for name, policy in frozen(cfg).items()}
    policies_by_name = trained(cfg, policies, cfg.ablation.seeds, cfg.ablation.steps)
    count = cfg.ablation.machines
    machines = Given(sample_at(reality_of(cfg, cfg.ablation.reality), cfg.seed, range(count)))
    wanted = targets(cfg.task, count, cfg.seed)
    rows = {}
    for name, some in policies_by_name.items():
        rows[name.removeprefix("ablation ")] = summary(cfg, tried(cfg, some, machines, wanted))
    out = Path(cfg.out)
    found = {"table": rows, **report.ablate(cfg, rows)}
    files.write(out / "ablate.json", json.dumps(found, indent=1))
    results.show(found)
    return pictures.ablate(out / "ablate.png", rows)


def frozen(cfg: ControlConfig) -> dict[str, PolicyConfig]:
    """The policies, by what they are trained with; UserError for a group with effects that are not randomized."""
    effects = cfg.ablation.policy.effects
    policies = {ALL: cfg.ablation.policy}
    for name, group in cfg.ablation.groups.items():
        for effect in group:
            if effect not in effects:
                raise UserError(f"ablation group '{name}': {effect} is not randomized, {nearest(effect, effects)}")
        left = {effect: given for effect, given in effects.items() if effect not in group}
        policies[f"{name} frozen"] = replace(cfg.ablation.policy, effects=left)
    return {**policies, NONE: replace(cfg.ablation.policy, effects={})}
