"""What a case finds out about a recording once: its noise, a reference fit, and which sets of effects to ask about."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from vision_s2r.camera.camera import default_intrinsics
from vision_s2r.fit.camera import excitation
from vision_s2r.fit.camera.codec import attenuation, codec_scatter
from vision_s2r.fit.camera.effect import of_stage
from vision_s2r.fit.camera.elimination import chain, needed, without_idle
from vision_s2r.fit.camera.fitting import Target
from vision_s2r.fit.camera.prediction import Pictures
from vision_s2r.fit.camera.quantization import jpeg_quality
from vision_s2r.fit.camera.reference import fit_reference, informative, likeliest_kernel, pyramid
from vision_s2r.fit.camera.scoring import Yardstick, temper
from vision_s2r.fit.camera.weighing import (
    IDENTITY,
    Attenuation,
    NoiseBins,
    NoiseModel,
    base_noise,
    counted_pixels,
    detail,
    measure,
    spread_map,
)
from vision_s2r.fit.case import Values
from vision_s2r.recording import CameraRecording

_FRAMES, _VALUES = 4, 400_000  # that a fit looks at, at most: frames, and values in them
_NOISE_WORTH = 0.02  # squared mismatch of noise, in units of it, that a noise effect must take away
_QUIET_EDGES = 0.015  # what a simulator without warps gets wrong, of an edge's height …
_BLURRED_EDGES, _WARPED_EDGES = 0.08, 0.2  # … and at most with a blur, or a warp


@dataclass(frozen=True)
class Study:
    """What is known of a recording."""

    pictures: Pictures
    jpeg: tuple[int, float] | None  # quality and evidence
    not_excited: Mapping[str, str]
    reference: Values
    links: Sequence[Values]  # sets fitted on the way from the reference to less
    yardstick: Yardstick
    bins: NoiseBins
    ranked: Sequence[int]  # frames, the most telling first
    proposals: Sequence[frozenset[str]]

    def known(self, names: Collection[str]) -> dict[str, Mapping[str, float]] | None:
        """Values of exactly these effects that a fit has ended with already."""
        for values in self.links:
            if set(values) == set(names):
                return dict(values)
        return None


@torch.inference_mode()
def study(recording: CameraRecording, library: Collection[str]) -> Study:
    """Look at a recording: minutes of a person's work, seconds here."""
    pictures = open_pictures(recording)
    count = len(pictures.sim)
    not_excited = excitation.not_excited(pictures, library)
    jpeg = _jpeg(recording) if "jpeg_compression" in library else None
    fixed: Values = {"jpeg_compression": {"quality": float(jpeg[0])}} if jpeg else {}
    noise = of_stage("noise")
    names = [name for name in library if name not in noise | not_excited.keys() | of_stage("encoder")]
    levels = pyramid(pictures)
    segments = informative(pictures, frames_of_a_fit(pictures))
    reference = fit_reference(levels, names, fixed, segments)
    yardstick, _ = measure_noise(pictures, reference, jpeg, recording.bits)
    target = Target(pictures, yardstick.variance, yardstick.counted)
    reference = without_idle(target, reference, segments, fixed)
    pictures = replace(pictures, kernel=likeliest_kernel(pictures, sharp(reference), segments))
    links = chain(replace(target, pictures=pictures), reference, segments, list(fixed))
    reference = min(links, key=lambda link: link[1])[0]
    yardstick, bins = measure_noise(pictures, reference, jpeg, recording.bits)
    noises = noise_names(
        yardstick.noise, bins, links[-1][0], [name for name in noise if name in library and name not in not_excited]
    )
    proposals = [names | frozenset(noises) for names in needed(links)]
    edges = detail(pictures.sim).mean((1, 2, 3))
    ranked = sorted(range(count), key=lambda segment: -float(edges[segment]))
    return Study(
        pictures, jpeg, not_excited, reference, [values for values, _ in links], yardstick, bins, ranked, proposals
    )


def frames_of_a_fit(pictures: Pictures) -> int:
    """How many frames a fit looks at."""
    return max(min(_FRAMES, _VALUES // pictures.sim[0].numel()), 2)


def sharp(values: Values) -> Values:
    """Without a blur so small that the kernel of a warp can be it."""
    if not values.keys() & of_stage("warp"):
        return values
    return {name: value for name, value in values.items() if not excitation.faint(name, value)}


def open_pictures(recording: CameraRecording) -> Pictures:
    """The pairs of a recording as the fit has them."""
    channels = 1 if recording.grey else 3

    def tensor(pictures: np.ndarray) -> torch.Tensor:
        return torch.from_numpy(np.ascontiguousarray(pictures[..., :channels].transpose(0, 3, 1, 2)))

    sim = tensor(recording.sim)
    height, width = sim.shape[-2:]
    meant = torch.ones((len(sim), 1, height, width))
    if recording.mask is not None:
        meant = torch.from_numpy(recording.mask)[:, None].float()
    intrinsics = default_intrinsics(height, width) if recording.intrinsics is None else recording.intrinsics
    return Pictures(sim, tensor(recording.real), meant, torch.from_numpy(intrinsics).float(), recording.encoding)


def _jpeg(recording: CameraRecording) -> tuple[int, float] | None:
    """JPEG's quality and evidence, unless the simulator's pictures have the same grid."""
    if recording.bits != 8:
        return None
    found = jpeg_quality(recording.real)
    return None if found is None or jpeg_quality(recording.sim) is not None else found


def measure_noise(
    pictures: Pictures, reference: Values, jpeg: tuple[int, float] | None, bits: int
) -> tuple[Yardstick, NoiseBins]:
    """The yardstick of a recording, from what the reference leaves."""
    every = range(len(pictures.sim))
    mean = pictures.predict(reference, every).mean
    residual = pictures.real - mean
    counted = counted_pixels(pictures, reference, 2)
    scatter = torch.zeros_like(mean[:, :1])
    if jpeg:
        scatter = codec_scatter(pictures, reference, float(jpeg[0]), residual, counted)
    bins = measure(residual, mean, counted, white=jpeg is None, known=scatter)
    rounding = 0.0 if jpeg else 1 / 12 / (2**bits - 1) ** 2
    through = IDENTITY
    if jpeg:
        before, after = attenuation(float(jpeg[0]), pictures.sim.shape[1])
        through = Attenuation(before.double().numpy(), after.double().numpy())
    base = (0.5 / 255) ** 2 if jpeg else base_noise(bins, every, rounding)
    noise = NoiseModel(base, rounding, through, pictures.encoding)
    measured = spread_map(bins, mean, noise.quiet)
    edge = _edge_error(residual, mean, measured, counted, reference)
    tolerance = (edge * detail(mean)).square() + scatter
    variance = measured + tolerance
    floor = measured + scatter
    return Yardstick(noise, measured, floor, tolerance, counted, temper(residual, variance, counted)), bins


def _edge_error(
    residual: torch.Tensor, mean: torch.Tensor, measured: torch.Tensor, counted: torch.Tensor, reference: Values
) -> float:
    """The standard deviation of what is wrong at edges, in units of their height."""
    fine = detail(mean)
    busy = counted & (fine > 8 / 255)
    moved = bool(reference.keys() & of_stage("warp"))
    if not busy.any() or not (moved or reference.keys() & of_stage("blur")):
        return _QUIET_EDGES
    over = ((residual.square() - measured) / fine.square()).mean(1, keepdim=True)[busy]
    typical = float(over.clamp(-0.1, 0.1).mean())
    return min(max(typical, _QUIET_EDGES**2), (_WARPED_EDGES if moved else _BLURRED_EDGES) ** 2) ** 0.5


def noise_names(noise: NoiseModel, bins: NoiseBins, values: Values, names: Sequence[str]) -> list[str]:
    """The fewest noise effects that make up for the measured noise."""
    segments = range(len(bins.squares))
    variance, counts = bins.variance(segments)
    usable = np.isfinite(variance) & (variance > 0)

    def misfit(chosen: list[str]) -> float:
        fitted = noise.fit(values, chosen, bins, segments) if chosen else {}
        model = noise.at(dict(values) | fitted, bins.values)[usable]
        mismatch = (np.sqrt(model / variance[usable]) - 1) ** 2
        return float((mismatch * counts[usable]).sum() / counts[usable].sum())

    if not usable.any():
        return []
    found: list[str] = []
    left = misfit(found)
    while rest := [name for name in sorted(names) if name not in found]:
        name = min(rest, key=lambda each: misfit([*found, each]))
        less = misfit([*found, name])
        if less > left - _NOISE_WORTH:
            break
        found, left = [*found, name], less
    return found
