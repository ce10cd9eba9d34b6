"""From folders to folders."""

from dataclasses import replace
from pathlib import Path

from vision_s2r.errors import UserError
from vision_s2r.identify import emps, two_point
from vision_s2r.identify.config import IdentifyConfig, check
from vision_s2r.identify.identify import identify, torque_error, validate
from vision_s2r.recording import JointRecording, read
from vision_s2r.recording.folders import folders, outputs
from vision_s2r.recording.joined import joined


def identify_all(cfg: IdentifyConfig) -> list[Path]:
    """Identify the joints of cfg's recordings, each into its folder, and print what was found; or run an example.

    One recording, or several together, land in `cfg.out`, else of several each in a folder of `cfg.out` with its name.
    Returns the files to look
    at first: identified.json, or what the example wrote.
    """
    check(cfg)
    if cfg.example == "two_point":
        return [two_point.run(Path(cfg.out), cfg.seed)]
    given = folders(cfg.recording)
    if cfg.example == "emps":
        estimation, pulses = (joint(given[0] / name, hold_out=False) for name in ("estimation", "validation_pulses"))
        return [emps.run(estimation, pulses, Path(cfg.out))]
    if cfg.together:
        return [_identify_into(given, Path(cfg.out), cfg)]
    return [_identify_into([folder], out, cfg) for folder, out in zip(given, outputs(cfg.out, given), strict=True)]


def joint(folder: Path, hold_out: bool = True) -> JointRecording:
    """The recording in a folder. Raises UserError unless it is of a joint."""
    recording = read(folder, hold_out)
    if not isinstance(recording, JointRecording):
        raise UserError(f"{folder}: a recording of a {recording.kind}, expected one of a joint")
    return recording


def _identify_into(given: list[Path], out: Path, cfg: IdentifyConfig) -> Path:
    recording = joined([joint(folder) for folder in given])
    other = joint(Path(cfg.validate), hold_out=False) if cfg.validate else None
    try:
        found = identify(recording, cfg)
    except UserError as error:
        raise UserError(f"{', '.join(map(str, given))}: {error}") from error
    if cfg.method == "inverse":
        more = [value for value, *_ in found.estimate.offsets.get("bias_torque", [])]
        found = replace(found, errors={"torque_error": torque_error(recording, found.values, cfg.inverse, more)})
    if other:
        found = replace(found, validation=validate(found, other, cfg.inverse))
    print(found.summary())
    return found.save(out)
