"""Names of an arm's joints, held against the free run of the whole arm."""

import numpy as np
import pytest
from recordings import an_arm

from vision_s2r.diagnose import borne_out
from vision_s2r.diagnose.borne_out import idle
from vision_s2r.fit.arm.free_run import FreeRuns


def test_a_name_that_the_whole_arm_runs_as_well_without_is_no_name():
    recording = an_arm({"elbow": {"latency": {"delay": 0.02}}}, seconds=1.0)
    found = {
        "elbow.latency": {"delay": 0.02},
        "elbow.viscous_damping": {"value": 1.3},  # as false names are: it only makes up for what is not there
        "shoulder.inertia": {"value": 1e-9},  # what the rotor has anyhow
    }
    held_out = {"segments": [[e, k, k + 20, 0] for e in (0, 1) for k in range(0, 100, 20)], "folds": [found]}
    least = dict.fromkeys(("shoulder", "elbow"), 0.03 * 2e-4**2)
    gone = idle(FreeRuns(recording), held_out, list(found), least, seed=0)
    assert gone == {"elbow.viscous_damping", "shoulder.inertia"}


@pytest.mark.parametrize(("worse", "goes"), [(1e-4, False), (0.1, True)])
def test_a_tip_that_is_a_hair_further_off_costs_no_joint_its_name(worse, goes, monkeypatch):
    alike = np.random.default_rng(0).uniform(0.9, 1.1, 20)  # stretches

    def errors(runs, held_out, gone):
        joint, tip = (3e-5, 4e-8) if gone else (4e-8, 4e-8 * (1 + worse))  # rad² and m²
        return borne_out._StretchErrors({"wrist": joint * alike}, tip * alike)

    monkeypatch.setattr(borne_out, "_errors", errors)
    gone = idle(None, {"folds": [{}]}, ["wrist.viscous_damping"], {"wrist": 1e-9}, seed=0)
    assert bool(gone) == goes


def test_what_makes_the_arm_run_away_goes_though_it_has_no_name(monkeypatch):
    """A joint is divided in two halves, of which one may be lighter than the bodies that it carries."""

    def errors(runs, held_out, gone):
        left = np.full(20, 4e-8 if "elbow.compliance" in gone else np.nan)
        return borne_out._StretchErrors({"elbow": left if "elbow.latency" not in gone else 10 * left}, None)

    monkeypatch.setattr(borne_out, "_errors", errors)
    fold = {name: {} for name in ("elbow.compliance", "elbow.latency", "wrist.compliance")}
    gone = idle(None, {"folds": [fold]}, ["elbow.latency"], {"elbow": 1e-9}, seed=0)
    assert gone == {"elbow.compliance"}


def test_what_only_made_up_for_another_name_goes_after_it(monkeypatch):
    def errors(runs, held_out, gone):
        left = 4e-8 if "elbow.viscous_damping" in gone or "elbow.latency" not in gone else 4e-7
        return borne_out._StretchErrors({"elbow": np.full(20, left)}, None)

    monkeypatch.setattr(borne_out, "_errors", errors)
    names = ["elbow.latency", "elbow.viscous_damping"]
    assert idle(None, {"folds": [{}]}, names, {"elbow": 1e-9}, seed=0) == set(names)
