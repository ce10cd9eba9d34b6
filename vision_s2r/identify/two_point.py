"""The worked example: a joint identified from two steady states, and what a wrong model of it costs.

At constant speed J·θ̈ = K·u − b·θ̇ − τ_f·sign(θ̇) leaves K·u = b·ω + τ_f: a line that two points give.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import rich.box
from rich.console import Console
from rich.table import Table

from vision_s2r.files import write
from vision_s2r.identify.config import IdentifyConfig
from vision_s2r.identify.drawing import two_lines
from vision_s2r.identify.identify import identify
from vision_s2r.joint import NominalJoint, pack, simulate
from vision_s2r.randomize import Range
from vision_s2r.randomize.coverage import covered
from vision_s2r.recording import JointRecording
from vision_s2r.recording import write as write_recording

NOMINAL = {"torque_constant": 0.5, "inertia": 0.02, "viscous_damping": 0.10, "coulomb_friction": 0.02}
SIMULATOR = NominalJoint(**NOMINAL)
CORRECTED = replace(SIMULATOR, viscous_damping=0.13)  # its damping a little better, its friction as wrong as before
REALITY = replace(SIMULATOR, viscous_damping=0.15, coulomb_friction=0.05)
IDENTIFIED = ("viscous_damping", "coulomb_friction")
CURRENTS, SPEEDS = (1.0, 1.9), (3.0, 6.0)  # A, rad/s: the steady states that were measured
TARGET = 5.0  # rad/s
DRAWN, REAL = Range(0.10, 0.16), Range(0.09, 0.18)  # of b, N·m·s/rad: what is randomized, and what real joints have
HELD, SAMPLE_TIME = 4.0, 0.01  # s: thirty time constants
NOISE = (1e-4, 0.01)  # rad, rad/s: standard deviations of the sensors


def from_steady_states(
    torque_constant: float, currents: tuple[float, float], speeds: tuple[float, float]
) -> tuple[float, float]:
    """Viscous damping (N·m·s/rad) and Coulomb friction (N·m) of the line through two steady states, in A and rad/s."""
    damping = torque_constant * (currents[1] - currents[0]) / (speeds[1] - speeds[0])
    return damping, torque_constant * currents[0] - damping * speeds[0]


def open_loop(joint: NominalJoint, speed: float) -> float:
    """The current (A) that holds a speed (rad/s, above 0), as this model of the joint has it."""
    return (joint.viscous_damping * speed + joint.coulomb_friction) / joint.torque_constant


def reached(joint: NominalJoint, current: float) -> float:
    """The steady speed (rad/s) of a current (A, not below 0)."""
    return max(joint.torque_constant * current - joint.coulomb_friction, 0.0) / joint.viscous_damping


def short(speed: float) -> float:
    """By what share a speed falls short of the target."""
    return 1 - speed / TARGET


def response(joint: NominalJoint, current: float) -> np.ndarray:
    """Speeds [T] (rad/s) every SAMPLE_TIME from rest under a current (A) that is held for HELD seconds."""
    command = np.full((1, round(HELD / SAMPLE_TIME)), current)
    return simulate(pack(joint, {})[None], command, np.zeros((1, 2)), SAMPLE_TIME)[0, 0, :, 1]


def log(seed: int) -> JointRecording:
    """What the sensors of the real joint show while each current is held until the speed is steady."""
    command = np.repeat(np.array(CURRENTS)[:, None], round(HELD / SAMPLE_TIME), axis=1)
    states = simulate(pack(REALITY, {})[None], command, np.zeros((2, 2)), SAMPLE_TIME)[0]
    states = states + np.random.default_rng(seed).normal(size=states.shape) * NOISE
    return JointRecording(
        nominal=NOMINAL,
        sample_time=SAMPLE_TIME,
        units="rotary",
        command=command,
        position=states[..., 0],
        velocity=states[..., 1],
        lengths=np.full(2, command.shape[1]),
        episodes=(0, 1),
    )


def run(out: Path, seed: int) -> Path:
    """Print the example from the formula and from a simulated log, and draw it; returns the picture's path.

    The table lands beside it as data, two_point.json, and the log as a recording, to be identified like any other.
    """
    exact = replace(SIMULATOR, **dict(zip(IDENTIFIED, from_steady_states(0.5, CURRENTS, SPEEDS), strict=True)))
    recording = log(seed)
    folder = out / f"log-{seed}"
    if not folder.exists():
        write_recording(recording, folder)
    found = identify(recording, IdentifyConfig())
    logged = replace(SIMULATOR, **{name: found.values[name]["value"] for name in IDENTIFIED})
    models = {
        "the simulator": SIMULATOR,
        "its damping corrected": CORRECTED,
        "two steady states": exact,
        "a simulated log": logged,
    }
    intervals = {"a simulated log": [found.estimate.intervals[name]["value"] for name in IDENTIFIED]}
    content = _content(models, intervals)
    write(out / "two_point.json", json.dumps(content, indent=1, ensure_ascii=False) + "\n")
    console = Console(highlight=False)
    console.print(_table(content))
    for name, (low, high) in zip(IDENTIFIED, intervals["a simulated log"], strict=True):
        console.print(f"{name.replace('_', ' ')} from the log, 95 %: {low:.4f} to {high:.4f}")
    share = covered(DRAWN, REAL)
    console.print(
        f"b drawn from {DRAWN.low:g} to {DRAWN.high:g} covers {100 * share:.1f} % of {REAL.low:g} to {REAL.high:g}"
    )
    current = open_loop(SIMULATOR, TARGET)
    responses = {"simulator": response(SIMULATOR, current), "reality": response(REALITY, current)}
    picture = two_lines(SIMULATOR, exact, (CURRENTS, SPEEDS), TARGET, responses, SAMPLE_TIME)
    return write(out / "two_point.png", picture)


def _content(models: dict[str, NominalJoint], intervals: dict[str, list[tuple[float, float]]]) -> dict[str, Any]:
    """What each model says, and what comes of its command, as the documentation's tables are."""
    rows = []
    for name, joint in models.items():
        current = open_loop(joint, TARGET)
        speed = reached(REALITY, current)
        known = [f"{value:.4f}" for value in (joint.viscous_damping, joint.coulomb_friction)]
        ends = [f" ({low:.4f}–{high:.4f})" for low, high in intervals.get(name, [])] or ["", ""]
        row = (f"{current:.2f} A", f"{speed:.2f} rad/s", f"{100 * short(speed):.1f} %".replace("-0.0", "0.0"))
        rows.append([name, *map(str.__add__, known, ends), *row])
    columns = ["model from", "b, N·m·s/rad", "τ_f, N·m", f"command for {TARGET:g} rad/s", "reached", "short"]
    return {"command": "vision-s2r identify example=two_point", "columns": columns, "rows": rows}


def _table(content: dict[str, Any]) -> Table:
    """The same for a terminal, without the intervals."""
    table = Table(box=rich.box.SIMPLE, show_edge=False, pad_edge=False)
    for name in content["columns"]:
        table.add_column(name.replace(", ", "\n").replace(" for ", " for\n"), no_wrap=True)
    for row in content["rows"]:
        table.add_row(*(cell.partition(" (")[0] for cell in row))
    return table
