"""A student learns from the teacher's chances alone, on pictures that mislead the teacher."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch
from bars import Bars
from test_policy import CAMERA, HELD_OUT, SEED, config, trained

from vision_s2r.camera import CameraConfig
from vision_s2r.errors import UserError
from vision_s2r.grasp import GraspPolicy
from vision_s2r.grasp.student import train_student
from vision_s2r.grasp.student_config import StudentConfig
from vision_s2r.networks.unet import NetworkConfig
from vision_s2r.training import Inputs, TrainingConfig, checkpoint

CFG = StudentConfig(
    training=TrainingConfig(
        max_steps=60, batch_size=16, learning_rate=2e-3, validate_every=60, metric="auc", mode="max", accelerator="cpu"
    )
)


def negative(pictures: torch.Tensor) -> torch.Tensor:
    """A translator that gets everything wrong, always in the same way."""
    return 1 - pictures


def unlabelled() -> Bars:
    views = Bars(300, 0)
    views.names -= {"grasps", "success"}
    return views


INPUTS = Inputs(unlabelled(), HELD_OUT, CAMERA, CameraConfig())


@pytest.fixture(scope="module")
def teacher(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return trained(tmp_path_factory.mktemp("teacher"), config())


def auc(path: Path) -> float:
    return checkpoint.load(path, "q_function").training["metrics"]["auc"]


def test_it_gets_used_to_its_translator(teacher: Path, tmp_path: Path) -> None:
    before, after = (
        train_student(
            replace(CFG, training=replace(CFG.training, **learning)),
            INPUTS,
            teacher,
            teacher,
            tmp_path / name,
            SEED,
            negative,
        )
        for name, learning in (("before", {"learning_rate": 1e-9, "max_steps": 1}), ("after", {}))
    )
    assert auc(after) > 0.85 > auc(before), (auc(after), auc(before))
    metrics = [checkpoint.load(path, "q_function").training["metrics"] for path in (after, before)]
    assert metrics[0]["chance_difference"] < 0.5 * metrics[1]["chance_difference"]
    assert GraspPolicy.load(after).size == HELD_OUT.size


@pytest.mark.slow
def test_domain_randomization_has_one_too(teacher: Path, tmp_path: Path) -> None:
    front = NetworkConfig(width=8, levels=2, blocks=1, rectifier=8)
    cfg = config(steps=4, picture="randomized", validate_on="randomized", front=front, rectification=1.0)
    start = trained(tmp_path / "start", cfg)
    steps = replace(CFG, training=replace(CFG.training, muon=4e-3))
    path = train_student(steps, INPUTS, start, teacher, tmp_path / "student", SEED)
    assert auc(path) > max(0.7, auc(start)), (auc(path), auc(start))
    with pytest.raises(UserError, match=r"of randomized pictures: expected canonical"):  # what it is told to begin as
        train_student(replace(CFG, start=str(start)), INPUTS, teacher, teacher, tmp_path / "other", SEED, negative)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA here")
def test_policies_and_students_learn_on_a_gpu(tmp_path: Path) -> None:
    def there(training: TrainingConfig) -> TrainingConfig:
        return replace(training, accelerator="cuda", resident=True, compile=True, precision="bf16-mixed")

    cfg = config()
    teacher = trained(tmp_path / "teacher", replace(cfg, training=there(cfg.training)))
    student = replace(CFG, training=there(CFG.training))
    path = train_student(student, INPUTS, teacher, teacher, tmp_path / "student", SEED, negative)
    assert auc(teacher) > 0.85 and auc(path) > 0.85, (auc(teacher), auc(path))


def test_what_does_not_fit_is_refused(teacher: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="expected randomized"):
        train_student(CFG, INPUTS, teacher, teacher, tmp_path, SEED)
    with pytest.raises(UserError, match=r"student\.own = 99"):
        train_student(replace(CFG, own=99), INPUTS, teacher, teacher, tmp_path, SEED, negative)
