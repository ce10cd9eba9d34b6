"""Ways from real pictures to grasps, by name: what a method is given, and what it gives back."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path

from vision_s2r.config import Config
from vision_s2r.errors import UserError, nearest
from vision_s2r.render.seen import Recorded
from vision_s2r.training import Inputs

GROUP = "vision_s2r.methods"  # of entry points: modules that register methods of other packages


@dataclass(frozen=True)
class MethodInputs:
    """What every method may learn from, all of it of the same scenes."""

    pairs: Inputs  # randomized and canonical pictures, without grasps
    labelled: Inputs  # the same with labelled grasps
    recorded: Recorded  # real pictures of other scenes, with the outcome of the grasps tried there
    policy: str  # the checkpoint of this seed's canonical policy


Released = Mapping[str, Path]  # by row of the transfer table: the checkpoint of its policy or of its translator
Train = Callable[[Config, MethodInputs, Path, int], Released]


class Methods:
    """Methods in the order of registration."""

    def __init__(self) -> None:
        self._methods: dict[str, Train] = {}

    def register(self, name: str) -> Callable[[Train], Train]:
        """Decorator of `train(cfg, inputs, out, seed)`, which trains in the folder `out`, or goes on there."""

        def decorate(train: Train) -> Train:
            if name in self._methods:
                raise ValueError(f"method '{name}' is registered twice")
            self._methods[name] = train
            return train

        return decorate

    def load_installed(self) -> None:
        """Import what other packages install, which registers it."""
        for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
            entry.load()

    def select(self, names: Iterable[str], where: str) -> dict[str, Train]:
        """Those of these names, all of them if there are none; UserError, which begins with `where`, for an unknown."""
        chosen = list(names) or list(self._methods)
        for name in chosen:
            if name not in self._methods:
                raise UserError(f"{where}: no method is called '{name}', {nearest(name, self._methods)}")
        return {name: self._methods[name] for name in chosen}

    def __iter__(self) -> Iterator[str]:
        return iter(self._methods)


METHODS = Methods()
