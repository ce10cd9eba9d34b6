"""What happens to commands at random moments: SIGKILL, a full disk. Given again, the result is to be the same."""

import json
import logging
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.files import write
from vision_s2r.progress import tracked
from vision_s2r.reliability.tasks import DATA, MARK, TASKS, LongTask, begin, end, hashes

log = logging.getLogger(__name__)
LEFT = 60.0  # s in which the workers of a command that was killed are to be gone
ENOUGH = "1g"  # of a disk
PLACE = "place"  # where every run of a command works: some files say where they are from


@dataclass
class Whole:
    """A task whose command ran to its end undisturbed."""

    task: LongTask
    data: Path
    said: Path
    seconds: float  # that it takes at most
    size: int  # bytes of its folder
    hashes: dict[str, str]

    def words(self, out: Path) -> list[str]:
        """Of the same command for another folder."""
        return self.task.words(out, self.data)

    def again(self, out: Path) -> bool:
        """Give the command again; whether it comes to the same."""
        end(self.words(out), self.said)
        found = hashes(self.task, out)
        for name in sorted(found.keys() | self.hashes.keys()):
            if found.get(name) != self.hashes.get(name):
                log.warning("%s: %s differs", " ".join(self.words(out)), name)
        return found == self.hashes


Accident = Callable[[Whole, Path, np.random.Generator], dict[str, bool] | None]


def killed(whole: Whole, folder: Path, rng: np.random.Generator) -> dict[str, bool] | None:
    """SIGKILL a command; None where it was through before its moment came."""
    out, mark, begun = folder / "out", str(folder), time.perf_counter()
    process = begin(whole.words(out), whole.said, mark)
    process.join(rng.uniform(0, whole.seconds))
    process.kill()
    process.join()
    if process.exitcode == 0:
        whole.seconds = min(whole.seconds, time.perf_counter() - begun)
        return None
    gone = _left(mark) == []
    return {"identical": whole.again(out), "no workers left": gone}


def filled(whole: Whole, folder: Path, rng: np.random.Generator) -> dict[str, bool] | None:
    """Run a command on a disk that it fills, then on the same with room; None where it had room enough."""
    with _disk(folder, int(rng.uniform(0, whole.size))) as grow:
        process = begin(whole.words(folder / "out"), whole.said)
        process.join()
        if process.exitcode == 0:
            return None
        said = whole.said.read_text()
        errors = [line for line in said.splitlines() if line.startswith("error: ")]
        one_line = process.exitcode == 2 and len(errors) == 1 and "Traceback" not in said
        grow()
        return {"one line": one_line, "identical": whole.again(folder / "out")}


def accidents(name: str, accident: Accident, times: int, seed: int, kept: Path) -> dict[str, Any]:
    """So many accidents of a command, and how often each thing that is to be was.

    What is known so far is noted in the file `kept`, from where the same call goes on; data to start from are beside.
    """
    nothing: dict[str, Any] = {"command": name, "seed": seed, "times": 0, "tried": 0}
    found = json.loads(kept.read_text()) if kept.exists() else nothing
    if found["times"] >= times:
        return found
    with tempfile.TemporaryDirectory() as folder:
        whole = _whole(TASKS[name], kept.parent / "data", Path(folder))
        for _ in tracked(range(found["times"], times), times, name, found["times"]):
            outcome = None
            while outcome is None:
                place = Path(folder) / PLACE
                outcome = accident(whole, place, np.random.default_rng([seed, found["tried"]]))
                found["tried"] += 1
                shutil.rmtree(place, ignore_errors=True)
            found["times"] += 1
            found |= {key: found.get(key, 0) + value for key, value in outcome.items()}
            write(kept, json.dumps(found))
    return found


def _whole(task: LongTask, data: Path, folder: Path) -> Whole:
    out, said = folder / PLACE / "out", folder / "said.txt"
    if task.data:
        end(DATA.words(data, data), said)
    begun = time.perf_counter()
    end(task.words(out, data), said)
    seconds = time.perf_counter() - begun
    size = sum(path.stat().st_size for path in out.rglob("*"))
    found = hashes(task, out)
    shutil.rmtree(folder / PLACE)
    return Whole(task, data, said, seconds, size, found)


def _left(mark: str) -> list[str]:
    """The workers of a command that was killed which do not end either."""
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


@contextmanager
def _disk(folder: Path, size: int) -> Iterator[Callable[[], None]]:
    """A disk of so many bytes at `folder`, and what makes it large enough. Raises UserError for who cannot mount."""
    folder.mkdir()
    _mount("-t", "tmpfs", "-o", f"size={max(size, 4096)}", "tmpfs", str(folder))
    try:
        yield lambda: _mount("-o", f"remount,size={ENOUGH}", str(folder))
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=False)


def _mount(*words: str) -> None:
    done = subprocess.run(["mount", *words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise UserError(f"checks=[full] makes small disks, which needs root: {done.stderr.strip()}")
