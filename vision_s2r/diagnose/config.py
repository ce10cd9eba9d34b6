"""The configuration of a diagnosis."""

from dataclasses import dataclass, replace
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.fit.gap import ADEQUATE
from vision_s2r.options import option, validate
from vision_s2r.parallel import backend_option
from vision_s2r.recording.folders import folders


@dataclass
class SearchConfig:
    """When an effect is worth a name, and how far the search goes."""

    evidence: float = option(8.0, "Nats of held-out log-likelihood that an effect must bring.", low=0)
    local: float = option(
        10.0, "… or, where the floor is reached, so many, wherever in the recording they come from.", low=0
    )
    slightest: float = option(
        0.0,
        "… and there it must lower the mean squared residual by more than this, in units of the noise's variance: long "
        "recordings bring nats for what no noise would show.",
        low=0,
    )
    confidence: float = option(
        0.999, "At which the former must be above zero, by bootstrap over blocks.", low=0.5, below=1
    )
    relief: float = option(
        0.03,
        "By how much an effect must lower the mean squared residual, in units of the noise's variance …",
        low=0,
    )
    share: float = option(0.03, "… and by which share of what there is over the floor.", low=0)
    faint: float = option(
        0.0,
        "An effect that, added last, lowers that residual by no more than this has no name, be it sure; of a joint of "
        "an arm, whose load is another engine's and in part measured, no more than `relief`.",
        low=0,
    )
    mostly: float = option(
        0.0,
        "Where something is left, an effect must leave no more than this share of what is left without it, nothing "
        "unknown beside it. 0: that is not asked.",
        low=0,
        high=1,
    )
    promising: float = option(
        20.0,
        "Nats that one more effect, or something unknown, must seem to gain, to be tried where the floor is reached "
        "already.",
        low=0,
    )
    adequate: float = option(
        ADEQUATE, "A mean squared residual that exceeds the noise's by no more than this is at the floor.", low=0
    )
    tolerance: float = option(
        0.05,
        "… and beside an effect whose form is only roughly known (how hard is the contact in a backlash?) a rest is "
        "explained up to this share of what the nominal simulator leaves.",
        low=0,
    )
    most: int = option(5, "Effects named at most.", low=1)
    folds: int = option(5, "Parts that the segments are held out in.", low=2)
    beam: int = option(3, "Sets of each size that are grown further.", low=1)
    breadth: int = option(
        12, "Effects tried on the best of them, the most promising by the screen; half as many on the second …", low=1
    )
    contenders: int = option(4, "Grown sets that are held out.", low=1)
    hidden: bool = option(
        True, "Whether effects that only show in pairs are looked for where the floor is reached already."
    )
    unknowns: bool = option(False, "Whether something unknown is looked for there, too.")
    known: bool = option(
        False,
        "Whether effects are looked for beside something unknown, too; they keep their names where nothing is left.",
    )
    plain: bool = option(
        False,
        "Whether an effect that shows plainly (so many nats, the interval above zero; where the floor is not reached "
        "without it, a fifth of what is left) keeps its name however little of the gap it is.",
    )
    beside: bool = option(
        False,
        "Whether effects that do what an unknown cannot keep their names beside it: where it is fitted to what they "
        "leave, so that it changes none of their parameters.",
    )


OF_PICTURES = SearchConfig(folds=2, beam=1, breadth=4, contenders=2, hidden=False, beside=True, known=True)


@dataclass
class DiagnoseConfig:
    """Everything that `vision-s2r diagnose` reads."""

    recording: Any = option(None, "The recording's folder, or several: recording=[DIR,DIR].")
    together: bool = option(
        False,
        "Of several recordings of one joint, or of one arm: one report, of what holds in all. What slow motion alone "
        "shows, and what fast motion alone does, then has one simulator.",
    )
    out: str = option("outputs/diagnosis", "Folder of the report; of several recordings, each gets a folder in it.")
    jobs: int = option(2, "Processes for several recordings, threads for one report.", low=1)
    backend: str = backend_option()
    seed: int = option(0, "Of the bootstrap; the same seed gives the same report, whatever the number of jobs.", low=0)
    quick: bool = option(
        False,
        "An answer in about a third of the time, from a third of the recording: of each size only the most promising "
        "sets of effects are tried, and none that shows in pairs alone. Report and summary say that it was quick.",
    )
    bounds: bool = option(
        False,
        "Whether to say of each effect without a name how large it could still be. Takes about as long again; not of "
        "arms.",
    )
    withhold: list[str] = option([], "Effects that the diagnosis is to know nothing of, by name.")
    sensitivity: str = option(
        "",
        "Of a camera: sensitivity.json, as vision-s2r sensitivity writes it. The report then says which of the effects "
        "found is worth mending for a policy. Empty: it does not.",
    )
    policy: str = option("", "The row of these curves; empty: the first.")
    joint: SearchConfig = option(SearchConfig(known=True, slightest=0.004), "The search for what a joint has.")
    camera: SearchConfig = option(
        OF_PICTURES,
        "The search for what a camera has.",
    )
    unpaired: SearchConfig = option(
        replace(OF_PICTURES, relief=0.02, promising=8.0, mostly=0.1),
        "… and where no picture of it shows a scene of the simulator's.",
    )
    contact: SearchConfig = option(
        SearchConfig(beam=2, breadth=5, contenders=3, most=4, unknowns=True, plain=True),
        "The search for what a body on its support has.",
    )


def check(cfg: DiagnoseConfig) -> None:
    """UserError unless every value can be."""
    validate(cfg)
    folders(cfg.recording)


ConfigStore.instance().store("diagnose_schema", node=DiagnoseConfig)
