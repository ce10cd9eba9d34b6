"""A joint's effects beside something unknown, integrated out."""

from dataclasses import replace

from scipy.signal import lfilter

from tests.identify.machines import a_log, steps
from vision_s2r.diagnose.diagnose import diagnose


def test_a_lag_of_the_drive_is_no_latency_though_nothing_is_left_with_one() -> None:
    command = steps(5, 200)
    late = lfilter([0.4], [1.0, -0.6], command, axis=1)
    report = diagnose(replace(a_log({}, late, (1e-3, 2e-2)), command=command))
    assert report.verdict == "unexplained" and not report.effects
    assert "a drive whose torque follows the command with a lag" in report.unexplained.resembles


def test_a_latency_is_no_lag_of_the_drive() -> None:
    report = diagnose(a_log({"latency": {"delay": 0.012}}, steps(5, 200), (1e-3, 2e-2)))
    assert report.verdict == "explained" and [effect.name for effect in report.effects] == ["latency"]
