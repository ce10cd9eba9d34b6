"""Machines with known effects come out as they are, with what is unsure said to be so."""

import dataclasses
import json

import numpy as np
import pytest
from machines import NOMINAL, a_log, steps

from vision_s2r.errors import UserError
from vision_s2r.fit.joint.case import JointCase
from vision_s2r.fit.joint.discrepancy import OWN_BIAS
from vision_s2r.identify import IdentifyConfig, identify, identify_all
from vision_s2r.identify.config import HoldConfig
from vision_s2r.joint import JOINT_EFFECTS, Tables
from vision_s2r.randomize import load_distribution
from vision_s2r.recording import write
from vision_s2r.recording.joined import joined

TRUTH = {
    "viscous_damping": {"value": 0.15},
    "coulomb_friction": {"value": 0.05},
    "inertia": {"value": 0.018},
    "compliance": {"stiffness": 8.0, "damping": 0.02},
}


@pytest.fixture(scope="module")
def springy(tmp_path_factory):
    """The folder of an identification of a joint with a spring, from the command's configuration to its files."""
    folder = tmp_path_factory.mktemp("springy")
    log, other = (
        str(write(a_log(TRUTH, steps(4, samples)), folder / name)) for name, samples in (("a", 600), ("b", 300))
    )
    identify_all(IdentifyConfig(recording=log, effects=["compliance"], validate=other, out=str(folder / "out")))
    return folder / "out"


def test_parameters_and_effects_lie_in_their_intervals(springy):
    result = json.loads((springy / "identified.json").read_text())
    found = {each["name"]: each["parameters"] for each in result["effects"]}
    truth = {name: {"value": value} for name, value in NOMINAL.items() if name != "torque_constant"} | TRUTH
    assert found.keys() == truth.keys()
    for name, given in truth.items():
        for key, value in given.items():
            low, high = found[name][key]["ci"]
            assert low <= value <= high, (name, key)
            assert high - low <= max(0.1 * abs(value), 2e-3), (name, key)
    assert result["unidentified"] == [] and result["doubtful"] == []
    assert result["intervals_of"] == "this recording"
    gap = result["gap"]
    assert gap["before"] > 10 * gap["floor"] and gap["after"] < 1.1 * gap["floor"] < gap["refitted"]
    assert result["validation"]["velocity_rmse"]["after"] < 0.05 * result["validation"]["velocity_rmse"]["before"]


def test_where_the_simulator_lacks_something_intervals_hold_what_another_motion_says():
    """A quadratic drag: of a slow motion its damping is small, of a fast one large."""
    speeds = np.linspace(-20.0, 20.0, 81)
    drag = Tables(velocity=(-20.0, 20.0, len(speeds))), -0.01 * speeds * np.abs(speeds)
    slow, fast = (identify(a_log({}, share * steps(5, 300), unknown=drag)) for share in (0.4, 1.0))
    (low, high), (least, most) = (each.estimate.intervals["viscous_damping"]["value"] for each in (slow, fast))
    assert low < least < high < most
    assert all("as wide as another motion" in each.summary() for each in (slow, fast))
    at = fast.estimate.labels.index(("viscous_damping", "value"))
    deviation = np.sqrt(fast.estimate.covariance[at, at])
    assert 2 * 1.96 * deviation == pytest.approx(most - least, rel=0.3)  # the interval is of a logarithm


def test_the_posterior_is_the_intervals(springy):
    result = json.loads((springy / "identified.json").read_text())
    drawn = load_distribution(springy / "posterior.yaml", JOINT_EFFECTS).sample(4000, np.random.default_rng(0))
    for effect in result["effects"]:
        for key, each in effect["parameters"].items():
            values, (low, high) = drawn[effect["name"]][key], each["ci"]
            assert np.quantile(values, [0.025, 0.975]) == pytest.approx([low, high], abs=0.05 * (high - low))
    labels = [label.partition(".") for label in result["correlation"]["parameters"]]
    columns = [drawn[name][key or "value"] for name, _, key in labels]
    assert np.corrcoef(columns) == pytest.approx(np.array(result["correlation"]["matrix"]), abs=0.08)


def test_pictures_and_the_patch_are_there(springy):
    names = {path.name for path in springy.iterdir()}
    assert {"before_after.png", "where.png", "correlation.png", "patch"} <= names
    assert "compliance" in (springy / "patch" / "joint.yaml").read_text()


def test_a_torque_constant_needs_something_known():
    log = a_log({"torque_constant": {"value": 0.45}, "inertia": {"value": 0.018}})
    found = identify(log, IdentifyConfig(effects=["torque_constant"], hold=HoldConfig(inertia=0.018)))
    assert found.values["torque_constant"]["value"] == pytest.approx(0.45, rel=0.01)
    assert found.left == {} and found.values["inertia"]["value"] == 0.018
    found = identify(log, IdentifyConfig(effects=["torque_constant"]))
    assert "scales everything" in found.left["inertia"].why
    assert found.values["torque_constant"]["value"] == pytest.approx(0.45 * 0.02 / 0.018, rel=0.01)


def test_what_is_absent_or_silent_is_said_to_be_so():
    found = identify(a_log({}), IdentifyConfig(effects=["backlash", "torque_saturation"]))
    assert "end of its range" in found.doubts["backlash"].why
    assert "end of its range" in found.doubts["torque_saturation"].why
    weak = a_log({}, steps(largest=0.1))  # which hardly moves its own friction
    found = identify(weak, IdentifyConfig(effects=["torque_saturation"]))
    assert found.left["torque_saturation"].why == "the torque never comes near a plausible limit"


@pytest.mark.parametrize("current", [0.0, 0.03])
def test_a_joint_at_rest_shows_nothing(current):
    resting = a_log({"coulomb_friction": {"value": 0.05}}, np.full((3, 300), current))
    with pytest.raises(UserError, match=r"nothing can be identified \(.*inertia: .*\).*[Ff]ast reversals") as error:
        identify(resting, IdentifyConfig())
    assert "\n" not in str(error.value)


def test_a_joint_that_never_moves_at_all():
    still = a_log({}, np.zeros((3, 300)), noise=(0.0, 0.0))
    with pytest.raises(UserError, match="the joint never moves"):
        identify(still, IdentifyConfig())


@pytest.mark.slow
def test_several_recordings_of_a_joint_together(tmp_path):
    """What one shows and the other does not: dry friction from slow motion, inertia from fast."""
    truth = {"viscous_damping": {"value": 0.15}, "coulomb_friction": {"value": 0.05}, "inertia": {"value": 0.018}}
    logs = [
        a_log(truth, steps(2, samples, largest, seed), seed=seed)
        for seed, samples, largest in ((2, 300, 0.4), (3, 400, 1.8))
    ]
    folders = [str(write(log, tmp_path / name)) for name, log in zip("ab", logs, strict=True)]
    apart = identify_all(IdentifyConfig(recording=folders, out=str(tmp_path / "apart")))
    (path,) = identify_all(IdentifyConfig(recording=folders, together=True, out=str(tmp_path / "out")))

    def widths(file):
        effects = json.loads(file.read_text())["effects"]
        return {each["name"]: np.ptp(each["parameters"]["value"]["ci"]) for each in effects}

    one, together = [widths(each) for each in apart], widths(path)
    for name, given in truth.items():
        assert together[name] < min(each.get(name, np.inf) for each in one), name
        low, high = next(e for e in json.loads(path.read_text())["effects"] if e["name"] == name)["parameters"][
            "value"
        ]["ci"]
        assert low <= given["value"] <= high, name


def test_recordings_that_are_not_of_one_joint_are_not_joined(tmp_path):
    one = a_log({})
    heavier = dataclasses.replace(one, nominal=NOMINAL | {"inertia": 0.03})
    folders = [str(write(log, tmp_path / name)) for name, log in (("a", one), ("b", heavier))]
    with pytest.raises(UserError, match=r"differ in nominal inertia, 0\.02 and 0\.03"):
        identify_all(IdentifyConfig(recording=folders, together=True, out=str(tmp_path / "out")))


def _together(folder, logs, **options):
    """What is identified from logs of one joint: identified.json, and its effects by name."""
    folders = [str(write(log, folder / str(k))) for k, log in enumerate(logs)]
    cfg = IdentifyConfig(recording=folders, together=True, out=str(folder / "out"), **options)
    result = json.loads(identify_all(cfg)[0].read_text())
    return result, {each["name"]: each["parameters"]["value"] for each in result["effects"]}


@pytest.mark.parametrize("method", ["forward", pytest.param("inverse", marks=pytest.mark.slow)])
def test_recordings_of_a_joint_have_a_bias_torque_each(tmp_path, method):
    """A load cell's or a driver's zero is set anew each time: one for all would pass for friction and noise."""
    truth = {"viscous_damping": {"value": 0.15}, "coulomb_friction": {"value": 0.05}, "inertia": {"value": 0.018}}
    biases = {"a": 0.06, "b": -0.05, "c": 0.02}
    logs = [
        a_log(truth | {"bias_torque": {"value": bias}}, steps(1, 1000, seed=seed), seed=seed)
        for seed, bias in enumerate(biases.values(), 2)
    ]
    result, found = _together(tmp_path, logs, method=method)
    for name, given in truth.items():
        assert found[name]["value"] == pytest.approx(given["value"], rel=0.01), name
    assert found["bias_torque"]["value"] == pytest.approx(biases["a"], abs=1e-3)
    assert [each["recording"] for each in result["offsets"]] == [1, 2]
    for each, name in zip(result["offsets"], "bc", strict=True):
        more = each["bias_torque"]
        assert more["value"] == pytest.approx(biases[name] - biases["a"], abs=1e-3)
        reach = (more["ci"][1] - more["ci"][0]) / 2
        assert abs(more["value"] - biases[name] + biases["a"]) < 2 * reach < 0.01
    assert result["gap"]["after"] < (1.1 if method == "forward" else 10) * result["gap"]["floor"]


@pytest.mark.slow
def test_recordings_of_a_joint_have_a_position_offset_each(tmp_path):
    """An encoder whose zero is set anew each time shows the same weight elsewhere."""
    zeros = {"a": 0.1, "b": -0.35, "c": 0.4}
    truth = {"gravity_torque": {"value": 0.5}, "viscous_damping": {"value": 0.15}}
    logs = []
    for seed, zero in enumerate(zeros.values(), 2):
        log = a_log(truth | {"position_offset": {"value": zero}}, steps(1, 1000, seed=seed), seed=seed)
        logs.append(dataclasses.replace(log, nominal=NOMINAL | {"gravity_torque": 0.45}))
    result, found = _together(tmp_path, logs, effects=["position_offset"])
    for name, given in truth.items():
        assert found[name]["value"] == pytest.approx(given["value"], rel=0.01), name
    assert found["position_offset"]["value"] == pytest.approx(zeros["a"], abs=3e-3)
    for each, name in zip(result["offsets"], "bc", strict=True):
        more = each["position_offset"]
        assert more["value"] == pytest.approx(zeros[name] - zeros["a"], abs=5e-3)
        assert more["ci"][0] < zeros[name] - zeros["a"] < more["ci"][1]
        assert each["bias_torque"]["value"] == pytest.approx(0.0, abs=2e-3)
    assert result["gap"]["after"] < 1.1 * result["gap"]["floor"]


@pytest.mark.parametrize("loads", [("load_inertia",), ("external", "load_inertia")])
def test_recordings_whose_loads_change_within_a_sample_are_joined(loads):
    """A bias torque of each recording's own is added to loads of several values a sample, or stands beside them."""
    logs = []
    for seed, samples, bias in ((1, 400, 0.02), (2, 300, -0.03)):
        log = a_log({"bias_torque": {"value": bias}}, steps(1, samples, seed=seed), seed=seed)
        logs.append(dataclasses.replace(log, **{name: np.full((1, 2 * samples), 1e-6) for name in loads}))
    together = joined(logs)
    assert together.load_inertia.shape == (2, 800)
    assert (together.load_inertia[1, :600] == 1e-6).all() and not together.load_inertia[1, 600:].any()
    case = JointCase(together, {each.name: each for each in JOINT_EFFECTS})
    found = case.fit(frozenset({"bias_torque"}), range(case.segments), None)
    assert found.extra[OWN_BIAS] == pytest.approx([-0.05], abs=2e-3)
    shared = dataclasses.replace(found, extra={OWN_BIAS: np.zeros(1)})
    every = range(case.segments)
    assert case.error(found, every).mean() < 0.1 * case.error(shared, every).mean()


def test_an_effect_as_large_as_is_plausible_is_seen():
    """Half a sample of latency was called not excited: with as much beside it, nothing moves."""
    case = JointCase(a_log({"latency": {"delay": 0.005}}, steps(2, 400)), {each.name: each for each in JOINT_EFFECTS})
    fitted = case.fit(frozenset({"latency"}), range(case.segments), None)
    assert fitted.values["latency"]["delay"] == pytest.approx(0.005, abs=1e-4)
    assert "latency" not in case.unshown(fitted)
