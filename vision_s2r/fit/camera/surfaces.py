"""What a renderer drew, as the fit has it: the labels of each pixel, which way it faces, and the renderer's light."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.appearance import APPEARANCE_EFFECTS, Lamp, Scene
from vision_s2r.appearance.effect import of_label
from vision_s2r.appearance.lamp import lamp_of
from vision_s2r.appearance.normals import normals
from vision_s2r.camera.camera import default_intrinsics
from vision_s2r.effects import Effect
from vision_s2r.fit.camera.effect import CAMERA_FITS, NEEDS, Setting
from vision_s2r.recording import CameraRecording

_LEAST, _MOST = 0.003, 0.98  # share of all pixels that a label has, to be told from what is beside it
_FRAMES = 2  # that show a label
_TURNED, _OTHERWISE = (
    0.97,
    0.015,
)  # cosine to the commonest normal; share of the pixels that face further away than that
_EVEN = 0.97  # share of light without direction, from which there is no shading to speak of


@dataclass(frozen=True)
class Surfaces:
    """Of all N frames."""

    labels: tuple[int, ...]
    shares: Tensor  # [N, labels, H, W]: the part of each pixel that is of a label
    normals: Tensor | None  # [N, 3, H, W]
    lamp: Lamp | None
    encoding: str

    @property
    def nominal(self) -> dict[str, Setting]:
        """What the simulator's own light is, as effects that replace it have it."""
        if self.lamp is None:
            return {}
        x, y, z = self.lamp.direction
        return {
            "light_direction": {
                "azimuth": float(np.arctan2(y, x)),
                "elevation": float(np.arcsin(np.clip(-z, -0.99, 1))),
            },
            "ambient": {"share": self.lamp.ambient},
        }

    def of(self, segments: Sequence[int], seed: int = 0) -> Scene:
        """Those frames; their grain is a function of the seed."""
        chosen = list(segments)
        facing = None if self.normals is None else self.normals[chosen]
        return Scene(
            self.labels, self.shares[chosen], facing, self.lamp, self.encoding, tuple(seed + each for each in chosen)
        )

    def half(self) -> "Surfaces":
        """At half the size."""
        facing = self.normals
        if facing is not None:
            facing = F.avg_pool2d(facing, 2)
            size = facing.norm(dim=1, keepdim=True)
            facing = torch.where(size > 0.7, facing / size.clamp(min=1e-6), 0.0)
        return replace(self, shares=F.avg_pool2d(self.shares, 2), normals=facing)

    def borders(self, segments: Sequence[int]) -> Tensor:
        """Pixels [B, 1, H, W] (bool) beside one of another label: part of both, in a picture that was not rendered."""
        shares = self.shares[list(segments)]
        largest, least = F.max_pool2d(shares, 3, 1, 1), -F.max_pool2d(-shares, 3, 1, 1)
        return ((largest - least) > 0.01).any(1, keepdim=True)


def surfaces_of(recording: CameraRecording) -> Surfaces | None:
    """What was rendered, where the recording tells it by labels."""
    if recording.labels is None:
        return None
    labels = torch.from_numpy(recording.labels.astype(np.int64))
    ids = tuple(int(each) for each in labels.unique())
    shares = torch.stack([(labels == each).float() for each in ids], 1)
    facing, lamp = None, None
    if recording.depth is not None:
        intrinsics = recording.intrinsics
        given = default_intrinsics(*labels.shape[1:]) if intrinsics is None else intrinsics
        facing = normals(torch.from_numpy(recording.depth), labels, torch.from_numpy(given))
        sim = torch.from_numpy(np.ascontiguousarray(recording.sim.transpose(0, 3, 1, 2)))
        lamp = lamp_of(sim, labels, facing, recording.encoding)
    return Surfaces(ids, shares, facing, lamp, recording.encoding)


def library_of(recording: CameraRecording, library: Mapping[str, Effect]) -> dict[str, Effect]:
    """The effects of `library` that this recording asks about: those of a label once for each that occurs."""
    camera = {name: effect for name, effect in library.items() if name not in APPEARANCE_EFFECTS}
    if recording.labels is None or recording.pairing == "unpaired":
        return camera
    labels = [int(each) for each in np.unique(recording.labels)]
    for name, effect in library.items():
        if name in APPEARANCE_EFFECTS:
            of_it = APPEARANCE_EFFECTS[name].labelled
            camera |= {of_label(each, name): effect for each in labels} if of_it else {name: effect}
    return camera


def not_excited(surfaces: Surfaces | None, names: Sequence[str], grey: bool) -> dict[str, str]:
    """Those appearance effects among `names` that the recording could not have shown, with the reason."""
    if surfaces is None:
        return {}
    lacking = {}
    lit = _lacking_of_light(surfaces)
    for name in names:
        if name not in APPEARANCE_EFFECTS:
            continue
        effect = APPEARANCE_EFFECTS[name]
        if effect.labelled:
            share = surfaces.of(range(len(surfaces.shares))).region(int(name.partition(".")[0]))
            shown = int((share.flatten(1).mean(1) > _LEAST / 2).sum())
            if float(share.mean()) < _LEAST or shown < _FRAMES:
                lacking[name] = "area"
            elif float(share.mean()) > _MOST and "other labels" in CAMERA_FITS[name].needs:
                lacking[name] = "other labels"
            elif grey and "colour" in CAMERA_FITS[name].needs:
                lacking[name] = "colour"
        elif lit and "directions" in CAMERA_FITS[name].needs:
            lacking[name] = lit
    return {name: NEEDS[need].lacking for name, need in lacking.items()}


def _lacking_of_light(surfaces: Surfaces) -> str:
    """What the recording lacks to show the direction of its light; empty where it lacks nothing."""
    if surfaces.normals is None or surfaces.lamp is None:
        return "depth"
    known = surfaces.normals.permute(0, 2, 3, 1)[surfaces.normals.square().sum(1) > 0.5]
    if not len(known):
        return "depth"
    rounded = (known * 5).round()
    _, index, counts = rounded.unique(dim=0, return_inverse=True, return_counts=True)
    commonest = known[index == counts.argmax()].mean(0)
    away = (known @ (commonest / commonest.norm())) < _TURNED
    if float(away.float().mean()) < _OTHERWISE:
        return "directions"
    return "shading" if surfaces.lamp.ambient > _EVEN else ""
