"""What a source gives of each joint, and what the user may add to it."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.options import option
from vision_s2r.recording import Recording, read


@dataclass
class ImportOptions:
    """What logs do not say."""

    joint: str = option("", "The one joint that is wanted, by its name in the log; all if empty.")
    drive: str = option(
        "", "What the simulator believes of the drive, such as sts3215 or xl330; the source's own if empty."
    )
    nominal: dict[str, float] = option({}, "As in recording.yaml, over the drive's: +nominal={inertia: 0.03}.")
    control: dict[str, float] = option({}, "The law of a position servo, likewise: +control={proportional: 12}.")
    units: str = option("rotary", "Of the joint.", choices=("rotary", "linear"))
    model: str = option("", "An arm's MJCF or URDF: the joints of the log then become one recording of an arm.")
    joints: dict[str, str] = option({}, "Which joint of the model each of the log is; in their order if empty.")
    tip: str = option("", "The body or site of the model whose place is the task's: its error is reported too, in mm.")
    topics: dict[str, str] = option(
        {},
        "bag: topics of the measured state and of the command, where it is not plain: +topics={command: /goals}.",
    )
    columns: dict[str, str] = option({}, "csv: what our columns are called there: +columns={t: time, position: angle}.")
    scale: dict[str, float] = option({}, "Factors to SI units, by our columns: +scale={position: 0.01745}.")


@dataclass(frozen=True)
class JointTable:
    """The log of one joint, in SI units."""

    name: str  # of the folder that it becomes
    columns: dict[str, np.ndarray]  # [N] each, by the names of joint.csv; episode and t among them
    drive: str  # of DRIVES, or ""
    nominal: dict[str, float] = field(default_factory=dict)  # what the log says of the joint itself
    control: dict[str, float] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)  # columns of the log that are not used, and why
    notes: tuple[str, ...] = ()  # what else to know of it
    of_model: bool = False  # by convention, name, sign and zero are those of the robot's model
    missing: tuple[str, ...] = ()  # what would help, and is not in the log
    units: str = ""  # rotary or linear, where the log says


def read_back(folder: Path, log: str) -> Recording:
    """What was made of a log. Raises UserError, which begins with the log's name, for what can be no recording."""
    try:
        return read(folder, hold_out=False)
    except UserError as error:
        raise UserError(f"{log}: {str(error).replace(f'{folder}/', '')}") from error
