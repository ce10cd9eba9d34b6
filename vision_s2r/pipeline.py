"""The whole way in one call: render three sets, train translators, policies and the baseline, evaluate."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from vision_s2r import parallel
from vision_s2r.adapt import Adapted, train_adapted
from vision_s2r.camera import Camera
from vision_s2r.camera.presets import preset
from vision_s2r.cli import log_to_terminal
from vision_s2r.config import Config
from vision_s2r.errors import UserError
from vision_s2r.evaluate import Table, evaluate
from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.evaluate.sensitivity import sensitivity
from vision_s2r.grasp import FrozenQ, train_policy
from vision_s2r.grasp.student import train_student
from vision_s2r.render import Recorded, Views, render
from vision_s2r.scene import SceneConfig
from vision_s2r.training import Inputs
from vision_s2r.training.data import RECORDED, generator
from vision_s2r.training.loop import BEST
from vision_s2r.translate import TranslateConfig, Translator, train_translator

Training = Callable[[Config, int], Path]
Checkpoints = dict[str, list[str]]  # of each kind of network, one a seed


def run(cfg: Config) -> Path:
    """Do, or go on with, what cfg describes; returns the page with the transfer table.

    Each stage keeps what it finished: the same command goes on where it was interrupted.
    """
    render_sets(cfg)
    table = evaluation(cfg, train(cfg))
    evaluate(table, test_scene(cfg))
    return Path(table.out) / "index.html"


def render_sets(cfg: Config, *names: str) -> None:
    """Render what is missing of these sets of cfg.data; without names, of those that `train` and `evaluate` read.

    Raises UserError as `render` does.
    """
    for name in names or ("pairs", "train", "validation", "test"):
        render(test_scene(cfg) if name == "test" else cfg.scene, getattr(cfg.data, name))


def render_absent(cfg: Config, *names: str) -> None:
    """Render those of these sets of cfg.data that nobody has rendered whole, whatever scenes the others are of.

    Raises UserError as `render` does.
    """
    for name in names:
        try:
            Views.open(getattr(cfg.data, name).out)
        except UserError:
            render_sets(cfg, name)


def test_scene(cfg: Config) -> SceneConfig:
    """The scene of cfg with objects that no training sees."""
    return replace(cfg.scene, objects=replace(cfg.scene.objects, split="test"))


def labelled(cfg: Config) -> Inputs:
    """Views with labelled grasps, and the cameras. Raises UserError unless they are rendered."""
    return _inputs(cfg, cfg.data.train.out)


def pairs(cfg: Config) -> Inputs:
    """Pairs of pictures without grasps, and the cameras. Raises UserError unless they are rendered."""
    return _inputs(cfg, cfg.data.pairs.out)


def _inputs(cfg: Config, views: str) -> Inputs:
    return Inputs(Views.open(views), Views.open(cfg.data.validation.out), cfg.camera, cfg.validation_camera)


def train(cfg: Config) -> Checkpoints:
    """Train every network of every seed, `cfg.jobs` processes at a time; returns the best checkpoints.

    A student's process first trains what it needs; what another is training already it waits for.
    """
    trainings: dict[str, Training] = {"policy": canonical_policy, "student": student}
    if cfg.with_baseline:
        trainings["baseline_student"] = baseline_student
    found = _train_all(cfg, trainings)
    for name in ("translator", "baseline")[: 1 + cfg.with_baseline]:
        found[name] = [str(_folder(cfg, name, seed) / BEST) for seed in _seeds(cfg)]
    return found


def canonical_policies(cfg: Config) -> list[str]:
    """Train the canonical policy of every seed alone, as `train` does."""
    return _train_all(cfg, {"policy": canonical_policy})["policy"]


def _train_all(cfg: Config, trainings: dict[str, Training]) -> Checkpoints:
    calls = ((training, cfg, seed) for training in trainings.values() for seed in _seeds(cfg))
    paths = [str(path) for path in parallel.run(_logged, calls, cfg.jobs, cfg.backend)]
    return {name: paths[k * cfg.seeds : (k + 1) * cfg.seeds] for k, name in enumerate(trainings)}


def _seeds(cfg: Config) -> range:
    return range(cfg.seed, cfg.seed + cfg.seeds)


def _folder(cfg: Config, name: str, seed: int) -> Path:
    """Where the network of this name is trained."""
    return Path(cfg.out) / f"{name}-{seed}"


def _logged(training: Training, cfg: Config, seed: int) -> Path:
    """One training, heard of also where it runs in a process of its own."""
    log_to_terminal()
    return training(cfg, seed)


def paired_translator(cfg: Config, seed: int) -> Path:
    """RCAN: randomized pictures through the training camera to canonical ones."""
    out = _folder(cfg, "translator", seed)
    return train_translator(cfg.translate, pairs(cfg), out, seed, frozen_q(cfg.translate))


def frozen_q(cfg: TranslateConfig) -> FrozenQ | None:
    """The policy that judges translations, where one is configured. Raises UserError where it is none."""
    return FrozenQ.load(cfg.q_function) if cfg.q_function else None


def canonical_policy(cfg: Config, seed: int) -> Path:
    """The policy that only ever sees canonical views."""
    return train_policy(cfg.grasp, labelled(cfg), _folder(cfg, "policy", seed), seed)


def student(cfg: Config, seed: int) -> Path:
    """The canonical policy's student, on the pictures of this seed's translator."""
    translator, policy = Translator.load(paired_translator(cfg, seed)), canonical_policy(cfg, seed)
    return train_student(cfg.student, pairs(cfg), policy, policy, _folder(cfg, "student", seed), seed, translator)


def baseline(cfg: Config, seed: int) -> Path:
    """Domain randomization: a policy of the same size and cost on randomized pictures directly."""
    return train_policy(cfg.baseline, labelled(cfg), _folder(cfg, "baseline", seed), seed)


def baseline_student(cfg: Config, seed: int) -> Path:
    """The student of domain randomization, taught by the same canonical policy."""
    start, teacher = baseline(cfg, seed), canonical_policy(cfg, seed)
    out = _folder(cfg, "baseline_student", seed)
    return train_student(cfg.baseline_student, pairs(cfg), start, teacher, out, seed)


def adapt(cfg: Config, seed: int) -> Adapted:
    """Adaptation without pairs, which begins with a canonical policy: `adapt.policy`, or else this seed's own."""
    settings = cfg.adapt if cfg.adapt.policy else replace(cfg.adapt, policy=str(canonical_policy(cfg, seed)))
    out = _folder(cfg, "adapt", seed)
    return train_adapted(settings, labelled(cfg), recorded(cfg), cfg.translate, out, seed)


def recorded(cfg: Config) -> Recorded:
    """What the robots of cfg recorded; the same for every training seed. Raises UserError unless it is rendered."""
    cameras = [Camera.from_config(preset(name, "adapt.cameras")) for name in cfg.adapt.cameras]
    return Recorded.by(Views.open(cfg.data.real.out), cameras, lambda scene: generator(RECORDED, *scene))


def evaluate_configured(cfg: Config) -> Table:
    """The transfer table of the checkpoints that cfg names; test scenes that are missing are rendered first."""
    _render_test(cfg)
    return evaluate(cfg.evaluate, cfg.scene)


def measure_sensitivity(cfg: Config) -> Path:
    """The curves of the checkpoints that cfg names, in OUT/sensitivity; returns the summary (JSON)."""
    _render_test(cfg)
    return sensitivity(cfg.sensitivity, cfg.evaluate, cfg.scene, Path(cfg.out) / "sensitivity")


def _render_test(cfg: Config) -> None:
    """Test scenes, unless the evaluation is of another folder's."""
    if cfg.evaluate.scenes == cfg.data.test.out:
        render(test_scene(cfg), cfg.data.test)


def evaluation(cfg: Config, found: Checkpoints) -> EvaluateConfig:
    """The evaluation of cfg with the checkpoints filled in."""
    rows = dict(cfg.evaluate.rows)
    for name in ("oracle", "no_translation", "rcan"):
        rows[name] = replace(rows[name], policy=found["policy"])
    rows["domain_randomization"] = replace(rows["domain_randomization"], policy=found.get("baseline", []))
    students = rows["domain_randomization_student"]
    rows["domain_randomization_student"] = replace(students, policy=found.get("baseline_student", []))
    rows["rcan_student"] = replace(rows["rcan_student"], policy=found["student"])
    for name in ("rcan", "rcan_student"):
        rows[name] = replace(rows[name], translator=found["translator"])
    return replace(cfg.evaluate, rows=rows)
