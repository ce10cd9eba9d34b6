"""Small recordings that are right, for tests to spoil; and those that other programs made."""

from pathlib import Path

import numpy as np
import pytest

from vision_s2r.contact import NominalContact, Shape, box, pack, simulate
from vision_s2r.diagnose.config import SearchConfig
from vision_s2r.errors import UserError
from vision_s2r.recording import ArmRecording, CameraRecording, ContactRecording, JointRecording, read

DATA = Path(__file__).resolve().parent / "data"
REAL = DATA / "real"  # a little of what real machines logged
EXAMPLES = DATA / "examples"  # recordings made by another engine and other image code, with answer.json
# Measurements of a real axis, which are not ours to give away: `make emps` fetches them.
EMPS = next(
    (path for path in (DATA / "emps", DATA.parents[2] / "shared" / "real" / "emps") if path.exists()), DATA / "emps"
)
needs_emps = pytest.mark.skipif(
    not EMPS.exists(), reason=f"{EMPS} is not there: make emps fetches it, from the network"
)

NOMINAL = {
    "torque_constant": 0.5,
    "inertia": 0.02,
    "viscous_damping": 0.1,
    "coulomb_friction": 0.02,
    "gravity_torque": 0.0,
    "bias_torque": 0.0,
}

# A search for what is easily found, where the search is not what is tested.
QUICK = SearchConfig(folds=2, beam=1, breadth=4, contenders=2, most=2)


def a_joint(noise: float = 0.0, quantum: float = 0.0, samples: int = 120, speed: float = 1.0) -> JointRecording:
    """Three episodes of a sum of sines; velocity is the exact derivative, or an encoder's central difference."""
    rng = np.random.default_rng(0)
    t = np.arange(samples) * 0.01
    rates = np.array([[3.0], [5.0], [8.0]])
    position = speed * np.sin(rates * t)
    velocity = speed * rates * np.cos(rates * t)
    if quantum:
        position = quantum * np.round(position / quantum)
        velocity = np.gradient(position, 0.01, axis=1)
    position = position + noise * rng.standard_normal(position.shape)
    velocity = velocity + 10 * noise * rng.standard_normal(velocity.shape)
    return JointRecording(
        nominal=NOMINAL,
        sample_time=0.01,
        units="rotary",
        command=np.sin(rates * t + 1),
        position=position,
        velocity=velocity,
        lengths=np.full(3, samples),
        episodes=(0, 1, 2),
    )


def a_camera(bits: int = 8, grey: bool = False, frames: int = 4) -> CameraRecording:
    """Random pictures of 24 x 20 px, exact at their depth, with labels and a mask."""
    rng = np.random.default_rng(1)
    full = 2**bits - 1
    pictures = rng.integers(0, full, (2, frames, 20, 24, 1 if grey else 3), endpoint=True).astype(np.float32) / full
    sim, real = np.broadcast_to(pictures, (2, frames, 20, 24, 3))
    names = tuple(f"{k:04}" for k in range(frames))
    return CameraRecording(
        pairing="paired",
        encoding="srgb",
        sim=sim,
        real=real,
        labels=rng.integers(0, 5, (frames, 20, 24)).astype(np.uint8),
        mask=rng.random((frames, 20, 24)) < 0.9,
        intrinsics=np.array([30.0, 31.0, 11.5, 9.5]),
        bits=bits,
        grey=grey,
        names=names,
        real_names=names,
    )


def a_contact(velocities: bool = True, samples: int = 60, shape: Shape | None = None) -> ContactRecording:
    """Four tosses of a cube (or another body) by the nominal simulator."""
    rng = np.random.default_rng(2)
    first = np.zeros((4, 13))
    first[:, 2] = 0.15
    attitude = rng.normal(size=(4, 4))
    first[:, 3:7] = attitude / np.linalg.norm(attitude, axis=1, keepdims=True)
    first[:, 7:] = rng.normal(size=(4, 6))
    shape = shape or box((0.05, 0.05, 0.05))
    states = simulate(pack(NominalContact(0.37, 0.3, 0.2), {})[None], shape, first, samples, 0.01)[0]
    return ContactRecording(
        nominal={"mass": 0.37, "lateral_friction": 0.3, "restitution": 0.2, "gravity": 9.81},
        shape=shape,
        sample_time=0.01,
        position=states[..., :3],
        attitude=states[..., 3:7],
        velocity=states[..., 7:] if velocities else None,
        lengths=np.full(4, samples),
        episodes=(0, 1, 2, 3),
    )


TWO_LINKS = DATA / "arm" / "two_links.xml"
DRIVE = {
    "torque_constant": 1.0,
    "inertia": 0.05,
    "viscous_damping": 1.0,
    "coulomb_friction": 0.03,
    "gravity_torque": 0.0,
    "bias_torque": 0.0,
    "proportional_gain": 60.0,
    "derivative_gain": 0.0,
    "command_limit": 15.0,
}


def an_arm(effects=None, whole=None, seconds=4.0, episodes=2, noise=2e-4, seed=0, rate=100) -> ArmRecording:
    """Two links under position servos, by the nominal simulator with effects by joint; logged at `rate` Hz."""
    from vision_s2r.arm.bodies import Bodies
    from vision_s2r.arm.model import ArmModel
    from vision_s2r.arm.simulate import simulate as run

    rng = np.random.default_rng(seed)
    names = ("shoulder", "elbow")
    bodies = Bodies(ArmModel(TWO_LINKS), names, {}, "tool", whole)
    machines = np.array([joint_row((effects or {}).get(name, {})) for name in names])
    t = np.arange(round(seconds * rate)) / rate
    command = np.empty((episodes, 2, len(t)))
    for each in command.reshape(-1, len(t)):
        each[:] = sum(
            a * np.sin(w * t + p)
            for a, w, p in zip((0.5, 0.3), rng.uniform(1, 6, 2), rng.uniform(0, 6, 2), strict=True)
        )
        each += 0.3 * np.sign(np.sin(rng.uniform(2, 4) * t))
    first = np.stack([command[:, :, 0], np.zeros((episodes, 2))], axis=-1)
    states = np.array([run(bodies, machines, c, f, t).states for c, f in zip(command, first, strict=True)])
    position = states[..., 0] + noise * rng.standard_normal(states.shape[:-1])
    lengths = np.full(episodes, len(t))
    joints = {
        name: JointRecording(
            DRIVE, 1 / rate, "rotary", command[:, j], position[:, j], None, lengths, tuple(range(episodes))
        )
        for j, name in enumerate(names)
    }
    return ArmRecording(TWO_LINKS, joints, dict.fromkeys(names, "position"), {}, "tool")


def played(model, recording):
    """Positions [T, J] of a MuJoCo model of an arm, whose actuators are given the commands of the first episode."""
    import mujoco

    model.opt.timestep, model.opt.integrator = 5e-4, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    commands = np.array([joint.command[0] for joint in recording.joints.values()]).T
    for k, name in enumerate(recording.joints):
        data.joint(name).qpos = recording.position[0, 0, k]
        if count := model.actuator_history[k, 0]:
            mujoco.mj_initCtrlHistory(model, data, k, None, np.full((count, 1), commands[0, k]))
    found = []
    for command in commands:
        found.append([data.joint(name).qpos[0] for name in recording.joints])
        data.ctrl[:] = command
        for _ in range(round(recording.any.sample_time / 5e-4)):
            mujoco.mj_step(model, data)
    return np.array(found)


def joint_row(effects):
    """A machine of the arm's."""
    from vision_s2r import joint

    return joint.pack(joint.NominalJoint(**DRIVE), effects)


def edit(path, *changes):
    """Replace texts of a file that it must have."""
    text = path.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text)


def refused(folder, message, **keys):
    """A recording is refused in one line that matches."""
    with pytest.raises(UserError, match=message) as caught:
        read(folder, **keys)
    assert "\n" not in str(caught.value)
