"""A diagnosis that knows: reads the answer of a recording from $ANSWERS, by the recording's header.

Takes recording=DIR out=DIR jobs=N withhold=[NAME], as scripts/diagnose.py does. $MANNER says how well it does:
right | nothing (never names anything) | crash | wrong (always names cogging, with a wrong value) | asks (names nothing
but asks for a recording, and is right where it was made).
"""

import hashlib
import json
import os
import sys
from pathlib import Path

keys = dict(argument.split("=", 1) for argument in sys.argv[1:])
recording, out = Path(keys["recording"]), Path(keys["out"])
if sorted(path.name for path in recording.parent.iterdir()) != ["recording"]:
    sys.exit("the folder of the recording is not empty beside it")
with Path(os.environ["CALLS"]).open("a") as calls:
    calls.write(" ".join(sorted(keys)) + "\n")
manner = os.environ["MANNER"]
if manner == "crash":
    sys.exit(3)
ASKED = "0.125"  # A
known = json.loads(Path(os.environ["ANSWERS"]).read_text())
answer = known[hashlib.sha256((recording / "recording.yaml").read_bytes()).hexdigest()]
made = (recording / "joint.csv").read_text().splitlines()[-1].split(",")[2] == ASKED
effects = {} if manner == "nothing" or (manner == "asks" and not made) else answer["effects"]
verdict = "explained" if effects else "no_gap"
if manner == "wrong":
    effects, verdict = {"cogging": {"amplitude": 9.0, "teeth": 3.0}}, "explained"
elif manner == "right" and (answer["unknown"] or answer["withhold"]):
    verdict = "partly_explained" if effects else "unexplained"
    assert ("withhold" in keys) == bool(answer["withhold"])
dynamics = {
    "inertia",
    "viscous_damping",
    "coulomb_friction",
    "gravity_torque",
    "bias_torque",
    "torque_constant",
}
out.mkdir(parents=True)
report = {
    "verdict": verdict,
    "gap": {"shrink": (answer["shrink"] or 0.0) if effects else 0.0},
    "where": [{"axis": axis} for axis in answer["where"]],
    "effects": [
        {
            "name": name,
            "source": "dynamics" if name in dynamics else "actuator",
            "parameters": {
                k: {"value": 1.01 * v, "unit": k, "ci": [v - abs(v), v + abs(v)]} for k, v in values.items()
            },
        }
        for name, values in effects.items()
    ],
    "candidates": [],
}
(out / "report.json").write_text(json.dumps(report))
if manner == "asks":
    rows = [f"0,{k / 100:g},{ASKED}" for k in range(50)]
    (out / "next_recording.csv").write_text("\n".join(["episode,t,current", *rows]) + "\n")
