"""The one word that a report begins with."""

from types import SimpleNamespace

import numpy as np
import pytest

from vision_s2r.diagnose.report import verdict
from vision_s2r.diagnose.settled import Settled
from vision_s2r.fit.gap import Gap


@pytest.mark.parametrize(("share", "said"), [(0.0, "unexplained"), (0.4, "partly_explained")])
def test_an_encoders_steps_that_close_nothing_explain_no_part(share, said):
    """Real encoders have steps, and a gap that is something else's is not partly theirs."""
    before = np.full(8, 1.0)
    gap = Gap(before, before, before * (1 - share), np.full(8, 1e-4), 0)
    name = "encoder_quantization"
    found = SimpleNamespace(effects=frozenset({name}), adequate=False, unknown=frozenset({"torque_of_position"}))
    none = frozenset()
    settled = Settled(found, SimpleNamespace(names=none), none, none, none, gap, {}, {name: before * share})
    case = SimpleNamespace(unsteady="", certain={name: 5000.0})
    assert verdict(SimpleNamespace(case=case), settled) == said


@pytest.mark.parametrize(("refitted", "said"), [(0.04, "explained"), (0.005, "partly_explained")])
def test_what_is_further_off_than_nominal_values_alone_does_not_explain(refitted, said):
    """A servo's dead zone had been explained by a dry friction, with which its free run was a quarter further off."""
    after, none = np.full(8, 0.01), frozenset()
    gap = Gap(np.full(8, 1.0), np.full(8, refitted), after, np.full(8, 1e-3), 0)
    found = SimpleNamespace(effects=frozenset({"coulomb_friction"}), adequate=True, unknown=none)
    settled = Settled(found, SimpleNamespace(names=none), none, none, none, gap, {}, {"coulomb_friction": after})
    assert verdict(SimpleNamespace(case=SimpleNamespace(unsteady="", certain={})), settled) == said
