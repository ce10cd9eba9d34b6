"""The benchmarks, a command each, on the visual configuration."""

from pathlib import Path

from vision_s2r.cli import compose
from vision_s2r.config import Config
from vision_s2r.contact import benchmark as contact_benchmark
from vision_s2r.control import benchmark as control_benchmark
from vision_s2r.evaluate import forms
from vision_s2r.export import benchmark as export_benchmark
from vision_s2r.joint import benchmark as joint_benchmark
from vision_s2r.lazy import load
from vision_s2r.pipeline import pairs
from vision_s2r.render import Views
from vision_s2r.render import benchmark as render_benchmark
from vision_s2r.render import scale as scale_benchmark
from vision_s2r.translate import benchmark as translate_benchmark


def render(cfg: Config) -> Path:
    """Pairs a second against the engine's limit and the usual loop; memory over 20,000 renders."""
    given = cfg.render
    return render_benchmark.run(cfg.scene, given.size, given.margin, given.views, cfg.seed, _out(cfg))


def scale(cfg: Config) -> Path:
    """What a million scenes cost on one node, ten and a hundred."""
    sets = {"labelled grasps": cfg.data.train, "pairs of pictures": cfg.data.pairs}
    return scale_benchmark.run(cfg.scene, sets, _out(cfg))


def translate(cfg: Config) -> None:
    """The translator against the U-Net of the literature: speed, and errors after the same time."""
    translate_benchmark.run(cfg.translate, cfg.benchmark, pairs(cfg), _out(cfg), cfg.seed)


def grasp(overrides: list[str]) -> Path:
    """The three forms of Q on the same data in the same minutes, and what their grasps are worth."""
    cfg = compose(Config, overrides=overrides)
    views, validation = Views.open(cfg.data.train.out), Views.open(cfg.data.validation.out)
    policies = {form: compose(Config, overrides=[*overrides, f"grasp={form}"]).grasp for form in forms.FORMS}
    return forms.compare(policies, views, validation, cfg.scene, _out(cfg))


def export(cfg: Config) -> Path:
    """Milliseconds from a picture to a grasp, torch beside onnxruntime."""
    return export_benchmark.run(cfg.seed, _out(cfg))


def joint(cfg: Config) -> Path:
    """Steps a second of the joint simulator, against a NumPy loop and against PyBullet."""
    return joint_benchmark.run(cfg.seed, _out(cfg))


def contact(cfg: Config) -> Path:
    """Steps a second of the contact simulator, against PyBullet."""
    return contact_benchmark.run(cfg.seed, _out(cfg))


def sysid(cfg: Config) -> Path:
    """A six-joint arm and 60 s of log: diagnosis, and mujoco.sysid that is told what is wrong."""
    run = load("vision_s2r.sysid:run")  # imports MuJoCo
    path: Path = run(cfg.seed, _out(cfg))
    return path


def control(cfg: Config) -> Path:
    """Steps a second of the speed-tracking environment, against a Python loop of one joint."""
    return control_benchmark.run(cfg.seed, _out(cfg))


def _out(cfg: Config) -> Path:
    return Path(cfg.out) / "benchmark"
