"""What an identification found."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.fit.case import Hypothesis, Values
from vision_s2r.fit.gap import Gap
from vision_s2r.fit.joint.case import JointCase
from vision_s2r.identify import result
from vision_s2r.identify.estimate import ParameterEstimates
from vision_s2r.identify.identifiable import Reason
from vision_s2r.joint import JOINT_EFFECTS
from vision_s2r.randomize import Posterior
from vision_s2r.recording import JointRecording
from vision_s2r.report.drawing import Figures


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
        return result.content(self)

    def summary(self) -> str:
        """A table of the parameters, and a few sentences."""
        return result.words_of(self.to_dict())

    def plot(self) -> Figures:
        """Figures by caption: what it looks like, where the gap lies, and how parameters are tied to each other."""
        return result.figures_of(self)

    def save(self, folder: Path | str) -> Path:
        """Write everything into a folder; returns the path of identified.json. Raises UserError as `write`."""
        return result.write_all(self, Path(folder))

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.summary())}</pre>{self.plot()._repr_html_()}"


def nominal_of(recording: JointRecording, held: Mapping[str, float]) -> Hypothesis:
    """The simulator as it came, in terms of a case that knows what is held."""
    return Hypothesis({name: {"value": recording.nominal[name]} for name in held})
