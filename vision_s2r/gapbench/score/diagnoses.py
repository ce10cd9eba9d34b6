"""Diagnose the recordings, each by a process that sees nothing but that recording.

OUT/reports/ID/ keeps what the diagnosis wrote and `run.json`: the exit code, the seconds it took (by the clock; of
processors, where it is one at a time) and its last words.
"""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from vision_s2r.errors import UserError
from vision_s2r.gapbench.config import GapbenchConfig
from vision_s2r.gapbench.files import read_json, write_json
from vision_s2r.parallel import run as in_pieces
from vision_s2r.progress import tracked

_DIAGNOSE = [sys.executable, "-m", "vision_s2r", "diagnose"]
_LAST_WORDS = 2000  # characters


def run(cfg: GapbenchConfig) -> list[str]:
    """Diagnose what has no finished report yet; returns the IDs that are scored.

    Raises UserError where there is no benchmark, or a recording is gone.
    """
    out = Path(cfg.out)
    committed = read_json(out / "commitments.json")
    names = sorted(committed["commitments"])[: cfg.limit or None]
    gone = [name for name in names if not (out / "recordings" / name).is_dir()]
    if gone:
        raise UserError(f"{out / 'recordings' / gone[0]}: the recording is gone")
    waiting = [name for name in names if not finished(out / "reports" / name)]
    (out / "reports").mkdir(exist_ok=True)
    calls = ((cfg, out, name, committed["withheld"].get(name)) for name in waiting)
    done = in_pieces(_one, calls, cfg.jobs, cfg.backend, ordered=False, threads=True)
    for _ in tracked(done, len(waiting), "score"):
        pass
    return names


def finished(folder: Path) -> bool:
    """Whether a diagnosis ended with a report; one that failed is tried again."""
    return (folder / "run.json").is_file() and read_json(folder / "run.json")["exit"] == 0


def _one(cfg: GapbenchConfig, out: Path, name: str, withhold: str | None) -> None:
    diagnose_apart(cfg, out / "recordings" / name, out / "reports" / name, withhold)


def diagnose_apart(cfg: GapbenchConfig, recording: Path, reports: Path, withhold: str | None = None) -> None:
    """Diagnose a recording in an otherwise empty folder; `reports` gets what was written, and run.json."""
    with tempfile.TemporaryDirectory() as empty:
        home = Path(empty)
        shutil.copytree(recording, home / "recording")
        told = _diagnosed(cfg, home, withhold)
        report = home / "report"
        report.mkdir(exist_ok=True)
        write_json(report / "run.json", told)
        shutil.rmtree(reports, ignore_errors=True)
        partial = reports.with_name(f"{reports.name}.partial")
        shutil.rmtree(partial, ignore_errors=True)
        shutil.copytree(report, partial)
        partial.rename(reports)


def _diagnosed(cfg: GapbenchConfig, home: Path, withhold: str | None) -> dict[str, Any]:
    """Run the command in a folder that holds a recording and nothing else."""
    threads = max(1, (os.cpu_count() or 1) // cfg.jobs)
    command = cfg.diagnose or _DIAGNOSE
    arguments = [f"recording={home / 'recording'}", f"out={home / 'report'}", f"jobs={threads}"]
    arguments += [f"withhold=[{withhold}]"] if withhold else []
    limits = {key: str(threads) for key in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
    begin, spent = time.perf_counter(), _of_processors()
    try:
        done = subprocess.run(
            [*command, *arguments],
            cwd=home,
            env={**os.environ, **limits},
            capture_output=True,
            text=True,
            timeout=cfg.timeout,
            check=False,
        )
        code, words = done.returncode, done.stderr
    except subprocess.TimeoutExpired:
        code, words = 124, f"stopped after {cfg.timeout:g} s"
    if code == 0 and not (home / "report" / "report.json").is_file():
        code, words = 1, "it wrote no report.json"
    told = {"exit": code, "seconds": time.perf_counter() - begin, "stderr": words[-_LAST_WORDS:]}
    if cfg.jobs == 1:  # else nobody knows whose they are
        told["processor"] = _of_processors() - spent
    return told


def _of_processors() -> float:
    """Seconds of all processors that finished diagnoses took."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
