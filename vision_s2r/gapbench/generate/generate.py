"""Generate a benchmark: recordings under meaningless names, commitments to the answers, and the answers apart.

    OUT/recordings/ID/     one recording each; all that a diagnosis may see
    OUT/commitments.json   what was drawn, for each ID the SHA-256 of its salt and answer, and the effects that the
                           diagnosis of some is to be told to forget
    OUT/answers.json        the salts and answers: nothing reads it before scoring

The same seed gives the same recordings, names and answers. Salts come from the system: the commitments tell nothing
about the answers, and no answer can be changed once they are published.
"""

import importlib
import secrets
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.gapbench.config import KINDS, GapbenchConfig
from vision_s2r.gapbench.files import commitment, read_json, write_json
from vision_s2r.gapbench.generate.base import CASES, SPLITS
from vision_s2r.parallel import run as in_pieces
from vision_s2r.progress import tracked

FORMAT = "vision-s2r/gapbench/1"


def generate(cfg: GapbenchConfig) -> Path:
    """Draw and write what the configuration asks for; returns its folder. A finished benchmark is left as it is.

    Raises UserError where the folder holds another benchmark.
    """
    out = Path(cfg.out)
    drawn = _contents(cfg)
    if (out / "commitments.json").exists():
        committed = read_json(out / "commitments.json")
        if any(committed.get(key) != value for key, value in drawn.items()):
            raise UserError(f"{out}: holds another benchmark; give another out= or remove it")
        print(f"{out}: drawn already", file=sys.stderr)
        return out
    (out / "recordings").mkdir(parents=True, exist_ok=True)
    jobs = [(case, index) for case, count in drawn["counts"].items() for index in range(count)]
    options = of_kind(cfg)
    calls = ((cfg.kind, cfg.set, cfg.seed, case, index, out, options) for case, index in jobs)
    machines = in_pieces(_one, calls, cfg.jobs, cfg.backend)
    answers = dict(sorted(tracked(machines, len(jobs), f"generate {cfg.kind} {cfg.set}")))
    salts = {name: secrets.token_hex(16) for name in answers}
    write_json(out / "answers.json", {name: {"salt": salts[name], "answer": answers[name]} for name in answers})
    promised = {name: commitment(salts[name], answers[name]) for name in answers}
    withheld = {name: answer["withhold"] for name, answer in answers.items() if answer["withhold"]}
    write_json(out / "commitments.json", {**drawn, "commitments": promised, "withheld": withheld})
    return out


def _contents(cfg: GapbenchConfig) -> dict[str, Any]:
    known = cases_of(cfg.kind)
    counts = {case: count for case, count in cfg.counts.items() if case in known and count}
    if not counts:
        raise UserError(f"gapbench: counts has no case of kind {cfg.kind}; known: {', '.join(known)}")
    return {"format": FORMAT, "kind": cfg.kind, "set": cfg.set, "seed": cfg.seed, **of_kind(cfg), "counts": counts}


def of_kind(cfg: GapbenchConfig) -> dict[str, Any]:
    """What is asked of machines of this kind alone: arguments of its `machine`."""
    return {"arms": cfg.arms, "rate": cfg.rate} if cfg.kind == "arm" else {}


def cases_of(kind: str) -> tuple[str, ...]:
    """The cases that a kind of machine has."""
    found: tuple[str, ...] = _module(kind).CASES
    return found


def _module(kind: str) -> Any:
    return importlib.import_module(f"vision_s2r.gapbench.generate.{kind}")


def stream(kind: str, split: str, seed: int, case: str, index: int) -> tuple[str, np.random.Generator]:
    """A machine's name, and the random numbers that it is drawn by."""
    rng = np.random.default_rng([seed, KINDS.index(kind), SPLITS.index(split), CASES.index(case), index])
    return rng.bytes(6).hex(), rng


def _one(
    kind: str, split: str, seed: int, case: str, index: int, out: Path, options: dict[str, Any]
) -> tuple[str, dict[str, Any]]:
    """Draw one machine and write its recording, whole or not at all. Raises UserError where it cannot be written."""
    name, rng = stream(kind, split, seed, case, index)
    machine = _module(kind).machine(case, index, split, rng, **options)
    partial, folder = out / f"{name}.partial", out / "recordings" / name
    for stale in (partial, folder):
        shutil.rmtree(stale, ignore_errors=True)
    try:
        partial.mkdir()
        machine.write(partial)
        partial.rename(folder)
    except OSError as error:
        raise UserError(f"{folder}: cannot be written ({error.strerror or error})") from error
    return name, machine.answer.to_dict()
