"""Another recording of the same machine through the simulator, before and after its diagnosis. Nothing is fitted."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from hydra.core.config_store import ConfigStore

from vision_s2r import parallel
from vision_s2r.errors import UserError
from vision_s2r.files import write
from vision_s2r.fit.case import Values
from vision_s2r.fit.contact.free_run import WINDOW, ContactRun, windowed
from vision_s2r.fit.joint.free_run import fingerprint, free_run, gap_errors, gap_metric, measured
from vision_s2r.options import option, validate
from vision_s2r.progress import tracked
from vision_s2r.recording import ArmRecording, CameraRecording, ContactRecording, JointRecording, Recording, read
from vision_s2r.recording.folders import folders, outputs
from vision_s2r.recording.joined import read_together
from vision_s2r.report.reading import diagnosed, read_report, values

FORMAT = "vision-s2r/replay/1"
COLUMNS = ("episode", "t", *(f"{q}_{k}" for q in ("position", "velocity") for k in ("measured", "before", "after")))

CONTACT_COLUMNS = (
    *("episode", "t", "window"),
    *(f"{axis}_{k}" for axis in "xyz" for k in ("measured", "before", "after")),
    *("angle_before", "angle_after"),
)


@dataclass
class ReplayConfig:
    """Everything that `vision-s2r replay` reads."""

    recording: Any = option(None, "The recording's folder, or several: recording=[DIR,DIR].")
    report: str = option("", "The report.json of a diagnosis of the same machine.")
    out: str = option("outputs/replay", "Folder of the replay; of several recordings, each gets a folder in it.")
    jobs: int = option(2, "Recordings at a time.", low=1)
    backend: str = parallel.backend_option()
    seed: int = option(0, "Of the noise in the pictures `after`; the same seed gives the same pictures.", low=0)
    together: bool = option(False, "Whether they are one, as a diagnosis of several together has them.")


ConfigStore.instance().store("replay_schema", node=ReplayConfig)


def replay_all(cfg: ReplayConfig) -> list[Path]:
    """Replay the recordings of cfg, `cfg.jobs` at a time; returns the replay.json of each.

    One lands in `cfg.out`; of several, each in a folder of `cfg.out` with its name. Raises UserError for a report or
    a recording that cannot be, or that are not of one kind.
    """
    given = folders(cfg.recording)
    if not cfg.report:
        raise UserError("report is missing, expected report=FILE, the report.json of a diagnosis")
    validate(cfg)
    report = read_report(cfg.report)
    of_one = [given] if cfg.together else [[folder] for folder in given]
    outs = [Path(cfg.out)] if cfg.together else outputs(cfg.out, given)
    calls = ((*each, report, cfg.seed) for each in zip(of_one, outs, strict=True))
    done = parallel.run(_replay_into, calls, min(cfg.jobs, len(of_one)), cfg.backend)
    return list(tracked(done, len(of_one), "recordings"))


def _replay_into(given: Sequence[Path], out: Path, report: Mapping[str, Any], seed: int) -> Path:
    recording = read(given[0], hold_out=False) if len(given) == 1 else read_together(given, hold_out=False)
    if recording.kind != report["kind"]:
        raise UserError(f"{given[0]}: a recording of a {recording.kind}, but the report is of a {report['kind']}")
    result = replay(recording, values(diagnosed(report)), out, seed, report.get("held_out"))
    return write(out / "replay.json", json.dumps(result, indent=1, allow_nan=False) + "\n")


def replay(
    recording: Recording, effects: Values, out: Path, seed: int = 0, held_out: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Write what the simulator makes of a recording without and with `effects`; returns what replay.json holds.

    Of the joint's recording that the effects were found in, `held_out` of its report has parameters from parts of it:
    each stretch is then run with those that have not seen it.
    """
    result = {"format": FORMAT, "kind": recording.kind, "effects": effects}
    if isinstance(recording, JointRecording):
        same = held_out is not None and held_out["recording"] == fingerprint(recording)
        return result | _replay_joint(recording, effects, out, held_out if same else None)
    if isinstance(recording, ContactRecording):
        return result | _replay_contact(recording, effects, out)
    if isinstance(recording, ArmRecording):
        from vision_s2r.diagnose.arm_replay import replay_arm  # imports MuJoCo

        rows, found = replay_arm(recording, effects, held_out)
        _write_table(out / "replay.csv", rows.table, rows.columns)
        return result | found
    return result | _replay_camera(recording, effects, out, seed)


def _replay_joint(
    recording: JointRecording, effects: Values, out: Path, held_out: Mapping[str, Any] | None
) -> dict[str, Any]:
    real, before, after = measured(recording), free_run(recording, {}), free_run(recording, effects)
    (metric, gap_unit), errors = gap_metric(recording), gap_errors(recording, after)
    rows: list[tuple[int, int, int]] = []
    if held_out:
        runs = [free_run(recording, values) for values in held_out["folds"]]
        of_runs = [gap_errors(recording, run) for run in runs]
        stretches = [(recording.episodes.index(e), first, end, fold) for e, first, end, fold in held_out["segments"]]
        for e, first, end, fold in stretches:
            after[e, first:end], errors[e, first:end] = runs[fold][e, first:end], of_runs[fold][e, first:end]
        rows = [(e, first, end) for e, first, end, _ in stretches]
    blocks = []
    for k, length in enumerate(recording.lengths):
        t = recording.time[k, :length]
        both = [each[k, :length, quantity] for quantity in (0, 1) for each in (real, before, after)]
        blocks.append(np.stack([np.full(length, recording.episodes[k]), t, *both], axis=1))
    _write_table(out / "replay.csv", np.concatenate(blocks), COLUMNS)
    unit = "rad" if recording.units == "rotary" else "m"
    gaps = {
        f"{name}_rmse": {
            "unit": each_unit,
            "before": _rms(before[..., k] - real[..., k]),
            "after": _rms(after[..., k] - real[..., k]),
        }
        for k, (name, each_unit) in enumerate((("position", unit), ("velocity", f"{unit}/s")))
    }
    return {
        "described": "free run from each episode's first row"
        + ("" if recording.velocity is not None else "; the velocity measured is the slope of the positions")
        + (", each stretch with parameters that have not seen it" if held_out else ""),
        "gap": {
            "metric": metric,
            "unit": gap_unit,
            "before": _root(gap_errors(recording, before), rows),
            "after": _root(errors, rows),
        },
        "gaps": gaps,
        "episodes": [
            {
                "episode": episode,
                "before": _rms(before[k, :, 1] - real[k, :, 1]),
                "after": _rms(after[k, :, 1] - real[k, :, 1]),
            }
            for k, episode in enumerate(recording.episodes)
        ],
    }


def _replay_contact(recording: ContactRecording, effects: Values, out: Path) -> dict[str, Any]:
    before, after = windowed(recording, {}), windowed(recording, effects)
    blocks = []
    for k, length in enumerate(recording.lengths):
        t = np.arange(length) * recording.sample_time
        all_three = (recording.position, before.position, after.position)
        columns = [np.full(length, recording.episodes[k]), t, before.window[k, :length]]
        columns += [each[k, :length, axis] for axis in range(3) for each in all_three]
        blocks.append(np.stack([*columns, before.angle[k, :length], after.angle[k, :length]], axis=1))
    _write_table(out / "replay.csv", np.concatenate(blocks), CONTACT_COLUMNS)

    def distances(run: ContactRun) -> np.ndarray:
        return np.linalg.norm(run.position - recording.position, axis=-1)

    errors = {"before": distances(before), "after": distances(after)}
    return {
        "described": f"in windows of {WINDOW:g} s that each begin at the measured state",
        "gap": {"metric": "position_rmse", "unit": "m", **{key: _rms(each) for key, each in errors.items()}},
        "gaps": {"angle_rmse": {"unit": "rad", "before": _rms(before.angle), "after": _rms(after.angle)}},
        "episodes": [
            {"episode": episode, **{key: _rms(each[k]) for key, each in errors.items()}}
            for k, episode in enumerate(recording.episodes)
        ],
    }


def _root(errors: np.ndarray, stretches: list[tuple[int, int, int]]) -> float:
    """Root of the mean squared error [E, T]: of all rows, or over stretches (episode, first row, row behind the last).

    A report counts each stretch the same.
    """
    if not stretches:
        return float(np.sqrt(np.nanmean(errors)))
    return float(np.sqrt(np.mean([float(np.nanmean(errors[e, first:end])) for e, first, end in stretches])))


def _replay_camera(recording: CameraRecording, effects: Values, out: Path, seed: int) -> dict[str, Any]:
    from vision_s2r.fit.camera import pictures  # imports torch

    surfaces = pictures.rendered(recording, effects)
    for folder in ("before", "after"):
        (out / folder).mkdir(parents=True, exist_ok=True)
    frames: list[dict[str, Any]] = []
    for k, name in enumerate(recording.names):
        shown = pictures.show(recording, k, effects, seed, surfaces)
        for folder, picture in (("before", recording.sim[k]), ("after", shown.picture)):
            write(out / folder / f"{name}.png", _png(picture, recording))
        if recording.pairing == "paired":
            frames.append({"frame": name} | pictures.gap(recording, k, shown))
        else:
            frames.append({"frame": name} | pictures.distance(recording, k, shown))
    if recording.pairing == "paired":
        metric, described = (
            "pixel_rmse",
            "coded values, pixel by pixel; the amount of noise counts by its standard deviation",
        )
        means = {key: float(np.sqrt(np.mean([frame[key] ** 2 for frame in frames]))) for key in ("before", "after")}
    else:
        metric, described = (
            "value_distance",
            "first Wasserstein distance of coded values from those of all real pictures",
        )
        means = {key: float(np.mean([frame[key] for frame in frames])) for key in ("before", "after")}
    gap = {"metric": metric, "unit": "grey levels", **means}
    return {"described": described, "gap": gap, "frames": frames}


def _png(picture: np.ndarray, recording: CameraRecording) -> bytes:
    full = 2**recording.bits - 1
    whole = np.rint(np.clip(picture, 0, 1) * full).astype(np.uint8 if recording.bits == 8 else np.uint16)
    done, encoded = cv2.imencode(".png", whole[..., 0] if recording.grey else whole[..., ::-1])
    if not done:
        raise UserError(f"a picture of shape {picture.shape} cannot be encoded as PNG")
    return encoded.tobytes()


def _write_table(path: Path, table: np.ndarray, columns: Sequence[str]) -> None:
    lines = [",".join(columns)]
    lines += [f"{int(row[0])}," + ",".join(f"{value:.9g}" for value in row[1:]) for row in table]
    write(path, "\n".join(lines) + "\n")


def _rms(difference: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(difference**2)))
