"""What every trainer is given beside its configuration."""

from dataclasses import dataclass, field

from vision_s2r.camera import CameraConfig
from vision_s2r.training.data import ViewSource


@dataclass(frozen=True)
class Inputs:
    """The scenes of a training, and the cameras through which networks look at their source pictures."""

    views: ViewSource  # to be trained on
    validation: ViewSource  # other scenes, on which the checkpoint is chosen
    camera: CameraConfig = field(default_factory=CameraConfig)  # drawn from in every step
    validation_camera: CameraConfig | None = None  # in validation; without it `camera`

    @property
    def cameras(self) -> tuple[CameraConfig, CameraConfig]:
        """Of training and of validation."""
        return self.camera, self.validation_camera or self.camera
