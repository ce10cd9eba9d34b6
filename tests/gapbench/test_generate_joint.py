"""The generated joints obey the contract, owe nothing to the project's simulator, and are what their answers say."""

import ast
from pathlib import Path

import numpy as np
import pytest
import yaml

import vision_s2r.gapbench as gapbench
from vision_s2r.errors import UserError
from vision_s2r.gapbench.config import COUNTS, GapbenchConfig
from vision_s2r.gapbench.generate import excitation, joint, truth
from vision_s2r.gapbench.generate.base import GeneratedMachine
from vision_s2r.gapbench.generate.drive import DriveModel, run, step_of
from vision_s2r.gapbench.generate.generate import generate
from vision_s2r.gapbench.generate.library import LIBRARY
from vision_s2r.gapbench.generate.unknown import UNKNOWN
from vision_s2r.joint import NominalJoint, pack, simulate

NOMINAL = DriveModel(torque_constant=0.5, inertia=0.02, viscous_damping=0.1, coulomb_friction=0.02)
SEVERE = {
    "stribeck_friction": {"static": 0.09, "velocity": 0.3},
    "load_dependent_friction": {"coefficient": 0.1},
    "backlash": {"width": 0.06},
    "torque_saturation": {"limit": 0.25},
    "torque_speed_limit": {"stall": 0.5, "no_load_speed": 6.0},
    "latency": {"delay": 0.0234},
    "encoder_quantization": {"resolution": 0.004},
    "cogging": {"amplitude": 0.05, "teeth": 7.0},
    "thermal_drift": {"rate": 0.1},
    "asymmetric_friction": {"viscous": 0.02, "coulomb": -0.01},
    "compliance": {"stiffness": 8.0, "damping": 0.02},
    "viscous_damping": {"value": 0.15},
    "coulomb_friction": {"value": 0.06},
    "inertia": {"value": 0.03},
    "gravity_torque": {"value": 0.2},
    "bias_torque": {"value": -0.05},
    "torque_constant": {"value": 0.6},
}


def of(name: str) -> DriveModel:
    fields = {LIBRARY[name].parameters[key]: value for key, value in SEVERE[name].items()}
    return NOMINAL._replace(**fields)


def commands() -> np.ndarray:
    rng = np.random.default_rng(2)
    loops = [excitation.FORMS[form](NOMINAL, 5.0, np.zeros((800, 2)), rng) for form in ("multisine", "steps", "chirp")]
    return np.stack([loop.command for loop in loops])


NEUTRAL = (
    "parallel",
    "bullet",
    "errors",
    "files",
    "options",
    "progress",
    "results",
    "statistics",
)  # rooms that know nothing of joints


def machine(case: str, index: int, split: str = "tuning", seed: int = 0) -> GeneratedMachine:
    return joint.machine(case, index, split, np.random.default_rng([seed, joint.CASES.index(case), index]))


def test_it_shares_nothing_with_the_project() -> None:
    for module in Path(gapbench.__file__).parent.rglob("*.py"):
        imported = [n.module or "" for n in ast.walk(ast.parse(module.read_text())) if isinstance(n, ast.ImportFrom)]
        neutral = {f"vision_s2r.{name}" for name in NEUTRAL}
        ours = {name for name in imported if name.startswith("vision_s2r")} - neutral
        assert all(name.startswith("vision_s2r.gapbench") for name in ours), module


@pytest.mark.parametrize("name", LIBRARY)
def test_two_implementations_of_an_effect_agree(name: str) -> None:
    first = np.zeros((3, 2))
    ours = truth.replay(of(name), commands(), first)
    nominal = NominalJoint(**{key: getattr(NOMINAL, key) for key in joint.MODELLED})
    theirs = simulate(pack(nominal, {name: SEVERE[name]})[None], commands(), first, 0.01)[0]
    without = truth.replay(NOMINAL, commands(), first)
    moved = np.sqrt(np.mean((ours - without)[..., 1] ** 2))
    apart = np.sqrt(np.median((ours - theirs)[..., 1] ** 2))  # an impact within a sample is a spike in both, shifted
    assert apart < 0.02 * moved, f"{apart:.2g} rad/s apart, the effect itself {moved:.2g}"


@pytest.mark.parametrize("name", ["compliance", "backlash", "stribeck_friction", "latency"])
def test_half_the_step_changes_nothing_that_a_sensor_would_see(name: str) -> None:
    drive = of(name)
    loop = excitation.played(commands()[0])
    coarse, _ = run(drive, loop, np.zeros(2), 0.01, step_of(drive))
    fine, _ = run(drive, loop, np.zeros(2), 0.01, step_of(drive) / 2)
    assert np.abs(coarse - fine).max() < 1e-5


def test_it_sticks_and_breaks_away() -> None:
    drive = NOMINAL._replace(static=0.1)
    ramp = np.linspace(0, 0.4, 400)  # 0.1 N·m is reached at sample 199.5
    rows, _ = run(drive, excitation.played(ramp), np.zeros(2), 0.01, 5e-4)
    assert not rows[:200].any()
    assert rows[205, 1] > 0


def test_a_mass_against_friction_stops_where_the_formula_says() -> None:
    drive = DriveModel(torque_constant=1.0, inertia=0.02, viscous_damping=0.0, coulomb_friction=0.1)
    rows, _ = run(drive, excitation.played(np.zeros(100)), np.array([0.0, 3.0]), 0.01, 5e-4)
    assert rows[-1] == pytest.approx([0.5 * 0.02 * 3.0**2 / 0.1, 0.0], abs=1e-9)


def test_the_same_seed_gives_the_same_recording(tmp_path: Path) -> None:
    texts = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        made = machine("pair", 3)
        made.write(tmp_path / name)
        texts.append((tmp_path / name / "joint.csv").read_text())
    assert texts[0] == texts[1]
    head = yaml.safe_load((tmp_path / "a" / "recording.yaml").read_text())
    assert head["format"] == "vision-s2r/recording/1"
    assert set(head["nominal"]) == set(joint.MODELLED)
    assert len(texts[0].splitlines()) == 1 + 5 * 800


@pytest.mark.parametrize(
    "case",
    [pytest.param(name, marks=pytest.mark.slow) if name in ("confusable", "unknown") else name for name in joint.CASES],
)
def test_a_gap_is_there_when_the_answer_says_so(case: str) -> None:
    answer = machine(case, 1).answer
    assert answer.severity is not None
    if case in ("null", "weak"):
        assert answer.effects == {}
        assert answer.severity == pytest.approx(1.0, abs=0.1)
    else:
        assert answer.severity > 2.5
        assert bool(answer.effects) == (case not in ("unknown", "left_out"))
    if case in ("single", "pair", "triple", "dynamics", "all_nominal"):
        assert answer.shrink == pytest.approx(1.0, abs=0.02)  # nothing is wrong beside the effects of the answer


def test_the_unknown_kinds_of_the_two_sets_are_disjoint() -> None:
    assert not set(UNKNOWN["tuning"]) & set(UNKNOWN["reporting"])
    assert len(UNKNOWN["tuning"]) + len(UNKNOWN["reporting"]) >= 25


@pytest.mark.slow
def test_each_unknown_kind_shows() -> None:
    for split, kinds in UNKNOWN.items():
        for index, name in enumerate(kinds):
            answer = machine("unknown", index, split).answer
            assert answer.unknown == name
            assert answer.severity is not None and answer.severity > 3


def test_the_answer_takes_the_fewest_parameters() -> None:
    off = {
        "inertia": 0.03,
        "viscous_damping": 0.15,
        "coulomb_friction": 0.03,
    }  # all times 1.5: the torque constant
    setting = joint.JointSetting(NOMINAL, [], (1e-4, 5e-3), joint.Scale(1.0, 1.0, 1.0))
    answer = joint.describe(setting, "dynamics", truth.JointTruth(NOMINAL._replace(**off)), ())
    assert answer.effects == {"torque_constant": {"value": pytest.approx(0.5 / 1.5)}}
    assert ["coulomb_friction", "inertia", "viscous_damping"] in answer.equivalents
    off = {"torque_constant": 0.6}  # of limits and other torques, a wrong torque constant says nothing
    drive = NOMINAL._replace(limit=0.3, **off)
    answer = joint.describe(setting, "pair", truth.JointTruth(drive), ("torque_constant", "torque_saturation"))
    assert answer.effects == {"torque_constant": {"value": 0.6}, "torque_saturation": {"limit": 0.3}}


def test_all_nominal_values_are_off_by_5_to_25_percent(tmp_path: Path) -> None:
    made = machine("all_nominal", 2)
    made.write(tmp_path)
    nominal = yaml.safe_load((tmp_path / "recording.yaml").read_text())["nominal"]
    true = made.answer.notes["machine"]
    off = [abs(true[name] / value - 1) for name, value in nominal.items() if value]
    assert len(off) >= 4
    assert all(0.05 <= share <= 0.25 for share in off)
    assert len(set(made.answer.effects) - set(joint.MODELLED)) == 1


def test_a_full_disk_is_one_line(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(joint, "_write", full)
    cfg = GapbenchConfig(counts=dict.fromkeys(COUNTS, 0) | {"null": 1}, jobs=1, out=str(tmp_path))
    with pytest.raises(UserError, match=r"recordings/\w+: cannot be written \(No space left on device\)"):
        generate(cfg)
