"""The root configuration of the visual pipeline: a field a room; of rooms that are given all of it, their part here."""

from dataclasses import dataclass
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.adapt.config import AdaptConfig
from vision_s2r.camera.config import CameraConfig
from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.finetune.config import FinetuneConfig
from vision_s2r.grasp.config import GraspConfig
from vision_s2r.options import option
from vision_s2r.render.config import RenderConfig
from vision_s2r.scene.config import SceneConfig
from vision_s2r.translate.config import BenchmarkConfig, TranslateConfig


@dataclass
class DataConfig:
    """The sets that an experiment needs."""

    train: RenderConfig = option(
        RenderConfig(out="renders/full/train", scenes=4000),
        "Networks train on it: randomized and canonical pictures, labelled grasps.",
    )
    validation: RenderConfig = option(
        RenderConfig(out="renders/full/validation", scenes=300, seed=1, views=1, real=True),
        "Checkpoints are chosen on it: other scenes of the training objects, real pictures for the validation camera.",
    )
    test: RenderConfig = option(
        RenderConfig(out="renders/full/test", scenes=500, seed=2, views=1, real=True, grasps=0),
        "The transfer table is measured on it: objects that no training saw.",
    )
    real: RenderConfig = option(
        RenderConfig(out="renders/full/real", scenes=1000, seed=3, views=0, real=True),
        "What robots recorded: unpaired methods learn the real look from it, and its grasps are the few real ones.",
    )


@dataclass
class CloseGapConfig:
    """A diagnosed camera becomes the one that the translator trains under: cameras, what is trained, and from where."""

    withheld: int = option(
        5, "Cameras drawn, with three effects each that the diagnosis is not told, where no recording is given.", low=1
    )
    frames: int = option(16, "Pairs in the recording of each of them.", low=4)
    effects: list[str] = option([], "Effects that they may have, by name; empty: all.")
    truth: str = option(
        "",
        "With one recording: its true camera (a YAML file as in configs/camera), where that is known. Empty: it is "
        "not, and the table looks through the diagnosed one.",
    )
    translator: str = option(
        "outputs/cpu/translator-0/best.safetensors", "The translator as it was: a released checkpoint."
    )
    policy: str = option("outputs/cpu/policy-0/best.safetensors", "The policy that grasps: a released checkpoint.")
    steps: int = option(1200, "Of fine-tuning under each camera.", low=1)
    learning_rate: float = option(1e-3, "Of fine-tuning, at its highest.", above=0)
    everything: str = option(
        "harsh",
        "The camera of configs/camera that the rival is fine-tuned under: everything randomized, nothing diagnosed.",
    )


@dataclass
class VariantConfig:
    """One way to train: a family of translators, and the weights of its loss that differ from the configuration."""

    family: str = option("paired", "Of translators.")
    loss: dict[str, float] = option({}, "Weights of its loss that differ from the configuration's.")


@dataclass
class AblationConfig:
    """Variants, and where they are measured. A job is one variant with one training seed."""

    definitions: dict[str, VariantConfig] = option({}, "Every variant there is, by name.")
    references: dict[str, str] = option({}, "By family: the variant that the others are compared with.")
    variants: list[str] = option([], "Those to run, by name, and their families' references with them; empty: all.")
    policy: list[str] = option(
        [],
        "Released canonical policies, one a seed, which grasp and judge translations; empty: trained first, in "
        "OUT/policy-SEED.",
    )
    cameras: list[str] = option(
        ["webcam", "harsh"], "What the real look is seen through: names in configs/camera.", unique=True
    )
    scenes: int = option(250, "Test scenes a camera, from the first; 0: all.", low=0)
    variant: str = option("", "Of this job; the sweep sets it.")
    seed: int = option(0, "Of this job; the sweep sets it.", low=0)


@dataclass
class Config:
    """Everything that the visual scripts read."""

    name: str = option("full", "What this run is called.")
    seed: int = option(0, "Of the first training.", low=0)
    seeds: int = option(1, "How many trainings (seed, seed + 1, …) of each network.", low=1)
    with_adapted: bool = option(True, "Whether the adapted policy is trained and evaluated too.")
    with_baseline: bool = option(True, "Whether the baseline is trained and evaluated too.")
    jobs: int = option(1, "Trainings at a time; they share the processor's cores.", low=1)
    out: str = option("outputs/full", "The folder that this run writes to.")
    scene: SceneConfig = option(SceneConfig, "The bin, the arm and what lies there.")
    render: RenderConfig = option(RenderConfig, "What `vision-s2r render` renders.")
    data: DataConfig = option(DataConfig, "The sets of scenes.")
    camera: CameraConfig = option(CameraConfig, "The camera whose effects are drawn while networks train.")
    validation_camera: CameraConfig = option(
        CameraConfig, "The camera that chooses checkpoints; never one of the test cameras."
    )
    translate: TranslateConfig = option(TranslateConfig, "The translator.")
    pix2pix: TranslateConfig = option(TranslateConfig, "Its rival, for `vision-s2r compare`.")
    adapt: AdaptConfig = option(AdaptConfig, "Adaptation without pairs.")
    cyclegan: AdaptConfig = option(AdaptConfig, "Its rival, for `vision-s2r compare`.")
    graspgan: AdaptConfig = option(AdaptConfig, "Its rival, for `vision-s2r compare`.")
    benchmark: BenchmarkConfig = option(BenchmarkConfig, "How `vision-s2r benchmark translate` compares.")
    grasp: GraspConfig = option(GraspConfig, "The policy.")
    adapted: GraspConfig = option(GraspConfig, "The policy that also learns from what the translator makes.")
    baseline: GraspConfig = option(GraspConfig, "The policy that domain randomization trains, to compare with.")
    evaluate: EvaluateConfig = option(EvaluateConfig, "The transfer table.")
    finetune: FinetuneConfig = option(FinetuneConfig, "Few real grasps.")
    recording: Any = option(
        None,
        "A camera recording, or several ([DIR, …]), that `vision-s2r close-gap` diagnoses; null: withheld cameras are "
        "drawn.",
    )
    close_gap: CloseGapConfig = option(CloseGapConfig, "A diagnosed camera becomes the one that trains.")
    ablation: AblationConfig = option(AblationConfig, "What each term of a translator's loss is worth.")


ConfigStore.instance().store("schema", node=Config)
