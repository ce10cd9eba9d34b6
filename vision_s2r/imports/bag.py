"""ROS 1 and ROS 2 bags and MCAP files: sensor_msgs/JointState beside what commanded the joints.

Commands come as the controller's own state (control_msgs/JointTrajectoryControllerState, its reference), as another
JointState, as std_msgs/Float64MultiArray of a forward command controller, or as trajectory_msgs/JointTrajectory, whose
points are joined as ros2_control's joint_trajectory_controller does: by lines, cubics or quintics, as they hold
positions, velocities and accelerations.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import BPoly
from scipy.optimize import linear_sum_assignment

from vision_s2r.errors import UserError, nearest
from vision_s2r.imports.table import ImportOptions, JointTable
from vision_s2r.recording.joint import LONGEST_GAP

STATE = "sensor_msgs/msg/JointState"
# In the order in which one is preferred, where several command a joint.
REFERENCE = "control_msgs/msg/JointTrajectoryControllerState"
ARRAY = "std_msgs/msg/Float64MultiArray"
TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
COMMANDS = (REFERENCE, STATE, ARRAY, TRAJECTORY)
TORQUE = ("effort", "torque")  # a topic whose name holds one of these commands torques
CLOCKS = 1.0  # s between stamps and the bag's time from which they are of two clocks
NANO = 1e-9
ROLES = ("state", "command")


@dataclass(frozen=True)
class Message:
    """One message, and when the bag got it (s)."""

    at: float
    content: Any


Clock = Callable[[Message], float]  # when a message was, s


@dataclass
class JointCommand:
    """What was asked of one joint, in the order of its instants."""

    topic: str
    column: str  # of a recording: target or torque
    t: np.ndarray  # [N] s
    value: np.ndarray  # [N]
    pieces: list[tuple[float, float, BPoly]] = field(default_factory=list)  # of a trajectory: from, to, and its course

    def at(self, times: np.ndarray) -> np.ndarray:
        """The command [T] in force at these instants: the last one, NaN before the first."""
        out = np.concatenate([[np.nan], self.value])[np.searchsorted(self.t, times, side="right")]
        for start, end, course in self.pieces:
            inside = (times >= start) & (times < end)
            out[inside] = course(times[inside])
        return out


def load(path: Path, options: ImportOptions) -> list[JointTable]:
    """The joints of a bag that were commanded. Raises UserError where there are none, listing the topics."""
    topics = _read(path)
    for role in options.topics:
        if role not in ROLES:
            raise UserError(f"topics: {nearest(role, ROLES)}")
    for name in options.topics.values():
        if name not in topics:
            raise UserError(f"{path}: no topic '{name}', {nearest(name, topics)}; {_listed(topics)}")
    state = options.topics.get("state") or _state_topic(path, topics)
    clock, notes = _clock([m for kind, m in topics.values() if kind in COMMANDS])
    joints = _joints(topics[state][1], clock, path, state)
    asked = [options.topics["command"]] if "command" in options.topics else [t for t in topics if t != state]
    commands = _commands({name: topics[name] for name in asked}, joints, clock, path)
    if not commands:
        raise UserError(
            f"{path}: nothing commands the joints of {state}, expected topics={{command: …}}; {_listed(topics)}"
        )
    begin = max(command.t[0] for command in commands.values())  # from here on all have one, so that rows are the same
    return [_table(name, joints[name], command, begin, notes) for name, command in commands.items()]


def _read(path: Path) -> dict[str, tuple[str, list[Message]]]:
    """Topics by name: the type, and the messages of those types that are looked at."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise UserError("bags need rosbags: pip install 'vision-s2r[bags]'") from error
    topics: dict[str, tuple[str, list[Message]]] = {}
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            for each in reader.connections:
                topics.setdefault(each.topic, (each.msgtype, []))
            wanted = [each for each in reader.connections if each.msgtype in COMMANDS]
            wanted = [each for each in wanted if each.msgtype in reader.typestore.fielddefs]
            for connection, at, raw in reader.messages(connections=wanted):
                content = reader.deserialize(raw, connection.msgtype)
                topics[connection.topic][1].append(Message(at * NANO, content))
    except Exception as error:  # a broken file raises whatever the layers below raise
        said = (str(error) or type(error).__name__).splitlines()[0]
        raise UserError(
            f"{path}: cannot be read as a bag ({said:.120}), expected .bag, .mcap or a ROS 2 folder"
        ) from error
    return topics


def _listed(topics: Mapping[str, tuple[str, Sequence[Message]]]) -> str:
    if not topics:
        return "the bag is empty"
    return "it has " + ", ".join(f"{name} ({kind})" for name, (kind, _) in sorted(topics.items()))


def _state_topic(path: Path, topics: Mapping[str, tuple[str, Sequence[Message]]]) -> str:
    found = [name for name, (kind, messages) in topics.items() if kind == STATE and messages]
    named = [name for name in found if name.rsplit("/", 1)[-1] == "joint_states"]
    for candidates in (named, found):
        if len(candidates) == 1:
            return candidates[0]
    what = "which JointState is measured? expected topics={state: …}" if found else "no JointState in it"
    raise UserError(f"{path}: {what}; {_listed(topics)}")


def _clock(topics: Sequence[Sequence[Message]]) -> tuple[Clock, tuple[str, ...]]:
    """When messages were, by their own stamps, or by the bag's time where these are of another clock; what to say."""
    late = [m.at - _stamp(m.content) for messages in topics for m in messages if _stamp(m.content)]
    if late and abs(np.median(late)) > CLOCKS:
        return lambda m: m.at, (f"stamps are {np.median(late):.4g} s off the bag's time: the bag's time is used",)
    return lambda m: _stamp(m.content) or m.at, ()


def _stamp(content: Any) -> float:
    """A message's own stamp (s), 0 where it has none."""
    header = getattr(content, "header", None)
    return header.stamp.sec + header.stamp.nanosec * NANO if header is not None else 0.0


def _joints(messages: Sequence[Message], clock: Clock, path: Path, topic: str) -> dict[str, dict[str, np.ndarray]]:
    """Columns t, position and, where they are given, velocity and effort of each joint; messages may hold some only."""
    rows: dict[str, list[tuple[float, float, float, float]]] = {}
    for message in messages:
        at, content = clock(message), message.content
        if len(content.position) != len(content.name):
            continue
        for k, name in enumerate(content.name):
            others = (
                float(v[k]) if len(v) == len(content.name) else np.nan for v in (content.velocity, content.effort)
            )
            rows.setdefault(name, []).append((at, float(content.position[k]), *others))  # type: ignore[arg-type]
    if not rows:
        raise UserError(f"{path}: {topic} holds no positions, expected name and position of each joint")
    columns = ("t", "position", "velocity", "effort")
    return {name: dict(zip(columns, np.array(of).T, strict=True)) for name, of in rows.items()}


def _commands(
    topics: Mapping[str, tuple[str, Sequence[Message]]],
    joints: Mapping[str, Mapping[str, np.ndarray]],
    clock: Clock,
    path: Path,
) -> dict[str, JointCommand]:
    """What commands each joint, by the most telling type of topic that does."""
    found: dict[str, JointCommand] = {}
    for kind in COMMANDS:
        of_kind: dict[str, JointCommand] = {}
        for topic, (own, messages) in topics.items():
            if own != kind or not messages:
                continue
            for name, command in _READ[kind](topic, messages, joints, clock):
                if name in of_kind:
                    both = f"{of_kind[name].topic} and {topic} both command '{name}'"
                    raise UserError(f"{path}: {both}, expected topics={{command: …}}")
                of_kind[name] = command
        found = {**of_kind, **found}
    return {name: found[name] for name in joints if name in found}


Commanded = Iterator[tuple[str, JointCommand]]


def _column(topic: str) -> str:
    return "torque" if any(word in topic for word in TORQUE) else "target"


def _references(
    topic: str, messages: Sequence[Message], joints: Mapping[str, Mapping[str, np.ndarray]], clock: Clock
) -> Commanded:
    """The point that a controller follows, as it reports it."""
    rows: dict[str, list[tuple[float, float]]] = {}
    for message in messages:
        point = getattr(message.content, "reference", None) or message.content.desired
        for name, value in zip(message.content.joint_names, point.positions, strict=False):
            rows.setdefault(name, []).append((clock(message), float(value)))
    yield from ((name, _command(topic, "target", of)) for name, of in rows.items() if name in joints)


def _states(
    topic: str, messages: Sequence[Message], joints: Mapping[str, Mapping[str, np.ndarray]], clock: Clock
) -> Commanded:
    """Commands in the form of joints' states: positions, or else efforts."""
    rows: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for message in messages:
        content = message.content
        column, values = ("target", content.position) if len(content.position) else ("torque", content.effort)
        for name, value in zip(content.name, values, strict=False):
            rows.setdefault((name, column), []).append((clock(message), float(value)))
    yield from ((name, _command(topic, column, of)) for (name, column), of in rows.items() if name in joints)


def _arrays(
    topic: str, messages: Sequence[Message], joints: Mapping[str, Mapping[str, np.ndarray]], clock: Clock
) -> Commanded:
    """Bare numbers: goals are of the joints that follow them; torques of the joints in the state's order."""
    width = len(messages[0].content.data)
    rows = np.array([[clock(m), *m.content.data] for m in messages if len(m.content.data) == width])
    commands = [_command(topic, _column(topic), rows[:, (0, 1 + k)].tolist()) for k in range(width)]
    names = list(joints)
    if _column(topic) == "torque":
        if width == len(names):
            yield from zip(names, commands, strict=True)
        return
    if width > len(names):
        return
    apart = np.array([[_apart(command, joints[name]) for name in names] for command in commands])
    for k, j in zip(*linear_sum_assignment(apart), strict=True):
        yield names[j], commands[k]


def _apart(command: JointCommand, joint: Mapping[str, np.ndarray]) -> float:
    """How far a joint's positions are from goals, mean square."""
    difference = command.at(joint["t"]) - joint["position"]
    difference = _in_half_a_turn(difference) if _turns(joint["position"]) else difference
    known = np.isfinite(difference)
    return float(np.mean(difference[known] ** 2)) if known.any() else 1e9


def _trajectories(
    topic: str, messages: Sequence[Message], joints: Mapping[str, Mapping[str, np.ndarray]], clock: Clock
) -> Commanded:
    """Trajectories: from where the joint is asked to be through their points; a new one replaces the last."""
    found: dict[str, JointCommand] = {}
    for message in messages:
        content, begin = message.content, clock(message)
        for k, name in enumerate(content.joint_names):
            if name not in joints or not content.points:
                continue
            command = found.setdefault(name, JointCommand(topic, "target", np.zeros(0), np.zeros(0)))
            joint = joints[name]
            here = command.at(np.array([begin]))[0]
            if not np.isfinite(here):  # before any goal a joint is asked to stay
                here = joint["position"][min(int(np.searchsorted(joint["t"], begin)), len(joint["t"]) - 1)]
            _append(command, begin, float(here), content.points, k)
    yield from found.items()


def _append(command: JointCommand, begin: float, here: float, points: Sequence[Any], k: int) -> None:
    """Add the course through a trajectory's points; what was to come of the one before is dropped."""
    command.pieces[:] = [(a, min(b, begin), course) for a, b, course in command.pieces if a < begin]
    before, kept = (begin, [here]), command.t < begin
    command.t, command.value = np.append(command.t[kept], begin), np.append(command.value[kept], here)
    for point in points:
        at = begin + point.time_from_start.sec + point.time_from_start.nanosec * NANO
        orders = [v for v in (point.positions, point.velocities, point.accelerations) if len(v) > k]
        there = [float(v[k]) for v in orders]
        if not there or at < before[0]:
            continue
        if at > before[0]:
            start = before[1] if len(before[1]) >= len(there) else before[1] + [0.0] * (len(there) - len(before[1]))
            course = BPoly.from_derivatives([before[0], at], [start[: len(there)], there])
            command.pieces.append((before[0], at, course))
        command.t, command.value = np.append(command.t, at), np.append(command.value, there[0])
        before = (at, there)


def _command(topic: str, column: str, rows: Sequence[Sequence[float]]) -> JointCommand:
    t, value = np.array(rows).T
    order = np.argsort(t, kind="stable")
    return JointCommand(topic, column, t[order], value[order])


_READ = {REFERENCE: _references, STATE: _states, ARRAY: _arrays, TRAJECTORY: _trajectories}


def _turns(position: np.ndarray) -> bool:
    """Whether angles start anew at a full turn."""
    return bool(np.abs(np.diff(position)).max(initial=0.0) > np.pi)


def _in_half_a_turn(angle: np.ndarray) -> np.ndarray:
    return (angle + np.pi) % (2 * np.pi) - np.pi


def _table(
    name: str, joint: Mapping[str, np.ndarray], command: JointCommand, begin: float, notes: tuple[str, ...]
) -> JointTable:
    """A joint's rows: sorted, no stamp twice, from `begin` on, a new episode after a gap, turns unrolled."""
    t, rows = np.unique(joint["t"], return_index=True)
    rows, t = rows[t >= begin], t[t >= begin]
    asked = command.at(t)
    position, left_out = joint["position"][rows], {}
    if repeated := len(joint["t"]) - len(np.unique(joint["t"])):
        left_out["rows"] = f"{repeated} with a stamp that another has"
    if _turns(position):
        position = np.unwrap(position)
        notes = (*notes, "positions wrap round at a full turn: unrolled")
        if command.column == "target":
            asked = position + _in_half_a_turn(asked - position)
    episode = np.concatenate([[0], np.cumsum(np.diff(t) > LONGEST_GAP)]) if len(t) else np.zeros(0)
    first = t[np.unique(episode, return_index=True)[1]] if len(t) else np.zeros(0)
    columns = {"episode": episode.astype(float), "t": t - first[episode.astype(int)], command.column: asked}
    columns["position"] = position
    missing = []
    velocity = joint["velocity"][rows]
    if not np.isfinite(velocity).all():
        missing.append("velocity")
    elif not velocity.any() and np.ptp(position) > 0:
        left_out["velocity"] = "it is 0 all along"
    else:
        columns["velocity"] = velocity
    effort = joint["effort"][rows]
    if np.isfinite(effort).any():
        left_out["effort"] = "what the driver says of it is no command"
    if np.isfinite(effort).all():
        columns["effort"] = effort  # which an arm's recording has beside its motion
    notes = (f"commanded by {command.topic}", *notes)
    return JointTable(
        name.replace("/", "_"), columns, "", left_out=left_out, missing=tuple(missing), notes=notes, of_model=True
    )
