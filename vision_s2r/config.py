"""The root configuration of the visual pipeline: a field a room."""

from dataclasses import dataclass

from hydra.core.config_store import ConfigStore

from vision_s2r.adapt.config import AdaptConfig
from vision_s2r.camera.config import CameraConfig
from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.evaluate.sensitivity_config import SensitivityConfig
from vision_s2r.finetune.config import FinetuneConfig
from vision_s2r.grasp.config import GraspConfig
from vision_s2r.grasp.student_config import StudentConfig
from vision_s2r.options import option
from vision_s2r.parallel import backend_option
from vision_s2r.render.config import RenderConfig
from vision_s2r.scene.config import SceneConfig
from vision_s2r.translate.config import BenchmarkConfig, TranslateConfig


@dataclass
class DataConfig:
    """The sets that an experiment needs."""

    pairs: RenderConfig = option(
        RenderConfig(out="renders/full/pairs", scenes=24000, seed=4, turns=4, views=1, grasps=0, shard_size=200),
        "The translator and the students learn from it: pairs of pictures, without grasps.",
    )
    train: RenderConfig = option(
        RenderConfig(out="renders/full/train", scenes=4000),
        "Policies learn from it: labelled grasps, randomized and canonical pictures.",
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
class Config:
    """Everything that the visual pipeline reads; verbs on top of it extend it."""

    name: str = option("full", "What this run is called.")
    seed: int = option(0, "Of the first training.", low=0)
    seeds: int = option(1, "How many trainings (seed, seed + 1, …) of each network.", low=1)
    with_baseline: bool = option(True, "Whether the baseline and its student are trained and evaluated too.")
    jobs: int = option(1, "Trainings at a time; they share the processor's cores.", low=1)
    backend: str = backend_option()
    out: str = option("outputs/full", "The folder that this run writes to.")
    scene: SceneConfig = option(SceneConfig, "The bin, the arm and what lies there.")
    render: RenderConfig = option(RenderConfig, "What `vision-s2r render` renders.")
    data: DataConfig = option(DataConfig, "The sets of scenes.")
    camera: CameraConfig = option(CameraConfig, "The camera whose effects are drawn while networks train.")
    validation_camera: CameraConfig = option(
        CameraConfig, "The camera that chooses checkpoints; never one of the test cameras."
    )
    translate: TranslateConfig = option(TranslateConfig, "The translator.")
    conditional_gan: TranslateConfig = option(TranslateConfig, "Its rival, for `vision-s2r compare`.")
    adapt: AdaptConfig = option(AdaptConfig, "Adaptation without pairs.")
    cyclegan: AdaptConfig = option(AdaptConfig, "Its rival, for `vision-s2r compare`.")
    graspgan: AdaptConfig = option(AdaptConfig, "Its rival, for `vision-s2r compare`.")
    benchmark: BenchmarkConfig = option(BenchmarkConfig, "How `vision-s2r benchmark translate` compares.")
    grasp: GraspConfig = option(GraspConfig, "The policy.")
    baseline: GraspConfig = option(GraspConfig, "The policy that domain randomization trains, to compare with.")
    student: StudentConfig = option(StudentConfig, "The policy that learns on from what the translator makes.")
    baseline_student: StudentConfig = option(StudentConfig, "And the one of domain randomization.")
    methods: list[str] = option([], "What `vision-s2r compare` trains and compares, by name; empty: every method.")
    evaluate: EvaluateConfig = option(EvaluateConfig, "The transfer table.")
    sensitivity: SensitivityConfig = option(SensitivityConfig, "Success against the strength of an effect.")
    finetune: FinetuneConfig = option(FinetuneConfig, "Few real grasps.")


# Its parts with their types, its top open: verbs have keys beside these.
ConfigStore.instance().store("schema", node=vars(Config()))
