"""The teacher: a controller that is told the machines and their states, which policies are to do without.

Feedforward holds the target, a linear-quadratic regulator on the linearized machine leads there (Anderson and Moore,
Optimal Control: Linear Quadratic Methods, 1990), from where the joint will be once a command arrives.
"""

import numpy as np

from vision_s2r.control.config import ControlTaskConfig
from vision_s2r.control.environment import SpeedTracking
from vision_s2r.control.machines import Machines
from vision_s2r.joint import NominalJoint
from vision_s2r.joint.machine import COLUMNS, pack

NEWTON = 5  # steps to the current that holds a speed
RICCATI = 150  # steps to the regulator's gains
DEAREST = 1e9  # what a state may cost: of a joint that no command holds, more and more
LEAST_ANSWER = 1e-3  # rad/s that a motor turns faster by 1 A, for it to be asked at all
MOST_CHANGE = 3.0  # of a Newton step: A, rad/s, rad
POSITION, LOAD, MOTOR, TWIST, COMMAND = range(5)  # rows of what `Joints.differentiated` returns
LOOP = ("latency", "encoder_quantization", "cogging")  # what acts beside the linear machine


class Teacher:
    """Commands the joints of an environment as it stands.

    Motor and load are led apart where a spring divides them. In play the motor is led, which takes the load along.
    `effort`: what an ampere squared costs, beside the square of a speed that is wrong by 1 rad/s.
    """

    def __init__(self, environment: SpeedTracking, effort: float) -> None:
        self.environment, self.effort = environment, effort
        joints = environment.joints
        machines = joints.machines
        self._sprung = np.isfinite(_column(machines, "compliance.stiffness"))
        self._led_by_motor = self._sprung | (_column(machines, "backlash.width") > 0)
        self._late = np.ceil(_column(machines, "latency.delay") / joints.sample_time - 1e-9)
        self._teeth = np.nan_to_num(_column(machines, "cogging.teeth"))
        self._cogging = _column(machines, "cogging.amplitude") / _column(machines, "torque_constant")
        self._linear = _without(machines, LOOP)
        self._linear[~self._sprung] = _without(self._linear[~self._sprung], ("backlash",))

    def act(self) -> np.ndarray:
        """Actions [N] in [-1, 1] for the present sample."""
        environment = self.environment
        if environment.is_new_target:
            self._plan(environment.target)
        moving = self._foreseen()
        motor = np.where(self._led_by_motor, moving[:, 2], moving[:, 1])
        load = np.where(self._sprung, moving[:, 1], motor)
        off = np.stack([load, motor, moving[:, 3] * self._sprung], axis=1) - self._hold
        angle = moving[:, 0] + moving[:, 3] * self._led_by_motor + 0.5 * environment.joints.sample_time * motor
        current = self._current - (self._gains * off).sum(axis=1) - self._cogging * np.sin(self._teeth * angle)
        most = environment.task.max_current
        return np.clip(current, -most, most) / most

    def _foreseen(self) -> np.ndarray:
        """Where the joints will be, [N, 4] as `moving`, when the next command begins to act."""
        environment, joints = self.environment, self.environment.joints
        moving = joints.moving
        if self._late.any():
            ahead = joints.take(np.arange(len(joints)))
            for k in range(int(self._late.max())):
                ahead.step(environment.sent * environment.task.max_current)
                moving = np.where((k < self._late)[:, None], ahead.moving, moving)
        return moving

    def _plan(self, target: np.ndarray) -> None:
        """The current that holds the target [N], what the joint does then, and the gains of the way there."""
        self._current, self._hold, jacobian = self._steady(target)
        self._gains = regulator(*self._dynamics(jacobian), self.effort)

    def _steady(self, target: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """By Newton's method: currents [N]; velocities of load and motor, and twist [N, 3]; the Jacobian [N, 6, 4]."""
        most, count, sprung = self.environment.task.max_current, len(target), self._sprung
        current, hold = np.zeros(count), np.stack([target, target, np.zeros(count)], axis=1)
        edge = 0.5 * _column(self._linear, "backlash.width")
        hold[sprung, 2] = (np.sign(target) * (edge + 1e-3))[sprung]
        for _ in range(NEWTON):
            state = np.column_stack([np.zeros(count), hold])
            after, jacobian = self.environment.joints.placed(self._linear, state).differentiated(current)
            missed = after[:, LOAD:] - hold
            answer = jacobian[:, COMMAND, LOAD]
            rigid = ~sprung & (np.abs(answer) > LEAST_ANSWER)
            current[rigid] -= missed[rigid, 0] / answer[rigid]
            if sprung.any():
                # Unknown are the current, the motor's velocity and the twist.
                slopes = jacobian[sprung][:, [COMMAND, MOTOR, TWIST], LOAD:].transpose(0, 2, 1)
                slopes = slopes - np.array([[0, 0, 0], [0, 1, 0], [0, 0, 1]])
                change = -np.einsum("nij,nj->ni", np.linalg.pinv(slopes), missed[sprung])
                change = np.clip(change, -MOST_CHANGE, MOST_CHANGE)
                current[sprung] += change[:, 0]
                hold[sprung, 1:] += change[:, 1:]
            current = np.clip(current, -most, most)
        return current, hold, jacobian

    def _dynamics(self, jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """State [N, 3, 3] and input matrix [N, 3, 1] of the discrete system; of a rigid joint the first state alone."""
        states = jacobian[:, LOAD:COMMAND, LOAD:].transpose(0, 2, 1).copy()
        inputs = jacobian[:, COMMAND, LOAD:, None].copy()
        rigid = ~self._sprung
        states[rigid, 1:], states[rigid, :, 1:], inputs[rigid, 1:] = 0.0, 0.0, 0.0
        return states, inputs


def regulator(states: np.ndarray, inputs: np.ndarray, effort: float) -> np.ndarray:
    """Gains [N, S] of u = -K·x for discrete systems [N, S, S] and [N, S, 1]; the first state and the input cost."""
    cost = np.zeros_like(states)
    cost[:, 0, 0] = 1.0
    value = cost
    for _ in range(RICCATI):
        led = inputs.transpose(0, 2, 1) @ value
        gains = (led @ states) / (effort + led @ inputs)
        value = np.clip(cost + states.transpose(0, 2, 1) @ value @ (states - inputs @ gains), -DEAREST, DEAREST)
    return gains[:, 0]


def taught(
    task: ControlTaskConfig, nominal: NominalJoint, machines: Machines, targets: np.ndarray, effort: float, seed: int
) -> np.ndarray:
    """Errors [N, T], as `track` has them, where the teacher itself leads."""
    environment = SpeedTracking(task, nominal, machines, len(targets), 0, seed)
    environment.reset(options={"targets": targets})
    teacher = Teacher(environment, effort)
    info: dict[str, np.ndarray] = {}
    while not info:
        *_, info = environment.step(teacher.act()[:, None])
    return info["errors"]


def _column(machines: np.ndarray, name: str) -> np.ndarray:
    return machines[:, COLUMNS.index(name)]


def _without(machines: np.ndarray, effects: tuple[str, ...]) -> np.ndarray:
    """The machines [N, P] with these effects away."""
    plain, nominal = machines.copy(), NominalJoint(1.0, 1.0, 0.0, 0.0)
    away = [k for k, name in enumerate(COLUMNS) if name.partition(".")[0] in effects]
    plain[:, away] = pack(nominal, {})[away]
    return plain
