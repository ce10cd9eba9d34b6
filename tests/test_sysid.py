"""What the diagnosis of arms is measured against, on an arm whose answer is known."""

import numpy as np
import pytest

from vision_s2r import sysid
from vision_s2r.errors import UserError
from vision_s2r.gapbench.generate import arm
from vision_s2r.recording import read


def test_it_finds_the_value_whose_name_it_is_told(tmp_path, monkeypatch):
    pytest.importorskip("tabulate", reason="the extra `sysid` is not installed")
    monkeypatch.setattr(sysid, "LOG", arm.ArmLog(rate=100.0, episodes=2, seconds=1.5))
    truth = sysid._record("viscous_damping", np.random.default_rng(0), tmp_path)
    found = sysid._identified(sysid._sysid(), read(tmp_path), truth)
    assert list(truth) == ["joint3.viscous_damping"] and found.error < 0.03 and found.seconds > 0


def test_what_was_not_found_has_no_error(tmp_path):
    truth = {"payload": {"mass": 2.0, "x": 0.1, "y": 0.0, "z": 0.2}}
    assert np.isnan(sysid._error(truth, {}))
    found = {"payload": {"mass": 2.2, "x": 0.1, "y": 0.01, "z": 0.2}}
    assert sysid._error(truth, found) == pytest.approx(0.1)


def test_a_missing_package_is_one_line(monkeypatch):
    monkeypatch.setattr(sysid.importlib, "import_module", lambda name: object())
    with pytest.raises(UserError, match=r"vision-s2r\[sysid\]"):
        sysid._sysid()
