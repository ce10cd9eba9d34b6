"""What `vision-s2r reliability` does, and how often."""

from dataclasses import dataclass

from hydra.core.config_store import ConfigStore

from vision_s2r.options import option

CHECKS = ("fuzz", "kill", "full", "memory")


@dataclass
class ReliabilityConfig:
    """Everything that `vision-s2r reliability` reads."""

    checks: list[str] = option(
        ["fuzz", "kill"],
        "fuzz: spoilt inputs of every reader; kill: SIGKILL at random moments; full: disks that run full (by root); "
        "memory: what long rendering holds.",
        choices=CHECKS,
        unique=True,
    )
    inputs: int = option(1000, "Spoilt inputs a reader; one that takes long gets a part of them.", low=1)
    readers: list[str] = option([], "Those to try, by name; empty: all.")
    times: int = option(5, "How often each command is killed, or fills its disk.", low=1)
    commands: list[str] = option([], "Those to try, by name; empty: all.")
    renders: int = option(20_000, "After which the memory is looked at.", low=2000)
    seed: int = option(0, "Of inputs and moments.", low=0)
    out: str = option("outputs/reliability", "Folder of what is found; the same command goes on there.")


ConfigStore.instance().store("reliability_schema", node=ReliabilityConfig)
