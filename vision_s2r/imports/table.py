"""What a source gives of each joint, and what the user may add to it."""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class ImportOptions:
    """What logs do not say. Keys of configs/import.yaml, where each is described."""

    joint: str = ""  # the only one to import; all by default
    drive: str = ""  # of DRIVES: what the simulator believes of the drive; the source's own by default
    nominal: dict[str, float] = field(default_factory=dict)  # as in recording.yaml, over the drive's
    control: dict[str, float] = field(default_factory=dict)  # as in recording.yaml, over the drive's
    units: str = "rotary"  # or linear
    columns: dict[str, str] = field(default_factory=dict)  # csv: our column -> theirs
    scale: dict[str, float] = field(default_factory=dict)  # our column -> factor to SI units


@dataclass(frozen=True)
class Table:
    """The log of one joint, in SI units."""

    name: str  # of the folder that it becomes
    columns: dict[str, np.ndarray]  # [N] each, by the names of joint.csv; episode and t among them
    drive: str  # of DRIVES, or ""
    nominal: dict[str, float] = field(default_factory=dict)  # what the log says of the joint itself
    control: dict[str, float] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)  # columns of the log that are not used, and why
    missing: tuple[str, ...] = ()  # what would help, and is not in the log
