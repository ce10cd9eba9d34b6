"""Small commands that things are done to, and what of their files is the result."""

import hashlib
import multiprocessing
import os
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import torch
from joblib.externals.loky import get_reusable_executor

from vision_s2r.commands.main import main
from vision_s2r.errors import UserError
from vision_s2r.gapbench.config import COUNTS
from vision_s2r.training.checkpoint import load_state
from vision_s2r.training.loop import BEST, LAST

MARK = "VISION_S2R_RELIABILITY"  # in the environment of a command's workers
SETS = ("pairs", "train", "validation", "real", "test")
# What all commands import: a process that has done so is copied for each, so that its moments are those of its work.
IMPORTED = (
    *("vision_s2r.commands.visual", "vision_s2r.ablation.sweep", "vision_s2r.gapbench.bench"),
    *("vision_s2r.gapbench.generate.generate", "torch.utils.tensorboard"),
)


@dataclass(frozen=True)
class LongTask:
    """A command: its words, given its folder and that of the data it starts from, and its files that are the result."""

    words: Callable[[Path, Path], list[str]]
    result: tuple[str, ...]  # patterns below its folder
    data: bool = False  # whether it starts from rendered scenes and a policy


def _rendered(workers: int) -> LongTask:
    words = ["render", "render.scenes=6", "render.shard_size=2", "render.size=32", "render.grasps=2"]
    return LongTask(
        lambda out, _: [*words, f"render.workers={workers}", f"render.out={out}"], ("manifest.json", "shard-*")
    )


def _generated(jobs: int) -> LongTask:
    counts = [f"counts.{case}={2 * (case in ('null', 'single', 'pair'))}" for case in COUNTS]
    words = ["gapbench", "stage=generate", "kind=joint", *counts, f"jobs={jobs}"]
    return LongTask(lambda out, _: [*words, f"out={out}"], ("recordings/**/*",))


def _on_data(words: list[str], *result: str, policy: str = "") -> LongTask:
    def every(out: Path, data: Path) -> list[str]:
        more = [policy.format(data / "policy-0" / BEST)] if policy else []
        return [*words, *(f"data.{name}.out={data / name}" for name in SETS), *more, f"out={out}"]

    return LongTask(every, result, data=True)


_STEPS = "training.max_steps=8"
_TRAINED = (f"**/{BEST}", f"**/{LAST}", "**/pictures/*")
DATA = _on_data(["ablate", "ablation=debug", "ablation.variants=[full]"])  # renders all sets, and trains a policy
TASKS = {
    "render": _rendered(1),
    "translate": _on_data(["translate", "experiment=debug", f"translate.{_STEPS}"], *_TRAINED),
    "adapt": _on_data(["adapt", "experiment=debug", f"adapt.{_STEPS}"], *_TRAINED, policy="adapt.policy={}"),
    "ablate": _on_data(
        ["ablate", "ablation=debug", "ablation.variants=[full,no_depth]"],
        *("ablation.*", "**/result.json", *_TRAINED),
        policy="ablation.policy=[{}]",
    ),
    "gapbench": _generated(1),
    "run": _on_data(["run", "experiment=debug", "seeds=2"], f"**/{BEST}", "table.json"),
    "render by 2 workers": _rendered(2),
    "gapbench by 2 workers": _generated(2),
}


def begin(words: list[str], said: Path, mark: str = "") -> BaseProcess:
    """A process with a command, whose standard streams go to the file `said`; `mark` is to be seen in its workers."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(IMPORTED))
    process = context.Process(target=_command, args=(words, said, mark))
    process.start()
    return process


def end(words: list[str], said: Path) -> None:
    """Let a command run to its end. Raises UserError where that is none."""
    process = begin(words, said)
    process.join()
    if process.exitcode:
        raise UserError(f"vision-s2r {' '.join(words)} ended with {process.exitcode}: {said.read_text()[-300:]}")


def _command(words: list[str], said: Path, mark: str) -> None:
    with said.open("w") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    os.environ[MARK] = mark
    sys.argv = ["vision-s2r", *words]
    try:
        main()
    except Exception:
        traceback.print_exc()
        raise
    finally:
        get_reusable_executor().shutdown()  # as a process of its own does at its exit


def hashes(task: LongTask, out: Path) -> dict[str, str]:
    """Of each file of a command's result; of a training's state without the seconds it took.

    What was being written when a command was killed stays beside it, and is no result.
    """
    found = {}
    paths = {path for pattern in task.result for path in out.glob(pattern) if path.is_file() and path.suffix != ".tmp"}
    for path in sorted(paths):
        digest = hashlib.sha256()
        if path.name == LAST:
            _digest({key: value for key, value in load_state(path).items() if key != "seconds"}, digest.update)
        else:
            digest.update(path.read_bytes())
        found[str(path.relative_to(out))] = digest.hexdigest()
    return found


def _digest(content: Any, update: Callable[[bytes], None]) -> None:
    if isinstance(content, dict | list | tuple):
        for key, value in content.items() if isinstance(content, dict) else enumerate(content):
            update(repr(key).encode())
            _digest(value, update)
    else:
        update(content.numpy().tobytes() if isinstance(content, torch.Tensor) else repr(content).encode())
