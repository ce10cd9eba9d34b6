"""What an identification found, and leaves behind: a JSON to go on with, pictures, a posterior, a patch.

`identified.json` holds `format`, `kind`, `method` (forward or inverse), and

effects         what to change in the simulator, as in a report: `name`, `source`, `parameters` with `value`, `unit` and
                `ci` (95 %); `nominal` where it replaces a nominal value, `held` where that was said to be known
unidentified    `name` and `why`: what the recording cannot identify; it stays as it was
doubtful        `name` and `why`: identified, but tied to another, or at the end of its range
correlation     `parameters` [K] and their `matrix` [K, K]
offsets         of each recording after the first of several: how much more its `bias_torque` and, where that was asked
                for, its `position_offset` are, and `ci`
gap             as in a report, held out; `refitted` is after the nominal parameters alone
torque_error    of the inverse method: relative, `before` and `after`
validation      the same on another recording, where one is given; `position_rmse` and `velocity_rmse` of a free run
next_experiment what to record to identify the rest; may be empty
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.files import write
from vision_s2r.fit.case import Hypothesis, Values
from vision_s2r.fit.gap import Gap
from vision_s2r.fit.joint.case import JointCase
from vision_s2r.identify.drawing import correlations
from vision_s2r.identify.estimate import ParameterEstimates, title
from vision_s2r.identify.identifiable import Reason
from vision_s2r.identify.words import words_of
from vision_s2r.joint import DYNAMICS, JOINT_EFFECTS, NominalJoint
from vision_s2r.patch.patch import write_patch
from vision_s2r.randomize import Posterior
from vision_s2r.recording import JointRecording
from vision_s2r.report import figures
from vision_s2r.report.drawing import Figures, png

FORMAT = "vision-s2r/identified/1"
PICTURES = ("before_after.png", "where.png")
CORRELATIONS = "How parameters are tied to each other: their correlations"


@dataclass(frozen=True)
class Identified:
    """The parameters of a joint, and what they are worth."""

    recording: JointRecording
    case: JointCase
    method: str  # forward | inverse
    estimate: ParameterEstimates
    held: dict[str, float]  # nominal parameters that were said to be known
    left: dict[str, Reason]  # effects that the recording cannot identify; they stay as they were
    doubts: dict[str, Reason]  # effects that were identified, but should not be trusted
    gap: Gap  # on stretches that no fit has seen
    errors: dict[str, dict[str, float]] = field(default_factory=dict)  # of the recording itself, besides
    validation: dict[str, Any] = field(default_factory=dict)  # of another recording

    @property
    def values(self) -> Values:
        """What to change in the simulator: nominal parameters that are known or identified, and effects."""
        known = {name: {"value": value} for name, value in self.held.items()}
        return {**known, **self.estimate.hypothesis.values}

    @property
    def before(self) -> Hypothesis:
        """The simulator as it came, in terms of the case, which knows what is held."""
        return nominal_of(self.recording, self.held)

    @property
    def posterior(self) -> Posterior:
        """What the recording leaves open, to randomize over; what is held or lies on a grid stays."""
        parameters = [(name, key) for name, given in self.values.items() for key in given]
        at = [parameters.index(label) for label in self.estimate.labels]
        size = [
            value if JOINT_EFFECTS[effect].parameter(key).scale == "log" else 1.0
            for (effect, key), value in zip(self.estimate.labels, self.estimate.values, strict=True)
        ]
        covariance = np.zeros((len(parameters), len(parameters)))
        covariance[np.ix_(at, at)] = self.estimate.covariance / np.outer(size, size)
        return Posterior(JOINT_EFFECTS, self.values, covariance)

    def to_dict(self) -> dict[str, Any]:
        """What identified.json holds."""
        return _content(self)

    def summary(self) -> str:
        """A table of the parameters, and a few sentences."""
        return words_of(self.to_dict())

    def plot(self) -> Figures:
        """Figures by caption: what it looks like, where the gap lies, and how parameters are tied to each other."""
        return _figures(self)

    def save(self, folder: Path | str) -> Path:
        """Write everything into a folder; returns the path of identified.json. Raises UserError as `write`."""
        return _written(self, Path(folder))

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.summary())}</pre>{self.plot()._repr_html_()}"


def nominal_of(recording: JointRecording, held: Mapping[str, float]) -> Hypothesis:
    """The simulator as it came, in terms of a case that knows what is held."""
    return Hypothesis({name: {"value": recording.nominal[name]} for name in held})


def _content(found: Identified) -> dict[str, Any]:
    """What identified.json holds."""
    curable = {name for name, reason in {**found.left, **found.doubts}.items() if reason.curable}
    return {
        "format": FORMAT,
        "kind": "joint",
        "method": found.method,
        "effects": [
            _effect(found, name) for name in sorted(found.values, key=lambda name: (name not in DYNAMICS, name))
        ],
        "unidentified": [{"name": name, "why": reason.why} for name, reason in found.left.items()],
        "doubtful": [{"name": name, "why": reason.why} for name, reason in found.doubts.items()],
        "correlation": {
            "parameters": [title(label) for label in found.estimate.labels],
            "matrix": found.estimate.correlation.tolist(),
        },
        "gap": _gap(found),
        "intervals_of": "another motion" if found.estimate.elsewhere else "this recording",
        **found.errors,
        **({"offsets": offsets} if (offsets := _offsets(found)) else {}),
        **({"validation": found.validation} if found.validation else {}),
        "next_experiment": found.case.experiment([], sorted(curable)).sentence,
    }


def _offsets(found: Identified) -> list[dict[str, Any]]:
    names, rows = found.estimate.offsets.keys(), zip(*found.estimate.offsets.values(), strict=True)
    return [
        {"recording": k}
        | {name: {"value": value, "ci": [low, high]} for name, (value, low, high) in zip(names, row, strict=True)}
        for k, row in enumerate(rows, 1)
    ]


def _figures(found: Identified) -> Figures:
    """The figures of a diagnosis, and the correlations of what was identified."""
    before, after = (found.case.samples(each) for each in (found.before, found.estimate.hypothesis))
    drawn = figures(found.recording, found.values, before, after, found.case.unit)
    labels = [title(label) for label in found.estimate.labels]
    drawn[CORRELATIONS] = correlations(labels, found.estimate.correlation)
    return drawn


def _written(found: Identified, out: Path) -> Path:
    """Write everything into a folder; returns the path of identified.json."""
    drawn, result = _figures(found), _content(found)
    write(out / "correlation.png", png(drawn.pop(CORRELATIONS)))
    for name, picture in zip(PICTURES, drawn.values(), strict=False):
        write(out / name, png(picture))
    found.posterior.write(out / "posterior.yaml")
    write_patch(result, found.recording, out / "patch")
    return write(out / "identified.json", json.dumps(result, indent=1, allow_nan=False))


def _effect(found: Identified, name: str) -> dict[str, Any]:
    effect = JOINT_EFFECTS[name]
    given = effect.check(found.values[name])
    parameters: dict[str, dict[str, Any]] = {}
    for parameter in effect.parameters:
        if parameter.optional and given[parameter.name] == parameter.neutral:
            continue
        value = float(given[parameter.name])
        low, high = (value, value) if name in found.held else found.estimate.intervals[name][parameter.name]
        parameters[parameter.name] = {"value": value, "unit": found.case.unit_of(parameter), "ci": [low, high]}
        if name in DYNAMICS:
            parameters[parameter.name]["nominal"] = getattr(NominalJoint(**found.recording.nominal), name)
        if name in found.held:
            parameters[parameter.name]["held"] = True
    return {"name": name, "source": effect.source, "parameters": parameters}


def _gap(found: Identified) -> dict[str, Any]:
    gap = found.gap
    shrink = gap.shrink(gap.after)
    levels = {key: float(np.sqrt(getattr(gap, key).mean())) for key in ("before", "refitted", "after", "floor")}
    return {
        "metric": found.case.metric,
        "unit": found.case.unit,
        "described": found.case.described,
        **levels,
        "shrink": shrink.value,
        "shrink_ci": list(shrink.ci),
    }
