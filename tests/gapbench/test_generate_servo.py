"""The generated servos obey the contract, move as their answers say, and are logged as real ones are."""

import numpy as np
import pytest

from vision_s2r.gapbench.generate import servo
from vision_s2r.gapbench.generate.base import GeneratedMachine
from vision_s2r.gapbench.generate.drive import DriveModel
from vision_s2r.gapbench.generate.servo_run import run_servo
from vision_s2r.gapbench.generate.unknown import UNKNOWN
from vision_s2r.joint import NominalJoint, pack, simulate
from vision_s2r.recording import JointRecording, read

NOMINAL = DriveModel(
    torque_constant=0.8,
    inertia=0.02,
    viscous_damping=0.25,
    coulomb_friction=0.05,
    gravity_torque=0.4,
    proportional_gain=14.0,
    derivative_gain=0.05,
    command_limit=6.0,
)
SEVERE = {
    "proportional_gain": {"value": 10.0},
    "derivative_gain": {"value": 0.15},
    "position_offset": {"value": 0.2},
    "deadband": {"width": 0.04},
    "velocity_limit": {"value": 2.5},
    "acceleration_limit": {"value": 25.0},
    "derivative_on_error": {"gain": 0.15, "time_constant": 0.01},
    "stribeck_friction": {"static": 0.3, "velocity": 0.3},
    "load_dependent_friction": {"coefficient": 0.1},
    "external_load_friction": {"coefficient": 0.2},
    "backlash": {"width": 0.03},
    "torque_saturation": {"limit": 2.0},
    "torque_speed_limit": {"stall": 4.0, "no_load_speed": 8.0},
    "latency": {"delay": 0.0134},
    "cogging": {"amplitude": 0.3, "teeth": 12.0},
    "thermal_drift": {"rate": 0.1},
    "asymmetric_friction": {"viscous": 0.08, "coulomb": -0.04},
    "compliance": {"stiffness": 30.0, "damping": 0.05},
}


def machine(case: str, index: int, split: str = "tuning") -> GeneratedMachine:
    return servo.machine(case, index, split, np.random.default_rng([3, servo.CASES.index(case), index]))


def motion() -> tuple[np.ndarray, np.ndarray]:
    """Time stamps at about 50 Hz that jitter and skip, and targets."""
    rng = np.random.default_rng(1)
    times = np.delete(np.arange(300) / 50 + rng.uniform(0, 0.004, 300), [40, 41, 170])
    times -= times[0]
    levels = rng.uniform(-0.8, 0.8, 12)
    levels[0] = 0.0
    return times, levels[(times / 0.55).astype(int)] + 0.1 * np.sin(5 * times)


@pytest.mark.parametrize("name", SEVERE)
def test_two_implementations_of_a_servo_agree(name: str) -> None:
    times, targets = motion()
    fields = {servo.SERVO_LIBRARY[name].parameters[key]: value for key, value in SEVERE[name].items()}
    ours, without = (
        run_servo(drive, targets, times, targets[0], 5e-4)[:, 0] for drive in (NOMINAL._replace(**fields), NOMINAL)
    )
    believed = {key: getattr(NOMINAL, key) for key in ("torque_constant", *servo.BELIEVED, *servo.GAINS)}
    nominal = NominalJoint(**believed, command_limit=NOMINAL.command_limit)
    first = np.array([[targets[0], 0.0]])
    theirs = simulate(
        pack(nominal, {name: SEVERE[name]})[None], targets[None], first, 0.02, times=times[None], substeps=80
    )[0, 0, :, 0]
    moved, apart = (float(np.sqrt(np.mean(each**2))) for each in (ours - without, ours - theirs))
    assert moved > 1e-3 and apart < 0.02 * moved, f"{apart:.2g} rad apart, the effect itself {moved:.2g}"


def test_the_law_is_at_work_between_rows() -> None:
    """Rows left out of the log change nothing of how the servo moves, as long as the targets do not."""
    times, targets = motion()
    targets = np.repeat(targets[::4], 4)[: len(times)]
    whole = run_servo(NOMINAL, targets, times, 0.0, 5e-4)
    some = run_servo(NOMINAL, targets[::4], times[::4], 0.0, 5e-4)
    assert np.abs(some - whole[::4])[:, 0].max() < 1e-5


def test_rows_jitter_skip_and_come_at_each_rate_with_each_kind_of_speed(tmp_path) -> None:
    seen = set()
    for index in (each for each in range(12) if each % 4 < 3):  # the fourth is at 1 kHz
        made = machine("null", index)
        folder = tmp_path / str(index)
        folder.mkdir()
        made.write(folder)
        recording = read(folder)
        assert isinstance(recording, JointRecording) and recording.servo and recording.times is not None
        notes = made.answer.notes
        seen.add((notes["rate"], notes["velocity"]))
        steps = np.diff(recording.times, axis=1) * notes["rate"]
        assert np.std(steps) > 0.03 and steps.max() > 1.6 and np.median(steps) == pytest.approx(1, abs=0.02)
        left_out = recording.left_out.get("velocity", "")
        assert (recording.velocity is None) == (notes["velocity"] != "true")
        assert ("lags" in left_out) == (notes["velocity"] == "lagging")
        if left_out:
            assert float(left_out.split()[5]) == pytest.approx(1e3 * notes["lag"], abs=3)
        assert made.answer.group == f"{notes['rate']} Hz"
    assert len(seen) == 9


def test_a_gap_is_there_when_the_answer_says_so() -> None:
    for case, index in (("single", 0), ("single", 16), ("pair", 4)):
        answer = machine(case, index).answer
        assert answer.severity > 1.2 and len(answer.effects) == (1 if case == "single" else 2)


@pytest.mark.slow
def test_nulls_are_logged_at_1_khz_too_and_the_unknowns_are_those_of_their_split() -> None:
    null = machine("null", 3).answer
    assert null.group == "1000 Hz" and null.severity == pytest.approx(1.0, abs=0.05) and not null.effects
    for split in UNKNOWN:
        answer = machine("unknown", 1, split).answer
        assert answer.unknown in UNKNOWN[split] and answer.severity > 3 and not answer.effects


@pytest.mark.slow
def test_an_unknown_effect_is_like_no_single_effect_of_the_vocabulary() -> None:
    rng = np.random.default_rng(4)
    setting = servo._setting(50, rng)
    refitted = (*servo.BELIEVED, *servo.GAINS)

    def imitated(drive: DriveModel, allowed: set[str]) -> bool:
        return not servo._distinct(
            setting, drive, setting.nominal, refitted, servo._rivals(setting, drive, allowed, rng)
        )

    dead = setting.nominal._replace(deadband=0.004)
    assert servo._distinct(setting, dead, setting.nominal, refitted) and imitated(dead, set())
    drag = setting.nominal._replace(drag=8 * setting.scale.torque / setting.scale.speed**2)
    assert not imitated(drag, set())
