"""Position servos: a perfect one has no gap, and what is added to it is named, at samples that jitter."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.diagnose.one_case import open_case
from vision_s2r.diagnose.replay import replay
from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.coordinates import log
from vision_s2r.fit.joint.free_run import free_run, gap_errors
from vision_s2r.fit.joint.smooth_unknown import ALL
from vision_s2r.joint import JOINT_EFFECTS, NominalJoint, Tables, pack, simulate
from vision_s2r.recording import JointRecording
from vision_s2r.report.reading import diagnosed, values

NOMINAL = {
    "torque_constant": 1.0,
    "inertia": 0.02,
    "viscous_damping": 0.25,
    "coulomb_friction": 0.05,
    "gravity_torque": 0.2,
    "bias_torque": 0.0,
    "proportional_gain": 11.6,
    "derivative_gain": 0.0,
    "command_limit": 7.4,
}


def a_servo(rate, effects, jitter=0.2, seconds=4.0, noise=2e-4, on=None, nominal=NOMINAL):
    """Five episodes of sines and jumps, simulated in steps of a quarter of a millisecond; `on` is what scales u."""
    rng = np.random.default_rng(0)
    t = np.arange(round(seconds * rate)) / rate + rng.uniform(0, jitter / rate, (5, round(seconds * rate)))
    t -= t[:, :1]
    target = 0.8 * np.sin(np.array([[2.0], [9.0], [4.0], [1.0], [3.0]]) * t)
    for row, hold in ((1, 0.6), (3, 1.1)):
        levels = rng.uniform(-1, 1, 20)
        levels[0] = 0
        target[row] = levels[(t[row] / hold).astype(int)]
    machine = pack(NominalJoint(**nominal), effects)[None]
    supply = None if on is None else np.broadcast_to(on, t.shape)
    steps = round(4000 / rate)
    states = simulate(machine, target, np.zeros((5, 2)), 1 / rate, times=t, scale=supply, substeps=steps)[0]
    position = states[..., 0] + noise * rng.standard_normal(t.shape)
    lengths = np.full(5, t.shape[1])
    recording = JointRecording(nominal, 1 / rate, "rotary", target, position, None, lengths, tuple(range(5)), t)
    return replace(recording, supply=supply)


def run(target, effects, rate, nominal=NOMINAL, external=None):
    """A recording of these targets [E, T]."""
    time = np.arange(target.shape[1]) / rate * np.ones((len(target), 1))
    first = np.stack([target[:, 0], np.zeros(len(target))], axis=1)
    machine = pack(NominalJoint(**nominal), effects)[None]
    states = simulate(machine, target, first, 1 / rate, times=time, substeps=round(4000 / rate), external=external)[0]
    position = states[..., 0] + 2e-4 * np.random.default_rng(1).standard_normal(target.shape)
    lengths = np.full(len(target), target.shape[1])
    numbers = tuple(range(len(target)))
    return JointRecording(
        nominal, 1 / rate, "rotary", target, position, None, lengths, numbers, time, external=external
    )


SLOW_MOTION = 0.5 * np.sin(np.array([[0.3], [0.4], [0.5]]) * np.arange(600) * 0.02)
STICKS = {"stribeck_friction": {"static": 0.3, "velocity": 0.1}}


@pytest.mark.slow
def test_a_joint_that_sticks_and_slips_is_told_from_one_that_rubs():
    sticks, rubs = (open_case(run(SLOW_MOTION, each, 50.0)) for each in (STICKS, {"coulomb_friction": {"value": 0.6}}))
    assert any("sticks and slips" in each for each in sticks.symptoms(Hypothesis({})))
    assert not rubs.symptoms(Hypothesis({}))


@pytest.mark.slow
def test_a_report_says_that_a_joint_sticks_and_slips():
    few = [each.name for each in JOINT_EFFECTS if each.name not in (*NOMINAL, "deadband")]  # for time's sake
    stairs = diagnose(run(SLOW_MOTION, STICKS, 50.0), DiagnoseConfig(withhold=few))
    assert any("sticks and slips" in each for each in stairs.unexplained.resembles)


def test_the_experiment_that_is_asked_for_shows_what_was_not_excited(tmp_path):
    limit = {"torque_speed_limit": {"stall": 1.4, "no_load_speed": 6.0}}
    gentle = 0.6 * np.sin(np.array([[0.8], [1.2], [1.6], [2.0], [0.5]]) * np.arange(300) * 0.02)
    few = [each.name for each in JOINT_EFFECTS if each.name not in (*limit, *NOMINAL, "latency")]  # for time's sake
    first = diagnose(run(gentle, limit, 50.0), DiagnoseConfig(withhold=few))
    states = {line.name: line.status for line in first.candidates}
    assert states["torque_speed_limit"] == "not_excited" and "show torque_speed_limit" in first.next_experiment
    asked = np.loadtxt(first.save(tmp_path / "report").parent / "next_recording.csv", delimiter=",", skiprows=1)
    target = asked[:, 2].reshape(int(asked[-1, 0]) + 1, -1)
    assert np.abs(target).max() <= 0.6
    case = open_case(run(target, limit, 50.0))
    name = frozenset({"torque_speed_limit"})
    found = case.fit(case.refitted | name, range(case.segments), None).values["torque_speed_limit"]
    assert found == pytest.approx(limit["torque_speed_limit"], rel=0.02)


def test_a_perfect_servo_has_no_gap():
    report = diagnose(a_servo(25.0, {}), DiagnoseConfig()).to_dict()
    assert report["verdict"] == "no_gap" and not report["effects"]
    assert report["gap"]["metric"] == "position_rmse" and report["gap"]["unit"] == "rad"


def test_what_a_servo_lacks_is_named_and_its_report_replays_to_the_digit(tmp_path):
    recording = a_servo(50.0, {"latency": {"delay": 0.013}})
    diagnosis = diagnose(recording, DiagnoseConfig())
    report = json.loads(json.dumps(diagnosis.to_dict()))
    assert [effect["name"] for effect in report["effects"]] == ["latency"] and report["verdict"] == "explained"
    assert report["effects"][0]["parameters"]["delay"]["value"] == pytest.approx(0.013, rel=0.02)
    states = {line["name"]: line["status"] for line in report["candidates"]}
    assert states["torque_constant"] == "absent" and states["deadband"] != "not_excited"
    assert diagnosis.case.simplify(diagnosis.case.refitted)[0] == frozenset(
        {"torque_constant", "inertia", "viscous_damping", "coulomb_friction", "bias_torque"}
    )  # the weight is what is known best
    unweighed = open_case(replace(recording, nominal={**NOMINAL, "gravity_torque": 0.0}))
    assert all("gravity_torque" in names for names in unweighed.simplify(unweighed.refitted))
    never_at_its_limit = replace(recording, nominal={**NOMINAL, "command_limit": 100.0})
    assert "one with the proportional gain" in open_case(never_at_its_limit).not_excited["torque_constant"]
    rivals = [diagnosis.settled.simulator.hypothesis, Hypothesis()]
    asked = diagnosis.case.experiment(rivals, ["position_offset"]).sentence
    assert "tells latency from without latency" in asked and "would show position_offset" in asked
    again = replay(recording, values(diagnosed(report)), tmp_path, held_out=report["held_out"])["gap"]
    assert {key: report["gap"][key] for key in again} == again
    rows = np.loadtxt(tmp_path / "replay.csv", delimiter=",", skiprows=1)
    assert np.sqrt(np.mean((rows[:, 4] - rows[:, 2]) ** 2)) == pytest.approx(again["after"], rel=1e-3)
    other = replay(a_servo(50.0, {}), values(diagnosed(report)), tmp_path, held_out=report["held_out"])
    assert "not seen" not in other["described"] and other["gap"]["after"] > other["gap"]["before"]


@pytest.mark.slow
def test_a_servo_that_answers_to_how_fast_its_error_changes_is_told_from_one_that_brakes_or_is_late():
    truth = {"gain": 0.2, "time_constant": 0.012}
    report = diagnose(a_servo(50.0, {"derivative_on_error": truth}))
    assert report.verdict == "explained" and [effect.name for effect in report.effects] == ["derivative_on_error"]
    found = {name: each.value for name, each in report.effects[0].parameters.items()}
    assert found == pytest.approx(truth, rel=0.03)


@pytest.mark.slow
def test_a_gain_is_found_beside_a_stronger_effect_though_a_guessed_damping_does_most_of_its_work():
    truth = {"deadband": {"width": 0.0288}, "derivative_on_error": {"gain": 0.0189, "time_constant": 0.0072}}
    soft = {
        **NOMINAL,
        "torque_constant": 0.7268,
        "inertia": 0.01456,
        "viscous_damping": 0.3184,
        "bias_torque": 0.0923,
        "proportional_gain": 5.707,
        "command_limit": 2.131,
    }
    report = diagnose(a_servo(200.0, truth, nominal=soft))
    assert report.verdict == "explained" and {effect.name for effect in report.effects} == truth.keys()


@pytest.mark.slow
def test_an_encoder_without_steps_is_not_tried_where_something_is_left():
    few = [each.name for each in JOINT_EFFECTS if each.name not in (*NOMINAL, "encoder_quantization")]
    kick = {"derivative_on_error": {"gain": 0.2, "time_constant": 0.012}}
    report = diagnose(a_servo(50.0, kick), DiagnoseConfig(withhold=few))
    assert "explained" in report.verdict and "encoder_quantization" not in {each.name for each in report.refitted}


@pytest.mark.slow
def test_one_limit_is_named_rather_than_a_gain_and_a_constant_that_make_up_for_each_other():
    report = diagnose(a_servo(50.0, {"torque_saturation": {"limit": 6.0}}))
    assert [effect.name for effect in report.effects] == ["torque_saturation"]


@pytest.mark.slow
def test_one_gain_is_named_rather_than_a_damping_and_a_limit_that_make_up_for_it():
    nominal = {**NOMINAL, "derivative_gain": 0.23, "command_limit": 3.2}
    report = diagnose(a_servo(50.0, {"derivative_gain": {"value": 0.215}}, nominal=nominal))
    assert [effect.name for effect in report.effects] == ["derivative_gain"] and report.verdict == "explained"
    assert report.effects[0].parameters["value"].value == pytest.approx(0.215, rel=0.01)


@pytest.mark.slow
def test_two_effects_are_named_rather_than_three_that_make_up_for_them():
    truth = {"derivative_gain": {"value": 0.12}, "asymmetric_friction": {"coulomb": 0.03, "viscous": 0.02}}
    nominal = {**NOMINAL, "derivative_gain": 0.23, "command_limit": 3.2}
    report = diagnose(a_servo(50.0, truth, nominal=nominal))
    assert {effect.name for effect in report.effects} == truth.keys() and report.verdict == "explained"


def test_a_delay_of_a_thirtieth_of_a_sample_is_seen():
    case = open_case(a_servo(25.0, {"latency": {"delay": 0.0012}}))
    base = case.fit(case.refitted, range(case.segments), None)
    gains = case.screen(base, sorted(case.library.keys() - base.values.keys()))
    assert max(gains, key=lambda name: gains[name]) == "latency" and gains["latency"] > 100


def test_a_fit_starts_from_no_limit_that_nothing_reaches():
    """It would be likelier than starts that are nearer to the truth, and no slope leads away from it."""
    case = open_case(a_servo(50.0, {}))
    base = case.fit(case.refitted, range(case.segments), None)
    assert case.screen(base, ["torque_speed_limit"])["torque_speed_limit"] < -10


def test_an_interval_allows_for_an_encoder_that_is_read_some_microseconds_late():
    recording = a_servo(50.0, {"latency": {"delay": 0.013}}, noise=1e-6)
    late = recording.position + 4e-5 * np.gradient(recording.position, axis=1) / np.gradient(recording.time, axis=1)
    case = open_case(replace(recording, position=late))
    found = case.fit(case.refitted | {"latency"}, range(case.segments), None)
    low, high = case.intervals(found)["latency"]["delay"]
    assert low < 0.013 < high < 0.0134


@pytest.mark.slow
def test_a_drive_that_is_off_tells_the_motors_damping_from_friction():
    """And a simulation that runs away is no perfect fit."""
    truth = {"viscous_damping": {"value": 0.05}, "back_emf": {"value": 0.3}}
    on = np.where(np.arange(200) % 50 < 30, 1.0, 0.0)
    case = open_case(a_servo(50.0, truth, on=on))
    found = case.fit(case.refitted, range(case.segments), None).values
    assert found["back_emf"]["value"] == pytest.approx(0.3, rel=0.03)
    assert found["viscous_damping"]["value"] == pytest.approx(0.05, rel=0.1)
    wild = {**found, "inertia": {"value": 0.001}, "back_emf": {"value": 50.0}}
    assert case.excess(Hypothesis(wild), [0])[0] > 1e3


def test_what_is_believed_parts_a_motors_brake_from_friction_where_its_drive_is_never_off():
    recording = a_servo(50.0, {"viscous_damping": {"value": 0.05}, "back_emf": {"value": 0.3}})
    case = open_case(replace(recording, nominal={**NOMINAL, "viscous_damping": 0.02, "back_emf": 0.25}))
    found = case.fit(case.refitted, range(case.segments), None).values
    friction, brake = found["viscous_damping"]["value"], found["back_emf"]["value"]
    assert (
        friction + brake == pytest.approx(0.35, rel=0.03)
        and brake > 0.25
        and "never off" in case.not_excited["back_emf"]
    )


def test_a_sensor_that_is_believed_to_stretch_leaves_what_it_shows():
    recording = a_servo(50.0, {})
    other = replace(recording, position=recording.position.copy())
    other.position[:, 30:] += 0.01
    bent = Hypothesis({}, {"sensor_nonlinearity": np.array([0.3, 0.0, 0.2, 0.1])})
    left = [open_case(each)._fitter.residuals(bent, range(5)) for each in (recording, other)]
    assert (left[1] - left[0])[:, 30:] == pytest.approx(0.01, rel=1e-6)


def test_a_servo_that_holds_still_has_no_gap_rather_than_no_noise():
    still = replace(a_servo(50.0, {}), command=np.zeros((5, 200)), position=np.zeros((5, 200)))
    still.position[:, 100:] = 0.0015
    case = open_case(replace(still, nominal={**NOMINAL, "coulomb_friction": 0.5}))
    assert np.isfinite(case.excess(Hypothesis(), range(5))).all() and 1e-8 < case.noise[0] < 1e-6


def test_a_load_that_swings_while_the_drive_is_off_is_found_from_far():
    """Swings that fall out of step with the measured ones would hold a free run's fit in another optimum."""
    truth = {"gravity_torque": 1.2, "viscous_damping": 0.02, "inertia": 0.016, "coulomb_friction": 0.01}
    effects = {name: {"value": value} for name, value in truth.items()}
    case = open_case(a_servo(50.0, effects, seconds=6.0, on=np.where(np.arange(300) < 60, 1.0, 0.0)))
    found = case.fit(case.refitted, range(case.segments), None).values
    assert {name: found[name]["value"] for name in truth} == pytest.approx(truth, rel=0.05)


def test_what_short_steps_do_not_show_stays_near_what_was_believed():
    """Weight and friction would do the work of what the simulator lacks, and be wrong wherever the joint goes else."""
    lacking = {"acceleration_limit": {"value": 60.0}, "latency": {"delay": 0.03}}
    jumps = 0.12 * np.repeat(np.random.default_rng(3).choice([-1.0, 1.0], (5, 8)), 25, axis=1)
    jumps[:, 0] = 0.0
    sines = 0.8 * np.sin(np.array([[0.8], [1.3], [0.5], [1.0], [0.6]]) * np.arange(200) * 0.02)
    recording, other = run(jumps, lacking, 50.0), run(sines, lacking, 50.0)
    case = open_case(recording)
    found = case.fit(case.refitted, range(case.segments), None)
    believed, identified = (
        [np.nanmean(np.sqrt(gap_errors(each, free_run(each, given)))) for each in (recording, other)]
        for given in ({}, found.values)
    )
    assert (np.array(identified) < 0.7 * np.array(believed)).all()
    for name, ends in case.intervals(found).items():  # about the truth, but for what delays as the bus and the limit do
        low, high = ends["value"]
        assert 0.95 * low < NOMINAL[name] < 1.05 * high or name in ("viscous_damping", "inertia")


def test_rests_that_are_met_to_the_digit_do_not_hold_a_fit():
    """Nor does what is believed: dry friction ten times as large is found, although most samples are at rest."""
    truth = {"coulomb_friction": {"value": 0.5}, "bias_torque": {"value": -0.5}, "latency": {"delay": 0.02}}
    jumps = np.repeat(np.random.default_rng(5).uniform(-0.15, 0.15, (5, 6)), 50, axis=1)
    jumps[:, :10] = 0.0
    recording = run(jumps, truth, 50.0)
    recording = replace(recording, position=0.0015 * np.round(recording.position / 0.0015))
    case = open_case(recording)
    assert case._fitter.floor.scale[0] > 0.5 * 0.0015**2 / 12
    found = case.fit(case.refitted | frozenset(case.certain), range(case.segments), None).values
    for name in ("coulomb_friction", "bias_torque"):
        assert found[name]["value"] == pytest.approx(truth[name]["value"], rel=0.02)


@pytest.mark.parametrize("fast", [True, False])
def test_an_encoder_whose_steps_lie_half_a_step_beside_zero_is_read_with_its_true_step(fast):
    """However fast the joint moves, and where it goes so slowly that few rows are a step apart."""
    step = 2 * np.pi / 4096
    recording = a_servo(200.0, {}) if fast else run(0.02 * np.sin(0.4 * np.arange(600) * 0.02)[None], {}, 50.0)
    position = step * (np.floor(recording.position / step) + 0.5)
    case = open_case(replace(recording, position=position))
    assert list(case.certain) == ["encoder_quantization"]
    found = case.fit(case.refitted | frozenset(case.certain), range(case.segments), None)
    values, intervals = (each["encoder_quantization"] for each in (found.values, case.intervals(found)))
    assert values["resolution"] == pytest.approx(step, rel=1e-6) and values["offset"] == pytest.approx(step / 2)
    low, high = intervals["offset"]
    assert low < values["offset"] < high
    shown = free_run(case.recording, found.values)[..., 0]
    assert np.abs((shown / step) % 1 - 0.5).max() < 1e-6


def test_a_weight_that_is_hung_askew_is_told_from_a_constant_torque():
    recording = a_servo(50.0, {"position_offset": {"value": 0.18}}, noise=1e-5)
    case = open_case(recording)
    base = case.fit(case.refitted, range(case.segments), None)
    gains = case.screen(base, sorted(case.library.keys() - base.values.keys()))
    assert max(gains, key=lambda name: gains[name]) == "position_offset"


def test_noise_is_what_the_end_of_a_search_leaves_where_samples_are_few():
    """At 25 Hz a spring's ringing is as fast as noise is."""
    truth = {"compliance": {"stiffness": 14.0, "damping": 0.02}}
    case = open_case(a_servo(25.0, truth, seconds=6.0))
    assert case.noise[0] > 1e-6
    quieter = case.quieter(Hypothesis(truth))
    assert quieter is not None and quieter.noise[0] == pytest.approx(4e-8, rel=0.3)
    assert quieter.quieter(quieter.likely) is None


def test_a_servos_gain_is_seen_behind_the_friction_that_was_refitted_in_its_place():
    """Without a rotor's weight friction and gain say nearly the same, and a guess that is a little off says nothing."""
    light = NOMINAL | {"inertia": 1e-4, "gravity_torque": 0.0}
    lively, pushed = np.cumsum(np.random.default_rng(3).standard_normal((2, 4, 800)), axis=2) * [[[0.02]], [[0.0001]]]
    case = open_case(run(lively, {"proportional_gain": {"value": 7.9}}, 100.0, light, pushed))
    refitted = case.fit(case.refitted, range(case.segments), None)
    assert case.screen(refitted, ["proportional_gain"])["proportional_gain"] > 5


def test_what_is_believed_may_be_wrong_by_any_factor():
    truth = 200 * NOMINAL["viscous_damping"]
    recording = a_servo(50.0, {"viscous_damping": {"value": truth}}, seconds=6.0)
    case = open_case(recording)
    found = case.fit(frozenset({"viscous_damping"}), range(case.segments), None)
    assert found.values["viscous_damping"]["value"] == pytest.approx(truth, rel=0.01)


@pytest.mark.slow
def test_a_drive_that_gives_way_under_load_passes_for_no_effect():
    recording = a_servo(100.0, {})
    root = np.linspace(-3, 3, 41)  # of N·m
    asked = root * np.abs(root)
    sag = -0.4 * asked * np.abs(asked) / 7.4
    machine = np.r_[pack(NominalJoint(**NOMINAL), {}), sag][None]
    states = simulate(
        machine, recording.command, np.zeros((5, 2)), 0.01, times=recording.times, substeps=40,
        tables=Tables(torque=(-3.0, 3.0, 41)),
    )[0]  # fmt: skip
    noise = 2e-4 * np.random.default_rng(1).standard_normal(recording.position.shape)
    report = diagnose(replace(recording, position=states[..., 0] + noise), DiagnoseConfig()).to_dict()
    resembled = report["unexplained"]["resembles"]  # beside the power drawn, which says much the same
    assert not report["effects"] and any("not proportional to the command" in each for each in resembled)


def test_slopes_of_torques_are_those_of_differences_whatever_goes_in_and_comes_out():
    on = np.where(np.arange(200) % 50 < 30, 1.0, 0.0)  # an observer leads the load while it swings freely
    smooth = {**NOMINAL, "coulomb_friction": 0.0}  # where a torque has a kink, differences depend on their length
    recording = a_servo(50.0, {}, on=on, nominal=smooth)
    case = open_case(replace(recording, source=np.array([0, 0, 0, 1, 1])))
    observer, rng = case._fitter.observer, np.random.default_rng(0)
    free = case.refitted - {"coulomb_friction"} | {"position_offset"}
    space = case._fitter.space(case._with_own(free) | ALL)
    point = space.start(Hypothesis({"position_offset": {"value": 0.02}}))
    own = len(space.coordinates)
    scales = np.concatenate([np.full(each.size, each.scale) for each in space.discrepancies])
    bent = [owner not in ("input_nonlinearity", "torque_of_velocity") for owner in space.owner[own:]]
    point[own:] += 0.02 * scales * bent * rng.standard_normal(len(scales))
    point = np.clip(point, space.low, space.high)
    episodes = [0, 3, 4]
    here = observer.residuals(space, point[None], episodes)[0]
    torques, found = observer.tangents(space, point, episodes)
    assert {space.owner[k] for k in torques} >= {"torque_of_time", "gain_of_power", "friction_of_position", "own_bias"}
    expected = observer.by_differences(space, point, here, episodes, 0.01, torques)
    for slopes, differences in zip(found, expected, strict=True):
        assert np.linalg.norm(slopes - differences) <= 0.05 * np.linalg.norm(differences) + 1e-3
    whole = observer.slopes(space, point, here, episodes)
    np.testing.assert_array_equal(whole[torques], found)


@pytest.mark.parametrize("ends", [(1e-20, 1e-17), (1e12, 1e15)])
def test_a_joint_that_stands_still_has_ranges_that_effects_may_have(ends) -> None:
    """A gripper that is held while the arm moves ended in `acceleration_limit: value is 8e-19`."""
    parameter = JOINT_EFFECTS["acceleration_limit"].parameters[0]
    there = log("value", *ends).within(parameter)
    assert there.low <= there.high
    for end in (there.low, there.high):
        parameter.check(math.exp(end), "acceleration_limit")


def test_a_joint_that_is_only_held_shows_its_dry_friction_at_most():
    """A gripper that is held would stay so under any limit; on other motions such a limit would hold it there."""
    recording = a_servo(50, {})
    still = replace(
        recording, command=np.full_like(recording.command, 0.5), position=np.full_like(recording.time, 0.504)
    )
    case = open_case(still, [], 1)
    assert case.not_excited.keys() >= set(case.library) - {"coulomb_friction"}
    needed = 0.2 * math.sin(0.504) + 0.004 * still.nominal["proportional_gain"]
    found = case.fit(frozenset({"coulomb_friction"}), range(case.segments), None)
    assert needed <= found.values["coulomb_friction"]["value"] < 1.05 * needed
    assert case.refitted == {"coulomb_friction"} and case.error(found, range(case.segments)).max() < 1e-12
    assert not open_case(recording, [], 1).not_excited.keys() & {"velocity_limit", "viscous_damping"}
