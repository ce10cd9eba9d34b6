"""Bags of ROS 1 and 2 become recordings, whatever commanded the joints."""

import numpy as np
import pytest
from recordings import TWO_LINKS
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from vision_s2r.errors import UserError
from vision_s2r.imports import ImportOptions, import_recording
from vision_s2r.recording import read

ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
BEGAN = 1_700_000_000  # s
T = np.arange(300) * 0.01
NOMINAL = ImportOptions(
    nominal={"inertia": 0.02, "viscous_damping": 0.1, "coulomb_friction": 0.02}, control={"proportional": 12.0}
)


def the_time(store, t):
    nanoseconds = round((BEGAN + t) * 1e9) if t >= 0 else 0
    return store.types["builtin_interfaces/msg/Time"](sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


def a_header(store, t):
    more = {"seq": 0} if store is ROS1 else {}
    return store.types["std_msgs/msg/Header"](stamp=the_time(store, t), frame_id="", **more)


def a_state(store, t, names, position, velocity=()):
    values = (np.asarray(v, float) for v in (position, velocity, [0.5] * len(names)))
    return store.types["sensor_msgs/msg/JointState"](a_header(store, t), list(names), *values)


def an_array(values):
    layout = ROS2.types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    return ROS2.types["std_msgs/msg/Float64MultiArray"](layout=layout, data=np.asarray(values, float))


def write_bag(path, messages, store=ROS2, plugin=StoragePlugin.MCAP):
    """(t, topic, message) of a recording."""
    serialize = store.serialize_ros1 if store is ROS1 else store.serialize_cdr
    with Writer1(path) if store is ROS1 else Writer(path, version=9, storage_plugin=plugin) as writer:
        to = {}
        for t, topic, message in sorted(messages, key=lambda each: each[0]):
            kind = message.__msgtype__
            if topic not in to:
                to[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(to[topic], round((BEGAN + t) * 1e9), serialize(message, kind))
    return path


def positions(t):
    """Of two joints; the second goes round and round."""
    return 0.5 * np.sin(3 * (t - 0.05)), (2.0 * (t - 0.05) + np.pi) % (2 * np.pi) - np.pi


@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_bare_numbers_command_the_joints_that_follow_them(tmp_path, plugin):
    goal = [(t, "/controller/commands", an_array([2.0 * t, 0.5 * np.sin(3 * t)])) for t in T[5::2]]
    state = [(t, "/joint_states", a_state(ROS2, t + 0.002, ["lift", "wheel"], positions(t), [1.0, 2.0])) for t in T]
    state += [
        (T[7] + 0.003, "/joint_states", a_state(ROS2, T[7] + 0.002, ["lift", "wheel"], positions(T[7]), [1.0, 2.0]))
    ]
    bag = write_bag(tmp_path / "bag", goal + state, plugin=plugin)
    found = import_recording("bag", bag, tmp_path / "out", NOMINAL)
    assert [each.folder.name for each in found] == ["lift", "wheel"]
    lift, wheel = (read(each.folder) for each in found)
    kept = T[5:]  # nothing was asked before
    np.testing.assert_allclose(lift.command[0], 0.5 * np.sin(3 * T[5::2]).repeat(2)[: len(kept)], atol=1e-8)
    np.testing.assert_allclose(np.diff(wheel.position[0]), 0.02, atol=1e-6)
    np.testing.assert_allclose(wheel.command[0] - wheel.position[0], 0.1, atol=0.0201)
    for said in ("commanded by /controller/commands", "1 with a stamp that another has", "no command", "unrolled"):
        assert said in str(found[1])
    mcap = list(bag.glob("*.mcap"))
    assert not mcap or len(import_recording("bag", mcap[0], tmp_path / "again", NOMINAL)) == 2


def test_a_trajectory_is_followed_between_its_points(tmp_path):
    types = ROS1.types
    waits = [types["builtin_interfaces/msg/Duration"](sec=s, nanosec=0) for s in (1, 2)]
    none = np.zeros(0)
    points = [
        types["trajectory_msgs/msg/JointTrajectoryPoint"](np.array([q]), np.array([0.0]), none, none, wait)
        for q, wait in zip((0.4, -0.2), waits, strict=True)
    ]
    goal = types["trajectory_msgs/msg/JointTrajectory"](a_header(ROS1, -1), ["lift"], points)
    state = [(t, "/joint_states", a_state(ROS1, t, ["lift"], [0.1])) for t in T]
    bag = write_bag(tmp_path / "log.bag", [(0.4999, "/arm/command", goal), *state], ROS1)
    (found,) = import_recording("bag", bag, tmp_path / "out", NOMINAL)
    t, command = read(found.folder).time[0], read(found.folder).command[0]
    s = np.clip(t, 0, 1)  # cubic, at rest at both ends; from where the joint was
    first = 0.1 + 0.3 * (3 * s**2 - 2 * s**3)
    np.testing.assert_allclose(command[t < 1], first[t < 1], atol=1e-4)
    np.testing.assert_allclose(command[t >= 2], -0.2, atol=1e-6)
    assert abs(np.interp(1.5, t, command) - 0.1) < 1e-3 and "velocity" in found.summary["missing"]


def test_the_joints_of_a_bag_are_those_of_the_robots_model(tmp_path):
    names = ["gripper", "elbow", "shoulder"]
    state = [(t, "/joint_states", a_state(ROS2, t, names, [0.01, 0.3 * np.sin(t), 0.2 * np.cos(t)])) for t in T]
    goals = [(t, "/joint_command", a_state(ROS2, t, names, [0.01, 0.3 * np.sin(t + 0.05), 0.2])) for t in T]
    bag = write_bag(tmp_path / "bag", state + goals)
    servo = ImportOptions(model=str(TWO_LINKS), control={"proportional": 60.0, "limit": 9.0})
    (found,) = import_recording("bag", bag, tmp_path / "arm", servo)
    arm = read(found.folder)
    assert sorted(arm.joints) == ["elbow", "shoulder"] and "by its name" in str(found)
    at = list(arm.joints).index("elbow")
    np.testing.assert_allclose(arm.position[0][:, at], 0.3 * np.sin(T), atol=1e-6)
    assert (arm.torque["elbow"] == 0.5).all()  # what the driver says of its effort


def test_what_a_bag_lacks_is_said_with_what_it_has(tmp_path):
    state = [(t, "/joint_states", a_state(ROS2, t, ["lift"], [0.1])) for t in T[:20]]
    bag = write_bag(tmp_path / "bag", state)
    with pytest.raises(UserError, match=r"nothing commands.*it has /joint_states \(sensor_msgs/msg/JointState\)"):
        import_recording("bag", bag, tmp_path / "out", NOMINAL)
    with pytest.raises(UserError, match="no topic '/joint_stats', did you mean '/joint_states'"):
        import_recording("bag", bag, tmp_path / "out", ImportOptions(topics={"state": "/joint_stats"}))
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(b"\x89MCAP0\r\nnothing that is one")
    with pytest.raises(UserError, match="cannot be read as a bag"):
        import_recording("bag", broken, tmp_path / "out", NOMINAL)
