"""From recordings to parameters."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.fit.case import NOMINAL, Hypothesis, Names, Values
from vision_s2r.fit.gap import Gap
from vision_s2r.fit.joint.case import JointCase
from vision_s2r.fit.joint.free_run import free_run, measured
from vision_s2r.identify.config import IdentifyConfig, InverseConfig
from vision_s2r.identify.forward import Forward
from vision_s2r.identify.identifiable import doubts, identifiable
from vision_s2r.identify.identified import Identified, nominal_of
from vision_s2r.identify.inverse import KNOWN, Inverse, regression
from vision_s2r.joint import DYNAMICS, JOINT_EFFECTS, REFITTED, SERVO
from vision_s2r.recording import JointRecording
from vision_s2r.report.reading import diagnosed, read_report


def identify(recording: JointRecording, cfg: IdentifyConfig | None = None) -> Identified:
    """Identify the nominal parameters of a joint, and the effects that `cfg` names, from one recording.

    Raises UserError for effects that are not known, or not by this method, and where nothing can be identified.
    """
    cfg = cfg or IdentifyConfig()
    asked = frozenset(cfg.effects) | _reported(cfg.report)
    held = cfg.hold.known()
    if not recording.servo and (wrong := sorted(asked & set(SERVO))):
        raise UserError(f"{wrong[0]} is of a position servo, but the recording has no targets")
    wanted = (asked | frozenset(REFITTED)) - held.keys()
    if recording.units == "linear" and not recording.nominal["gravity_torque"]:
        wanted -= {"gravity_torque"} - asked  # the sine of a distance is no load
    if cfg.method == "inverse" and not wanted <= KNOWN:
        raise UserError(f"method=inverse: no torque is linear in {min(wanted - KNOWN)} alone, expected method=forward")
    known = replace(recording, nominal=recording.nominal | held)
    case = _open(known, asked)
    found = identifiable(case, wanted, asked)
    if not found.fitted.values:
        why = "; ".join(f"{name}: {reason.why}" for name, reason in found.left.items())
        raise UserError(f"nothing can be identified ({why}). {case.experiment([], sorted(found.left)).sentence}")
    whole, plain = _methods(known, case, found.fitted, cfg)
    estimate = whole.estimate()
    segments = range(case.segments)
    nominal = nominal_of(recording, held)
    gap = Gap(
        before=case.error(nominal, segments),
        refitted=_held_out(case, plain),
        after=_held_out(case, whole),
        floor=case.floor(segments),
        seed=cfg.seed,
    )
    doubtful = doubts(case, found.fitted)
    return Identified(recording, case, cfg.method, estimate, held, dict(found.left), doubtful, gap)


def validate(identified: Identified, recording: JointRecording, cfg: InverseConfig) -> dict[str, dict[str, float]]:
    """How far another recording of the machine is from the simulator before and after; nothing is fitted to it.

    Root mean squares of position and velocity in a free run; after the inverse method, also the relative torque error.
    """
    real = measured(recording)
    runs = {"before": free_run(recording, {}), "after": free_run(recording, identified.values)}
    found = {
        f"{what}_rmse": {key: float(np.sqrt(np.nanmean((run - real)[..., k] ** 2))) for key, run in runs.items()}
        for k, what in enumerate(("position", "velocity"))
    }
    if identified.method == "inverse":
        found["torque_error"] = torque_error(recording, identified.values, cfg)
    return found


def torque_error(
    recording: JointRecording, values: Values, cfg: InverseConfig, more: Sequence[float] = ()
) -> dict[str, float]:
    """Relative torque error ‖τ − Wθ‖ / ‖τ‖ of a recording, reversals and all, before and after effects, all linear.

    `more` is the bias torque of its parts after the first beyond that, where it is several.
    """
    rows = regression(recording, replace(cfg, reversals=True), np.zeros(recording.position.shape, dtype=int))
    nominal = recording.nominal
    return {"before": rows.error(nominal, {}), "after": rows.error(nominal, values, more)}


def _reported(report: str) -> Names:
    """The effects of the drive that a diagnosis found."""
    if not report:
        return frozenset()
    content = read_report(report)
    if content["kind"] != "joint":
        raise UserError(f"{report}: is of a {content['kind']}, expected the report of a joint")
    return frozenset(diagnosed(content))


def _open(recording: JointRecording, asked: Names) -> JointCase:
    """The recording beside a simulator that takes positions for a grid's only where it is told to."""
    if not any(np.ptp(row[:n]) > 0 for row, n in zip(recording.position, recording.lengths, strict=True)):
        raise UserError("nothing can be identified: the joint never moves. Record fast and slow motion both ways.")
    library = {effect.name: effect for effect in JOINT_EFFECTS}
    if "encoder_quantization" not in asked:
        del library["encoder_quantization"]
    case = JointCase(recording, library)
    if case.segments < 2:
        raise UserError(f"{recording.lengths.sum()} samples are too short to hold any out, expected 120 or more")
    return case


def _methods(
    recording: JointRecording, case: JointCase, fitted: Hypothesis, cfg: IdentifyConfig
) -> tuple[Forward | Inverse, Forward | Inverse]:
    """The method for all effects of the fit, and for its nominal parameters alone."""
    names = frozenset(fitted.values)
    plain = names & frozenset(DYNAMICS)
    if cfg.method == "forward":
        return Forward(case, fitted), Forward(case, case.fit(plain, range(case.segments), NOMINAL))
    step = round(case.track.sample_time / recording.sample_time)
    segment = case.track.segment[:, np.arange(recording.position.shape[1]) // step]
    rows = regression(recording, cfg.inverse, segment)
    return Inverse(rows, recording.nominal, names), Inverse(rows, recording.nominal, plain)


def _held_out(case: JointCase, method: Forward | Inverse) -> np.ndarray:
    """Mean squared error [segments] of the gap, each segment under the fit to all others."""
    segments = range(case.segments)
    fits = [method.fit([other for other in segments if other != segment]) for segment in segments]
    return np.array([case.error(fit, [segment])[0] for segment, fit in zip(segments, fits, strict=True)])
