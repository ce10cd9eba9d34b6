"""Patches: what other programs read in them is what the report named."""

import json
import math
from xml.etree import ElementTree

import cv2
import numpy as np
import pybullet
import pytest
import torch
from omegaconf import OmegaConf
from pybullet_utils.bullet_client import BulletClient
from recordings import a_camera, a_joint
from reports import a_report

from vision_s2r.camera import Camera, load_config
from vision_s2r.cli import compose
from vision_s2r.config import Config
from vision_s2r.errors import UserError
from vision_s2r.patch.patch import write_patch

CAMERA = {
    "defocus_blur": {"radius": 2.0},
    "lens_distortion": {"k1": -0.15, "k2": 0.03},
    "camera_pose_offset": {"yaw": 0.01, "pitch": -0.02, "roll": 0.03},
    "jpeg_compression": {"quality": 30.0},
    "shot_noise": {"full_well": 1e6},
}
JOINT = {
    "viscous_damping": {"value": 0.18},
    "coulomb_friction": {"value": 0.03},
    "inertia": {"value": 0.025},
    "bias_torque": {"value": -0.02},
    "torque_saturation": {"limit": 0.4},
    "backlash": {"width": 0.03},
}


def test_a_camera_is_one_of_this_projects(tmp_path):
    write_patch(a_report("camera", **CAMERA), a_camera(), tmp_path)
    camera = Camera.from_config(load_config(tmp_path / "camera.yaml"))
    drawn = camera.sample(3, torch.Generator(), 20, 24)
    for name, given in CAMERA.items():
        for key, value in given.items():
            assert drawn.values[name][key].tolist() == pytest.approx([value] * 3)
    spread = Camera.from_config(load_config(tmp_path / "camera_randomized.yaml"))
    assert tuple(spread.ranges["defocus_blur"].ranges["radius"]) == pytest.approx((1.98, 2.02))
    assert tuple(spread.ranges["shot_noise"].ranges["full_well"]) == pytest.approx((0.99e6, 1e6))  # within the bounds
    overrides = (tmp_path / "overrides.txt").read_text().splitlines()
    assert compose(Config, overrides=overrides).camera == load_config(tmp_path / "camera.yaml")


def test_opencv_reads_the_calibration(tmp_path):
    recording = a_camera()
    write_patch(a_report("camera", **CAMERA), recording, tmp_path)
    storage = cv2.FileStorage(str(tmp_path / "opencv.yml"), cv2.FILE_STORAGE_READ)
    fx, fy, cx, cy = recording.intrinsics
    np.testing.assert_allclose(storage.getNode("camera_matrix").mat(), [[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    np.testing.assert_allclose(storage.getNode("distortion_coefficients").mat().ravel(), [-0.15, 0.03, 0, 0, 0])
    np.testing.assert_allclose(storage.getNode("rotation_vector").mat().ravel(), [-0.02, 0.01, 0.03])
    assert storage.getNode("image_width").real() == 24
    write_patch(a_report("camera", exposure={"stops": 1.0}), recording, tmp_path / "light")
    assert not (tmp_path / "light" / "opencv.yml").exists()


def test_mujoco_and_urdf_have_the_attributes_and_say_what_they_lack(tmp_path):
    write_patch(a_report("joint", **JOINT), a_joint(), tmp_path)
    model = ElementTree.parse(tmp_path / "mujoco.xml")
    joint, motor = model.find(".//joint"), model.find(".//general")
    assert {key: float(joint.get(key)) for key in ("damping", "frictionloss", "armature")} == pytest.approx(
        {"damping": 0.18, "frictionloss": 0.03, "armature": 0.005}
    )
    assert (
        float(motor.get("gainprm")) == 0.5
        and motor.get("ctrlrange") == "-0.8 0.8"
        and motor.get("biasprm") == "0.02 0 0"
    )
    text = (tmp_path / "mujoco.xml").read_text()
    assert text.count("no attribute") == 1 and "backlash: a second joint in series, free within ±0.03/2 rad" in text
    dynamics = ElementTree.parse(tmp_path / "urdf.xml").find("dynamics")
    assert (float(dynamics.get("damping")), float(dynamics.get("friction"))) == (0.18, 0.03)
    assert (tmp_path / "urdf.xml").read_text().count("no attribute") == 4


def test_a_smaller_inertia_is_no_negative_armature(tmp_path):
    write_patch(a_report("joint", inertia={"value": 0.015}), a_joint(), tmp_path)
    assert "armature=" not in (tmp_path / "mujoco.xml").read_text()
    assert "by -0.005, to 0.015" in (tmp_path / "mujoco.xml").read_text()


LINK = (
    '<link name="{}"><inertial><mass value="1"/>'
    '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
JOINT_OF = (
    '<joint name="JOINT" type="continuous"><parent link="base"/><child link="load"/><axis xyz="0 0 1"/>{}</joint>'
)


def _spin(folder, dynamics, patch):
    """Damping and friction as PyBullet read them, and the velocity a second after 1 rad/s; the inertia is 1 kg·m²."""
    path = folder / "robot.urdf"
    links = LINK.format("base") + LINK.format("load")
    path.write_text(f'<robot name="one">{links}{JOINT_OF.format(dynamics)}</robot>')
    client = BulletClient(pybullet.DIRECT)
    body = client.loadURDF(str(path), useFixedBase=True, flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
    client.changeDynamics(body, 0, linearDamping=0, angularDamping=0)
    client.setJointMotorControl2(body, 0, pybullet.VELOCITY_CONTROL, force=0)
    if patch:
        client.changeDynamics(body, 0, **patch["changeDynamics"])
        client.setJointMotorControl2(body, 0, **patch["setJointMotorControl2"])
    client.resetJointState(body, 0, 0.0, 1.0)
    for _ in range(240):
        client.stepSimulation()
    return *client.getJointInfo(body, 0)[6:8], client.getJointState(body, 0)[1]


def test_pybullet_moves_as_diagnosed(tmp_path):
    write_patch(a_report("joint", **JOINT), a_joint(), tmp_path)
    patch = json.loads((tmp_path / "pybullet.json").read_text())
    assert set(patch["not_expressed"]) == {"inertia", "bias_torque", "torque_saturation", "backlash"}
    assert patch["setJointMotorControl2"]["controlMode"] == pybullet.VELOCITY_CONTROL
    decay, friction = math.exp(-0.18), 0.03 / 0.18
    assert _spin(tmp_path, "", patch)[2] == pytest.approx((1 + friction) * decay - friction, rel=2e-3)
    dynamics = ElementTree.tostring(ElementTree.parse(tmp_path / "urdf.xml").find("dynamics"), encoding="unicode")
    assert _spin(tmp_path, dynamics, None) == pytest.approx((0.18, 0.03, decay), rel=2e-3)


def test_joint_values_and_intervals(tmp_path):
    write_patch(a_report("joint", **JOINT), a_joint(), tmp_path)
    fixed, spread = (OmegaConf.load(tmp_path / name) for name in ("joint.yaml", "joint_randomized.yaml"))
    assert fixed.nominal.viscous_damping == 0.18 and fixed.nominal.torque_constant == 0.5
    assert fixed.effects == {"torque_saturation": {"limit": 0.4}, "backlash": {"width": 0.03}}
    assert spread.nominal.bias_torque == pytest.approx([-0.0202, -0.0198]) and spread.nominal.torque_constant == 0.5
    assert spread.effects.backlash.width == pytest.approx([0.0297, 0.0303])


def test_an_effect_that_is_not_known_is_named(tmp_path):
    report = a_report("joint", backlash={"width": 0.03})
    report["effects"][0]["name"] = "backlsh"
    with pytest.raises(UserError, match="did you mean 'backlash'"):
        write_patch(report, a_joint(), tmp_path)
