"""All checks, and the tables of what came of them."""

import json
import logging
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from vision_s2r.errors import UserError, nearest
from vision_s2r.files import write
from vision_s2r.options import validate
from vision_s2r.reliability.accidents import Accident, accidents, filled, killed
from vision_s2r.reliability.config import ReliabilityConfig
from vision_s2r.reliability.fuzz import OUTCOMES, fuzz
from vision_s2r.reliability.memory import grown
from vision_s2r.reliability.samples import READERS
from vision_s2r.reliability.tasks import TASKS

ACCIDENTS: dict[str, Accident] = {"kill": killed, "full": filled}
log = logging.getLogger(__name__)


def reliability(cfg: ReliabilityConfig) -> list[Path]:
    """Do the checks of cfg; returns a table (JSON) of each. Raises UserError for names that are not there."""
    validate(cfg)
    readers, tasks = _chosen("readers", cfg.readers, READERS), _chosen("commands", cfg.commands, TASKS)
    written = []
    for check in cfg.checks:
        if check == "fuzz":
            found = [fuzz(name, cfg.inputs, cfg.seed, _kept(cfg, check, name)) for name in readers]
            rows = [_fuzz_row(each) for each in found]
            columns = ["reader", "spoilt inputs", *OUTCOMES.values()]
        elif check == "memory":
            found = [grown(cfg.renders, cfg.seed)]
            columns = [key for key in found[0] if key != "held"]
            rows = [[found[0][key] for key in columns]]
        else:
            accident = ACCIDENTS[check]
            found = [accidents(name, accident, cfg.times, cfg.seed, _kept(cfg, check, name)) for name in tasks]
            columns = [key for key in found[0] if key not in ("seed", "tried")]
            rows = [[each[key] for key in columns] for each in found]
        command = f"vision-s2r reliability checks=[{check}]"
        content = {"command": command, "seed": cfg.seed, "columns": columns, "rows": rows, "found": found}
        written.append(write(Path(cfg.out) / f"reliability_{check}.json", json.dumps(content, indent=1) + "\n"))
    return written


def _kept(cfg: ReliabilityConfig, check: str, name: str) -> Path:
    return Path(cfg.out) / check / f"{name}-{cfg.seed}.json"


def _chosen(key: str, names: list[str], known: Iterable[str]) -> list[str]:
    known = list(known)
    for name in names:
        if name not in known:
            raise UserError(f"{key}: nothing is called '{name}', {nearest(name, known)}")
    return names or known


def _fuzz_row(found: dict[str, Any]) -> list[Any]:
    for why, how in found["failures"].items():
        log.warning("%s: %s (%s)", found["reader"], why, how)
    return [found["reader"], found["inputs"], *(found["outcomes"].get(key, 0) for key in OUTCOMES)]
