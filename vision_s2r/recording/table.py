"""Tables of a recording: comma-separated rows, each of one sample of one episode."""

import io
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

from vision_s2r.errors import UserError, nearest

LARGEST_VALUE = 1e9  # beyond it nothing is a position, speed or current
RATE_TOLERANCE = 0.01  # of the sample time, for the mean step; steps that keep to it are even


def columns(path: Path, check_names: Callable[[list[str], Path], None]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Every column by name, float64 [rows], and the line of the file that each row stands in.

    Raises UserError for a file that is no such table, and what `check_names` raises.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}), expected the rows of the recording") from error
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: is not text, expected comma-separated values") from error
    first, *rest = text.split("\n")
    names = [name.strip().strip('"') for name in first.split(",")]
    check_names(names, path)
    lines = np.array([k for k, line in enumerate(rest, start=2) if line.strip()], dtype=np.int64)
    if not len(lines):
        raise UserError(f"{path}: no row under the header, expected one a sample")
    table = _table(text[len(first) + 1 :], rest, len(names), path)
    found = dict(zip(names, table.T, strict=True))
    check_values(found, lines, path)
    return found, lines


def check_names(
    names: Sequence[str],
    known: Collection[str],
    needed: Iterable[str],
    path: Path,
    meant: Mapping[str, str] = MappingProxyType({}),
) -> None:
    """UserError unless the names of columns are all `known` and different, and every `needed` one is there.

    `meant`: what people call a column, and its name.
    """
    for name in names:
        if name not in known:
            shown = "".join(letter for letter in name if letter.isprintable())[:40]
            hint = f"did you mean '{meant[name]}'?" if name in meant else nearest(name[:40], known)
            raise UserError(f"{path}: unknown column '{shown}', {hint}")
        if names.count(name) > 1:
            raise UserError(f"{path}: two columns are called '{name}'")
    missing = [name for name in needed if name not in names]
    if missing:
        raise UserError(f"{path}: missing column {', '.join(missing)}")


def text(names: Sequence[str], rows: np.ndarray) -> str:
    """The file of rows [N, columns] under these names, the first column whole numbers."""
    file = io.StringIO()
    np.savetxt(file, rows, ["%d"] + ["%.9g"] * (len(names) - 1), ",", header=",".join(names), comments="")
    return file.getvalue()


def check_values(columns: Mapping[str, np.ndarray], lines: np.ndarray, path: Path) -> None:
    """UserError for the first value that is no finite number."""
    for name, column in columns.items():
        wrong = np.flatnonzero(~(np.abs(column) <= LARGEST_VALUE))
        if len(wrong):
            raise UserError(f"{path}, line {lines[wrong[0]]}: {name} is {column[wrong[0]]:g}, expected a finite number")


def episodes(numbers: np.ndarray, lines: np.ndarray, path: Path) -> dict[int, np.ndarray]:
    """The rows of each episode, in the order of their first."""
    wrong = np.flatnonzero(numbers != np.round(numbers))
    if len(wrong):
        at = wrong[0]
        raise UserError(f"{path}, line {lines[at]}: episode is {numbers[at]:g}, expected a whole number")
    found, start = np.unique(numbers, return_index=True)
    order = np.argsort(numbers, kind="stable")
    rows = np.split(order, np.searchsorted(numbers[order], found[1:]))
    return {int(found[k]): rows[k] for k in np.argsort(start)}


def padded(values: np.ndarray, episodes: Sequence[np.ndarray], fill: float) -> np.ndarray:
    """A column [rows, …] by episode: [E, T, …], with `fill` after the end of those that are shorter."""
    out = np.full((len(episodes), max(map(len, episodes)), *values.shape[1:]), fill)
    for row, rows in zip(out, episodes, strict=True):
        row[: len(rows)] = values[rows]
    return out


def _table(body: str, rows: list[str], width: int, path: Path) -> np.ndarray:
    try:
        table = np.loadtxt(io.StringIO(body), delimiter=",", comments=None, ndmin=2)
        if table.shape[1] == width:
            return table
    except (ValueError, OverflowError):
        pass
    for line, row in enumerate(rows, start=2):  # only now, to name the line
        cells = row.split(",")
        if row.strip() and len(cells) != width:
            raise UserError(f"{path}, line {line}: {len(cells)} values, expected {width}")
        for cell in cells if row.strip() else []:
            try:
                float(cell)
            except ValueError:
                shown = "".join(letter for letter in cell if letter.isprintable())[:40]
                raise UserError(f"{path}, line {line}: '{shown}' is not a number") from None
    raise UserError(f"{path}: is not a table of numbers")


def time_steps(t: np.ndarray, lines: np.ndarray, sample_time: float, path: Path) -> np.ndarray:
    """The steps (s) of an episode; UserError where time does not go on, or at another rate than it is said to."""
    steps = np.diff(t)
    backward = np.flatnonzero(steps <= 0)
    if len(backward):
        k = backward[0]
        how = "stands still" if steps[k] == 0 else "goes backward"
        raise UserError(f"{path}, line {lines[k + 1]}: time {how}, from {t[k]:g} to {t[k + 1]:g} s")
    if len(steps) and abs(steps.mean() / sample_time - 1) > RATE_TOLERANCE and np.ptp(steps) < 0.1 * steps.mean():
        raise UserError(f"{path}, line {lines[0]}: rows every {steps.mean():g} s, but sample_time is {sample_time:g} s")
    return steps
