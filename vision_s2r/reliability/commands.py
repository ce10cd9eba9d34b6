"""Commands that are killed at random moments and given again: the result is to be the same."""

import hashlib
import os
import secrets
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.gapbench.config import COUNTS

LEFT = 60.0  # s in which the workers of a command that was killed are to be gone
MARK = "VISION_S2R_RELIABILITY"  # in the environment of a command and its workers


@dataclass(frozen=True)
class KilledCommand:
    """A command: its words, given its folder, and which of its files are the result."""

    words: Callable[[Path], list[str]]
    result: tuple[str, ...]  # patterns below its folder


TASKS = {
    "render": KilledCommand(
        lambda out: [
            *("render", f"render.out={out}", "render.scenes=16", "render.shard_size=2", "render.size=32"),
            *("render.grasps=2", "render.workers=2"),
        ],
        ("manifest.json", "shard-*"),
    ),
    "gapbench": KilledCommand(
        lambda out: [
            *("gapbench", "stage=generate", "kind=joint", f"out={out}"),
            *(f"counts.{case}={4 * (case in ('null', 'single', 'pair'))}" for case in COUNTS),
        ],
        ("recordings/**/*",),
    ),
}


def killed(name: str, times: int, seed: int, folder: Path) -> dict[str, Any]:
    """SIGKILL a command so many times at random moments, each time let it go on to the end, and compare."""
    task, whole, seconds = _whole(name, folder)
    same, gone, moments = 0, 0, np.random.default_rng([seed, 1]).uniform(0.1, 1.0, times) * seconds
    for k, moment in enumerate(moments):
        out, mark = folder / f"killed-{k}", secrets.token_hex(8)
        process = _begin(task.words(out), mark)
        time.sleep(float(moment))
        process.kill()
        process.wait()
        gone += _left(mark) == []
        _end(task.words(out))
        same += _hashes(task, out) == whole
    return {"command": name, "times": times, "identical": same, "no workers left": gone, "seconds": round(seconds, 1)}


def _whole(name: str, folder: Path) -> tuple[KilledCommand, dict[str, str], float]:
    """The task, and of a run to the end: the result's hashes, and the seconds it took."""
    task, out = TASKS[name], folder / "whole"
    begun = time.perf_counter()
    _end(task.words(out))
    return task, _hashes(task, out), time.perf_counter() - begun


def _begin(words: list[str], mark: str) -> subprocess.Popen[bytes]:
    command, nothing = [sys.executable, "-m", "vision_s2r", *words], subprocess.DEVNULL
    return subprocess.Popen(command, env={**os.environ, MARK: mark}, stdout=nothing, stderr=nothing)


def _end(words: list[str]) -> None:
    done = subprocess.run([sys.executable, "-m", "vision_s2r", *words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise UserError(f"vision-s2r {' '.join(words)} ended with {done.returncode}: {done.stderr.strip()[-300:]}")


def _left(mark: str) -> list[str]:
    """The processes of a command that was killed which do not end either."""
    deadline = time.monotonic() + LEFT
    while (found := _marked(mark)) and time.monotonic() < deadline:
        time.sleep(0.5)
    return found


def _marked(mark: str) -> list[str]:
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if f"{MARK}={mark}".encode() in (process / "environ").read_bytes().split(b"\0"):
                found.append((process / "cmdline").read_text())
        except OSError:  # it has ended, or is another user's
            continue
    return [each for each in found if each]


def _hashes(task: KilledCommand, out: Path) -> dict[str, str]:
    paths = sorted(path for pattern in task.result for path in out.glob(pattern) if path.is_file())
    return {str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}
