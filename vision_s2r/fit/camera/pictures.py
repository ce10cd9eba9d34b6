"""What a camera with given effects makes of simulated pictures, and how far that is from the real ones."""

from dataclasses import dataclass
from math import ceil

import numpy as np
import torch
import torch.nn.functional as F

from vision_s2r.appearance import is_appearance
from vision_s2r.appearance import through as through_scene
from vision_s2r.camera import Camera, CameraParameters
from vision_s2r.errors import UserError
from vision_s2r.fit.camera import effects as _effects  # noqa: F401  (fills CAMERA_FITS)
from vision_s2r.fit.camera.area import inside_of
from vision_s2r.fit.camera.effect import at_stage, of_stage
from vision_s2r.fit.camera.prediction import coded, linear
from vision_s2r.fit.camera.surfaces import Surfaces, surfaces_of
from vision_s2r.fit.case import Values
from vision_s2r.recording import CameraRecording

MARGIN = 0.25  # of the longer side: as far as warps may look beyond the picture
QUANTILES = 512  # of the values of a picture, for the distance between sets
TILE = 8  # px: of the places whose noise is measured apart
FULL = 255.0  # grey levels


@dataclass(frozen=True)
class Shown:
    """A simulated picture through the effects."""

    picture: np.ndarray  # float32 [H, W, 3] in [0, 1], with a draw of the noise
    mean: np.ndarray  # the same without noise and grain
    grain: np.ndarray | None  # what the grain of surfaces adds to it; None without any
    known: np.ndarray  # bool [H, W]: where the simulator's picture is meant, and the camera did not look beyond it
    missing: np.ndarray | None = None  # bool [H, W]: where something else is said to be, and nothing is predicted


def rendered(recording: CameraRecording, effects: Values) -> Surfaces | None:
    """What the recording's labels say was rendered, where effects of surfaces and light ask for it.

    Raises UserError where they do, and it has no labels.
    """
    scene = [name for name in effects if is_appearance(name)]
    if scene and recording.labels is None:
        raise UserError(f"{', '.join(scene)}: of surfaces and light, but the recording has no labels/")
    return surfaces_of(recording) if scene else None


def show(
    recording: CameraRecording, frame: int, effects: Values, seed: int = 0, surfaces: Surfaces | None = None
) -> Shown:
    """The simulator's picture of a frame with the effects; noise and grain are functions of seed and frame.

    Effects of surfaces and light are applied to `surfaces`, as `rendered` has them.
    """
    camera = Camera(encoding=recording.encoding)
    seeds = torch.tensor([(seed * 1_000_003 + frame) % 2**31])
    height, width = recording.sim.shape[1:3]
    margin = ceil(MARGIN * max(height, width)) if effects.keys() & of_stage("warp") else 0
    scene = {name: given for name, given in effects.items() if is_appearance(name)}
    effects = {name: given for name, given in effects.items() if name not in scene}
    areas = [inside_of(scene.pop(name), (height, width)).numpy() for name in at_stage(list(scene), "area")]
    flat = {name: given for name, given in scene.items() if name not in at_stage(scene, "grain")}
    bare, dressed = (_canvas(recording, frame, surfaces, some, margin, int(seeds[0])) for some in (flat, scene))
    intrinsics = None
    if recording.intrinsics is not None:
        intrinsics = torch.from_numpy(recording.intrinsics).float()[None]
    quiet = {name: given for name, given in effects.items() if name not in of_stage("noise")}

    def through(image: torch.Tensor, some: Values) -> np.ndarray:
        return camera(image, CameraParameters.of(some, 1, seeds), margin, intrinsics)[0].permute(1, 2, 0).numpy()

    mean = through(bare, quiet)
    grainy = mean if len(flat) == len(scene) else through(dressed, quiet)
    picture = grainy if len(quiet) == len(effects) else through(dressed, effects)
    meant = torch.ones(1, 1, height, width)
    if recording.mask is not None:
        meant = torch.from_numpy(recording.mask[frame]).float()[None, None]
    meant = F.pad(meant, (margin,) * 4).expand(1, 3, -1, -1)
    known = through(meant, {name: given for name, given in effects.items() if name in of_stage("warp")})
    missing = np.any(areas, axis=0) if areas else None
    return Shown(picture, mean, None if grainy is mean else grainy - mean, np.all(known > 0.999, axis=2), missing)


def _canvas(
    recording: CameraRecording, frame: int, surfaces: Surfaces | None, scene: Values, margin: int, seed: int
) -> torch.Tensor:
    """The simulator's picture [1, 3, H + 2m, W + 2m] under effects of surfaces and light; its edge repeats."""
    sim = torch.from_numpy(np.array(recording.sim[frame])).permute(2, 0, 1)[None]
    if surfaces is not None:
        light = through_scene(linear(sim, recording.encoding), scene, surfaces.of([frame], seed))
        sim = coded(light.clamp(min=0), recording.encoding).clamp(0, 1)
    return F.pad(sim, (margin,) * 4, mode="replicate")


def gap(recording: CameraRecording, frame: int, shown: Shown) -> dict[str, float]:
    """Root mean square (grey levels) between a real picture and the simulator's, before and after the effects.

    A draw of noise or grain never matches another: the mean is compared, and to its squared error comes the squared
    difference of the standard deviations of the real picture's noise and of the noise predicted, which is none before.
    What is said to be missing is no error after it has been said.
    """
    real, known = recording.real[frame], shown.known
    if not known.any():
        known = np.ones_like(known)
    before, after = real - recording.sim[frame], real - shown.mean
    told = known if shown.missing is None else known & ~shown.missing
    noise = np.sqrt(noise_variance(after, told))
    grain = np.zeros_like(after) if shown.grain is None else shown.grain
    predicted = np.sqrt(np.mean((shown.picture - shown.mean - grain)[told] ** 2))
    share = told.sum() / known.sum()
    return {
        "before": _level(np.mean(before[known] ** 2) + noise**2),
        "after": _level(share * _unlike(after[told], grain[told]) + (noise - predicted) ** 2),
    }


def _unlike(left: np.ndarray, grain: np.ndarray) -> float:
    """Mean square of what is left [n, C], where there is grain by the difference of standard deviations alone."""
    own = np.abs(grain).max(axis=1) > 0
    if not own.any():
        return float(np.mean(left**2))
    spread = np.sqrt(np.mean(left[own] ** 2)) - np.sqrt(np.mean(grain[own] ** 2))
    return float(np.sum(left[~own] ** 2) / left.size + spread**2 * own.mean())


def distance(recording: CameraRecording, frame: int, shown: Shown) -> dict[str, float]:
    """First Wasserstein distance (grey levels) from the values of all real pictures, before and after the effects."""
    levels = (np.arange(QUANTILES) + 0.5) / QUANTILES
    real = np.quantile(recording.real, levels, axis=(0, 1, 2))

    def of(picture: np.ndarray) -> float:
        values = np.quantile(picture, levels, axis=(0, 1))
        return FULL * float(np.abs(values - real).mean())

    return {"before": of(recording.sim[frame]), "after": of(shown.picture)}


def noise_variance(residual: np.ndarray, where: np.ndarray) -> float:
    """Mean variance of the white noise in [H, W, C], insensitive to what is smooth in it, or sharp in few places.

    From the median size, tile by tile, of the difference of two second differences, whose response to white noise is 6
    (Immerkær, Computer Vision and Image Understanding 64, 1996): noise differs with brightness, so from place to place.
    """
    twice = residual[:-2] - 2 * residual[1:-1] + residual[2:]
    twice = np.abs(twice[:, :-2] - 2 * twice[:, 1:-1] + twice[:, 2:])
    rows, columns = (max(size // TILE, 1) for size in twice.shape[:2])
    tiles = [
        np.median(twice[y : y + TILE, x : x + TILE])
        for y in range(0, rows * TILE, TILE)
        for x in range(0, columns * TILE, TILE)
        if where[y + 1 : y + 1 + TILE, x + 1 : x + 1 + TILE].all()
    ]
    return float(np.mean(np.square(tiles))) / (0.6745 * 6) ** 2 if tiles else 0.0


def _level(square: float) -> float:
    return FULL * float(np.sqrt(square))
