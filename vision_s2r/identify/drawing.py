"""The pictures of an identification."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vision_s2r.joint import NominalJoint
from vision_s2r.report.drawing import AFTER, BEFORE, FLOOR, INK, canvas, plain, png


def correlations(labels: Sequence[str], matrix: np.ndarray) -> Figure:
    """A correlation matrix [K, K] with its numbers."""
    figure, axes = canvas(1, 1, 1.6 + 0.6 * len(labels))
    axis = axes[0, 0]
    axis.imshow(matrix, vmin=-1, vmax=1, cmap="RdBu_r")
    for (row, column), value in np.ndenumerate(matrix):
        text = f"{value:.2f}".replace("-", "−")
        axis.text(column, row, text, ha="center", va="center", color="white" if abs(value) > 0.6 else INK, fontsize=9)
    names = [label.replace("_", " ").replace(".", ",\n") for label in labels]
    axis.set_xticks(range(len(labels)), names, rotation=40, ha="right", rotation_mode="anchor")
    axis.set_yticks(range(len(labels)), names)
    axis.tick_params(labelsize=8, length=0)
    axis.spines[:].set_visible(False)
    return figure


def two_lines(
    simulator: NominalJoint,
    reality: NominalJoint,
    states: tuple[Sequence[float], Sequence[float]],
    target: float,
    responses: Mapping[str, np.ndarray],
    sample_time: float,
) -> bytes:
    """Two steady states (currents in A, speeds in rad/s) and what follows from them; then what it costs not to know.

    Left the torque that holds a speed, in the simulator and in reality; right `responses`, speeds [T] over time of the
    simulator and of reality under the current that the simulator asks for the target.
    """
    figure, axes = canvas(1, 2, 3.6)
    _torques(axes[0, 0], simulator, reality, states, target)
    axis = axes[0, 1]
    for (name, speed), colour in zip(responses.items(), (BEFORE, AFTER), strict=True):
        t = np.arange(len(speed)) * sample_time
        axis.plot(t, speed, color=colour, label=f"{name}: {speed[-1]:.2f} rad/s")
    axis.axhline(target, color=FLOOR, linewidth=1, linestyle="--")
    axis.set(xlim=(0, 1.5), ylim=(0, 1.15 * target), xlabel="t, s", ylabel="speed, rad/s")
    current = (simulator.viscous_damping * target + simulator.coulomb_friction) / simulator.torque_constant
    axis.set_title(f"{current:.2f} A, the simulator's command for {target:g} rad/s", fontsize=10, loc="left")
    axis.legend(frameon=False, fontsize=9, loc="lower right")
    plain(axis)
    return png(figure)


def _torques(
    axis: Axes,
    simulator: NominalJoint,
    reality: NominalJoint,
    states: tuple[Sequence[float], Sequence[float]],
    target: float,
) -> None:
    speeds = np.linspace(0, 7, 2)
    for joint, colour, name in ((simulator, BEFORE, "simulator"), (reality, AFTER, "through both points")):
        torque = joint.viscous_damping * speeds + joint.coulomb_friction
        axis.plot(
            speeds,
            torque,
            color=colour,
            label=f"{name}: b = {joint.viscous_damping:.2f}, τ_f = {joint.coulomb_friction:.2f}",
        )
    currents, measured = states
    axis.plot(measured, simulator.torque_constant * np.array(currents), "o", color=INK, label="steady states")
    given = simulator.viscous_damping * target + simulator.coulomb_friction
    fallen = (given - reality.coulomb_friction) / reality.viscous_damping
    axis.annotate("", (fallen, given), (target, given), arrowprops={"arrowstyle": "->", "color": INK})
    axis.plot([target, target, fallen, fallen], [0, given, given, 0], color=FLOOR, linewidth=1, linestyle="--")
    axis.set(xlim=(0, 7), ylim=(0, 1.15), xlabel="speed, rad/s", ylabel="torque that holds it, N·m")
    axis.set_title("what holds a speed: K·u = b·ω + τ_f", fontsize=10, loc="left")
    axis.legend(frameon=False, fontsize=9, loc="upper left")
    plain(axis)
