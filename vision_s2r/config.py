"""The root configuration: a field a room, as configs/config.yaml has it."""

from dataclasses import dataclass, field
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.ablation.config import AblationConfig
from vision_s2r.adapt.config import AdaptConfig
from vision_s2r.camera.config import CameraConfig
from vision_s2r.close_gap.config import CloseGapConfig
from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.finetune.config import FinetuneConfig
from vision_s2r.grasp.config import GraspConfig
from vision_s2r.render.config import RenderConfig
from vision_s2r.scene.config import SceneConfig
from vision_s2r.translate.config import BenchmarkConfig, TranslateConfig


@dataclass
class DataConfig:
    """The sets that an experiment needs; test is of objects never trained on."""

    train: RenderConfig = field(default_factory=RenderConfig)
    validation: RenderConfig = field(default_factory=RenderConfig)
    real: RenderConfig = field(default_factory=RenderConfig)
    test: RenderConfig = field(default_factory=RenderConfig)


@dataclass
class Config:
    """Everything that the visual scripts read."""

    name: str = "default"
    seed: int = 0
    seeds: int = 1
    with_adapted: bool = True
    with_baseline: bool = True
    jobs: int = 1
    out: str = "outputs"
    scene: SceneConfig = field(default_factory=SceneConfig)
    render: RenderConfig = field(default_factory=RenderConfig)
    data: DataConfig = field(default_factory=DataConfig)
    camera: CameraConfig = field(default_factory=CameraConfig)
    validation_camera: CameraConfig = field(default_factory=CameraConfig)
    translate: TranslateConfig = field(default_factory=TranslateConfig)
    pix2pix: TranslateConfig = field(default_factory=TranslateConfig)
    adapt: AdaptConfig = field(default_factory=AdaptConfig)
    cyclegan: AdaptConfig = field(default_factory=AdaptConfig)
    graspgan: AdaptConfig = field(default_factory=AdaptConfig)
    benchmark: BenchmarkConfig = field(default_factory=BenchmarkConfig)
    grasp: GraspConfig = field(default_factory=GraspConfig)
    adapted: GraspConfig = field(default_factory=GraspConfig)
    baseline: GraspConfig = field(default_factory=GraspConfig)
    evaluate: EvaluateConfig = field(default_factory=EvaluateConfig)
    finetune: FinetuneConfig = field(default_factory=FinetuneConfig)
    recording: Any = None
    close_gap: CloseGapConfig = field(default_factory=CloseGapConfig)
    ablation: AblationConfig = field(default_factory=AblationConfig)


ConfigStore.instance().store("schema", node=Config)
