"""The diagnosis of what is one case: a joint, a camera, tosses."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeAlias

from vision_s2r.diagnose.assess import Assessor
from vision_s2r.diagnose.common_light import with_common_light
from vision_s2r.diagnose.config import DiagnoseConfig, SearchConfig
from vision_s2r.diagnose.guesses import HARDLY, is_known
from vision_s2r.diagnose.quick import part_of, quickly
from vision_s2r.diagnose.report import OPEN, report
from vision_s2r.diagnose.saved import SavedDiagnosis
from vision_s2r.diagnose.search import Found, Search
from vision_s2r.diagnose.settle import settle
from vision_s2r.diagnose.settled import Settled
from vision_s2r.diagnose.simulator import BETTER, simulator_of
from vision_s2r.effects import E
from vision_s2r.errors import UserError, nearest
from vision_s2r.fit.case import NOMINAL, Case, Names
from vision_s2r.lazy import load
from vision_s2r.recording import CameraRecording, ContactRecording, JointRecording
from vision_s2r.report import figures
from vision_s2r.report.drawing import Figures
from vision_s2r.report.reading import library

LIKELIEST = 3  # sets of effects, that free runs are asked about where nothing has a name
NEXT_TO_NOTHING = 0.1  # of the squared error that is left without a name
OfOneCase: TypeAlias = JointRecording | CameraRecording | ContactRecording  # an arm is of several


@dataclass(frozen=True, kw_only=True)
class Diagnosis(SavedDiagnosis):
    """A report that knows what it was made from."""

    recording: OfOneCase = field(repr=False)
    case: Case = field(repr=False)
    settled: Settled = field(repr=False)

    @property
    def patched(self) -> bool:
        """Whether the simulator has anything that it had not."""
        return bool(self.settled.simulator.names)

    def plot(self) -> Figures:
        """Figures by caption: what it looks like, and where the gap lies before and after."""
        simulator = self.settled.simulator
        with self.case.session():
            before, after = (self.case.samples(each) for each in (NOMINAL, simulator.hypothesis))
        return figures(self.recording, simulator.hypothesis.values, before, after, self.case.unit)


def diagnose_one(recording: OfOneCase, cfg: DiagnoseConfig, jobs: int = 1, opened: Case | None = None) -> Diagnosis:
    """Diagnose a recording with `jobs` threads; `opened` is its case, where there is one. UserError as `diagnose`."""
    recording = part_of(recording) if cfg.quick else recording
    case: Any = opened or open_case(recording, cfg.withhold, jobs)
    limits = _limits(recording, cfg)
    limits = quickly(limits) if cfg.quick else limits
    assessor = Assessor(case, limits, jobs, cfg.seed)
    with case.session():
        search = Search(case, assessor)
        found = search.run()
        if isinstance(recording, JointRecording) and (quieter := case.quieter(found.final.hypothesis)):
            case, assessor = quieter, Assessor(quieter, limits, jobs, cfg.seed)
            search = Search(case, assessor)
            found = search.run()
        settled = _settled(case, assessor, search, found)
        if isinstance(recording, CameraRecording) and recording.pairing == "paired":
            settled = with_common_light(case, assessor, settled)
            settled = settled.at(case.finer(settled.simulator.hypothesis))
        written, experiment = report(case, assessor, settled, cfg.bounds)
    written |= {"quick": True} if cfg.quick else {}
    if isinstance(recording, JointRecording):
        written |= {"held_out": _held_out(recording, case, assessor, settled), "left_out": recording.left_out}
        if written["verdict"] in OPEN:
            ends = settled.simulator.hypothesis, settled.found.final.hypothesis
            written["unexplained"]["resembles"] += case.symptoms(*ends)
    if isinstance(recording, CameraRecording):
        with case.session():
            written |= _of_pictures(recording, case, settled, written["verdict"] in OPEN)
    if isinstance(recording, CameraRecording) and recording.label_names:
        written |= {"effects": _by_name(written["effects"], recording.label_names)}
    if isinstance(recording, CameraRecording) and cfg.sensitivity:
        written |= {"policy": load("vision_s2r.diagnose.worth:worth")(written["effects"], cfg.sensitivity, cfg.policy)}
    return Diagnosis.of(written, recording=recording, experiment=experiment, case=case, settled=settled)


def _limits(recording: OfOneCase, cfg: DiagnoseConfig) -> SearchConfig:
    """The search for what such a recording shows."""
    if isinstance(recording, CameraRecording):
        return cfg.unpaired if recording.pairing == "unpaired" else cfg.camera
    return cfg.contact if isinstance(recording, ContactRecording) else cfg.joint


def _settled(case: Case, assessor: Assessor, search: Search, found: Found) -> Settled:
    """The search's end settled; and gone on with where something is left.

    Beside guesses, where the simulator leaves nothing, or next to nothing, but has no name for why: what free runs are
    better with stays in it unnamed, and the search had missed it then. Else where nothing has a name: the unknown may
    be no function, or only in part.
    """
    settled = settle(case, assessor, found)
    if not settled.found.is_open:
        return settled
    if case.guessed:
        unnamed = settled.simulator.names - settled.found.effects - case.refitted
        more = search.resumed(settled.simulator.assessment, bool(unnamed) and settled.gap.left <= HARDLY)
        named = settle(case, assessor, more) if more else settled
        return named if named.simulator.left * BETTER**2 <= settled.simulator.left else settled
    if _nameless(case, settled) and search.disturbances:
        return _beside_more(case, assessor, search, found, settled)
    return settled


def _beside_more(case: Case, assessor: Assessor, search: Search, found: Found, settled: Settled) -> Settled:
    """With names that show beside an unknown of which functions do a part; as it is where none does.

    What one try comes upon, and loses again, is doubted in the next.
    """
    doubted = Names()
    for disturbance in search.disturbances:
        if more := search.beside_more(found, disturbance, doubted):
            end = settle(case, assessor, more)
            if not _nameless(case, end):
                return end
            doubted |= more.effects
    return by_free_runs(case, assessor, search, settled)


def by_free_runs(case: Case, assessor: Assessor, search: Search, settled: Settled) -> Settled:
    """With effects that leave next to nothing of what free runs leave without a name; as it is where none do.

    What a real machine does otherwise is often no function of what is measured: then no likelihood beside one tells.
    """
    most = NEXT_TO_NOTHING * settled.simulator.left
    sets = [each for each in search.plain(LIKELIEST) if _left(case, assessor, each) <= most]
    ends = [settle(case, assessor, each) for each in sets]
    named = [each for each in ends if each.simulator.left <= most and not _nameless(case, each)]
    named = [each for each in named if all(is_known(case, each.found.final, name) for name in each.found.effects)]
    return min(named, key=lambda each: each.simulator.left, default=settled)


def _left(case: Case, assessor: Assessor, found: Found) -> float:
    """The mean of the squared error of free runs under all that a search ended with."""
    return simulator_of(case, assessor, found.final, found.final.names).left


def _nameless(case: Case, settled: Settled) -> bool:
    return settled.found.effects <= frozenset(case.certain)


def _of_pictures(recording: CameraRecording, case: Any, settled: Settled, left: bool) -> dict[str, Any]:
    """What a camera's report says beside effects: how light differs between frames; what may be contents."""
    simulator = settled.simulator.hypothesis
    if recording.pairing == "paired":
        return {"light": case.light(simulator)}
    return {"contents": case.contents(simulator, settled.found.effects & simulator.values.keys(), left)}


def _by_name(effects: Sequence[dict[str, Any]], names: Mapping[int, str]) -> list[dict[str, Any]]:
    """Effects with what the recording calls their labels."""
    return [each | ({"label_name": names[each["label"]]} if each.get("label") in names else {}) for each in effects]


def _held_out(recording: JointRecording, case: Any, assessor: Assessor, settled: Settled) -> dict[str, Any]:
    """What a replay of this very recording needs to see it as the report did: held out."""
    rows = case.rows(range(case.segments))
    fold = {segment: k for k, held in enumerate(assessor.folds) for segment in held}
    return {
        "recording": load("vision_s2r.fit.joint.free_run:fingerprint")(recording),
        "segments": [[recording.episodes[e], first, end, fold[k]] for k, (e, first, end) in enumerate(rows)],
        "folds": [each.values for each in settled.simulator.folds],
    }


def open_case(recording: OfOneCase, withhold: Collection[str] = (), jobs: int = 1) -> Case:
    """A recording beside its simulator, which does not know the withheld effects; no other kind is imported.

    `jobs`: threads that a first look at a joint may take.
    """
    if isinstance(recording, JointRecording):
        opened = partial(load("vision_s2r.fit.joint.case:JointCase"), jobs=jobs)
    elif isinstance(recording, ContactRecording):
        opened = load("vision_s2r.fit.contact.case:ContactCase")
    else:
        place = "unpaired.case:UnpairedCase" if recording.pairing == "unpaired" else "camera.case:CameraCase"
        opened = load(f"vision_s2r.fit.{place}").open
    case: Case = opened(recording, _library(library(recording.kind), withhold))
    return case


def _library(effects: Iterable[E], withhold: Collection[str]) -> dict[str, E]:
    library = {effect.name: effect for effect in effects}
    for name in withhold:
        if name not in library:
            raise UserError(f"withhold: no effect is called '{name}': {nearest(name, library)}")
    return {name: effect for name, effect in library.items() if name not in withhold}
