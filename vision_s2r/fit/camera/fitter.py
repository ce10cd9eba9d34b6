"""Fits of a camera's hypotheses: effects that move pictures, noise, grain and areas, then something unknown."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, replace
from types import MappingProxyType

import torch
from torch import Tensor

from vision_s2r.appearance import label_of
from vision_s2r.fit.camera import discrepancy
from vision_s2r.fit.camera.area import area_of, inside_of
from vision_s2r.fit.camera.coordinates import at_scale, bounded, neutral, starts
from vision_s2r.fit.camera.effect import APART, CAMERA_FITS, at_stage, charted, of_stage
from vision_s2r.fit.camera.fitting import Target, best_start, gauss_newton, search_factor
from vision_s2r.fit.camera.grain import grain_of
from vision_s2r.fit.camera.noise import Tail
from vision_s2r.fit.camera.predictor import CameraPredictor
from vision_s2r.fit.camera.reference import fitted_variance
from vision_s2r.fit.camera.study import Study, frames_of_a_fit
from vision_s2r.fit.case import NOMINAL, Hypothesis, Names, Segments, Values

_TURNS = 8  # of effects and an unknown, each fitted to what the other leaves, at most
_COUNTED = "low_resolution"  # goes by whole cells, and has no slope
_SETTLED = 1e-3  # of the loss: a turn that gains less is the last
_DISCREPANCY_VALUES = 1_000_000  # that the fit of a discrepancy looks at, at most

Near = Mapping[str, discrepancy.FittedDiscrepancy]  # fits of unknowns to nearly the same
_NOTHING: Near = MappingProxyType({})


class CameraFitter:
    """Maximum likelihood on some frames; each set of names on the same frames once."""

    def __init__(
        self, study: Study, predictor: CameraPredictor, effects: Collection[str], discrepancies: Collection[str]
    ) -> None:
        """`effects` and `discrepancies` are the names that there are."""
        self._study, self._predictor = study, predictor
        self._effects, self._discrepancies = frozenset(effects), frozenset(discrepancies)
        pictures, counted = study.pictures, study.yardstick.counted
        if study.area is not None:
            counted = counted & ~inside_of(study.area, counted.shape[-2:])
        self.target = Target(pictures, fitted_variance(pictures, study.yardstick.variance), counted)
        self._fits: dict[tuple[Names, tuple[int, ...]], Hypothesis] = {}
        self._noises: dict[tuple[object, ...], dict[str, dict[str, float]]] = {}
        self._frames = frames_of_a_fit(pictures)

    def fit(self, names: Names, segments: Segments, start: Hypothesis | None) -> Hypothesis:
        """The most likely parameters of these effects and discrepancies on these segments; `start` is near, or None."""
        key = (names, tuple(segments))
        if key not in self._fits:
            self._fits[key] = self._fit(names, tuple(segments), start)
        return self._fits[key]

    @torch.inference_mode()
    def _fit(self, names: Names, segments: tuple[int, ...], start: Hypothesis | None) -> Hypothesis:
        plain = frozenset(names & self._effects)
        apart = at_stage(sorted(plain), *APART)
        plain -= frozenset(apart)
        unknown = sorted(names & self._discrepancies)
        beside = unknown or apart
        values = self.fit(plain, segments, start).values if beside else self._fit_effects(plain, segments, start)
        values = dict(values) | self.fit_apart(values, apart, segments)
        if not (unknown and (charted(plain) or _COUNTED in plain)):
            return Hypothesis(values, self.fit_unknown(values, unknown, segments))
        begun = self._begun(values, names, start)
        if _COUNTED in plain and len(segments) == self._study.count:
            counted = self._counted(values, unknown, self.few(segments)[:2])
            begun += [(counted, _NOTHING)] if counted is not values else []
        both = [Hypothesis(each, self.fit_unknown(each, unknown, segments, near)) for each, near in begun]
        return self._in_turn(both, segments)

    def _begun(self, values: Values, names: Names, start: Hypothesis | None) -> list[tuple[Values, Near]]:
        """Where effects and an unknown may begin: as effects are alone, or as the start has them where that differs.

        Alone they make up for the unknown. Those that the start has not are neutral, where a fit may begin there.
        """
        given = NOMINAL if start is None else start
        moving = names & self._effects - of_stage("noise")
        smooth = [name for name in charted(moving - given.values.keys()) if CAMERA_FITS[name].starts is None]
        before = dict(values) | {name: given.values[name] for name in moving & given.values.keys()}
        before |= {name: neutral(name, self._study.pictures.optics) for name in smooth}
        if before == values:
            return [(values, _NOTHING)]
        whole = names <= given.values.keys() | given.extra.keys()  # the fit to all frames, of which these are some
        return [(before, given.extra)] if whole else [(before, given.extra), (values, _NOTHING)]

    def _counted(self, values: Values, unknown: Sequence[str], few: list[int]) -> Values:
        """With that resolution which is likeliest beside unknowns: alone it may be one that makes up for them."""
        options = [values, *(dict(values) | {_COUNTED: each} for each in starts(_COUNTED, self._study.pictures.optics))]

        def loss(each: Values) -> float:
            found = Hypothesis(each, self.fit_unknown(each, unknown, few))
            return self.target.mean_loss(self._predictor.residual(found, few, lit=True)[0], few)

        return min(options, key=loss)

    def _in_turn(self, begun: Sequence[Hypothesis], segments: tuple[int, ...]) -> Hypothesis:
        """Effects fitted to what the unknown leaves, then the unknown to what they leave, and so on.

        From that of several beginnings which leaves least after a turn.
        """
        turned = [self._turn(each, segments) for each in begun]
        found, before = min(turned, key=lambda each: each[1])
        for _ in range(_TURNS - 1):
            more, loss = self._turn(found, segments)
            if more is found:
                break
            found = more
            if before - loss < _SETTLED * loss:
                break
            before = loss
        return found

    def _turn(self, found: Hypothesis, segments: tuple[int, ...]) -> tuple[Hypothesis, float]:
        """Effects fitted to what the unknown leaves, and it to what they leave; the mean loss between the two."""
        few = self.few(segments)
        without, left = (self._predictor.residual(each, few, lit=True)[0] for each in (Hypothesis(found.values), found))
        real = self.target.pictures.real.clone()
        real[few] -= without - left  # what the unknown adds
        target = replace(self.target, pictures=replace(self.target.pictures, real=real))
        values, loss = gauss_newton(target, found.values, charted(found.values), few, 2)
        if _COUNTED in values:
            values, loss = search_factor(target, values, few)
        if values == found.values:
            return found, loss
        return Hypothesis(values, self.fit_unknown(values, sorted(found.extra), segments, found.extra)), loss

    def _fit_effects(
        self, names: Names, segments: tuple[int, ...], start: Hypothesis | None
    ) -> dict[str, dict[str, float]]:
        effects = sorted(names)
        few = self.few(segments)
        values = self._begin(frozenset(effects), start, few)
        noisy = [name for name in effects if name in of_stage("noise")]
        moving = charted(effects)
        if noisy:
            values |= self.fit_noise(values, noisy, segments)
        whole = len(segments) == self._study.count
        found = gauss_newton(self.target, values, moving, few, 6 if whole else 3)[0]
        if _COUNTED in names:
            found = search_factor(self.target, found, few)[0]
            found = gauss_newton(self.target, found, moving, few, 2)[0]
        if noisy and moving:
            found = {**found, **self.fit_noise(found, noisy, segments)}
        return {name: dict(found[name]) for name in effects}

    def fit_noise(self, values: Values, names: Sequence[str], segments: Sequence[int]) -> dict[str, dict[str, float]]:
        """The noise of `names`, for which only the tone of `values` matters: most hypotheses have the same.

        Of flat fields, where both are told apart, read noise without a name does not count as shot noise.
        """
        tone = {name: value for name, value in values.items() if name in of_stage("tone")}
        tail = Tail.of(tone, self._study.pictures.encoding, self._study.pictures.sim.shape[1])
        key = (tail, tuple(names), tuple(segments))
        if key not in self._noises:
            both = sorted(of_stage("noise")) if self._study.photon_transfer else names
            self._noises[key] = self._study.yardstick.noise.fit(tone, both, self._study.bins, segments)
        return {name: dict(self._noises[key][name]) for name in names}

    def fit_apart(self, values: Values, names: Sequence[str], segments: Sequence[int]) -> dict[str, dict[str, float]]:
        """The grain of labels, and the area of a missing object, in what effects leave; of no size if there is none."""
        found: dict[str, dict[str, float]] = {}
        surfaces = self._study.pictures.surfaces
        if not names or surfaces is None:
            return found
        mean, _, _ = self._predictor.frames(values, segments, lit=True)
        residual = self._study.pictures.real[list(segments)] - self._predictor.encoded(mean, values)
        counted, encoding = self.target.counted[list(segments)], self._study.pictures.encoding
        for name in names:
            if CAMERA_FITS[name].stage == "area":
                found[name] = self._fit_area(name, residual, segments)
                continue
            region = surfaces.of(segments).region(label_of(name) or 0)
            grain = grain_of(residual, mean, region, counted, encoding)
            found[name] = neutral(name) if grain is None else bounded(name, asdict(grain))
        grains = {name: found[name] for name in at_stage(found, "grain")}
        if any(grain["amplitude"] for grain in grains.values()) and self._told_soon(values):
            found |= {name: neutral(name) for name in grains}
        return found

    def _told_soon(self, values: Values) -> bool:
        """Whether what these values leave is told, as far as that is soon asked: then it is no grain."""
        moving = {name: value for name, value in values.items() if CAMERA_FITS[name].stage not in APART}
        return self._predictor.told(Hypothesis(moving), discrepancy.SOON)

    def _fit_area(self, name: str, residual: Tensor, segments: Sequence[int]) -> dict[str, float]:
        yardstick, surfaces = self._study.yardstick, self._study.pictures.surfaces
        chosen = list(segments)
        squared = (residual.square() / yardstick.variance[chosen]).mean(1)
        assert surfaces is not None
        area = area_of(squared, yardstick.counted[chosen], surfaces.shares[chosen])
        if area is None:
            return neutral(name, self._study.pictures.optics)
        return at_scale(name, area, 1 / self._study.pictures.scale)

    def few(self, segments: Sequence[int]) -> list[int]:
        """The frames that show most, of these."""
        return sorted([segment for segment in self._study.ranked if segment in set(segments)][: self._frames])

    def _begin(self, names: Names, start: Hypothesis | None, few: list[int]) -> dict[str, dict[str, float]]:
        """Values of all of `names` from which a fit of them should end well."""
        noises = of_stage("noise")
        moving = names - noises
        values: dict[str, dict[str, float]] = {}
        known = dict(start.values) if start is not None and names <= start.values.keys() else self._study.known(moving)
        if known is None:
            known = dict(start.values) if start is not None else {}
        for name in sorted(names):
            if name in known:
                values[name] = dict(known[name])
            elif name == "jpeg_compression":
                values[name] = {"quality": float(self._study.jpeg[0] if self._study.jpeg else 90)}
            elif name in noises:
                values[name] = dict(starts(name, self._study.pictures.optics)[0])
        for name in sorted(moving - values.keys()):
            options = starts(name, self._study.pictures.optics)
            if name in self._study.reference:
                options = [dict(self._study.reference[name]), *options]
            values = {
                each: dict(value) for each, value in best_start(self.target, values, name, few[:2], options).items()
            }
        return values

    def fit_unknown(
        self, values: Values, names: Sequence[str], segments: Segments, near: Near = _NOTHING
    ) -> dict[str, discrepancy.FittedDiscrepancy]:
        """Discrepancies fitted to what effects of these values leave; `near`: to what nearly the same ones left."""
        fitted: dict[str, discrepancy.FittedDiscrepancy] = {}
        if not names:
            return fitted
        segments = list(segments)[: max(_DISCREPANCY_VALUES // self._study.pictures.sim[0].numel(), 2)]
        mean, _, weight = self._predictor.frames(values, segments, lit=True)
        residual = self._study.pictures.real[segments] - self._predictor.encoded(mean, values)
        added, before = torch.zeros_like(mean), self._predictor.before(values, segments, names, lit=True)
        for name in names:
            fitted[name] = discrepancy.fit(name, residual - added, mean, weight, near.get(name), before)
            added = added + discrepancy.add(name, fitted[name], mean, residual - added, weight, before)
        return fitted
