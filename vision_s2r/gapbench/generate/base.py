"""What a generated machine is: its answer, and how its recording is written.

A kind of recording is a module (`generate.joint`, `generate.camera`) with

    CASES: tuple[str, ...]                                        # the cases it can draw, of `CASES` below
    def machine(case: str, index: int, split: str, rng: np.random.Generator) -> Machine

`index` counts the machines of a case from 0, so that effects are taken in turn; `split` is one of `SPLITS`; all that is
random comes from `rng`. The unknown effects of the two splits are disjoint. What `generate.of_kind` asks of a kind
follows by name. A kind whose machines can do what a report asks for (`score.follow`) also has

    def asked(report: Path, folder: Path, answer: dict) -> np.ndarray  # what a report asks the recorded machine to do
    def at_random(folder: Path, answer: dict, like: np.ndarray, rng: np.random.Generator) -> np.ndarray  # as much
    def continued(folder: Path, out: Path, answer: dict, done: np.ndarray, rng: np.random.Generator) -> None
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

SPLITS = ("tuning", "reporting")

CASES = (
    "null",  # the simulator is right: nothing beyond measurement noise
    "dynamics",  # wrong values of modelled parameters, one or several, and nothing else
    "single",  # one effect, mild to severe
    "pair",  # two effects
    "whole_pair",  # arms: two effects that all joints feel
    "triple",  # three effects
    "unknown",  # an effect outside the library, and nothing else
    "known_unknown",  # one effect of the library beside one outside it
    "weak",  # one effect too weak to matter
    "all_nominal",  # every modelled parameter 5 to 25 % off, and one effect
    "left_out",  # one effect of the library, which the diagnosis is told to forget
    "content",  # two sets of pictures: the camera is right, and what lies before it is not what is rendered
    "confusable",  # one effect that its recording hardly shows, or that another imitates there; another recording tells
    "sensor",  # cameras: flat fields of a sensor that is not ideal; shot noise, and read noise where it shows
)

Effects = dict[str, dict[str, float]]  # effect -> parameter -> value, as a report names them


@dataclass(frozen=True)
class Answer:
    """What is true of one machine, in the vocabulary of recordings and reports.

    `effects` must be named; `optional` may be (parameters within 3 % of nominal, effects too weak to matter, values of
    a degenerate description). `equivalents` are sets of effects that predict the same as `effects`: no error, only
    no exact answer either. `where` lists the axes of a report's `where`, or places on them (AXIS: AT), of which the
    leading one is right; empty: the machine does not define one. `shrink` is the gap that the true effects remove, by
    the generator's own simulation, in the sense of a report's `gap.shrink`; None where there is no gap. Values in
    `effects` that are arbitrary by a symmetry (an angle at zero strength) are left out.
    """

    case: str
    effects: Effects = field(default_factory=dict)
    optional: Effects = field(default_factory=dict)
    equivalents: list[list[str]] = field(default_factory=list)
    unknown: str | None = None
    withhold: str | None = None
    where: list[str] = field(default_factory=list)
    shrink: float | None = None
    parts: dict[str, dict[str, Any]] = field(default_factory=dict)  # of a robot: their answers, by folder
    group: str = ""  # of machines that are told apart in the table, a servo's rate
    severity: float | None = None  # size of the gap in units of measurement noise
    notes: dict[str, Any] = field(default_factory=dict)  # noise levels, excitations …: for people, not scored

    def to_dict(self) -> dict[str, Any]:
        """The answer as JSON has it."""
        return asdict(self)


@dataclass(frozen=True)
class GeneratedMachine:
    """One machine: the truth, and a function that writes its recording into a folder that exists and is empty."""

    answer: Answer
    write: Callable[[Path], None]


class Redraw(Exception):  # noqa: N818  (a signal, no error)
    """What was drawn does not make a machine of its case: draw again."""


def drawn(draw: Callable[[], GeneratedMachine], what: str, draws: int = 200) -> GeneratedMachine:
    """What `draw` makes, again while it raises `Redraw`; RuntimeError, naming `what`, after so many draws."""
    for _ in range(draws):
        try:
            return draw()
        except Redraw:
            continue
    raise RuntimeError(f"no {what} in {draws} draws")
