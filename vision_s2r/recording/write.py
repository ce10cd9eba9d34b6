"""The other way round: a recording from arrays, as a folder that `read` takes."""

import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from scipy.spatial import ConvexHull

from vision_s2r.contact.shape import Shape
from vision_s2r.errors import UserError
from vision_s2r.recording import contact, table
from vision_s2r.recording.data import ArmRecording, CameraRecording, ContactRecording, JointRecording, Recording
from vision_s2r.recording.header import FORMAT
from vision_s2r.recording.joint import CONTROL


def write(recording: Recording, folder: Path | str) -> Path:
    """Write a recording into a folder, which must be absent or empty; returns it.

    A joint's command is written as a current, a servo's as a target. Raises UserError where it cannot be written.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise UserError(f"{folder}: is not empty, expected a new folder for a recording")
        if isinstance(recording, JointRecording):
            content = _joint(recording, folder)
        elif isinstance(recording, ContactRecording):
            content = _contact(recording, folder)
        elif isinstance(recording, ArmRecording):
            content = _arm(recording, folder)
        else:
            content = _camera(recording, folder)
        head = {"format": FORMAT, "kind": recording.kind, **content}
        (folder / "recording.yaml").write_text(yaml.safe_dump(head, sort_keys=False))
    except OSError as error:
        raise UserError(f"{folder}: cannot be written ({error.strerror})") from error
    return folder


def _joint(recording: JointRecording, folder: Path) -> dict[str, Any]:
    command = "target" if recording.servo else "current"
    optional = {name: getattr(recording, name) for name in ("velocity", "supply", "external")}
    given = {name: values for name, values in optional.items() if values is not None}
    if recording.gains is not None:
        given["gain"] = np.broadcast_to(recording.gains[:, None], recording.position.shape)
    columns = ["episode", "t", command, "position", *given]
    blocks = []
    for k, length in enumerate(recording.lengths):
        block = [np.full(length, recording.episodes[k]), recording.time[k, :length]]
        block += [recording.command[k, :length], recording.position[k, :length]]
        block += [values[k, :length] for values in given.values()]
        blocks.append(np.stack(block, axis=1))
    (folder / "joint.csv").write_text(table.text(columns, np.concatenate(blocks)))
    return joint_head(recording)


def joint_head(recording: JointRecording) -> dict[str, Any]:
    """What recording.yaml says of a joint: sample_time, units, nominal and, of a servo, control."""
    law = {key: recording.nominal[name] for key, name in CONTROL.items() if name in recording.nominal}
    nominal = {key: value for key, value in recording.nominal.items() if key not in CONTROL.values()}
    head = {"sample_time": recording.sample_time, "units": recording.units, "nominal": nominal}
    return {**head, "control": law} if recording.servo else head


def _arm(recording: ArmRecording, folder: Path) -> dict[str, Any]:
    """The model is copied, without meshes."""
    shutil.copy(recording.model, folder / recording.model.name)
    some = recording.any
    drives, columns = {}, ["episode", "t"]
    rows = [[np.full(n, recording.episodes[k]), some.time[k, :n]] for k, n in enumerate(some.lengths)]
    for name, joint in recording.joints.items():
        drives[name] = {"command": recording.modes[name], **_drive(joint.nominal, recording.modes[name])}
        given = {key: getattr(joint, key) for key in ("command", "position", "velocity")}
        given = {key: values for key, values in given.items() if values is not None}
        given |= {"torque": recording.torque[name]} if name in recording.torque else {}
        columns += [f"{key}.{name}" for key in given]
        for k, n in enumerate(some.lengths):
            rows[k] += [values[k, :n] for values in given.values()]
    values = np.concatenate([np.stack(each, axis=1) for each in rows])
    (folder / "arm.csv").write_text(table.text(columns, values))
    tip = {} if recording.tip is None else {"tip": recording.tip}
    head = {"model": recording.model.name, "sample_time": some.sample_time, **tip, "joints": drives}
    return {**head, "hold": recording.hold} if recording.hold else head


def _drive(nominal: dict[str, float], mode: str) -> dict[str, float]:
    """A joint's nominal values under the names that an arm's header has for them."""
    damping = nominal["viscous_damping"]
    drive = {"armature": nominal["inertia"], "coulomb_friction": nominal["coulomb_friction"]}
    if mode == "velocity":
        gain = nominal["torque_constant"]
        return {**drive, "proportional_gain": gain, "viscous_damping": damping - gain}
    law = {
        "proportional_gain": "proportional_gain",
        "derivative_gain": "derivative_gain",
        "torque_limit": "command_limit",
    }
    return {**drive, "viscous_damping": damping, **{key: nominal[name] for key, name in law.items() if name in nominal}}


def _contact(recording: ContactRecording, folder: Path) -> dict[str, Any]:
    velocity = recording.velocity
    blocks = []
    for k, length in enumerate(recording.lengths):
        stamps = np.stack([np.full(length, recording.episodes[k]), np.arange(length) * recording.sample_time], axis=1)
        block = [stamps, recording.position[k, :length], recording.attitude[k, :length]]
        block += [] if velocity is None else [velocity[k, :length]]
        blocks.append(np.concatenate(block, axis=1))
    columns = contact.COLUMNS if velocity is not None else contact.COLUMNS[: -len(contact.VELOCITIES)]
    (folder / "contact.csv").write_text(table.text(columns, np.concatenate(blocks)))
    nominal = {**_shape(recording.shape, folder), **recording.nominal}
    return {"sample_time": recording.sample_time, "nominal": nominal}


def _shape(shape: Shape, folder: Path) -> dict[str, Any]:
    """The keys of a shape in the header; a mesh is written beside it."""
    sizes: dict[str, dict[str, Any]] = {
        "box": {"half_extents": shape.points.max(axis=0, initial=0.0).tolist()},
        "sphere": {"radius": shape.radius},
        "cylinder": {"radius": shape.radius, "length": 2 * shape.half_length},
        "mesh": {"mesh": "body.obj"},
    }
    if shape.kind == "mesh":
        lines = ["v " + " ".join(f"{x:.9g}" for x in point) for point in shape.points]
        lines += ["f " + " ".join(str(k + 1) for k in face) for face in ConvexHull(shape.points).simplices]
        (folder / "body.obj").write_text("\n".join(lines) + "\n")
    return {"shape": shape.kind, **sizes[shape.kind]}


def _camera(recording: CameraRecording, folder: Path) -> dict[str, Any]:
    _pictures(recording.sim, recording.names, folder / "sim", recording.bits, recording.grey)
    _pictures(recording.real, recording.real_names, folder / "real", recording.bits, recording.grey)
    beside = {
        "labels": recording.labels,
        "mask": None if recording.mask is None else recording.mask.astype(np.uint8) * np.uint8(255),
        "depth": None if recording.depth is None else np.rint(recording.depth * 1000).astype(np.uint16),
    }
    for name, values in beside.items():
        if values is not None:
            (folder / name).mkdir()
            for stem, picture in zip(recording.names, values, strict=True):
                cv2.imwrite(str(folder / name / f"{stem}.png"), picture)
    head: dict[str, Any] = {"pairing": recording.pairing, "encoding": recording.encoding}
    if recording.intrinsics is not None:
        height, width = recording.sim.shape[1:3]
        geometry = dict(zip(("fx", "fy", "cx", "cy"), recording.intrinsics.tolist(), strict=True))
        head["camera"] = {"width": width, "height": height, **geometry}
    if recording.label_names:
        head["label_names"] = dict(recording.label_names)
    return head


def _pictures(pictures: np.ndarray, names: tuple[str, ...], folder: Path, bits: int, grey: bool) -> None:
    folder.mkdir()
    full = 2**bits - 1
    for name, picture in zip(names, pictures, strict=True):
        whole = np.clip(np.rint(picture * full), 0, full).astype(np.uint8 if bits == 8 else np.uint16)
        cv2.imwrite(str(folder / f"{name}.png"), whole[..., 0] if grey else whole[..., ::-1])
