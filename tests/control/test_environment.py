"""The environment as a learner meets it."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from vision_s2r.control import DrawnMachines, Given, OpenLoop, SpeedTracking, benchmark, track
from vision_s2r.control.config import ControlTaskConfig, JointConfig
from vision_s2r.control.effects import CONTROL_EFFECTS
from vision_s2r.errors import UserError
from vision_s2r.joint import NominalJoint
from vision_s2r.randomize import Box

NOMINAL = NominalJoint(**vars(JointConfig()))
TRUTH = {"viscous_damping": {"value": 0.15}, "coulomb_friction": {"value": 0.05}}
BOX = Box.of({"viscous_damping": {"value": [0.08, 0.2]}, "observation_noise": {"sigma": [0.0, 0.1]}}, CONTROL_EFFECTS)


def environment(count=6, history=0, machines=None, **task):
    return SpeedTracking(ControlTaskConfig(**task), NOMINAL, machines or Given({}), count, history)


def test_gymnasium_knows_it_and_finds_nothing_wrong():
    single = gymnasium.make("vision_s2r/SpeedTracking-v0")
    check_env(single.unwrapped, skip_render_check=True)


def test_the_open_loop_inverse_of_the_wrong_simulator_is_37_percent_short_in_reality():
    task = ControlTaskConfig(hold=3.0)
    wrong = OpenLoop(NOMINAL, task)
    assert wrong.act(np.array([[5.0 / task.highest, 0.0]], np.float32))[0, 0] * task.max_current == pytest.approx(1.04)
    errors = track(wrong, task, NOMINAL, Given(TRUTH), np.array([[5.0]]))
    assert errors[0, 0] == pytest.approx(3.1333 / 5 - 1, abs=1e-4)
    right = OpenLoop(NominalJoint(0.5, 0.02, 0.15, 0.05), task)
    assert abs(track(right, task, NOMINAL, Given(TRUTH), np.array([[5.0, -2.0]]))).max() < 1e-6


def test_what_is_seen_is_the_target_the_speed_and_the_past():
    env = environment(count=1, history=2)
    seen, _ = env.reset(options={"targets": np.full((1, 25), 4.0)})
    np.testing.assert_array_equal(seen, [[0.5, 0, 0, 0, 0, 0]])
    first = env.step(np.array([[0.5]]))[0]
    second = env.step(np.array([[-0.25]]))[0]
    assert first[0, 1] > 0
    np.testing.assert_array_equal(first[0, 2:], [0, 0.5, 0, 0])
    np.testing.assert_array_equal(second[0, 2:], [first[0, 1], -0.25, 0, 0.5])


def test_an_episode_ends_with_what_was_left_of_each_target_and_the_next_has_other_machines():
    env = environment(count=64, machines=DrawnMachines(BOX), targets=3, hold=0.2)
    seen, _ = env.reset(seed=1)
    for _ in range(60):
        seen, reward, terminated, truncated, info = env.step(np.full((64, 1), 0.3))
    assert truncated.all() and not terminated.any() and info["errors"].shape == (64, 3)
    assert reward.min() >= -1 and reward.max() <= 0
    assert (seen[:, 1] != info["final_obs"][:, 1]).all()
    before = info["errors"]
    for _ in range(60):
        info = env.step(np.full((64, 1), 0.3))[4]
    assert np.std(info["errors"] - before) > 0.01


def test_the_same_seed_gives_the_same_episodes():
    runs = []
    for _ in range(2):
        env = environment(count=8, machines=DrawnMachines(BOX))
        env.reset(seed=7)
        runs.append([env.step(np.full((8, 1), 0.2))[0] for _ in range(50)])
    np.testing.assert_array_equal(runs[0], runs[1])


def test_the_loop_may_be_slow_and_noisy():
    values = {"observation_noise": {"sigma": np.array([0.0, 0.5, 0.0])}, "time_step": {"scale": np.array([1, 1, 2.0])}}
    env = environment(count=3, machines=Given(values))
    env.reset(seed=0, options={"targets": np.full((3, 25), 4.0)})
    seen = np.array([env.step(np.full((3, 1), 0.2))[0][:, 1] for _ in range(20)])
    assert seen[9, 2] == pytest.approx(seen[19, 0], rel=1e-5)  # twice the time has passed
    assert np.std(np.diff(seen[:, 1])) > 5 * np.std(np.diff(seen[:, 0]))


def test_the_python_loop_of_the_benchmark_turns_the_same_joint():
    loop, ours = benchmark.OneJointEnv(ControlTaskConfig()), environment(count=1)
    loop.reset(seed=0)
    loop.damping, loop.friction = NOMINAL.viscous_damping, NOMINAL.coulomb_friction
    ours.reset(options={"targets": loop.targets[None]})
    for action in np.random.default_rng(0).uniform(-1, 1, 100):
        theirs = loop.step(np.array([action]))[0]
        mine = ours.step(np.array([[action]]))[0][0]
    np.testing.assert_allclose(theirs, mine, atol=0.02)


def test_an_effect_that_is_not_there_is_named():
    with pytest.raises(UserError, match=r"no joint effect is called 'viscous_dampling'.*viscous_damping"):
        Box.of({"viscous_dampling": {"value": [0.1, 0.2]}}, CONTROL_EFFECTS)
