"""Fetch EMPS, the measurements of a real linear axis, as recordings into tests/data/emps; needs a network.

A. Janot, M. Gautier, M. Brunot, "Data Set and Reference Models of EMPS", Nonlinear System Identification Benchmarks,
2019; from a repository that carries the data. The force is the controller's output times the drive's gain.
"""

import hashlib
import io
import sys
import urllib.request
from pathlib import Path

import numpy as np
import yaml
from scipy.io import loadmat

from vision_s2r.files import write

SOURCE = (
    "https://raw.githubusercontent.com/forgi86/sysid-neural-continuous/"
    "93afc131780fb1d5477472935a18ac8405683890/examples/EMPS/data"
)
# By recording: its file, and the checksum of joint.csv.
PARTS = {
    "estimation": (
        "DATA_EMPS.mat",
        "d25761758ced56728a2071cf210dddebc99b09b290f3dd6aafcde03be10715f6",  # pragma: allowlist secret
    ),
    "validation_pulses": (
        "DATA_EMPS_PULSES.mat",
        "8acd0bb8e192b951e971c2c3a67a852519c2673342fac8d4c228906586e47434",  # pragma: allowlist secret
    ),
}
HEADER = {
    "format": "vision-s2r/recording/1",
    "kind": "joint",
    "units": "linear",
    "sample_time": 0.001,
    "nominal": {  # the published symmetric model
        "torque_constant": 1.0,
        "inertia": 95.1089,
        "viscous_damping": 203.5034,
        "coulomb_friction": 20.3935,
        "gravity_torque": 0.0,
        "bias_torque": -3.1648,
    },
}


def joint_csv(content: bytes) -> str:
    """joint.csv from the published file: time (s), force (N), position (m), to eight digits."""
    data = loadmat(io.BytesIO(content))
    columns = [data["t"].ravel(), (data["gtau"] * data["vir"]).ravel(), data["qm"].ravel()]
    rows = (",".join(["0", *(f"{value:.8g}" for value in row)]) for row in np.column_stack(columns))
    return "\n".join(["episode,t,force,position", *rows]) + "\n"


def fetch(out: Path) -> None:
    """Both recordings, each once it has been checked. Raises SystemExit where a checksum differs."""
    for name, (file, checksum) in PARTS.items():
        with urllib.request.urlopen(f"{SOURCE}/{file}", timeout=60) as answer:
            text = joint_csv(answer.read())
        found = hashlib.sha256(text.encode()).hexdigest()
        if found != checksum:
            sys.exit(f"error: {file} gives a joint.csv of checksum {found}, expected {checksum}")
        write(out / name / "joint.csv", text)
        write(out / name / "recording.yaml", yaml.safe_dump(HEADER, sort_keys=False))


if __name__ == "__main__":
    fetch(Path(__file__).resolve().parent / "emps")
