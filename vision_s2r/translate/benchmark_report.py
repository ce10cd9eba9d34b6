"""What the benchmark of the translator shows: a figure, and a table."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

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


def as_table(found: dict[str, Any]) -> dict[str, Any]:
    """`command`, `columns` and `rows` of a page of results: each network's figures, then ours over theirs."""
    networks, error = found["networks"], found["error"]
    done, fastest = "step_operations_per_second", "ceiling_operations_per_second"
    after = f"after {found['minutes']:g} min"
    measured: dict[str, list[float]] = {
        "parameters": [network["parameters"] for network in networks.values()],
        "inference, ms a picture": [network["inference_milliseconds"] for network in networks.values()],
        "training, pictures/s: the network alone": [n["step_pictures_per_second"] for n in networks.values()],
        "training, pictures/s: in the loop": [n["loop_pictures_per_second"] for n in networks.values()],
        "GFLOP/s: the network alone": [network[done] / 1e9 for network in networks.values()],
        "GFLOP/s: the fastest 3 × 3 convolution here": [network[fastest] / 1e9 for network in networks.values()],
        "share of that, %": [100 * network[done] / network[fastest] for network in networks.values()],
        **{f"{key} {after}": [n["curve"][-1][key] for n in networks.values()] for key in (error, "object_l1")},
    }
    rows: list[list[Any]] = [[title, *values] for title, values in measured.items()]
    compared = {
        f"{error} {after}": "error",
        "pictures/s, inference": "inference",
        "pictures/s, training, the network alone": "step",
        "pictures/s, training, in the loop": "loop",
        "times fewer pictures to the reference's best error": "pictures",
        "times less time to it: pictures/s at equal error": "time",
    }
    for title, key in compared.items():
        ratios = [found["ratios"].get(name, {}).get(key) for name in networks]
        rows.append([f"over the {found['reference']}: {title}", *("–" if each is None else each for each in ratios)])
    return {"command": "vision-s2r benchmark translate", "columns": ["", *networks], "rows": rows}
