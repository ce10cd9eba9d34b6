"""Effects added to logs: the log is that of a drive that has them."""

import numpy as np
import pytest
from recordings import EMPS, NOMINAL, needs_emps

from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.hardware.added import with_effects
from vision_s2r.joint import NominalJoint, pack, simulate
from vision_s2r.recording import JointRecording, read

EFFECTS = (
    "viscous_damping",
    "coulomb_friction",
    "bias_torque",
    "inertia",
    "torque_constant",
    "asymmetric_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "cogging",
    "thermal_drift",
    "latency",
)


@pytest.fixture(scope="module")
def added():
    """Of a drive that is all that is believed, by effect; it moves slowly and fast, to either side."""
    t = np.arange(4000) * 1e-3
    command = (2.0 * np.sin(2 * np.pi * 0.7 * t) + 1.5 * np.sin(2 * np.pi * 1.9 * t))[None]
    states = simulate(pack(NominalJoint(**NOMINAL), {})[None], command, np.zeros((1, 2)), 1e-3)[0]
    log = JointRecording(NOMINAL, 1e-3, "rotary", command, states[..., 0], None, np.array([4000]), (0,))
    return {each.effect: each for each in with_effects(log)}


@pytest.mark.parametrize("effect", EFFECTS)
def test_a_drive_that_has_the_effect_moves_as_the_log_says(added, effect):
    each = added[effect]
    log = each.recording

    def missed(effects):
        machine = pack(NominalJoint(**NOMINAL), effects)[None]
        states = simulate(machine, log.command, np.zeros((1, 2)), log.sample_time)[0]
        return float(np.sqrt(np.mean((states[..., 0] - log.position) ** 2)))

    assert missed({effect: dict(each.values)}) < 0.1 * missed({})


def test_an_encoder_with_steps_shows_nothing_between_them(added):
    each = added["encoder_quantization"]
    steps = each.recording.position / each.size
    assert np.allclose(steps, np.round(steps), atol=1e-6) and len(added) == len(EFFECTS) + 1


@needs_emps
@pytest.mark.slow
@pytest.mark.parametrize("effect", ["coulomb_friction", "cogging", "load_dependent_friction"])
def test_what_is_added_to_a_real_axis_is_named_beside_what_it_has(effect):
    """A wrong value, what a wall before its speed stood in for, and what no likelihood beside an unknown told."""
    each = next(each for each in with_effects(read(EMPS / "estimation")) if each.effect == effect)
    report = diagnose(each.recording, DiagnoseConfig()).to_dict()
    names = {named["name"]: named["parameters"] for named in report["effects"]}
    assert names.keys() == {effect, "asymmetric_friction"}
    assert names[effect][each.parameter]["value"] == pytest.approx(each.values[each.parameter], rel=0.1)
