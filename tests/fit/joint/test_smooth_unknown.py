"""A joint's effects beside something unknown, integrated out."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.identify.machines import a_log, steps
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.diagnose.one_case import open_case


@pytest.mark.slow
def test_a_lag_of_the_drive_is_no_latency_though_nothing_is_left_with_one() -> None:
    command = steps(5, 200)
    late = lfilter([0.4], [1.0, -0.6], command, axis=1)
    report = diagnose(replace(a_log({}, late, (1e-3, 2e-2)), command=command))
    assert report.verdict == "unexplained" and not report.effects
    assert "a drive whose torque follows the command with a lag" in report.unexplained.resembles


def test_a_latency_is_no_lag_of_the_drive() -> None:
    report = diagnose(a_log({"latency": {"delay": 0.012}}, steps(5, 200), (1e-3, 2e-2)))
    assert report.verdict == "explained" and [effect.name for effect in report.effects] == ["latency"]


@pytest.mark.parametrize(
    "named", [pytest.param({"load_dependent_friction": {"coefficient": 0.2}}, marks=pytest.mark.slow), {}]
)
def test_a_friction_has_its_name_beside_knocks_and_knocks_have_none(named) -> None:
    command, drawn = steps(5, 400), np.random.default_rng(4)
    knocks = np.where(drawn.random(command.shape) < 0.02, drawn.normal(size=command.shape), 0.0)
    knocked = command + 1.2 * sum(np.roll(knocks, lag, axis=1) for lag in range(3))
    report = diagnose(replace(a_log(named, knocked, (1e-4, 2e-3)), command=command))
    assert report.verdict == ("partly_explained" if named else "unexplained")
    found = {effect.name: {key: value.value for key, value in effect.parameters.items()} for effect in report.effects}
    assert found == {name: pytest.approx(values, rel=0.1) for name, values in named.items()}
    assert any("torques of their own instants" in each for each in report.unexplained.resembles) == bool(named)


@pytest.mark.slow
def test_a_sensor_whose_delay_wanders_is_no_latency() -> None:
    """Though a latency as long as the mean does most of its work, and stays in the simulator."""
    log = a_log({}, steps(5, 400), (1e-4, 2e-3))
    seconds = np.arange(400) * log.sample_time
    seen = seconds - 0.02 * (1 + np.sin(2 * np.pi * seconds / 1.5))
    late = [np.array([np.interp(seen, seconds, row) for row in each]) for each in (log.position, log.velocity)]
    report = diagnose(replace(log, position=late[0], velocity=late[1]))
    assert not report.effects and report.verdict == "unexplained" and report.gap.shrink > 0.3
    assert "latency" in {each.name for each in report.refitted}
    assert "latency of another size from instant to instant" in report.unexplained.resembles


def test_commands_that_a_drive_holds_are_told_from_late_ones() -> None:
    sent = steps(5, 400) + 0.3 * np.sin(np.linspace(2.0, 4.0, 5)[:, None] * np.arange(400) * 2 * np.pi * 0.01)  # A
    held = replace(a_log({}, sent[:, np.arange(400) // 8 * 8], (1e-4, 2e-3)), command=sent)
    for log, wavers in ((held, True), (a_log({"latency": {"delay": 0.02}}, sent, (1e-4, 2e-3)), False)):
        case = open_case(log)
        assert case.wavers(case.fit(frozenset({"latency"}), range(case.segments), None), "latency") == wavers


def test_the_evidence_of_effects_is_the_same_wherever_their_fit_begins() -> None:
    """Functions that turn out to be nothing cost nothing, though a fit that begins at its end has no way to go."""
    case = open_case(a_log({"cogging": {"amplitude": 0.05, "teeth": 8}}, steps(8, 100), (1e-3, 2e-2)))
    names = frozenset({"cogging"}) | case.refitted | frozenset(case.discrepancies)
    first = case.fit(names, range(case.segments), case.fit(frozenset({"cogging"}), range(case.segments), None))
    again = case.fit(names, range(case.segments), first)
    assert again.extra["evidence"] == pytest.approx(first.extra["evidence"], abs=0.3)
