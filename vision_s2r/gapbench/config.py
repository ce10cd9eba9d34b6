"""What a benchmark draws and how it is scored."""

from dataclasses import dataclass

from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError, nearest
from vision_s2r.gapbench.generate.base import CASES, SPLITS
from vision_s2r.options import option, validate
from vision_s2r.parallel import backend_option

STAGES = ("generate", "score", "all", "follow")
ARMS = ("chains", "public", "all")
KINDS = ("joint", "camera", "contact", "arm", "appearance", "servo", "robot", "unpaired")
COUNTS = {
    "null": 20,
    "dynamics": 18,
    "single": 34,
    "pair": 22,
    "whole_pair": 6,
    "triple": 11,
    "unknown": 20,
    "known_unknown": 11,
    "weak": 17,
    "all_nominal": 11,
    "left_out": 17,
    "content": 10,
    "confusable": 0,
    "sensor": 10,
}


@dataclass
class GapbenchConfig:
    """Everything that `vision-s2r gapbench` reads: machines with withheld answers, and the score of their diagnoses."""

    stage: str = option(
        "all",
        "generate (draw and write the recordings), score (diagnose each, then open the answers and score), all (both), "
        "or follow (kind=joint, camera, contact: make the recording that each unsettled diagnosis asks for, beside a "
        "random one, and diagnose again).",
        choices=STAGES,
    )
    kind: str = option("joint", "Of machine.", choices=KINDS)
    set: str = option(
        "tuning",
        "tuning (to develop on) or reporting (other machines and other unknown effects: run once, for the published "
        "table).",
        choices=SPLITS,
    )
    seed: int = option(0, "Of the machines.", low=0)
    counts: dict[str, int] = option(
        COUNTS,
        "How many machines of each case; a case that the kind does not have is passed over, effects are taken in turn.",
        low=0,
    )
    arms: str = option(
        "all",
        "kind=arm: chains (drawn, of two or three links), public (of two to seven joints, from URDFs that PyBullet "
        "ships), or all (as many of both).",
        choices=ARMS,
    )
    rate: float = option(100.0, "kind=arm: of the logs, Hz; the servos run at 10 kHz or more.", low=5, high=1000)
    jobs: int = option(2, "How many processes at a time.", low=1)
    backend: str = backend_option()
    limit: int = option(0, "How many of the recordings to score, from the first; 0: all.", low=0)
    timeout: float = option(300.0, "Seconds after which a diagnosis is stopped and counts as failed.", above=0)
    out: str = option(
        "outputs/gapbench",
        "Folder of recordings/, commitments.json, answers.json, reports/, results.json, table.md, table.json, *.png.",
    )
    diagnose: list[str] = option(
        [],
        "The command that diagnoses; recording=, out= and withhold= are appended. Empty: `vision-s2r diagnose`.",
    )


def check(cfg: GapbenchConfig) -> None:
    """Raise UserError for a value that is out of range."""
    validate(cfg)
    for case in cfg.counts:
        if case not in CASES:
            raise UserError(f"gapbench: no case '{case}' in counts; {nearest(case, CASES)}")


ConfigStore.instance().store("gapbench_schema", node=GapbenchConfig)
