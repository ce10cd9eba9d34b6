"""The stages of the visual pipeline, one command each, with the first seed of the configuration.

Each renders the sets that it reads and that nobody has rendered.
"""

from pathlib import Path

from vision_s2r import pipeline
from vision_s2r import render as rendering
from vision_s2r.config import Config
from vision_s2r.grasp import train_policy


def render(cfg: Config) -> None:
    """The scenes of `cfg.render`."""
    rendering.render(cfg.scene, cfg.render)


def translate(cfg: Config) -> Path:
    """The translator, in OUT/translator-SEED; returns its released checkpoint."""
    pipeline.render_absent(cfg, "pairs", "validation")
    return pipeline.paired_translator(cfg, cfg.seed)


def adapt(cfg: Config) -> list[Path]:
    """The adaptation, in OUT/adapt-SEED; returns the released policy and, where there is one, the translator."""
    pipeline.render_absent(cfg, "train", "validation", "real")
    released = pipeline.adapt(cfg, cfg.seed)
    return [path for path in (released.policy, released.translator) if path]


def grasp(cfg: Config) -> Path:
    """The policy, in OUT/policy-SEED; one on randomized pictures in OUT/baseline-SEED. Returns its checkpoint."""
    role = "policy" if cfg.grasp.picture == "canonical" else "baseline"
    out = Path(cfg.out) / f"{role}-{cfg.seed}"
    pipeline.render_absent(cfg, "train", "validation")
    return train_policy(cfg.grasp, pipeline.labelled(cfg), out, cfg.seed)


def table(cfg: Config) -> None:
    """The transfer table and its page, in `cfg.evaluate.out`; test scenes that are missing are rendered."""
    pipeline.evaluate_configured(cfg)
