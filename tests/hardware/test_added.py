"""Effects added to logs: the log is that of a drive that has them."""

from dataclasses import replace

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
    "asymmetric_friction",
    "load_dependent_friction",
    "cogging",
    "thermal_drift",
    "latency",
)


TORQUES = (*EFFECTS, "torque_constant", "stribeck_friction")
TARGETS = (*EFFECTS, "proportional_gain")
NAMELESS = {"effects": [], "refitted": []}  # a report
SERVO = NOMINAL | {"proportional_gain": 12.0, "viscous_damping": 0.6, "coulomb_friction": 0.2}


def _log(nominal, command, sample_time):
    """Of a drive that is all that is believed."""
    states = _states(nominal, {}, command, sample_time)
    lengths = np.array([command.shape[1]])
    return JointRecording(nominal, sample_time, "rotary", command, states[..., 0], None, lengths, (0,))


def _states(nominal, effects, command, sample_time):
    return simulate(pack(NominalJoint(**nominal), effects)[None], command, np.zeros((1, 2)), sample_time)[0]


@pytest.fixture(scope="module")
def added():
    """By the command's kind and by effect; the joint moves slowly and fast, to either side."""
    t = np.arange(4000) * 1e-3
    torques = (2.0 * np.sin(2 * np.pi * 0.7 * t) + 1.5 * np.sin(2 * np.pi * 1.9 * t))[None]
    t = np.arange(600) * 0.02
    targets = (0.8 * np.sin(2 * np.pi * 0.13 * t) + 0.4 * np.sin(2 * np.pi * 0.37 * t))[None]
    logs = {"torque": _log(NOMINAL, torques, 1e-3), "target": _log(SERVO, targets, 0.02)}
    return {kind: {each.effect: each for each in with_effects(log, NAMELESS)} for kind, log in logs.items()}


@pytest.mark.parametrize(
    ("kind", "effect"), [*(("torque", each) for each in TORQUES), *(("target", each) for each in TARGETS)]
)
def test_a_drive_that_has_the_effect_moves_as_the_log_says(added, kind, effect):
    each = added[kind][effect]
    log = each.recording

    def missed(effects):
        states = _states(log.nominal, effects, log.command, log.sample_time)
        return float(np.sqrt(np.mean((states[..., 0] - log.position) ** 2)))

    assert missed({effect: dict(each.values)}) < 0.1 * missed({})


def test_a_drive_that_is_off_at_times_has_nothing_added_to_it():
    log = _log(SERVO, np.ones((1, 100)), 0.02)
    assert not list(with_effects(replace(log, supply=(log.time > 1.0).astype(float)), NAMELESS))


def test_an_encoder_with_steps_shows_nothing_between_them(added):
    each = added["torque"]["encoder_quantization"]
    steps = each.recording.position / each.size
    assert np.allclose(steps, np.round(steps), atol=1e-6) and len(added["torque"]) == len(TORQUES) + 1


@needs_emps
@pytest.mark.slow
@pytest.mark.parametrize("effect", ["coulomb_friction", "cogging", "load_dependent_friction"])
def test_what_is_added_to_a_real_axis_is_named_beside_what_it_has(effect):
    """A wrong value, what a wall before its speed stood in for, and what no likelihood beside an unknown told."""
    each = next(each for each in with_effects(read(EMPS / "estimation"), NAMELESS) if each.effect == effect)
    report = diagnose(each.recording, DiagnoseConfig()).to_dict()
    names = {named["name"]: named["parameters"] for named in report["effects"]}
    assert names.keys() == {effect, "asymmetric_friction"}
    assert names[effect][each.parameter]["value"] == pytest.approx(each.values[each.parameter], rel=0.1)
