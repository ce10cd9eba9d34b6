"""A robot with effects in the scene: none changes nothing, an effect displaces the tool or loses the object."""

import numpy as np
import pytest

from vision_s2r.errors import UserError
from vision_s2r.scene import SceneConfig, attempt, sample_state
from vision_s2r.scene.drives import NOMINAL, Drives, Tuning
from vision_s2r.scene.machine import Machine
from vision_s2r.scene.world import World

CFG = SceneConfig()
WAITING = np.array([-1.4, 2.0, 0.07, 0.2])
OVER = np.array([-1.0, 1.5, 0.1, 0.3])


@pytest.fixture(scope="module")
def grasps():
    rng = np.random.default_rng(0)
    states = [sample_state(CFG, 5, k) for k in range(3)]
    return [(state, np.array([*pose[:2], rng.uniform(-1.5, 1.5)])) for state in states for pose in state.object_poses]


@pytest.fixture
def left_behind(monkeypatch):
    """Poses of the objects at the end of every attempt."""
    found = []

    class Watched(World):
        def __exit__(self, *error):
            found.append(self.poses())
            super().__exit__(*error)

    monkeypatch.setattr("vision_s2r.scene.grasping.World", Watched)
    return found


def test_neutral_drives_leave_the_world_as_the_scene_s_own_arm_does(grasps, left_behind):
    neutral = Machine({"lift": {"latency": {"delay": 0.0}}, "shoulder": {"backlash": {"width": 0.0}}})
    for machine in (Machine(), neutral):
        outcomes = [attempt(CFG, *grasp, machine) for grasp in grasps]
        assert {outcome.success for outcome in outcomes} == {True, False}
    count = len(grasps)
    for plain, driven in zip(left_behind[:count], left_behind[count:], strict=True):
        assert plain.tobytes() == driven.tobytes()


def displaced(effects):
    return Drives(effects, CFG.physics.time_step, WAITING).approach(OVER)


def test_drives_displace_the_tool_by_what_their_effects_say():
    assert displaced({"elbow": {"position_offset": {"value": 0.02}}}) == pytest.approx([0, -0.02, 0, 0], abs=1e-4)
    sag = displaced({"lift": {"bias_torque": {"value": 10.0}}})
    assert sag == pytest.approx([0, 0, -10 / NOMINAL["lift"].proportional_gain, 0], abs=1e-4)
    slow = displaced({"shoulder": {"velocity_limit": {"value": 0.2}}})
    assert slow[0] == pytest.approx(WAITING[0] + 0.2 - OVER[0], abs=0.05)
    drives = Drives({"lift": {"latency": {"delay": 0.05}}}, CFG.physics.time_step, OVER)
    down = np.tile(OVER, (60, 1))
    down[:, 2] -= 0.3 * CFG.physics.time_step * np.arange(60)
    assert drives.plan(down)[-1, 2] == pytest.approx(0.05 * 0.3, rel=0.1)


def test_a_robot_with_effects_holds_less(grasps):
    def held(parts):
        return sum(attempt(CFG, *grasp, Machine(parts)).success for grasp in grasps)

    plain = held({})
    assert held({"contact": {"lateral_friction": {"value": 0.1}}}) < 0.8 * plain
    assert held({"shoulder": {"velocity_limit": {"value": 0.2}}}) < 0.6 * plain


@pytest.mark.slow
def test_a_controller_that_knows_its_drives_waits_and_holds_what_a_healthy_robot_holds(grasps):
    slow = Machine({"lift": {"viscous_damping": {"value": 600.0}}})

    def held(machine, *tuning):
        return sum(attempt(CFG, *grasp, machine, *tuning).success for grasp in grasps)

    assert held(slow) < 0.4 * held(Machine())
    assert held(slow, Tuning((slow.drives,))) > 0.8 * held(Machine())


def test_a_machine_survives_the_disk_and_is_read_with_care(tmp_path):
    machine = Machine({"camera": {"exposure": {"stops": -1.0}}, "lift": {"latency": {"delay": 0.05}}})
    assert Machine.load(machine.save(tmp_path / "machine.yaml")) == machine
    assert machine.only([("lift", "latency")]).keys == [("lift", "latency")]
    for text, message in (
        ("lift: {latenzy: {delay: 1}}", "latency"),
        ("hip: {latency: {delay: 1}}", "unknown key 'hip'"),
        ("lift: 3", "lift is 3, expected effects"),
        ("contact: {center_of_mass: {x: 0.01, y: 0, z: 0}}", "the scene does not simulate center_of_mass"),
    ):
        path = tmp_path / "bad.yaml"
        path.write_text(text)
        with pytest.raises(UserError, match=message):
            Machine.load(path)
