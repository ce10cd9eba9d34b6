"""One step of a joint with play between motor and load.

Followed from event to event: free flight, impact, contact, parting, and the motor's coming to rest. Between events, and
under torques taken in the middle of the step, the motion is exact.
"""

from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.drive import Glide, Weight, advance, weight_at
from vision_s2r.joint.effects.backlash import contact_force, impact_time, merged
from vision_s2r.joint.effects.inertia import half
from vision_s2r.joint.machine import JointMachine

EVENTS = 12  # in one step of play; a step with more ends in contact

# The state of the two masses: velocities of motor and load, twist (motor - load), position of the load, and the side
# on which they touch (+1: the motor pushes forward, -1 back, 0 they do not).
State = tuple[float, float, float, float, float]


@compiled
def play_step(
    machine: JointMachine,
    state: State,
    weight: Weight,  # of static friction
    motor: float,  # the commanded torque
    motor_torque: float,  # all torque on the motor but its friction
    load_torque: float,
    joined: tuple[Glide, Glide],  # of both masses together, ahead and back
    alone: tuple[Glide, Glide],  # of the motor alone
    step: float,
) -> State:
    """Play without a spring."""
    v_motor, v_load, twist, position, side = state
    inertia = half(machine.inertia)
    edge = 0.5 * machine.backlash_width
    pressed, free = (motor, load_torque), (motor, 0.0)
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
                pressed,
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
                machine, v_motor, motor_torque, weight, free, alone[0], alone[1], inertia, left, whole
            )
            fall = used * (v_load + 0.5 * used * load_torque / inertia)
            end = twist + distance - fall
            if abs(end) > edge:
                side = 1.0 if end > 0 else -1.0
                used = impact_time(edge - side * twist, side * (v_motor - v_load), edge - side * end, used)
                distance, after, _ = advance(
                    machine, v_motor, motor_torque, weight, free, alone[0], alone[1], inertia, used, False
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
def play_velocities(
    machine: JointMachine,
    state: State,
    weight: Weight,
    motor: float,
    motor_torque: float,
    load_torque: float,
    joined: tuple[Glide, Glide],
    alone: tuple[Glide, Glide],
    step: float,
) -> tuple[float, float]:
    """Velocities of motor and load after a step in which they touch all the time or not at all."""
    touching = state[4] != 0
    ahead, back = joined if touching else alone
    inertia = machine.inertia if touching else half(machine.inertia)
    torque = motor_torque + load_torque if touching else motor_torque
    loads = motor, load_torque if touching else 0.0
    after = advance(machine, state[0], torque, weight, loads, ahead, back, inertia, step, True)[1]
    return after, after if touching else state[1] + step * load_torque / inertia
