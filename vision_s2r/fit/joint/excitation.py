"""What a recording could not have shown: each effect at a plausible size, and how far it moves the residual."""

import numpy as np

from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.joint.effect import JOINT_FITS
from vision_s2r.fit.joint.fitter import JointFitter, names_of

DETECTABLE = 20.0  # nats that an effect of plausible size should bring


def not_excited(fitter: JointFitter, base: Hypothesis, noise: np.ndarray, names: list[str]) -> dict[str, str]:
    """Of these effects, those that the recording could not have shown, and why."""
    space = fitter.space(names_of(base))
    row = space.row(space.start(base))
    found = {}
    for name in names:
        fit = JOINT_FITS[name]
        if fit.plausible is None:
            continue
        size = fit.plausible(fitter.track, row)
        if size is None or fitter.shows(base, name, size, noise) < DETECTABLE:
            found[name] = fit.not_excited
    return found
