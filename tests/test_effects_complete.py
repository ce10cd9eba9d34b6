"""Every registered effect says what every verb needs of it; else the list of what is missing."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tests.recordings import a_contact, a_joint
from vision_s2r.appearance import APPEARANCE_EFFECTS, PICTURE_EFFECTS
from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.contact import CONTACT_EFFECTS
from vision_s2r.fit.camera.coordinates import starts
from vision_s2r.fit.camera.effect import APART, CAMERA_FITS, NEEDS, Chart, Optics, UnpairedFit
from vision_s2r.fit.camera.prediction import BEHIND
from vision_s2r.fit.joint.effect import JOINT_FITS
from vision_s2r.fit.joint.space import JointSpace
from vision_s2r.fit.joint.track import make_track
from vision_s2r.joint import JOINT_EFFECTS, pack
from vision_s2r.patch import contact
from vision_s2r.patch.effect import CAMERA_PATCHES, CONTACT_PATCHES, JOINT_PATCHES
from vision_s2r.patch.rigid import advice
from vision_s2r.report.reading import ReportedParameter


def test_joint_effects_can_be_fitted() -> None:
    assert list(_missing_of_joint()) == []


def test_joint_effects_can_be_written_for_other_simulators() -> None:
    missing = {effect.name for effect in JOINT_EFFECTS} ^ set(JOINT_PATCHES)
    assert not missing, f"patch/effects/NAME.py is missing, or of no effect: {sorted(missing)}"
    assert set(CAMERA_PATCHES) <= {effect.name for effect in CAMERA_EFFECTS}
    named = {
        effect.name: {key: ReportedParameter(x, x, x) for key, x in effect.moderate().items()}
        for effect in JOINT_EFFECTS
    }
    assert advice(named, a_joint()).keys() == named.keys()  # raises where words ask for what is not there


def test_contact_effects_are_written_for_other_simulators() -> None:
    missing = {effect.name for effect in CONTACT_EFFECTS} ^ set(CONTACT_PATCHES)
    assert not missing, f"patch/effects/NAME.py is missing, or of no effect: {sorted(missing)}"
    recording = a_contact()
    named = {
        effect.name: {key: ReportedParameter(x, x, x) for key, x in effect.moderate().items()}
        for effect in CONTACT_EFFECTS
    }
    for write in (contact.bullet, contact.urdf, contact.mujoco):
        nothing = write({}, recording)
        assert not [name for name in named if write({name: named[name]}, recording) == nothing], write.__name__


def test_camera_effects_can_be_fitted() -> None:
    assert list(_missing_of_camera()) == []


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
        row = JointSpace(frozenset(), track, 1e-4).row(np.empty(0))
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
        space = JointSpace(frozenset({name}), track, 1e-4)
        for end in (space.low, space.high) if fitted else ():  # it may be found there
            pack(track.nominal, space.hypothesis(end, {}).values)  # raises where it cannot be
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


def _missing_of_camera() -> Iterator[str]:
    names = {effect.name for effect in PICTURE_EFFECTS}
    for name in sorted(set(CAMERA_FITS) - names):
        yield f"{name} is fitted, but no effect"
    for effect in PICTURE_EFFECTS:
        name, parameters = effect.name, [parameter.name for parameter in effect.parameters]
        if name not in CAMERA_FITS:
            yield f"{name} has no CameraFit: register one in fit/camera/effects/{name}.py"
            continue
        fit = CAMERA_FITS[name]
        if (fit.stage in ("scene", *APART)) != (name in APPEARANCE_EFFECTS):
            yield f"{name}: stage {fit.stage}, but it acts {'on the scene' if name in APPEARANCE_EFFECTS else 'later'}"
        if (fit.stage in ("tone", "noise", "encoder")) != (name in BEHIND):
            yield f"{name}: stage {fit.stage}, which fit/camera/noise.py does not know"
        if not all(list(setting) == parameters for setting in starts(name, Optics(128, 128, 140.0))):
            yield f"{name}: starts that do not set {parameters}"
        if fit.coarse is not None and fit.chart is None:
            yield f"{name}: begins a coarse fit, but has no chart"
        for need in fit.needs:
            if need not in NEEDS:
                yield f"{name}: needs {need}, which is none of {', '.join(NEEDS)}"
        for other in sorted(fit.confusable - names):
            yield f"{name}: confusable with {other}, which is no effect"
        yield from (f"{name}: {what}" for what in _wrong_in(fit.chart, parameters, effect.moderate()))
        if isinstance(fit.unpaired, UnpairedFit):
            yield from (
                f"{name}, unpaired: {what}" for what in _wrong_in(fit.unpaired.chart, parameters, effect.moderate())
            )
            if fit.unpaired.negligible(effect.moderate(), 128):
                yield f"{name}, unpaired: negligible at its moderate setting"
        elif not fit.unpaired:
            yield f"{name}: no word of why unpaired pictures cannot show it"


def _wrong_in(chart: Chart | None, parameters: list[str], values: dict[str, float]) -> Iterator[str]:
    if chart is None:
        return
    point = chart.inward(values)
    sizes = {len(point), len(chart.steps(Optics(128, 128, 140.0))), len(chart.limits)}
    if sizes != {len(parameters)}:
        yield f"coordinates, steps and limits of {sorted(sizes)} numbers for {len(parameters)} parameters"
    if set(chart.outward(point)) != set(parameters):
        yield f"a chart that does not give {parameters}"
