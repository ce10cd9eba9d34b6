"""The one progress bar of work that comes in pieces."""

from collections.abc import Iterable, Iterator
from multiprocessing import current_process
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

T = TypeVar("T")


def bar() -> Progress:
    """A bar on standard error with an estimate of the time left; silent but in the main process.

    Bars of several processes would overwrite each other.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    return Progress(*columns, console=Console(stderr=True), disable=current_process().name != "MainProcess")


def tracked(items: Iterable[T], total: int, title: str, completed: int = 0) -> Iterator[T]:
    """The items, counted on a bar; `completed` were done before."""
    with bar() as progress:
        task = progress.add_task(title, total=total, completed=completed)
        for item in items:
            progress.advance(task)
            yield item
