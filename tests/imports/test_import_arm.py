"""The joints of a log as an arm: signs and zeros that only gravity tells."""

from dataclasses import replace

import numpy as np
import pytest
from recordings import TWO_LINKS

from vision_s2r.arm.bodies import Bodies
from vision_s2r.arm.model import ArmModel
from vision_s2r.errors import UserError
from vision_s2r.imports.arm import place, write_arms
from vision_s2r.imports.convert import Imported
from vision_s2r.imports.table import ImportOptions, JointTable
from vision_s2r.recording import read

SIGN, ZERO = {"shoulder": 1, "elbow": -1}, {"shoulder": 0.0, "elbow": 0.2}


T = np.arange(800) * 0.05
POSITION = np.stack([0.9 * np.sin(0.35 * T), 1.1 * np.sin(0.5 * T + 1)], axis=1)


def the_tables(position=POSITION, noise=0.0, sign=SIGN, zero=ZERO):
    """A slow motion of two servos that give way to weight, logged by an elbow that counts the other way."""
    bodies = Bodies(ArmModel(TWO_LINKS), list(sign), {})
    load = np.array([bodies.terms(q, np.zeros(2))[1] for q in position])
    target = position + (load + 0.05 * np.sign(np.gradient(position, axis=0))) / 60 + noise
    tables = []
    for j, name in enumerate(sign):
        rows = {"target": target[:, j], "position": position[:, j]}
        columns = {key: sign[name] * (values - zero[name]) for key, values in rows.items()}
        columns["velocity"] = np.gradient(columns["position"], 0.05)
        tables.append(JointTable(f"motion/{name}", {"episode": np.zeros(len(T)), "t": T} | columns, "sts3215"))
    return tables


def test_gravity_tells_the_sign_and_the_zero_of_a_joint(tmp_path):
    placed = place(the_tables(), ArmModel(TWO_LINKS), {"shoulder": "shoulder", "elbow": "elbow"})
    assert placed.sign == SIGN
    assert placed.zero == pytest.approx(ZERO, abs=0.05)
    assert placed.explained > 0.8 and "other sign explains" in placed.why["elbow"]
    options = ImportOptions(model=str(TWO_LINKS), joints={"shoulder": "shoulder", "elbow": "elbow"}, tip="tool")
    ((folder, summary),) = write_arms(the_tables(), tmp_path / "arm", options)
    assert "left out: velocity of shoulder, elbow: an arm's is" in str(Imported(folder, summary))
    recording = read(folder)
    assert (
        list(recording.joints) == ["shoulder", "elbow"] and recording.tip == "tool" and "−elbow" in summary["joints"][1]
    )
    np.testing.assert_allclose(recording.position[0], POSITION, atol=0.06)


def test_a_joint_that_the_model_lacks_is_said():
    with pytest.raises(UserError, match=r"no joint 'elbw' in two_links\.xml, did you mean 'elbow'"):
        place(the_tables(), ArmModel(TWO_LINKS), {"shoulder": "shoulder", "elbow": "elbw"})


def test_a_tip_that_the_model_lacks_is_said(tmp_path):
    options = ImportOptions(model=str(TWO_LINKS), joints={"shoulder": "shoulder", "elbow": "elbow"}, tip="tol")
    with pytest.raises(UserError, match=r"tip: no 'tol' in two_links\.xml, did you mean 'tool'"):
        write_arms(the_tables(), tmp_path / "arm", options)


def test_degrees_are_said_at_the_import_and_nothing_is_left(tmp_path):
    tables = the_tables()
    tables = [
        replace(each, columns=each.columns | {"position": np.rad2deg(each.columns["position"])}) for each in tables
    ]
    options = ImportOptions(model=str(TWO_LINKS), joints={"shoulder": "shoulder", "elbow": "elbow"})
    with pytest.raises(UserError, match=r"^motion: arm\.csv: .*is it in degrees \(57\.3 to a rad\)"):
        write_arms(tables, tmp_path / "arm", options)
    assert not list(tmp_path.iterdir())


def test_a_known_servo_brings_its_whole_law(tmp_path):
    """The damping of a model's own servo belongs to its own gain."""
    model = tmp_path / "damped.xml"
    model.write_text(TWO_LINKS.read_text().replace('kp="60"', 'kp="60" kv="3"'))
    options = ImportOptions(model=str(model), joints={"shoulder": "shoulder", "elbow": "elbow"})
    ((folder, _),) = write_arms(the_tables(), tmp_path / "arm", options)
    nominal = read(folder).joints["elbow"].nominal
    assert (nominal["proportional_gain"], nominal["derivative_gain"]) == (17.8, 0.0)


def test_where_weight_says_little_of_the_zeros_they_are_the_models_own():
    noise = np.random.default_rng(0).normal(0, 2e-3, POSITION.shape)
    upright = dict.fromkeys(SIGN, 1)
    tables = the_tables(0.2 * POSITION + 0.5, noise, upright, dict.fromkeys(SIGN, 0.0))
    placed = place(tables, ArmModel(TWO_LINKS), {"shoulder": "shoulder", "elbow": "elbow"})
    assert placed.sign == upright and set(placed.zero.values()) == {0.0}
    assert "no other zero" in placed.why["elbow"]
