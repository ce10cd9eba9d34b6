"""One step of a joint with a spring between motor and load, behind play or not.

A spring and two inertias are solved exactly, by a matrix exponential, so that a stiff spring asks for no smaller step.
Dry friction is an impulse, shared out in time where the motor comes to rest within a step. A step in which the spring
meets the end of the play is taken in small pieces.
"""

import numpy as np

from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.drive import REST, Weight, dry
from vision_s2r.joint.effects.compliance import spring_response, spring_torque
from vision_s2r.joint.effects.coulomb_friction import direction_of
from vision_s2r.joint.effects.inertia import half
from vision_s2r.joint.machine import JointMachine
from vision_s2r.joint.play import State

PIECES = 16


@compiled
def spring_responses(machine: JointMachine, step: float, out: np.ndarray) -> None:
    """What `spring_step` needs to know, into `out` [4, 4, 5]: the spring engaged and not, a whole step and a piece.

    Without play it is engaged all the time, and no step is taken in pieces: the others are left as they are.
    """
    stiffness, damping = machine.compliance_stiffness, machine.compliance_damping
    believed, inertia = machine.viscous_damping, half(machine.inertia)
    for k in range(4 if machine.backlash_width > 0 else 1):
        time = step / PIECES if k >= 2 else step
        engaged = k % 2 == 0
        spring_response(stiffness if engaged else 0.0, damping if engaged else 0.0, believed, inertia, time, out[k])


@compiled
def spring_step(
    machine: JointMachine,
    state: State,
    weight: Weight,  # of static friction
    motor: float,  # the commanded torque
    motor_torque: float,  # all torque on the motor but its friction
    load_torque: float,
    damping: tuple[float, float],  # of motion ahead and back
    responses: np.ndarray,  # [4, 4, 5] of `spring_responses`
    step: float,
) -> State:
    """The state after a step."""
    start = state
    pieces = 1
    while True:
        for _ in range(pieces):
            state = _piece(
                machine,
                state,
                weight,
                motor,
                motor_torque,
                load_torque,
                damping,
                responses[0 if pieces == 1 else 2],
                responses[1 if pieces == 1 else 3],
                step / pieces,
            )
        if pieces > 1 or machine.backlash_width == 0 or _side(machine, start) == _side(machine, state):
            return state
        state, pieces = start, PIECES


@compiled
def spring_velocities(
    machine: JointMachine,
    state: State,
    weight: Weight,
    motor: float,
    motor_torque: float,
    load_torque: float,
    damping: tuple[float, float],
    responses: np.ndarray,
) -> tuple[float, float]:
    """Velocities of motor and load after a step in which the spring touches all the time, or not at all."""
    v_motor, v_load, twist, _, _ = state
    side = _side(machine, state)
    touching = side != 0 or machine.backlash_width == 0
    response, loads = responses[0 if touching else 1], (motor, load_torque if touching else 0.0)
    twist -= side * 0.5 * machine.backlash_width
    direction = direction_of(v_motor, motor_torque)
    extra = (damping[0] if direction > 0 else damping[1]) - machine.viscous_damping
    pushed = motor_torque - direction * dry(machine, direction, weight, loads) - extra * v_motor
    after = _respond(response, 0, v_motor, v_load, twist, pushed, load_torque)
    load = _respond(response, 1, v_motor, v_load, twist, pushed, load_torque)
    return after if direction * after > 0 else 0.0, load


@compiled
def _side(machine: JointMachine, state: State) -> float:
    """Where the spring touches: ±1, 0 within the play. It can push, but not pull."""
    v_motor, v_load, twist, _, _ = state
    edge = 0.5 * machine.backlash_width
    beyond = twist - min(max(twist, -edge), edge)
    torque = spring_torque(beyond, v_motor - v_load, machine.compliance_stiffness, machine.compliance_damping)
    return 0.0 if torque * beyond <= 0 else 1.0 if beyond > 0 else -1.0


@compiled
def _piece(
    machine: JointMachine,
    state: State,
    weight: Weight,
    motor: float,
    motor_torque: float,
    load_torque: float,
    damping: tuple[float, float],
    engaged: np.ndarray,
    free: np.ndarray,
    step: float,
) -> State:
    """A step in which the spring touches all the time or not at all."""
    v_motor, v_load, twist, position, _ = state
    side = _side(machine, (v_motor, v_load, twist + 0.5 * step * (v_motor - v_load), 0.0, 0.0))
    touching = side != 0 or machine.backlash_width == 0
    response, loads = (engaged if touching else free), (motor, load_torque if touching else 0.0)
    offset = side * 0.5 * machine.backlash_width
    twist -= offset
    gain = response[0, 3]
    direction = direction_of(v_motor, motor_torque)
    extra = (damping[0] if direction > 0 else damping[1]) - machine.viscous_damping  # beside what `response` knows
    if extra != 0 and v_motor != 0:  # as a torque, at the velocity in the middle of the step
        after = _respond(response, 0, v_motor, v_load, twist, motor_torque, load_torque)
        after -= gain * direction * dry(machine, direction, weight, loads)
        motor_torque -= extra * 0.5 * (v_motor + after) / (1 + 0.5 * gain * extra)
    ahead = _respond(response, 0, v_motor, v_load, twist, motor_torque, load_torque)
    hold = (ahead - response[0, 0] * v_motor) / gain  # the friction that would keep a resting motor at rest
    stuck = abs(hold) <= dry(machine, direction_of(0.0, hold), REST, loads)
    if v_motor == 0:
        direction = direction_of(0.0, hold)
        friction = hold if stuck else direction * dry(machine, direction, weight, loads)
    else:
        friction = direction * dry(machine, direction, weight, loads)
        after = ahead - gain * friction
        if direction * after < 0:  # it comes to rest on the way
            stuck = stuck or direction * hold > 0
            back = -direction * dry(machine, -direction, REST, loads)
            share = v_motor / (v_motor - after)
            friction = ahead / gain if stuck else friction * share + back * (1 - share)
        else:
            stuck = False
    pushed = motor_torque - friction
    return (
        0.0 if stuck else ahead - gain * friction,
        _respond(response, 1, v_motor, v_load, twist, pushed, load_torque),
        offset + _respond(response, 2, v_motor, v_load, twist, pushed, load_torque),
        position + _respond(response, 3, v_motor, v_load, twist, pushed, load_torque),
        0.0,
    )


@compiled
def _respond(
    response: np.ndarray, row: int, v_motor: float, v_load: float, twist: float, motor_torque: float, load_torque: float
) -> float:
    return (
        response[row, 0] * v_motor
        + response[row, 1] * v_load
        + response[row, 2] * twist
        + response[row, 3] * motor_torque
        + response[row, 4] * load_torque
    )
