"""Work in pieces, on this machine's cores or on a Ray cluster: the one place that chooses."""

import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

import joblib

from vision_s2r.errors import UserError
from vision_s2r.options import option

R = TypeVar("R")
BACKENDS = ("local", "ray")
AHEAD = 2  # pieces a core that a cluster is given at a time: one under way, one waiting


def backend_option() -> Any:
    """The key of a configuration that chooses."""
    return option(
        "local",
        "Where pieces of work run: local (processes of this machine), or ray (the cluster of RAY_ADDRESS, whose nodes "
        "share the folders; without it one of this machine alone).",
        choices=BACKENDS,
    )


def run(
    function: Callable[..., R],
    calls: Iterable[tuple[Any, ...]],
    jobs: int,
    backend: str = "local",
    *,
    ordered: bool = True,
    threads: bool = False,
) -> Iterator[R]:
    """What `function` returns for the arguments of each call, in their order unless not `ordered`.

    `jobs` are at a time, -1: as many as there are cores. What a call raises is raised here. `threads`: of this machine,
    where each call is a process of its own anyway. On a cluster, calls in flight on a node that dies are repeated
    elsewhere: they must be such that it does no harm. Raises UserError where Ray is asked for and not there.
    """
    if backend == "ray":
        return _on_ray(function, calls, jobs, ordered)
    kind = "generator" if ordered else "generator_unordered"
    parallel = joblib.Parallel(jobs, backend="threading" if threads else "loky", return_as=kind)
    found: Iterator[R] = parallel(joblib.delayed(_watched)(os.getpid(), function, call) for call in calls)
    return found


def _watched(parent: int, function: Callable[..., R], call: tuple[Any, ...]) -> R:
    """In a worker, which ends when the process that it works for was killed: by itself it would wait for ever."""
    if os.getpid() != parent:
        _watch(parent)
    return function(*call)


@cache
def _watch(parent: int) -> None:
    threading.Thread(target=_outlive, args=(parent,), daemon=True).start()


def _outlive(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)


def _on_ray(function: Callable[..., R], calls: Iterable[tuple[Any, ...]], jobs: int, ordered: bool) -> Iterator[R]:
    ray = _ray()
    # -1: a node that dies is no reason to end. What `function` itself raises is not tried again.
    remote = ray.remote(num_cpus=1, max_retries=-1)(_here)
    waiting, ready, place = enumerate(calls), {}, Path.cwd()
    flying: dict[Any, int] = {}
    wanted = 0
    try:
        while True:
            room = (jobs if jobs > 0 else AHEAD * _cores(ray)) - len(flying)
            for number, call in islice(waiting, max(room, 0)):
                flying[remote.remote(place, function, call)] = number
            if not flying:
                return
            done, _ = ray.wait(list(flying))
            number = flying.pop(done[0])
            result = _got(ray, done[0])
            if not ordered:
                yield result
                continue
            ready[number] = result
            while wanted in ready:
                yield ready.pop(wanted)
                wanted += 1
    finally:
        for each in flying:
            with suppress(Exception):  # a cluster that is gone has nothing to cancel
                ray.cancel(each, force=True)


def _here(place: Path, function: Callable[..., R], call: tuple[Any, ...]) -> R:
    """On a node, in the folder that relative paths are meant from."""
    place.mkdir(parents=True, exist_ok=True)
    os.chdir(place)
    return function(*call)


def _ray() -> Any:
    try:
        import ray
    except ImportError as error:
        raise UserError("backend = ray needs pip install 'vision-s2r[ray]'") from error
    if not ray.is_initialized():
        os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
        try:
            ray.init(configure_logging=False, include_dashboard=False)
        except ConnectionError as error:
            address = os.environ.get("RAY_ADDRESS", "")
            raise UserError(f"RAY_ADDRESS = {address}: no cluster answers there") from error
    return ray


def _cores(ray: Any) -> int:
    """Of all nodes that live now."""
    return max(1, int(ray.cluster_resources().get("CPU", 1)))


def _got(ray: Any, reference: Any) -> Any:
    """A call's result; what it raised, without the traceback of the node around it."""
    try:
        return ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        raise error.cause from None
