"""What a case finds out about a recording once: its noise, a reference fit, and which sets of effects to ask about."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from vision_s2r.camera.camera import default_intrinsics
from vision_s2r.fit.camera import excitation, surfaces
from vision_s2r.fit.camera.appearing import appearing, camera_only, mixed
from vision_s2r.fit.camera.area import Area, area_of, inside_of
from vision_s2r.fit.camera.codec import BEFORE, DRAWS, attenuation, behind, scattered
from vision_s2r.fit.camera.effect import CAMERA_FITS, NEEDS, of_stage
from vision_s2r.fit.camera.elimination import chain, needed, without_idle
from vision_s2r.fit.camera.fitting import Target
from vision_s2r.fit.camera.flat_fields import black_level
from vision_s2r.fit.camera.light import LEAST_FRAMES, STEADY, Differing, FrameLight, deciding_level, differing
from vision_s2r.fit.camera.prediction import Pictures, linear, without_encoder
from vision_s2r.fit.camera.quantization import jpeg_quality
from vision_s2r.fit.camera.reference import (
    coarse,
    fit_reference,
    fitted_variance,
    informative,
    likeliest_curve,
    likeliest_kernel,
    pyramid,
    rough_target,
    rough_variance,
)
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
    photon_transfer,
    spread_map,
)
from vision_s2r.fit.case import Values
from vision_s2r.recording import CameraRecording

_FRAMES, _MANY, _VALUES = 4, 16, 400_000  # that a fit looks at, at most: frames, of unsteady light, values in them
_ASKED = 16  # frames, at most, that an effect is doubted by
_LARGE = 200  # px of the shorter side: pictures of more are worked on at less size
_COARSE_NOISE = (0.3 / 255) ** 2  # variance that averaged pixels still have: no simulator is better
_CODED_NOISE = (0.5 / 255) ** 2  # variance before an encoder, that no effect is named for
_NOISE_WORTH = 0.02  # squared mismatch of noise, in units of it, that a noise effect must take away
_DARK_SLOPE = 12.92  # of sRGB's coded values over the light, in the dark
_CODES = 128  # values in use, from which their distance tells the step of a converter
_QUIET_EDGES = 0.015  # what a simulator without warps gets wrong, of an edge's height …
_DEFINED, _KERNELS = 0.05, 0.1  # of what it changes, that an effect may do otherwise; and a blur
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
    photon_transfer: Mapping[str, float]  # noise effects that flat fields prove, with nats
    area: Area | None = None  # which shows something else than the simulator drew, px of `pictures`

    @property
    def count(self) -> int:
        """Frames."""
        return len(self.pictures.real)

    @property
    def asked(self) -> list[int]:
        """The most telling frames, that are asked for the size of an effect, or whether something tells it."""
        return sorted(self.ranked[:_ASKED])

    def known(self, names: Collection[str]) -> dict[str, Mapping[str, float]] | None:
        """Values of exactly these effects that a fit has ended with already."""
        for values in self.links:
            if set(values) == set(names):
                return dict(values)
        return None


@torch.inference_mode()
def study(recording: CameraRecording, library: Collection[str]) -> Study:
    """Look at a recording: minutes of a person's work, seconds here.

    Where an area of the pictures shows something else, everything is found from the rest of them.
    """
    whole = open_pictures(recording)
    found = _studied(recording, library, whole)
    area = _area(found) if "missing_object" in library else None
    if area is None:
        return found
    outside = ~inside_of(area, whole.meant.shape[-2:], 1 / found.pictures.scale)
    rest = _studied(recording, library, replace(whole, meant=whole.meant * outside))
    inside = inside_of(area, rest.pictures.meant.shape[-2:])
    counted = rest.yardstick.counted | (found.yardstick.counted & inside)
    proposals = [names | {"missing_object"} for names in rest.proposals]
    return replace(rest, yardstick=replace(rest.yardstick, counted=counted), proposals=proposals, area=area)


def _area(found: Study) -> Area | None:
    """The area that the reference leaves."""
    pictures, yardstick = found.pictures, found.yardstick
    if pictures.surfaces is None:
        return None
    target = Target(pictures, yardstick.variance, yardstick.counted)
    every = range(len(pictures.sim))
    squared = torch.cat([target.residual(found.reference, [k]).square().mean(1) for k in every])
    return area_of(squared / yardstick.variance.mean(1), yardstick.counted, pictures.surfaces.shares)


def _studied(recording: CameraRecording, library: Collection[str], whole: Pictures) -> Study:
    levels = worked(pyramid(whole))
    pictures, count = levels[0], len(whole.sim)
    not_excited = excitation.not_excited(pictures, library)
    not_excited |= surfaces.not_excited(pictures.surfaces, list(library), recording.grey)
    jpeg = _jpeg(recording) if "jpeg_compression" in library else None
    fixed: Values = {"jpeg_compression": {"quality": float(jpeg[0])}} if jpeg else {}
    step = step_of(recording)
    noise = of_stage("noise")
    usable = [name for name in library if name not in noise | not_excited.keys() | of_stage("encoder")]
    names = camera_only(usable)
    segments = informative(pictures, frames_of_a_fit(pictures))
    scene = appearing(levels, usable, segments)
    begun = coarse(levels, [*names, *scene], {**fixed, **scene}, segments)
    light = light_of(levels, begun, names)
    if light != STEADY:
        pictures, levels = replace(pictures, light=light), [replace(level, light=light) for level in levels]
        not_excited = hidden(light, pictures, names) | not_excited
        names = [name for name in names if name not in not_excited]
        segments = informative(pictures, frames_of_a_fit(pictures))
        begun = coarse(levels, [*names, *scene], {**fixed, **scene}, segments)
    reference = fit_reference(levels, begun, names, fixed, segments)
    yardstick, bins = measure_noise(pictures, whole, reference, jpeg, step)
    target = Target(pictures, fitted_variance(pictures, yardstick.variance), yardstick.counted)
    reference = without_idle(target, reference, segments, fixed)
    sharper = sharp(reference, pictures.scale)
    pictures = replace(pictures, kernel=likeliest_kernel(pictures, sharper, names, segments))
    pictures = replace(pictures, encoding=likeliest_curve(pictures, sharper, segments))
    links = chain(replace(target, pictures=pictures), reference, segments, list(fixed))
    reference = min(links, key=lambda link: link[1])[0]
    noisy = [name for name in noise if name in library and name not in not_excited]
    fitted: Values = {}
    if jpeg and (noises := noise_names(yardstick.noise, bins, reference, noisy)):
        fitted = yardstick.noise.fit(reference, noises, bins, range(count))  # of noisy pictures it makes another mean
    yardstick, bins = measure_noise(pictures, whole, {**reference, **fitted}, jpeg, step)
    noises = noise_names(yardstick.noise, bins, links[-1][0], noisy)
    proved = photon_transfer(yardstick.noise, links[-1][0], noisy, bins)
    proposals = [names | frozenset(noises) for names in needed(links)]
    edges = detail(pictures.sim).mean((1, 2, 3))
    ranked = sorted(range(count), key=lambda segment: -float(edges[segment]))
    known = [values for values, _ in links]
    return Study(pictures, jpeg, not_excited, reference, known, yardstick, bins, ranked, proposals, proved)


def worked(levels: Sequence[Pictures]) -> Sequence[Pictures]:
    """The levels from that on which photographs are worked on: large ones are, at less than their size."""
    return [level for level in levels if min(level.sim.shape[-2:]) <= _LARGE]


def light_of(levels: Sequence[Pictures], values: Values, names: Sequence[str]) -> FrameLight:
    """The light that the frames have of their own: decided on small pictures, about the best geometry beside it.

    `values` is a fit in the light that all have alike, which tells whether it is worth looking.
    """
    every = range(len(levels[0].sim))
    small = deciding_level([(level.sim.shape[-2], level.sim.shape[-1]) for level in levels])

    def compared(found: Values) -> Differing:
        target = rough_target(levels[small], found)
        mean = levels[small].predict(without_encoder(found), every).mean
        return differing(mean, levels[small].real, target.counted / target.variance, levels[small].encoding)

    if len(every) < LEAST_FRAMES or not compared(values).plausible:
        return STEADY
    warps = [name for name in names if name in of_stage("warp") and not CAMERA_FITS[name].by_channel]
    own = [replace(level, light=FrameLight("field")) for level in levels[max(small - 1, 0) :]]
    return compared(coarse(own, warps, {}, every)).light


def hidden(light: FrameLight, pictures: Pictures, names: Sequence[str]) -> dict[str, str]:
    """Those of `names` that frames in a light of their own could not show, with the reason."""
    lost = light.hides & set(names)
    if light.kind == "field" and excitation.two_toned(pictures):
        lost |= of_stage("tone") & set(names)
    return dict.fromkeys(sorted(lost), NEEDS["steady light"].lacking)


def frames_of_a_fit(pictures: Pictures) -> int:
    """How many frames a fit looks at."""
    most = _FRAMES if pictures.light == STEADY else _MANY  # each of which has but its own light
    return max(min(most, _VALUES // pictures.sim[0].numel()), 2)


def sharp(values: Values, scale: float) -> Values:
    """Without a blur so small that the kernel of what looks between pixels can be it."""
    return {name: value for name, value in values.items() if not excitation.faint(name, values, scale)}


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
    return Pictures(
        sim,
        tensor(recording.real),
        meant,
        torch.from_numpy(intrinsics).float(),
        recording.encoding,
        surfaces=surfaces.surfaces_of(recording) if recording.pairing == "paired" else None,
    )


def _jpeg(recording: CameraRecording) -> tuple[int, float] | None:
    """JPEG's quality and evidence, unless the simulator's pictures have the same grid."""
    if recording.bits != 8:
        return None
    found = jpeg_quality(recording.real)
    return None if found is None or jpeg_quality(recording.sim) is not None else found


def step_of(recording: CameraRecording) -> float:
    """What the real pictures' values are rounded to: their bits, or those of a converter of fewer."""
    full = 2**recording.bits - 1
    codes = np.unique(np.rint(recording.real * full).astype(np.int64))
    if recording.bits == 8 or len(codes) < _CODES:
        return 1 / full
    return float(np.quantile(np.diff(codes), 0.05)) / full


def measure_noise(
    pictures: Pictures, whole: Pictures, reference: Values, jpeg: tuple[int, float] | None, step: float
) -> tuple[Yardstick, NoiseBins]:
    """The yardstick of `pictures`, from what the reference leaves; noise is that of the `whole` ones' pixels.

    `step`: what the recording's values are rounded to.
    """
    whole = replace(whole, kernel=pictures.kernel, encoding=pictures.encoding, light=pictures.light)
    large = pictures.scale < 1
    counted, mean, residual = _left(whole, reference)
    made = scattered(pictures, reference, float(jpeg[0]), mean) if jpeg and not large else ()
    bins = measure(residual, mean, counted, jpeg is None, pictures.encoding, made, pictures.light == STEADY)
    rounding = 0.0 if jpeg else step**2 / 12
    through = _encoder(float(jpeg[0]), bins) if jpeg else IDENTITY
    base = _CODED_NOISE if jpeg else base_noise(bins, range(len(mean)), reference, step)
    black = 0.0
    if bins.independent:
        seen, light = (linear(each, pictures.encoding) for each in (whole.real, whole.sim))
        black = black_level(seen, light, counted, rounding**0.5 / (1 if pictures.encoding == "linear" else _DARK_SLOPE))
    noise = NoiseModel(base, rounding, through, pictures.encoding, black)
    if large:
        counted, mean, residual = _left(pictures, reference)
    measured = spread_map(bins, mean, noise)
    if large:
        measured = (measured * pictures.scale**2).clamp(min=_COARSE_NOISE)
    edge = _edge_error(residual, mean, measured, counted, reference)
    tolerance = (edge * detail(mean)).square()
    floor = measured
    if bins.scatter is not None:
        slight = (bins.scatter.slight(residual, counted) - measured).clamp(min=0).mean(1, keepdim=True)
        floor = measured + slight
        tolerance += slight + measured.mean(1, keepdim=True) / DRAWS  # a mean of so many is that unsure
    tolerance += torch.cat([mixed(pictures, reference, [k]) for k in range(len(mean))])
    allowed = _allowance(pictures, mean, reference)
    tolerance += allowed
    variance = measured + tolerance
    tempered = temper(residual, variance, counted)
    share = float((allowed / variance).mean(1, keepdim=True)[counted].mean()) if counted.any() else 0.0
    return Yardstick(noise, measured, floor, tolerance, counted, tempered, share, bins.scatter, pictures.scale), bins


def _encoder(quality: float, bins: NoiseBins) -> Attenuation:
    """What JPEG leaves of noise: on these pictures, where they are not so large that it is not worked out for them."""
    after = attenuation(quality, len(bins.values)).double().numpy() if bins.after is None else bins.after
    return Attenuation(BEFORE.double().numpy(), after)


def _left(pictures: Pictures, reference: Values) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """The pixels that count, what a reference predicts of them, and what it leaves, each frame in its own light."""
    counted = counted_pixels(pictures, reference, 2)
    means = []
    for k in range(len(pictures.sim)):  # one after the other: all at once would not fit
        mean = pictures.predict(without_encoder(reference), [k]).mean
        if pictures.light != STEADY:
            weight = counted[[k]] / rough_variance(pictures, [k])
            mean = pictures.light.on(mean, pictures.real[[k]], weight, pictures.encoding).mean
        means.append(behind(pictures, mean, reference, _CODED_NOISE))
    mean = torch.cat(means)
    return counted, mean, pictures.real - mean


def _allowance(pictures: Pictures, mean: torch.Tensor, reference: Values) -> torch.Tensor:
    """The variance [N, 1, H, W] of what effects may do otherwise than their definitions: a share of what they change.

    No lens' blur is a disk, and no maker's curve quite sRGB's. `mean` is what the reference predicts.
    """
    every = range(len(pictures.sim))
    blurs = of_stage("blur")
    sharp = mean
    if reference.keys() & blurs:
        sharp = pictures.predict({k: v for k, v in reference.items() if k not in blurs}, every).mean
    change = (_DEFINED * (mean - pictures.sim)).square() + (_KERNELS * (mean - sharp)).square()
    return change.mean(1, keepdim=True)


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
