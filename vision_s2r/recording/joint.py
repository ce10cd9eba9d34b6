"""Recordings of a joint: joint.csv beside its header."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np

from vision_s2r.errors import UserError, check_keys
from vision_s2r.recording import header, motion, plausible, table
from vision_s2r.recording.data import JointRecording
from vision_s2r.recording.table import LARGEST_VALUE, RATE_TOLERANCE

KEYS = ("format", "kind", "sample_time", "nominal", "units", "control")
# Of the nominal simulator J·θ̈ = K·u − b·θ̇ − τ_f·sign(θ̇) − τ_g·sin θ − τ_0: the least value of each, and whether
# it is one; the last four are optional.
NOMINAL = {
    "torque_constant": (0.0, False),
    "inertia": (0.0, False),
    "viscous_damping": (0.0, True),
    "coulomb_friction": (0.0, True),
    "gravity_torque": (-math.inf, True),
    "bias_torque": (-math.inf, True),
    "position_offset": (-math.inf, True),
    "back_emf": (0.0, True),
}
UNSAID = ("position_offset", "back_emf")  # none, unless a recording says so
OPTIONAL = {"gravity_torque": 0.0, "bias_torque": 0.0}
CONTROL = {"proportional": "proportional_gain", "derivative": "derivative_gain", "limit": "command_limit"}
COMMANDS = {
    "current": ("rotary", "linear"),
    "torque": ("rotary",),
    "force": ("linear",),
    "target": ("rotary", "linear"),
}
COLUMNS = ("episode", "t", *COMMANDS, "position", "velocity", "external", "enabled", "supply", "gain")
MEANT = {"goal": "target", "goal_position": "target", "command": "target", "voltage": "supply", "time": "t"}


MOST_UNEVEN = 2.0  # a factor between sample_time and the median step of uneven samples
LONGEST_GAP = 60.0  # s without a row in an episode
HIGHEST_SUPPLY = 4.0  # a factor; beyond it, it is volts
LEAST_EPISODE, LEAST_SAMPLES = 10, 100  # rows of an episode and of a recording, to hold a part of it out


def read(folder: Path, content: Mapping[str, Any], hold_out: bool) -> JointRecording:
    """The recording of a folder whose header is `content`. Raises UserError for whatever cannot be."""
    path = folder / "joint.csv"
    columns, lines = table.columns(path, check_names)
    return of_columns(content, columns, lines, hold_out, str(folder / "recording.yaml"), path)


def of_columns(
    content: Mapping[str, Any],
    columns: Mapping[str, np.ndarray],
    lines: np.ndarray,
    hold_out: bool,
    where: str,
    path: Path,
) -> JointRecording:
    """The recording of a header, and of columns [rows] with the line that each row stands in, checked.

    `where` is the header's place and `path` the columns', for messages. Raises UserError for whatever cannot be.
    """
    check_keys(content, KEYS, where, ("sample_time", "nominal"))
    sample_time = header.number(content, "sample_time", where, 0.0, 1e3, inclusive=False)
    units = cast(Literal["rotary", "linear"], header.choice(content, "units", ("rotary", "linear"), where, "rotary"))
    command = _command(columns, units, path)
    nominal = _nominal(header.mapping(content, "nominal", where), command, where) | _control(content, command, where)
    _check_inputs(columns, command, lines, path)
    recording = of_rows(nominal, sample_time, units, columns, command, lines, hold_out, path)
    plausible.check(recording, command, path)
    return recording


def of_rows(
    nominal: dict[str, float],
    sample_time: float,
    units: Literal["rotary", "linear"],
    columns: Mapping[str, np.ndarray],
    command: str,
    lines: np.ndarray,
    hold_out: bool,
    path: Path,
) -> JointRecording:
    """The recording of columns [rows], of which `command` is the command.

    Raises UserError where time or motion cannot be.
    """
    episodes = table.episodes(columns["episode"], lines, path)
    steps = [_steps(columns["t"][rows], lines[rows], sample_time, path) for rows in episodes.values()]
    even = all(np.all(np.abs(each / sample_time - 1) <= RATE_TOLERANCE) for each in steps)
    if not even:
        sample_time = _median_step(np.concatenate(steps), sample_time, path)
    recording = _recording(nominal, sample_time, units, columns, command, episodes, even)
    _check_length(recording, hold_out, path)
    return motion.checked(recording, path)


def _nominal(given: dict[str, Any], command: str, where: str) -> dict[str, float]:
    where = f"{where}: nominal"
    optional = {*OPTIONAL, *UNSAID} | ({"torque_constant"} if command != "current" else set())
    check_keys(given, NOMINAL, where, [key for key in NOMINAL if key not in optional])
    values = {
        key: header.number(given, key, where, low, LARGEST_VALUE, inclusive) if key in given else OPTIONAL.get(key, 1.0)
        for key, (low, inclusive) in NOMINAL.items()
        if key in given or key not in UNSAID
    }
    return values | {"torque_constant": 1.0} if command in ("torque", "force") else values


def _control(content: Mapping[str, Any], command: str, where: str) -> dict[str, float]:
    """The law of a position servo, under the names of a nominal joint."""
    if "control" not in content:
        if command == "target":
            raise UserError(f"{where}: control is missing, expected the gains of the servo that follows the targets")
        return {}
    if command != "target":
        raise UserError(f"{where}: control is of a position servo, but joint.csv has a {command} and no target")
    given, where = header.mapping(content, "control", where), f"{where}: control"
    check_keys(given, CONTROL, where, ("proportional",))
    inclusive = {"proportional": False, "derivative": True, "limit": False}
    return {
        name: header.number(given, key, where, 0.0, LARGEST_VALUE, inclusive[key])
        for key, name in CONTROL.items()
        if key in given
    }


def _check_inputs(columns: Mapping[str, np.ndarray], command: str, lines: np.ndarray, path: Path) -> None:
    """UserError where a supply is in volts, a drive neither on nor off, or a gain none of a servo."""
    if "gain" in columns:
        _check_gain(columns, command, lines, path)
    for name, high, expected in (
        ("enabled", 1.0, "0 or 1"),
        ("supply", HIGHEST_SUPPLY, "a factor of the command: volts over nominal volts"),
    ):
        values = columns.get(name, np.ones(1))
        wrong = np.flatnonzero((values < 0) | (values > high))
        if len(wrong):
            k = wrong[0]
            raise UserError(f"{path}, line {lines[k]}: {name} is {columns[name][k]:g}, expected {expected}")


def _check_gain(columns: Mapping[str, np.ndarray], command: str, lines: np.ndarray, path: Path) -> None:
    if command != "target":
        raise UserError(f"{path}: a gain is of a position servo, but the column of commands is {command}, not target")
    gain, changes = columns["gain"], np.diff(columns["gain"], prepend=columns["gain"][:1]) != 0
    within = changes & (np.diff(columns["episode"], prepend=columns["episode"][:1]) == 0)
    wrong = np.flatnonzero((gain <= 0) | within)
    if len(wrong):
        k = wrong[0]
        was = f" after {gain[k - 1]:g} in its episode" if within[k] else ""
        expected = "one factor, more than 0, of control's gains in all of an episode"
        raise UserError(f"{path}, line {lines[k]}: gain is {gain[k]:g}{was}, expected {expected}")


def check_names(names: list[str], path: Path) -> None:
    """UserError unless these are columns of a joint's recording, and none is missing."""
    commanded = any(name in names for name in COMMANDS)
    needed = ("episode", "t", "position", *(() if commanded else ("current (or torque, force or target)",)))
    table.check_names(names, COLUMNS, needed, path, MEANT)


def _command(columns: Mapping[str, np.ndarray], units: str, path: Path) -> str:
    given = [name for name in COMMANDS if name in columns]
    if len(given) > 1:
        raise UserError(f"{path}: columns {' and '.join(given)}, expected one of them: what was commanded")
    if units not in COMMANDS[given[0]]:
        raise UserError(f"{path}: a {given[0]} does not go with units '{units}', expected {_expected_command(units)}")
    return given[0]


def _expected_command(units: str) -> str:
    return " or ".join(name for name, allowed in COMMANDS.items() if units in allowed)


def _steps(t: np.ndarray, lines: np.ndarray, sample_time: float, path: Path) -> np.ndarray:
    """The steps (s) of an episode; UserError where time does not go on, or at another rate than it is said to."""
    steps = table.time_steps(t, lines, sample_time, path)
    gap = np.flatnonzero(steps > LONGEST_GAP)
    if len(gap):
        k = gap[0]
        raise UserError(
            f"{path}, line {lines[k + 1]}: no row for {steps[k]:g} s, expected another episode after such a gap"
        )
    return steps


def _median_step(steps: np.ndarray, sample_time: float, path: Path) -> float:
    """The sample time of uneven samples."""
    median = float(np.median(steps))
    if not 1 / MOST_UNEVEN < median / sample_time < MOST_UNEVEN:
        raise UserError(f"{path}: rows every {median:g} s in the median, but sample_time is {sample_time:g} s")
    return median


def _recording(
    nominal: dict[str, float],
    sample_time: float,
    units: Literal["rotary", "linear"],
    columns: Mapping[str, np.ndarray],
    command: str,
    episodes: Mapping[int, np.ndarray],
    even: bool,
) -> JointRecording:
    lengths = np.array([len(rows) for rows in episodes.values()], dtype=np.int64)

    def padded(name: str, fill: float) -> np.ndarray:
        return table.padded(columns[name], list(episodes.values()), fill)

    def optional(*names: str) -> np.ndarray | None:
        """The product of these columns, held after the end; None where there is none of them."""
        given = [padded(name, np.nan) for name in names if name in columns]
        return _held(np.prod(given, axis=0), lengths) if given else None

    return JointRecording(
        nominal=nominal,
        sample_time=sample_time,
        units=units,
        command=padded(command, 0.0),
        position=padded("position", np.nan),
        velocity=padded("velocity", np.nan) if "velocity" in columns else None,
        lengths=lengths,
        episodes=tuple(episodes),
        times=None if even else _going_on(padded("t", np.nan), lengths, sample_time),
        supply=optional("supply", "enabled"),
        gains=padded("gain", 1.0)[:, 0] if "gain" in columns else None,
        external=optional("external"),
    )


def _held(values: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Each row [E, T] with its last value after its end."""
    last = np.minimum(np.arange(values.shape[1]), lengths[:, None] - 1)
    return np.take_along_axis(values, last, axis=1)


def _going_on(t: np.ndarray, lengths: np.ndarray, sample_time: float) -> np.ndarray:
    """Time stamps [E, T] from 0, which go on evenly after the end."""
    after = np.maximum(np.arange(t.shape[1]) - lengths[:, None] + 1, 0)
    return _held(t, lengths) - t[:, :1] + after * sample_time


def _check_length(recording: JointRecording, hold_out: bool, path: Path) -> None:
    total = int(recording.lengths.sum())
    least = LEAST_EPISODE if hold_out else 2
    short = np.flatnonzero(recording.lengths < least)
    if total == 1:
        raise UserError(f"{path}: one sample, expected at least {LEAST_SAMPLES}")
    if len(short):
        k = short[0]
        count = f"{recording.lengths[k]} samples" if recording.lengths[k] > 1 else "one sample"
        raise UserError(f"{path}: episode {recording.episodes[k]} has {count}, expected at least {least}")
    if hold_out and total < LEAST_SAMPLES:
        raise UserError(f"{path}: {total} samples are too short to hold any out, expected at least {LEAST_SAMPLES}")
