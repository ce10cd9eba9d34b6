"""The benchmarks of scripts/benchmark.py, by name: each takes the overrides of the visual configuration."""

from pathlib import Path

from vision_s2r.cli import compose, log_to_terminal
from vision_s2r.config import Config
from vision_s2r.contact import benchmark as contact_benchmark
from vision_s2r.control import benchmark as control_benchmark
from vision_s2r.evaluate import forms
from vision_s2r.joint import benchmark as joint_benchmark
from vision_s2r.pipeline import training_sets
from vision_s2r.render import benchmark as render_benchmark
from vision_s2r.translate import benchmark as translate_benchmark


def render(overrides: list[str]) -> None:
    """Pairs a second against the engine's limit and the usual loop; memory over 20,000 renders."""
    cfg = compose(Config, overrides=overrides)
    render_benchmark.run(cfg.scene, cfg.render.size, cfg.render.margin, cfg.render.views, cfg.seed)


def translate(overrides: list[str]) -> None:
    """The translator against the U-Net of the literature: speed, and errors after the same time."""
    cfg = compose(Config, overrides=overrides)
    log_to_terminal()
    cameras, out = (cfg.camera, cfg.validation_camera), Path(cfg.out) / "benchmark"
    translate_benchmark.run(cfg.translate, cfg.benchmark, *training_sets(cfg), *cameras, out, cfg.seed)


def grasp(overrides: list[str]) -> None:
    """The three forms of Q on the same data in the same minutes, and what their grasps are worth."""
    cfg = compose(Config, overrides=overrides)
    policies = {form: compose(Config, overrides=[*overrides, f"grasp={form}"]).grasp for form in forms.FORMS}
    forms.compare(policies, *training_sets(cfg), cfg.scene, cfg.out)


def joint(overrides: list[str]) -> None:
    """Steps a second of the joint simulator, against a NumPy loop and against PyBullet."""
    joint_benchmark.run(compose(Config, overrides=overrides).seed)


def contact(overrides: list[str]) -> None:
    """Steps a second of the contact simulator, against PyBullet."""
    contact_benchmark.run(compose(Config, overrides=overrides).seed)


def control(overrides: list[str]) -> None:
    """Steps a second of the speed-tracking environment, against a Python loop of one joint."""
    control_benchmark.run(compose(Config, overrides=overrides).seed)


BENCHMARKS = {
    "render": render,
    "translate": translate,
    "grasp": grasp,
    "joint": joint,
    "contact": contact,
    "control": control,
}
