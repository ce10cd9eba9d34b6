"""What to believe of an effect that was found: whether it can be seen, and whether it is a stand-in for another."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.effects import Effect
from vision_s2r.fit.camera import excitation
from vision_s2r.fit.camera.area import far_off, inside_of, seen_behind
from vision_s2r.fit.camera.consistency import (
    ALLOWED,
    ALLOWED_WITHIN,
    DIRECTION,
    OF_EDGES,
    OF_LIGHT,
    PARITY,
    SHARP,
    WITHIN,
    detail_lacking,
    disagreement,
)
from vision_s2r.fit.camera.coordinates import at_bound, at_scale
from vision_s2r.fit.camera.discrepancy import IMITATING, RANDOM, available
from vision_s2r.fit.camera.effect import APART, CAMERA_FITS, at_stage, charted, of_stage
from vision_s2r.fit.camera.fitter import CameraFitter
from vision_s2r.fit.camera.predictor import CameraPredictor
from vision_s2r.fit.camera.scoring import predicted_noise
from vision_s2r.fit.camera.study import Study
from vision_s2r.fit.camera.uncertainty import CameraUncertainty
from vision_s2r.fit.case import Hypothesis, Values

_NEGLIGIBLE = 0.01  # mean squared change, in units of the noise, that nobody could see
_ROUNDED = 1.5  # times the variance of rounding, likewise
_SHOWING = 500  # samples of a brightness, that tell how noisy it is
_STEP, _BESIDE_REST = 1 / 255, 0.3  # coded change beside surfaces that differ; of what is left: less is nothing
_SPREAD = 0.3  # relative difference of a parameter between frames that a true effect does not have


class CameraDoubts:
    """What speaks against effects of a hypothesis."""

    def __init__(
        self,
        study: Study,
        predictor: CameraPredictor,
        fitter: CameraFitter,
        uncertainty: CameraUncertainty,
        library: Mapping[str, Effect],
        certain: Collection[str],
        bits: int,
    ) -> None:
        """`certain`: effects that are known to be there; `bits` of the real pictures' values."""
        self._study, self._predictor, self._fitter, self._uncertainty = study, predictor, fitter, uncertainty
        self._library, self._certain, self._bits = library, frozenset(certain), bits

    @torch.inference_mode()
    def negligible(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether switching the effect off changes nothing that could be seen above the simulator's tolerance."""
        values, stage = hypothesis.values, CAMERA_FITS[name].stage
        if name in self._certain:
            return False
        if stage in APART:
            return bool(self._library[name].is_neutral(values[name]))
        if excitation.faint(name, values, self._study.pictures.scale) or self._within_a_lens(name, values):
            return True
        without = hypothesis.without(name).values
        if name in of_stage("noise"):
            return self._unseen_noise(values, without)
        few = self._fitter.few(range(self._study.count))
        (mean, variance), (other, other_variance) = (self._predictor.mean(each, few) for each in (values, without))
        yardstick = self._study.yardstick
        if name == "jpeg_compression":
            other, mean = mean, self._predictor.encoded(mean, values)
        squared = (mean - other).square()
        beside = at_stage(values, "scene") and stage in ("scene", "light", "tone")
        if beside and float(squared.mean().sqrt()) < self._least_beside_surfaces(hypothesis, few):
            return True
        spread, other_spread = (
            predicted_noise(yardstick, each, mean, few).sqrt() for each in (variance, other_variance)
        )
        return self._unseen(squared + (spread - other_spread).square(), few)

    def _least_beside_surfaces(self, hypothesis: Hypothesis, few: list[int]) -> float:
        """What can be seen there: colours are rendered to a step, and which way surfaces face is known to a degree."""
        left = self._predictor.residual(hypothesis, few, lit=True)[0]
        counted = self._study.yardstick.counted[few].expand_as(left)
        return max(_STEP, _BESIDE_REST * float(left[counted].square().mean().sqrt()))

    def _unseen(self, squared: Tensor, few: list[int]) -> bool:
        """Whether nobody could see squared changes [B, C, H, W] of frames."""
        yardstick = self._study.yardstick
        counted = yardstick.counted[few].expand_as(squared)
        if not counted.any():
            return True
        change = squared[counted]
        # A blur makes of a rounded slope what it was: the simulator's own rounding is no effect.
        rounding = (self._study.pictures.scale / (2**self._bits - 1)) ** 2 / 12
        seen = float((change / yardstick.variance[few].expand_as(squared)[counted]).mean())
        return seen < _NEGLIGIBLE or float(change.mean()) < _ROUNDED * rounding

    def _within_a_lens(self, name: str, values: Values) -> bool:
        """Whether a warp moves things less than another one may move them otherwise than its definition."""
        fit = CAMERA_FITS[name]
        if fit.stage != "warp" or fit.by_channel:
            return False
        others = [each for each in at_stage(values, "warp") if each != name]
        allowed = sum(CAMERA_FITS[each].otherwise * self._moved(each, values) for each in others)
        return self._moved(name, values) < allowed

    def _moved(self, name: str, values: Values) -> float:
        """How far a warp moves things, px (root mean square over the picture)."""
        pictures, own = self._study.pictures, at_scale(name, values[name], self._study.pictures.scale)
        moved = pictures.looked(CAMERA_EFFECTS[name], own) - pictures.places(1)
        return float(moved.square().sum(0).mean().sqrt())

    def _unseen_noise(self, values: Values, without: Values) -> bool:
        """Whether no brightness shows what differs in noise: read noise shows in the dark, and may nowhere else."""
        noise, bins = self._study.yardstick.noise, self._study.bins
        variance, counts = bins.variance(range(self._study.count))
        usable = np.isfinite(variance) & (counts > _SHOWING)
        spread, other = (np.sqrt(noise.at(each, bins.values)[usable]) for each in (values, without))
        return not usable.any() or float(((spread / other - 1) ** 2).max()) < _NEGLIGIBLE

    def suspicious(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether the effect sits at a bound, or differs between frames or parts of them more than a camera's does."""
        if name != "jpeg_compression" and at_bound(name, hypothesis.values[name]):
            return True
        stage = CAMERA_FITS[name].stage
        if stage in ("grain", "noise"):
            return self._told(hypothesis, stage)
        if stage in APART:
            return self._shows_behind(hypothesis.values, name)
        # What scales light scales the edges that a warp or a blur moves.
        if self._stands_in(hypothesis, name, OF_LIGHT if stage in ("light", "tone") else OF_EDGES):
            return True
        if not charted([name]):
            return False
        return self._uncertainty.spread(hypothesis).relative.get(name, 0.0) > _SPREAD

    def contradicted(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether rows, columns or channels ask for another size of it, even where no more than noise is left.

        Or edges that run another way, of what moves or blurs them; or whether pictures are sharp that it blurs.
        """
        stage = CAMERA_FITS[name].stage
        if stage == "grain":
            return self._told(hypothesis, stage)
        if stage in APART:
            return self._shows_behind(hypothesis.values, name)
        return self._stands_in(hypothesis, name, (*PARITY, DIRECTION) if stage in ("warp", "blur") else PARITY)

    def _stands_in(self, hypothesis: Hypothesis, name: str, axes: Sequence[str]) -> bool:
        """Whether pixels ask for another size of it along these axes, or edges do, or pictures are not blurred."""
        found = self._disagreements(hypothesis, name)
        return _differs(found, axes, ALLOWED) or _within(name, found) or self._is_sharp(hypothesis, name)

    def _told(self, hypothesis: Hypothesis, stage: str) -> bool:
        """Whether few levels tell what is left, or the frame before; of a grain, or an unknown not there yet."""
        beside = {kind: fitted for kind, fitted in hypothesis.extra.items() if kind != "levels"}
        kinds = {"levels"}
        if stage == "grain":
            kinds = set(available(self._study.pictures.sim.shape[1] == 1)) - RANDOM - set(beside)
        return self._predictor.told(Hypothesis(hypothesis.values, beside), kinds)

    @torch.inference_mode()
    def _shows_behind(self, values: Values, name: str) -> bool:
        """Whether what was rendered shows in an area that something else is said to fill: then it is light upon it.

        Beside a thing that does not fill its rectangle the scene is seen as it is.
        """
        pictures, yardstick = self._study.pictures, self._study.yardstick
        mean = self._predictor.frames(values, range(self._study.count), lit=True)[0]
        far = far_off((pictures.real - mean).square().mean(1) / yardstick.variance.mean(1))[:, None]
        inside = inside_of(values[name], pictures.sim.shape[-2:], pictures.scale)
        return seen_behind(pictures.real, mean, yardstick.counted & inside & far)

    @torch.inference_mode()
    def _disagreements(self, hypothesis: Hypothesis, name: str) -> dict[str, float]:
        """By axis, how much more of the effect some pixels ask for than others; none of noise."""
        values, stage = hypothesis.values, CAMERA_FITS[name].stage
        if stage not in IMITATING:
            return {}
        asked = self._study.asked
        mean, _, weight = self._predictor.frames(values, asked, lit=True)
        other = self._predictor.frames(hypothesis.without(name).values, asked, lit=True)[0]
        # Beside an unknown that may do its work nothing would be seen to differ; none does what differs by channel.
        imitating = frozenset() if CAMERA_FITS[name].by_channel else IMITATING[stage]
        other_kinds = {key: fitted for key, fitted in hypothesis.extra.items() if key not in imitating}
        left = self._predictor.residual(Hypothesis(values, other_kinds), asked, lit=True)[0]
        return disagreement(mean - other, left, weight * self._predicted(values), other)

    def _predicted(self, values: Values) -> Tensor:
        """Where [H, W] (bool) pixels say anything of an effect; in an area of something else they do not."""
        unpredicted = self._predictor.unpredicted(values)
        return torch.tensor(True) if unpredicted is None else ~unpredicted

    @torch.inference_mode()
    def _is_sharp(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether the real pictures are about as sharp as without a blur."""
        if CAMERA_FITS[name].stage != "blur":
            return False
        asked = self._study.asked
        real = self._study.pictures.real[asked]
        counted = self._study.yardstick.counted[asked] & self._predicted(hypothesis.values)
        left, noise, _ = self._predictor.residual(hypothesis, asked, lit=True)
        sharp = real - self._predictor.residual(hypothesis.without(name), asked, lit=True)[0]
        lacking = detail_lacking(real, real - left, sharp, noise, counted)
        return lacking is not None and abs(lacking) < SHARP  # far less than none: something sharpens what was blurred


def _differs(found: Mapping[str, float], axes: Sequence[str], allowed: float) -> bool:
    """Whether an effect is of another size along one of these axes."""
    return max((found[axis] for axis in axes if axis in found), default=0.0) > allowed


def _within(name: str, found: Mapping[str, float]) -> bool:
    """Whether channels, their sites on a sensor, or what is fine ask for another size of what moves or blurs them."""
    fit = CAMERA_FITS[name]
    return not fit.by_channel and _differs(found, WITHIN.get(fit.stage, ()), ALLOWED_WITHIN)
