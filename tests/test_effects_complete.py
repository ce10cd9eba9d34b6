"""Every registered effect says what every verb needs of it; else the list of what is missing."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tests.recordings import a_joint
from vision_s2r.fit.joint.effect import JOINT_FITS
from vision_s2r.fit.joint.space import Space
from vision_s2r.fit.joint.track import make_track
from vision_s2r.joint import JOINT_EFFECTS, pack


def test_joint_effects_can_be_fitted() -> None:
    assert list(_missing_of_joint()) == []


def _missing_of_joint() -> Iterator[str]:
    one = a_joint(noise=1e-4)
    servo = replace(one, nominal=one.nominal | {"proportional_gain": 5.0})
    tracks = {law: make_track(each, velocity_is_derived=False) for law, each in ((False, one), (True, servo))}
    residuals = np.random.default_rng(0).normal(size=tracks[False].observed.shape)
    names = {effect.name for effect in JOINT_EFFECTS}
    for name in sorted(set(JOINT_FITS) - names):
        yield f"{name} is fitted, but no effect"
    for effect in JOINT_EFFECTS:
        name, track = effect.name, tracks[effect.servo]
        row = Space(frozenset(), track, 1e-4).row(np.empty(0))
        if name not in JOINT_FITS:
            yield f"{name} has no JointFit: register one in fit/joint/effects/{name}.py"
            continue
        fit = JOINT_FITS[name]
        parameters = [parameter.name for parameter in effect.parameters]
        fitted = [each.parameter for each in fit.ranges(track, 1e-4)]
        if fitted and fitted != parameters:
            yield f"{name}: ranges of {fitted}, but its parameters are {parameters}"
        settings = fit.starts(track, row, residuals)
        if not settings or any(fitted and list(setting) != parameters for setting in settings):
            yield f"{name}: starts that do not set {parameters}"
        if fit.plausible is not None:
            size = fit.plausible(track, row)
            if size is not None:
                pack(track.nominal, {name: size})  # raises where it cannot be
            if not fit.not_excited:
                yield f"{name}: no reason why a recording could not have shown it (not_excited)"
            if not fit.excited_by:
                yield f"{name}: no motion that would show it (excited_by)"
        for other in sorted(fit.confusable - names):
            yield f"{name}: confusable with {other}, which is no effect"
