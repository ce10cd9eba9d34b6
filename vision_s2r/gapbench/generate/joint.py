"""Generated joints: machines of every case, drawn so that each of their effects shows in the motion.

An effect shows when it moves the free run's velocity by 3 (mild) to 100 times (severe) the noise of the velocity
sensor, everything else equal; in pairs and triples each effect does, beside the others. And it is distinct: at least
once the noise remains when the parameters of the simulator and those of the other effects are refitted to imitate it.
An unknown effect remains distinct whichever one effect of the vocabulary is added to the imitation. (To first order.)
"""

import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from vision_s2r.gapbench.generate.base import Answer, Effects, GeneratedMachine, Redraw, drawn
from vision_s2r.gapbench.generate.drive import DriveModel
from vision_s2r.gapbench.generate.excitation import SAMPLE_TIME, Excitation, played
from vision_s2r.gapbench.generate.excitation import draw as draw_excitation
from vision_s2r.gapbench.generate.library import ACTUATOR, DYNAMICS, LIBRARY, TORQUES, Family, Scale, compatible
from vision_s2r.gapbench.generate.severity import of_severity
from vision_s2r.gapbench.generate.truth import (
    COARSE,
    JointTruth,
    encoded,
    record,
    replay,
    unimitated,
    velocity_difference,
)
from vision_s2r.gapbench.generate.unknown import UNKNOWN

CASES = (
    *("null", "dynamics", "single", "pair", "triple", "unknown", "known_unknown"),
    *("weak", "all_nominal", "left_out", "confusable"),
)
MILD, SEVERE = 3.0, 100.0  # in units of the velocity's noise
WEAK = (0.02, 0.2)
DISTINCT = 1.0
HIDDEN, ALIKE = 0.2, 0.12  # of the noise: an effect, and what is left of it beside another, that nobody can tell
REPEATED = 3  # times that one motion is recorded
UNLIKE = 5.0  # how much one of a known and an unknown effect may outweigh the other
NOTICEABLE = 0.03  # share of a nominal value from which a wrong one must be named
MODELLED = tuple(DYNAMICS)


@dataclass(frozen=True)
class JointSetting:
    """What the simulator believes, how the joint is excited, and the noise of its sensors (rad, rad/s)."""

    nominal: DriveModel
    excitations: list[Excitation]
    noise: tuple[float, float]
    scale: Scale

    def severity(self, truth: JointTruth, without: JointTruth) -> float:
        """How far apart two joints move, in units of the velocity's noise."""
        return velocity_difference(truth, without, self.excitations) / self.noise[1]


def machine(case: str, index: int, split: str, rng: np.random.Generator) -> GeneratedMachine:
    """Draw one machine of a case; see `generate.base`."""

    def draw() -> GeneratedMachine:
        setting = _setting(rng)
        truth, answer = _DRAWN[case](setting, index, split, rng)
        if case == "confusable":
            setting = _hiding(setting, truth, answer, rng)
        return _recorded(setting, truth, answer, rng)

    return drawn(draw, f"machine of case '{case}' number {index}")


def _setting(rng: np.random.Generator) -> JointSetting:
    """A joint of the size of a small servo, its excitation and its sensors."""

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    damping = between(0.05, 0.2)
    nominal = DriveModel(
        torque_constant=between(0.3, 0.8),
        inertia=damping * between(0.12, 0.4),
        viscous_damping=damping,
        coulomb_friction=damping * between(0.15, 0.6),
        gravity_torque=between(0.05, 0.3) if rng.random() < 0.3 else 0.0,
        bias_torque=rng.choice([-1.0, 1.0]) * between(0.01, 0.05) if rng.random() < 0.2 else 0.0,
    )
    nominal = DriveModel(*(float(f"{value:.4g}") for value in nominal))
    noise = (between(5e-5, 4e-4), between(2e-3, 1e-2))
    excitations = draw_excitation(nominal, noise, rng)
    motion, commands = record(JointTruth(nominal), excitations, COARSE)
    scale = Scale(
        torque=float(np.abs(commands).max() * nominal.torque_constant),
        speed=float(np.abs(motion[..., 1]).max()),
        range=float(np.abs(motion[..., 0]).max()),
    )
    return JointSetting(nominal, excitations, noise, scale)


# Drawing truths, one function a case: (setting, index, split, rng) -> the joint and its answer. Raises Redraw.


def _null(setting: JointSetting, index: int, split: str, rng: np.random.Generator) -> tuple[JointTruth, Answer]:
    return JointTruth(setting.nominal), Answer("null")


def _dynamics(setting: JointSetting, index: int, split: str, rng: np.random.Generator) -> tuple[JointTruth, Answer]:
    """The first of each six machines have one wrong value, in turn, the others two or three."""
    names = (MODELLED[index % 6],)
    if index // 6 % 2:
        names = tuple(rng.choice(MODELLED, size=rng.integers(2, 4), replace=False))
    return _with_effects(setting, "dynamics", names, rng)


def _single(setting: JointSetting, index: int, split: str, rng: np.random.Generator) -> tuple[JointTruth, Answer]:
    return _with_effects(setting, "single", (list(LIBRARY)[index % len(LIBRARY)],), rng)


def _several(case: str, count: int) -> Callable[..., tuple[JointTruth, Answer]]:
    def draw(setting: JointSetting, index: int, split: str, rng: np.random.Generator) -> tuple[JointTruth, Answer]:
        """An effect of the drive, in turn, beside others."""
        first = list(ACTUATOR)[index % len(ACTUATOR)]
        names = (first, *map(str, rng.choice(list(LIBRARY), size=count - 1, replace=False)))
        if not compatible(names):
            raise Redraw
        return _with_effects(setting, case, names, rng)

    return draw


def _weak(setting: JointSetting, index: int, split: str, rng: np.random.Generator) -> tuple[JointTruth, Answer]:
    """An effect too weak to matter, in turn; not an encoder, whose velocity is another signal however fine it is."""
    names = [name for name in LIBRARY if name != "encoder_quantization"]
    name = names[index % len(names)]
    truth = _grown(setting, JointTruth(setting.nominal), name, rng, *WEAK)
    return truth, Answer("weak", optional=_effects(truth.drive, (name,)))


def _all_nominal(setting: JointSetting, index: int, split: str, rng: np.random.Generator) -> tuple[JointTruth, Answer]:
    """Every value that is not zero 5 to 25 % off, as a whole and relative to the torque constant."""
    factors = _factors([name for name in MODELLED if getattr(setting.nominal, name)], rng)
    off = setting.nominal._replace(**{name: getattr(setting.nominal, name) * f for name, f in factors.items()})
    name = list(ACTUATOR)[index % len(ACTUATOR)]
    truth = _grown(setting, JointTruth(off), name, rng)
    if not _distinct(setting, truth, name, (name,)):
        raise Redraw
    return truth, describe(setting, "all_nominal", truth, (name,))


def _factors(names: Sequence[str], rng: np.random.Generator) -> dict[str, float]:
    """How far each value is off; no other torque constant makes one of them nearly right, or two at once."""
    while True:
        factors = {name: 1 + rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.25) for name in names}
        relative = [factors[name] / factors["torque_constant"] for name in names if name != "torque_constant"]
        apart = min(abs(a / b - 1) for a, b in itertools.combinations(relative, 2))
        if apart >= 0.05 and all(0.05 <= abs(value - 1) <= 0.25 for value in relative):
            return factors


def _unknown(setting: JointSetting, index: int, split: str, rng: np.random.Generator) -> tuple[JointTruth, Answer]:
    truth, name, optional = _with_unknown(setting, JointTruth(setting.nominal), index, split, rng)
    if _best_imitation(setting, truth, JointTruth(setting.nominal), optional, rng) < DISTINCT:
        raise Redraw
    return truth, Answer("unknown", unknown=name, optional=optional)


def _known_unknown(
    setting: JointSetting, index: int, split: str, rng: np.random.Generator
) -> tuple[JointTruth, Answer]:
    """An unknown effect and one of the drive, each in turn."""
    effect = list(ACTUATOR)[index % len(ACTUATOR)]
    known = _grown(setting, JointTruth(setting.nominal), effect, rng)
    truth, name, optional = _with_unknown(setting, known, index, split, rng)
    if effect in optional or not _distinct(setting, truth, effect, (effect,)):
        raise Redraw
    sizes = [setting.severity(truth, other) for other in (_without(setting, truth, effect), known)]
    if min(sizes) < MILD or max(sizes) > min(SEVERE, UNLIKE * min(sizes)):
        raise Redraw
    if _best_imitation(setting, truth, known, {**optional, effect: {}}, rng) < DISTINCT:
        raise Redraw
    answer = describe(setting, "known_unknown", truth, (effect,))
    return truth, replace(answer, unknown=name, optional=optional)


def _left_out(setting: JointSetting, index: int, split: str, rng: np.random.Generator) -> tuple[JointTruth, Answer]:
    name = list(LIBRARY)[index % len(LIBRARY)]
    truth, answer = _with_effects(setting, "left_out", (name,), rng)
    # A wrong parameter has its equivalents in the answer; nothing else has an encoder's grid
    imitable = name in ACTUATOR and name != "encoder_quantization"
    if imitable and _best_imitation(setting, truth, JointTruth(setting.nominal), {name: {}}, rng) < DISTINCT:
        raise Redraw
    return truth, replace(answer, effects={}, withhold=name, where=[])


def _confusable(setting: JointSetting, index: int, split: str, rng: np.random.Generator) -> tuple[JointTruth, Answer]:
    """An effect of the drive; which, is drawn: few are hidden by a motion that shows others.

    Not an encoder, nor limits that only commands beyond the recording's reach.
    """
    names = [
        name for name in ACTUATOR if name not in ("encoder_quantization", "torque_saturation", "torque_speed_limit")
    ]
    return _with_effects(setting, "confusable", (str(rng.choice(names)),), rng)


def _hiding(setting: JointSetting, truth: JointTruth, answer: Answer, rng: np.random.Generator) -> JointSetting:
    """Of the setting's episodes one, repeated, in which the effect hardly shows or another imitates it."""
    nominal = JointTruth(setting.nominal)
    own: Effects = {name: {} for name in answer.effects}
    for k in rng.permutation(len(setting.excitations)):
        one = replace(setting, excitations=[setting.excitations[k]])
        hidden = one.severity(truth, nominal) < HIDDEN
        if hidden or _best_imitation(one, truth, nominal, own, rng) < ALIKE:
            return replace(one, excitations=one.excitations * REPEATED)
    raise Redraw


_DRAWN: dict[str, Callable[..., tuple[JointTruth, Answer]]] = {
    "null": _null,
    "dynamics": _dynamics,
    "single": _single,
    "pair": _several("pair", 2),
    "triple": _several("triple", 3),
    "unknown": _unknown,
    "known_unknown": _known_unknown,
    "weak": _weak,
    "all_nominal": _all_nominal,
    "left_out": _left_out,
    "confusable": _confusable,
}


# Growing effects to a severity


def _with_effects(
    setting: JointSetting, case: str, names: Sequence[str], rng: np.random.Generator
) -> tuple[JointTruth, Answer]:
    """A joint with these effects, each of which shows beside the others."""
    truth = JointTruth(setting.nominal)
    for name in names:
        truth = _grown(setting, truth, name, rng)
    for name in names:
        if not MILD <= setting.severity(truth, _without(setting, truth, name)) <= 1.1 * SEVERE:
            raise Redraw
        if not _distinct(setting, truth, name, names):
            raise Redraw
    return truth, describe(setting, case, truth, tuple(names))


def _grown(
    setting: JointSetting,
    truth: JointTruth,
    name: str,
    rng: np.random.Generator,
    low: float = MILD,
    high: float = SEVERE,
) -> JointTruth:
    """Add an effect, of a severity drawn uniformly in its logarithm."""
    family = LIBRARY[name].draw(truth.drive, setting.scale, rng)
    least = 0.0
    if name in DYNAMICS and low >= MILD:
        least = _noticeable(family, setting.nominal, name)
    return of_severity(
        lambda grown: setting.severity(grown, truth), lambda x: truth.with_fields(family(x)), rng, (low, high), least
    )


def _noticeable(family: Family, nominal: DriveModel, name: str) -> float:
    """The intensity from which a wrong value is wrong by more than the share that must be named."""
    before = getattr(nominal, name)
    if before == 0:
        return 0.0
    fractions = np.geomspace(1e-3, 1, 200)
    wrong = [abs(family(x)[name] / before - 1) > 1.2 * NOTICEABLE for x in fractions]
    return float(fractions[np.argmax(wrong)])


def _with_unknown(
    setting: JointSetting, truth: JointTruth, index: int, split: str, rng: np.random.Generator
) -> tuple[JointTruth, str, Effects]:
    """Add an unknown effect, at least half again as severe as the mildest known ones."""
    name = list(UNKNOWN[split])[index % len(UNKNOWN[split])]
    effect = UNKNOWN[split][name]
    family = effect.draw(truth.drive, setting.scale, rng)
    seed = int(rng.integers(2**31))

    def grow(x: float) -> JointTruth:
        grown = truth.with_fields(family(x))
        if effect.command:
            grown = replace(grown, command=effect.command(x, np.random.default_rng(seed)))
        if effect.sensor:
            grown = replace(grown, sensor=effect.sensor(x, np.random.default_rng(seed)))
        return grown

    optional: Effects = {known: {} for known in effect.optional}
    grown = of_severity(lambda each: setting.severity(each, truth), grow, rng, (1.5 * MILD, SEVERE))
    return grown, name, optional


def _distinct(setting: JointSetting, truth: JointTruth, name: str, names: Sequence[str]) -> bool:
    """Whether no refit of the simulator's parameters and of the other effects imitates one of a joint's effects."""
    others = [other for other in names if other != name and other not in DYNAMICS]
    near = [truth.with_fields({field: 1.03 * getattr(truth.drive, field)}) for field in _fields(others)]
    if name in ACTUATOR:
        near += _refitted(setting, truth)
    if name == "encoder_quantization" or not near:
        return True
    without = _without(setting, truth, name)
    return unimitated(truth, truth, without, near, setting.excitations) >= DISTINCT * setting.noise[1]


def _best_imitation(
    setting: JointSetting, truth: JointTruth, base: JointTruth, allowed: Effects, rng: np.random.Generator
) -> float:
    """What remains, in units of noise, of the difference of a joint to `base` when one more effect may imitate it."""
    near = _refitted(setting, base)
    near += [base.with_fields({field: 1.03 * getattr(base.drive, field)}) for field in _fields(allowed)]
    size = min(setting.severity(truth, base), 30.0)
    remains = []
    for name in [name for name in ACTUATOR if name not in allowed] * 2:  # signs and the like are drawn twice
        try:
            rival = _grown(setting, base, name, rng, size, size)
        except Redraw:
            continue
        remains.append(unimitated(truth, base, truth, [*near, rival], setting.excitations))
    return min(remains, default=size * setting.noise[1]) / setting.noise[1]


def _refitted(setting: JointSetting, truth: JointTruth) -> list[JointTruth]:
    """The joint with each of the simulator's parameters a little off."""
    steps = {name: 0.02 * abs(getattr(truth.drive, name)) or 0.01 * setting.scale.torque for name in MODELLED}
    return [truth.with_fields({name: getattr(truth.drive, name) + step}) for name, step in steps.items()]


def _fields(names: Iterable[str]) -> list[str]:
    """The fields of these effects that a fit could move and that are at work."""
    return [
        field for name in names for field in LIBRARY[name].parameters.values() if field not in ("resolution", "teeth")
    ]


def _without(setting: JointSetting, truth: JointTruth, name: str) -> JointTruth:
    """The joint without one of its effects of the vocabulary."""
    neutral = setting.nominal._asdict()
    return truth.with_fields({field: neutral[field] for field in LIBRARY[name].parameters.values()})


# The answer


def _effects(drive: DriveModel, names: Sequence[str]) -> Effects:
    """The parameters of these effects, in the vocabulary's names."""
    return {
        name: {key: float(getattr(drive, field)) for key, field in LIBRARY[name].parameters.items()} for name in names
    }


def describe(setting: JointSetting, case: str, truth: JointTruth, names: tuple[str, ...]) -> Answer:
    """The description with the fewest effects, and its equivalents.

    A joint moves the same when every torque and the inertia are divided by one number: any torque constant describes
    it. The nominal one goes first among descriptions of the same size.
    """
    actuator = tuple(name for name in names if name in ACTUATOR)
    descriptions = []
    for divisor in _divisors(truth.drive, setting.nominal):
        scaled = {field: getattr(truth.drive, field) / divisor for field in TORQUES}
        scaled["static"] = scaled["static"] if truth.drive.static >= 0 else -1.0
        drive = truth.drive._replace(**scaled)
        wrong = {name: _wrongness(getattr(drive, name), getattr(setting.nominal, name)) for name in MODELLED}
        named = tuple(name for name in MODELLED if wrong[name] > NOTICEABLE)
        barely = tuple(name for name in MODELLED if 1e-9 < wrong[name] <= NOTICEABLE)
        descriptions.append((_effects(drive, named + actuator), _effects(drive, barely)))
    effects, optional = min(descriptions, key=lambda description: len(description[0]))
    equivalents = {tuple(sorted(other)) for other, _ in descriptions} - {tuple(sorted(effects))}
    where = sorted({axis for name in effects for axis in LIBRARY[name].where}) if len(effects) == 1 else []
    return Answer(case, effects, optional, equivalents=[list(names) for names in sorted(equivalents)], where=where)


def _divisors(drive: DriveModel, nominal: DriveModel) -> list[float]:
    """Numbers that make the torque constant or another wrong value nominal, the torque constant first."""
    ratios = [getattr(drive, name) / getattr(nominal, name) for name in MODELLED if getattr(nominal, name)]
    constant = drive.torque_constant / nominal.torque_constant
    return [constant, 1.0, *(ratio for ratio in ratios if ratio > 0)]


def _wrongness(value: float, nominal: float) -> float:
    """The share by which a value is off; infinite where nominal is zero and the value is not."""
    if nominal == 0:
        return np.inf if value else 0.0
    return abs(value / nominal - 1)


# The recording


def _recorded(setting: JointSetting, truth: JointTruth, answer: Answer, rng: np.random.Generator) -> GeneratedMachine:
    motion, commands = record(truth, setting.excitations)
    resolution = truth.drive.resolution
    shown = encoded(motion, resolution)
    noise = rng.normal(size=motion.shape) * setting.noise
    # An encoder's velocity is computed from its positions: it has their noise and no other
    measured = encoded(motion + noise, resolution)
    tell: dict[str, Any] = {
        "noise": dict(zip(("position", "velocity"), setting.noise, strict=True)),
        "excitation": [excitation.form for excitation in setting.excitations],
        "machine": {k: float(v) for k, v in truth.drive._asdict().items() if v != DriveModel._field_defaults.get(k)},
    }
    severity, shrink = _gap(setting, truth, answer, measured, shown, commands)
    answer = replace(answer, severity=severity, shrink=shrink, notes=tell)
    return GeneratedMachine(answer, lambda folder: _write(folder, setting.nominal, commands, measured))


def _gap(
    setting: JointSetting,
    truth: JointTruth,
    answer: Answer,
    measured: np.ndarray,
    shown: np.ndarray,
    commands: np.ndarray,
) -> tuple[float, float | None]:
    """How severe the gap is, and the share of it (beyond noise) that the effects of the answer remove."""

    def distance(motion: np.ndarray) -> float:
        return float(np.sqrt(np.mean((motion - measured)[..., 1] ** 2)))

    first = measured[:, 0] * (1, 0)  # at rest, as the recording says
    before = distance(replay(setting.nominal, commands, first))
    floor = distance(shown)
    shrink = None
    if answer.effects and answer.case != "confusable":  # there is no gap to shrink
        after = distance(replay(truth.drive if not answer.unknown else _known_part(setting, answer), commands, first))
        shrink = (before - after) / (before - floor)
    return before / floor, shrink


def _known_part(setting: JointSetting, answer: Answer) -> DriveModel:
    """The joint that the effects of the answer make of the nominal one."""
    fields = {
        LIBRARY[name].parameters[key]: value
        for name, parameters in answer.effects.items()
        for key, value in parameters.items()
    }
    return setting.nominal._replace(**fields)


def continued(folder: Path, out: Path, answer: dict[str, Any], commands: np.ndarray, rng: np.random.Generator) -> None:
    """A recording of a machine once more, with episodes of these commands [E, T] (A) behind those that it has."""
    head = yaml.safe_load((folder / "recording.yaml").read_text())
    drive = DriveModel(**{**head["nominal"], **answer["notes"]["machine"]})
    noise = [answer["notes"]["noise"][name] for name in ("position", "velocity")]
    excitations = [Excitation("asked", played(command), 0.0) for command in commands]
    motion, _ = record(JointTruth(drive), excitations)
    measured = encoded(motion + rng.normal(size=motion.shape) * noise, drive.resolution)
    lines = (folder / "joint.csv").read_text().splitlines()
    last = int(lines[-1].partition(",")[0])
    out.mkdir(parents=True)
    (out / "recording.yaml").write_text((folder / "recording.yaml").read_text())
    (out / "joint.csv").write_text("\n".join([*lines, *_rows(commands, measured, last + 1)]) + "\n")


def asked(report: Path, folder: Path, answer: dict[str, Any]) -> np.ndarray:
    """The commands [E, T] (A) of a report's next_recording.csv."""
    table = np.genfromtxt(report / "next_recording.csv", delimiter=",", names=True)
    return np.stack([table["current"][table["episode"] == k] for k in np.unique(table["episode"])])


def at_random(folder: Path, answer: dict[str, Any], like: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Commands of this shape [E, T] (A) as a recording's are drawn, for the nominal joint."""
    nominal = DriveModel(**yaml.safe_load((folder / "recording.yaml").read_text())["nominal"])
    noise = tuple(answer["notes"]["noise"][name] for name in ("position", "velocity"))
    drawn = record(JointTruth(nominal), draw_excitation(nominal, noise, rng)[: len(like)], COARSE)[1]
    return drawn[:, : like.shape[1]]


def _write(folder: Path, nominal: DriveModel, commands: np.ndarray, measured: np.ndarray) -> None:
    believed = {name: float(getattr(nominal, name)) for name in MODELLED}
    head = {
        "format": "vision-s2r/recording/1",
        "kind": "joint",
        "sample_time": SAMPLE_TIME,
        "nominal": believed,
    }
    (folder / "recording.yaml").write_text(yaml.safe_dump(head, sort_keys=False))
    rows = ["episode,t,current,position,velocity", *_rows(commands, measured, 0)]
    (folder / "joint.csv").write_text("\n".join(rows) + "\n")


def _rows(commands: np.ndarray, measured: np.ndarray, first: int) -> list[str]:
    """Lines of joint.csv, episodes counted from `first`."""
    return [
        f"{episode},{k * SAMPLE_TIME:.6g},{u:.9g},{q:.9g},{v:.9g}"
        for episode, (currents, motion) in enumerate(zip(commands, measured, strict=True), first)
        for k, (u, (q, v)) in enumerate(zip(currents, motion, strict=True))
    ]
