"""Whether the recording that a diagnosis asks for settles what it left open, beside a random one of the same length.

Each machine whose first diagnosis did not name the truth does, by its own generator, what the report's
next_recording.csv asks, and in another trial what is drawn as recordings are (a camera photographs the report's print,
or scenes); both behind what was recorded before,
both diagnosed anew in a folder of their own. OUT/next/ID-WAY/ keeps recording and report, OUT/follow.json the counts.
"""

import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.gapbench.config import GapbenchConfig
from vision_s2r.gapbench.files import read_json
from vision_s2r.gapbench.generate import camera_next, contact, joint
from vision_s2r.gapbench.score.diagnoses import diagnose_apart, finished, run
from vision_s2r.gapbench.score.run import command, opened, scored
from vision_s2r.parallel import run as in_pieces
from vision_s2r.progress import tracked
from vision_s2r.results import publish
from vision_s2r.statistics import wilson

WAYS = {"asked": "the recording asked for", "random": "a random one of that length"}
KINDS: dict[str, tuple[str, Any]] = {
    "joint": ("joints", joint),
    "contact": ("tosses", contact),
    "camera": ("cameras", camera_next),
}


def follow_all(cfg: GapbenchConfig) -> Path:
    """Follow every unsettled diagnosis of a benchmark; prints and writes OUT/follow.json, its path.

    Raises UserError where there is no benchmark, or one of a kind that asks for no file to play.
    """
    out = Path(cfg.out)
    committed = read_json(out / "commitments.json")
    kind = committed["kind"]
    if kind not in KINDS:
        raise UserError(f"{out}: is a benchmark of kind {kind}, expected {' or '.join(KINDS)} to follow")
    answers = {name: each for name, each in opened(out, committed["commitments"]).items() if _has_one(each)}
    names = [name for name in run(cfg) if name in answers]
    first = {name: scored(out / "reports" / name, name, kind, answers[name]) for name in names}
    unsettled = [name for name in names if not first[name].exact]
    asking = [name for name in unsettled if (out / "reports" / name / "next_recording.csv").is_file()]
    calls = [(cfg, out, name, KINDS[kind][1], way, answers[name]) for name in asking for way in WAYS]
    for _ in tracked(in_pieces(_followed, calls, cfg.jobs, cfg.backend, threads=True), len(calls), "follow"):
        pass
    exact = {
        way: [scored(_folder(out, name, way) / "report", name, kind, answers[name]).exact for name in asking]
        for way in WAYS
    }
    rows: list[list[Any]] = [
        ["recordings", len(names)],
        ["of them not exact at first", len(unsettled)],
        ["of these that ask for a recording", len(asking)],
        *([f"of these exact with {WAYS[way]}", _share(each)] for way, each in exact.items()),
    ]
    return publish(out / "follow.json", f"{command(committed, cfg.limit)} stage=follow", ["", KINDS[kind][0]], rows)


def _has_one(answer: dict[str, Any]) -> bool:
    """Whether there is something to be named, and nothing that has no name."""
    return bool(answer["effects"]) and not answer["unknown"]


def _followed(cfg: GapbenchConfig, out: Path, name: str, machines: Any, way: str, answer: dict[str, Any]) -> None:
    """Record and diagnose once more; what is finished stays."""
    folder, before = _folder(out, name, way), out / "recordings" / name
    if finished(folder / "report"):
        return
    rng = np.random.default_rng([cfg.seed, int(name, 16), list(WAYS).index(way)])
    played = machines.asked(out / "reports" / name, before, answer)
    if way == "random":
        played = machines.at_random(before, answer, played, rng)
    shutil.rmtree(folder, ignore_errors=True)
    machines.continued(before, folder / "recording", answer, played, rng)
    diagnose_apart(cfg, folder / "recording", folder / "report")


def _folder(out: Path, name: str, way: str) -> Path:
    return out / "next" / f"{name}-{way}"


def _share(exact: list[bool]) -> Any:
    if not exact:
        return "–"
    found = {key: round(100 * value, 1) for key, value in asdict(wilson(sum(exact), len(exact))).items()}
    return {**found, "unit": "%", "of": len(exact)}
