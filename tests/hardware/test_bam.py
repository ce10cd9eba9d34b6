"""BAM's friction models: the same pendulum as ours where both have it, and found where they differ."""

from dataclasses import replace

import numpy as np
import pytest

from vision_s2r import diagnose
from vision_s2r.hardware import bam
from vision_s2r.joint import NominalJoint, pack, simulate
from vision_s2r.recording import JointRecording, split

NOMINAL = {
    "torque_constant": 1.0,
    "inertia": 0.03,
    "viscous_damping": 0.0,
    "coulomb_friction": 0.0,
    "gravity_torque": 1.3,
    "bias_torque": 0.0,
    "back_emf": 0.0,
    "proportional_gain": 26.0,
    "command_limit": 4.9,
}


def pendulum(model, step=bam.LONGEST_STEP, **given):
    """Three logs of a servo's swings, by the model itself."""
    time = np.arange(150) * 0.02
    target = np.stack([np.sin((1.0 + k) * time) * (1 + k) for k in range(3)])
    rows = np.stack([np.broadcast_to(time, target.shape), target, np.ones_like(target)], axis=-1)
    p = values(model, **given)
    position = np.stack([bam.run(p, np.array([0.03, 1.3, 26.0, 4.9]), each, np.zeros(2), step) for each in rows])
    return JointRecording(NOMINAL, 0.02, "rotary", target, position, None, np.full(3, 150), (0, 1, 2)), p


def values(model, **given):
    """The model's values, of which these are not neutral."""
    return bam.packed(model, np.array([(bam.NEUTRAL | given).get(name, 0.0) for name in bam.MODELS[model]]))


GEARS = {"load_dependent_friction": {"coefficient": 0.1}, "external_load_friction": {"coefficient": 0.25}}


@pytest.mark.parametrize("gears", [{}, GEARS])
def test_it_swings_as_our_simulator_does_under_dry_friction(gears):
    loaded = {"motor": 0.1, "external": 0.25} if gears else {}
    recording, _ = pendulum("M5", 1e-4, coulomb=0.1, viscous=0.05, back_emf=0.6, **loaded)
    effects = {"viscous_damping": {"value": 0.05}, "coulomb_friction": {"value": 0.1}, "back_emf": {"value": 0.6}}
    machine = pack(NominalJoint(**NOMINAL), effects | gears)[None]
    ours = simulate(machine, recording.command, np.zeros((3, 2)), 0.02, substeps=20)[0][..., 0]
    assert np.ptp(ours) > 1.0 and np.abs(ours - recording.position).max() < 1e-3


def test_friction_that_grows_with_load_is_found_by_the_model_that_has_it(monkeypatch):
    recording, p = pendulum("M3", coulomb=0.05, viscous=0.05, back_emf=0.6, motor=0.3)
    assert max(bam.errors(bam.logs_of(recording), p)) < 1e-12
    monkeypatch.setattr(bam, "RUNS", 1500)
    seen, unseen = split(recording, [0, 1]), split(recording, [2])
    (m1,), (m3,) = (bam.errors(bam.logs_of(unseen), bam.fit(model, seen)) for model in ("M1", "M3"))
    assert m3 < 1e-3 < 5e-3 < m1


@pytest.mark.slow
def test_gears_that_the_load_presses_are_what_the_diagnosis_names():
    recording, _ = pendulum("M5", 1e-4, coulomb=0.1, viscous=0.05, back_emf=0.6, external=0.25)
    noise = 2e-4 * np.random.default_rng(0).standard_normal(recording.position.shape)
    nominal = NOMINAL | {"viscous_damping": 0.05, "coulomb_friction": 0.1, "back_emf": 0.6}
    report = diagnose(replace(recording, nominal=nominal, position=recording.position + noise))
    assert [effect.name for effect in report.effects] == ["external_load_friction"]
    assert report.effects[0].parameters["coefficient"].value == pytest.approx(0.25, rel=0.02)


@pytest.mark.parametrize(("motor", "external", "expected"), [(2.0, 1.0, 0.3), (2.0, -1.0, 0.5 + 0.2), (1.0, -2.0, 0.5)])
def test_torques_against_each_other_load_a_gearbox_more(motor, external, expected):
    p = values("M6", motor=0.2, external=0.1, motor_quadratic=0.1, external_quadratic=0.2)
    assert bam.friction.py_func(p, motor, external, 0.0) == pytest.approx(expected)
