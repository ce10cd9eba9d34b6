"""A folder, read by its kind."""

from pathlib import Path

from vision_s2r.errors import UserError
from vision_s2r.recording import camera, contact, header, joint
from vision_s2r.recording.data import Recording

KINDS = ("joint", "camera", "contact", "arm", "robot")


def read(folder: Path | str, hold_out: bool = True) -> Recording:
    """The recording in a folder, checked. Raises UserError, one line, for whatever cannot be.

    `hold_out` asks that it be long enough to keep a part of it from being fitted; a replay need not.
    """
    folder = Path(folder)
    content = header.load(folder)
    kind = header.choice(content, "kind", KINDS, str(folder / "recording.yaml"))
    if kind == "joint":
        return joint.read(folder, content, hold_out)
    if kind == "camera":
        return camera.read(folder, content, hold_out)
    if kind == "contact":
        return contact.read(folder, content, hold_out)
    if kind == "arm":
        from vision_s2r.recording import arm  # imports MuJoCo

        return arm.read(folder, content, hold_out)
    raise UserError(
        f"{folder}: a robot has several recordings: expected the folder of one, of kind joint, camera, contact or arm"
    )
