"""A replay and a diagnosis as a Rerun recording (rerun.io), for its viewer.

Of a joint or an arm, curves measured, before and after; of a tossed body, paths in space; of a camera, pictures. The
diagnosis is a page of text beside them.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pandas
from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError
from vision_s2r.files import whole
from vision_s2r.options import option, validate
from vision_s2r.report import GapReport

SIDES = {"measured": (60, 60, 60), "before": (217, 64, 64), "after": (64, 115, 190)}  # and their colours
AXES = "xyz"


@dataclass
class RerunConfig:
    """Everything that `vision-s2r export rerun` reads."""

    replay: str = option("", "Folder of a replay …")
    report: str = option("", "… the report.json of a diagnosis, or both.")
    recording: str = option("", "A camera's recording, for its real pictures beside those of its replay.")
    out: str = option("outputs/replay.rrd", "The file that is written, for `rerun FILE`.")


ConfigStore.instance().store("export_rerun_schema", node=RerunConfig)


def export_rerun(cfg: RerunConfig) -> Path:
    """Write the recording of cfg; returns its path. Raises UserError where there is nothing to show."""
    validate(cfg)
    if not cfg.replay and not cfg.report:
        raise UserError("expected replay=DIR, report=FILE or both")
    try:
        import rerun
    except ImportError as error:
        raise UserError("export needs rerun-sdk: pip install 'vision-s2r[rerun]'") from error
    out = Path(cfg.out)
    stream, views, said = rerun.RecordingStream("vision-s2r"), [], []
    with whole(out) as temporary:
        stream.save(temporary)
        if cfg.replay:
            views += _replay(stream, Path(cfg.replay), cfg.recording)
        if cfg.report:
            text = GapReport.read(cfg.report).summary()
            stream.log("diagnosis", rerun.TextDocument(text), static=True)
            said.append(rerun.blueprint.TextDocumentView(origin="diagnosis", name="diagnosis"))
        grids = [rerun.blueprint.Grid(*views)] if views else []
        page = rerun.blueprint.Vertical(*said, *grids, row_shares=[1] * len(said) + [6] * len(grids))
        stream.send_blueprint(rerun.blueprint.Blueprint(page, collapse_panels=True))
        stream.flush()
        stream.disconnect()
    return out


def _replay(stream: Any, folder: Path, recording: str) -> list[Any]:
    """Log what a replay wrote; returns views of it."""
    path = folder / "replay.csv"
    if not path.is_file():
        return _pictures(stream, folder, recording)
    try:
        table = pandas.read_csv(path)
        episodes = [(int(number), rows) for number, rows in table.groupby("episode")]
        names = [name.removesuffix("_measured") for name in table.columns if name.endswith("_measured")]
        table = table[["t", *(f"{name}_{side}" for name in names for side in SIDES)]].astype(float)
    except (OSError, ValueError, KeyError) as error:
        reason = str(error).splitlines()[0]
        raise UserError(f"{path}: {reason}: expected a table that `vision-s2r replay` wrote") from error
    if names == list(AXES):
        return [_path(stream, f"episode {number}", rows) for number, rows in episodes]
    return [_curves(stream, f"episode {number}", name, rows) for number, rows in episodes for name in names]


def _curves(stream: Any, episode: str, name: str, rows: pandas.DataFrame) -> Any:
    import rerun

    origin = rerun.new_entity_path([episode, name])
    for side, colour in SIDES.items():
        stream.log(f"{origin}/{side}", rerun.SeriesLines(colors=[colour], names=[side]), static=True)
        times = rerun.TimeColumn("t", duration=rows["t"].to_numpy())
        values = rerun.Scalars.columns(scalars=rows[f"{name}_{side}"].to_numpy(float))
        stream.send_columns(f"{origin}/{side}", indexes=[times], columns=values)
    legend = rerun.blueprint.PlotLegend(corner=rerun.blueprint.Corner2D.RightTop)
    return rerun.blueprint.TimeSeriesView(origin=origin, name=f"{name}, {episode}", plot_legend=legend)


def _path(stream: Any, episode: str, rows: pandas.DataFrame) -> Any:
    """Where a body was, window by window: each begins at the measured place."""
    import rerun

    origin = rerun.new_entity_path([episode])
    for side, colour in SIDES.items():
        windows = rows.groupby("window") if side != "measured" else [(0, rows)]
        lines = [part[[f"{axis}_{side}" for axis in AXES]].to_numpy(float) for _, part in windows]
        stream.log(f"{origin}/{side}", rerun.LineStrips3D(lines, colors=[colour] * len(lines)), static=True)
    return rerun.blueprint.Spatial3DView(origin=origin, name=episode)


def _pictures(stream: Any, folder: Path, recording: str) -> list[Any]:
    import rerun

    sides = {"before": folder / "before", "after": folder / "after"}
    if recording:
        sides = {"real": Path(recording) / "real", **sides}
    paths = {side: sorted(where.glob("*")) for side, where in sides.items()}
    for side, where in sides.items():
        if not paths[side]:
            raise UserError(f"{where}: no pictures, nor a replay.csv: expected a folder that `vision-s2r replay` wrote")
        for k, path in enumerate(paths[side]):
            picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
            if picture is None:
                raise UserError(f"{path}: not a picture, or a damaged one")
            stream.set_time("frame", sequence=k)
            stream.log(side, rerun.Image(np.ascontiguousarray(picture[..., ::-1])))
    return [rerun.blueprint.Spatial2DView(origin=side, name=side) for side in sides]
