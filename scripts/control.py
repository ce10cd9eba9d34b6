"""Control across the dynamics gap: `python scripts/control.py follow|ablate|adr [KEY=VALUE …]`.

follow: policies trained on the wrong simulator and on randomized ones, in reality; ablate: what each randomization is
worth; adr: ranges that adr by themselves. Keys: configs/control.yaml; sizes: control=full|small|debug.
"""

from collections.abc import Callable
from pathlib import Path

from vision_s2r.cli import choose, compose, log_to_terminal
from vision_s2r.control.ablate import ablate
from vision_s2r.control.adr import adr
from vision_s2r.control.config import ControlConfig
from vision_s2r.control.follow import follow


def task(experiment: Callable[[ControlConfig], Path]) -> Callable[[list[str]], None]:
    """The experiment on a configuration that these overrides make."""

    def run(overrides: list[str]) -> None:
        log_to_terminal()
        print(f"picture: {experiment(compose(ControlConfig, 'control', overrides))}")

    return run


if __name__ == "__main__":
    choose("experiment", {"follow": task(follow), "ablate": task(ablate), "adr": task(adr)})
