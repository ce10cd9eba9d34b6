"""One step of a joint whose motor and load are divided by play, by a spring, or by both.

As with one mass, torques are taken in the middle of the step. Play is followed from event to event: free flight,
impact, contact, parting, and the motor's coming to rest. A spring and two inertias are solved exactly, by a matrix
exponential, so that a stiff spring asks for no smaller step; dry friction then is an impulse, shared out in time where
the motor comes to rest within a step.
"""

import numpy as np

from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.drive import Glide, advance, dry, weight_at
from vision_s2r.joint.effects.backlash import contact_force, impact_time, merged
from vision_s2r.joint.effects.compliance import spring_torque
from vision_s2r.joint.effects.coulomb_friction import direction_of
from vision_s2r.joint.effects.inertia import half
from vision_s2r.joint.machine import Machine

EVENTS = 12  # in one step of play; a step with more ends in contact

# The state of the two masses: velocities of motor and load, twist (motor - load), position of the load, and the side
# on which they touch (+1: the motor pushes forward, -1 back, 0 they do not).
State = tuple[float, float, float, float, float]


@compiled
def play_step(
    machine: Machine,
    state: State,
    weight: float,
    motor: float,
    motor_torque: float,
    load_torque: float,
    joined: tuple[Glide, Glide],  # of both masses together, ahead and back
    alone: tuple[Glide, Glide],  # of the motor alone
    step: float,
) -> State:
    """Play without a spring."""
    v_motor, v_load, twist, position, side = state
    inertia = half(machine.inertia)
    edge = 0.5 * machine.backlash_width
    left = step
    held = False  # the contact lasts to the end of the step
    for event in range(EVENTS):
        whole = left == step
        if side != 0:
            distance, after, used = advance(
                machine,
                v_motor,
                motor_torque + load_torque,
                weight,
                motor,
                joined[0],
                joined[1],
                machine.inertia,
                left,
                whole,
            )
            force = contact_force((after - v_motor) / used, load_torque, inertia) if used > 0 else 0.0
            if side * force < 0 and not held:
                side = 0.0
                continue
            position += distance
            v_motor = v_load = after
        else:
            distance, after, used = advance(
                machine, v_motor, motor_torque, weight, motor, alone[0], alone[1], inertia, left, whole
            )
            fall = used * (v_load + 0.5 * used * load_torque / inertia)
            end = twist + distance - fall
            if abs(end) > edge:
                side = 1.0 if end > 0 else -1.0
                used = impact_time(edge - side * twist, side * (v_motor - v_load), edge - side * end, used)
                distance, after, _ = advance(
                    machine, v_motor, motor_torque, weight, motor, alone[0], alone[1], inertia, used, False
                )
                position += used * (v_load + 0.5 * used * load_torque / inertia)
                twist = side * edge
                v_motor = v_load = merged(after, v_load + used * load_torque / inertia)
                held = used == 0 or event > EVENTS - 4  # just parted: on the edge between contact and flight
            else:
                twist = end
                position += fall
                v_motor, v_load = after, v_load + used * load_torque / inertia
        left -= used
        if left <= 0:
            break
        if v_motor == 0:
            weight = weight_at(machine, 0.0)
    return v_motor, v_load, twist, position, side


@compiled
def spring_step(
    machine: Machine,
    state: State,
    weight: float,
    motor: float,
    motor_torque: float,
    load_torque: float,
    damping: tuple[float, float],  # ahead and back
    believed: float,  # the damping that `engaged` and `free` were made with
    engaged: np.ndarray,  # [4, 5] spring_response of a whole step
    free: np.ndarray,  # [4, 5] the same without the spring, for play
    step: float,
) -> State:
    """A spring, behind play or not."""
    v_motor, v_load, twist, position, _ = state
    edge = 0.5 * machine.backlash_width
    # How far the spring is twisted, by the middle of the step: beyond the play, and not pulling back into it.
    middle = twist + 0.5 * step * (v_motor - v_load)
    offset = min(max(middle, -edge), edge)
    torque = spring_torque(middle - offset, v_motor - v_load, machine.compliance_stiffness, machine.compliance_damping)
    touching = edge == 0 or (middle != offset and torque * middle > 0)
    response = engaged if touching else free
    if not touching:
        offset = 0.0
    twist -= offset
    gain = response[0, 3]
    direction = direction_of(v_motor, motor_torque)
    extra = (damping[0] if direction > 0 else damping[1]) - believed
    if extra != 0 and v_motor != 0:  # as a torque, at the velocity in the middle of the step
        after = _respond(response, 0, v_motor, v_load, twist, motor_torque, load_torque)
        after -= gain * direction * dry(machine, direction, weight, motor)
        motor_torque -= extra * 0.5 * (v_motor + after)
    ahead = _respond(response, 0, v_motor, v_load, twist, motor_torque, load_torque)
    hold = (ahead - response[0, 0] * v_motor) / gain  # the friction that would keep a resting motor at rest
    stuck = abs(hold) <= dry(machine, direction_of(0.0, hold), 1.0, motor)
    if v_motor == 0:
        direction = direction_of(0.0, hold)
        friction = hold if stuck else direction * dry(machine, direction, weight, motor)
    else:
        friction = direction * dry(machine, direction, weight, motor)
        after = ahead - gain * friction
        if direction * after < 0:  # it comes to rest on the way
            stuck = stuck or direction * hold > 0
            back = -direction * dry(machine, -direction, 1.0, motor)
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
