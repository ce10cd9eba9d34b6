"""What the benchmark of the translator shows: a table and a figure."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from rich.console import Console
from rich.table import Table

from vision_s2r.files import write_figure


def draw(found: dict[str, Any], path: Path) -> Path:
    """The validation error of each network over time and over pictures seen; returns the PNG's path."""
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    time_axes, picture_axes = figure.subplots(1, 2, sharey=True)
    for name, network in found["networks"].items():
        errors = [row[found["error"]] for row in network["curve"]]
        time_axes.plot([60 * row["minutes"] for row in network["curve"]], errors, "o-", ms=3, lw=1.2, label=name)
        picture_axes.plot([row["pictures"] for row in network["curve"]], errors, "o-", ms=3, lw=1.2)
    time_axes.set(xlabel="seconds of training", ylabel=f"validation error ({found['error']})", yscale="log")
    picture_axes.set(xlabel="pictures seen", xscale="log")
    picture_axes.xaxis.set_minor_formatter(NullFormatter())
    for axis in (time_axes.yaxis, picture_axes.xaxis):
        axis.set_major_formatter("{x:g}")
    time_axes.yaxis.set_minor_formatter("{x:g}")
    for axes in (time_axes, picture_axes):
        axes.grid(alpha=0.3, which="both")
    time_axes.legend(frameon=False, fontsize=8)
    return write_figure(path, figure, dpi=130)


def show(found: dict[str, Any]) -> None:
    """Prints the table."""
    networks, error, reference = found["networks"], found["error"], found["reference"]
    table = Table("", *networks)

    def row(title: str, form: str, values: Iterable[float | None]) -> None:
        table.add_row(title, *("–" if value is None else format(value, form) for value in values))

    def measured(title: str, form: str, key: str) -> None:
        row(title, form, (network[key] for network in networks.values()))

    def compared(title: str, key: str) -> None:
        row(title, ".2f", (found["ratios"].get(name, {}).get(key) for name in networks))

    measured("parameters", ",", "parameters")
    measured("inference, ms a picture", ".2f", "inference_milliseconds")
    measured("training, pictures/s: the network alone", ".1f", "step_pictures_per_second")
    measured("training, pictures/s: in the loop", ".1f", "loop_pictures_per_second")
    done, fastest = "step_operations_per_second", "ceiling_operations_per_second"
    row("GFLOP/s: the network alone", ".0f", (network[done] / 1e9 for network in networks.values()))
    row("GFLOP/s: the fastest 3 x 3 convolution here", ".0f", (network[fastest] / 1e9 for network in networks.values()))
    row("share of that, %", ".0f", (100 * network[done] / network[fastest] for network in networks.values()))
    for key in (error, "object_l1"):
        row(f"{key} after {found['minutes']:g} min", ".4f", (n["curve"][-1][key] for n in networks.values()))
    table.add_section()
    table.add_row(f"over the {reference}:")
    compared(f"{error} after {found['minutes']:g} min", "error")
    compared("pictures/s, inference", "inference")
    compared("pictures/s, training, the network alone", "step")
    compared("pictures/s, training, in the loop", "loop")
    compared("times fewer pictures to the reference's best error", "pictures")
    compared("times less time to it: pictures/s at equal error", "time")
    Console(width=120).print(table)
