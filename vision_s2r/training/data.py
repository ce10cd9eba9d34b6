"""What a run reads, and which of it each step and process gets.

The data of a step is a function of (seed, step, rank) alone, so a run resumes exactly. The ranks' parts of a
step together are the batch that a single process would get: more processes change the speed, not the result.
"""

from collections.abc import Iterable, Set
from functools import lru_cache
from itertools import permutations
from typing import Protocol

import numpy as np
import torch

from vision_s2r.errors import UserError, nearest

CHUNK = 1024  # scenes at a time on their way to a device
ORDERS = torch.tensor(list(permutations(range(3))))  # of red, green and blue


class ViewSource(Protocol):
    """Paired views of rendered scenes, as `vision_s2r.render.Views` reads them from disk."""

    @property
    def size(self) -> int:
        """Height and width of the canonical picture, pixels."""

    @property
    def source_size(self) -> int:
        """The same of randomized and real pictures, without their margin."""

    @property
    def margin(self) -> int:
        """Pixels of theirs by which randomized and real pictures are wider on each side."""

    @property
    def names(self) -> Set[str]:
        """Tensors there are."""

    def __len__(self) -> int:
        """Number of scenes."""

    def batch(self, name: str, indices: torch.Tensor) -> torch.Tensor:
        """Tensor `name` of the scenes `indices` (int64 [B], on the CPU): [B, ...]."""


class Resident:
    """Views whose tensors lie on a device whole, each from when it is first asked for: no step waits for a disk."""

    def __init__(self, views: ViewSource, device: torch.device) -> None:
        self.size, self.source_size, self.margin = views.size, views.source_size, views.margin
        self.names = views.names
        self._views, self._device, self._there = views, device, dict[str, torch.Tensor]()

    def __len__(self) -> int:
        return len(self._views)

    def batch(self, name: str, indices: torch.Tensor) -> torch.Tensor:
        """As ViewSource has it, on the device."""
        if name not in self._there:
            self._there[name] = self._brought(name)
        return self._there[name][indices.to(self._device)]

    def _brought(self, name: str) -> torch.Tensor:
        """The whole tensor on the device, which never holds it twice."""
        one = self._views.batch(name, torch.arange(1))
        whole = torch.empty((len(self), *one.shape[1:]), dtype=one.dtype, device=self._device)
        for part in torch.arange(len(self)).split(CHUNK):
            whole[part[0] : part[-1] + 1] = self._views.batch(name, part)
        return whole


def require(part: str, views: ViewSource, names: Iterable[str]) -> None:
    """Raises UserError, with the nearest name, where views lack a tensor; `part` (training …) says which they are."""
    for name in names:
        if name not in views.names:
            raise UserError(f"{part} views hold no '{name}': {nearest(name, views.names)}")


def require_alike(views: ViewSource, validation: ViewSource, sources: bool = True) -> None:
    """Raises UserError unless pictures to train and to validate on have the same sizes, `sources` those of both."""
    for key in ("size", "source_size", "margin")[: 3 if sources else 1]:
        found = getattr(views, key), getattr(validation, key)
        if found[0] != found[1]:
            raise UserError(
                f"training and validation views differ in {key}, {found[0]} and {found[1]} px: expected one"
            )


def generator(*key: int) -> torch.Generator:
    """A CPU generator that is a function of the whole numbers `key` (0 or more) alone."""
    state = int(np.random.SeedSequence(key).generate_state(1, np.uint64)[0])
    return torch.Generator().manual_seed(state)


# First words of the keys of `generator`: streams that never meet.
ORDER, DRAW, STEP, VALIDATION, PROBE, RECORDED = range(6)


@lru_cache(maxsize=4)
def _order(seed: int, epoch: int, length: int) -> torch.Tensor:
    """int64 [length]: the order of the scenes in an epoch."""
    return torch.randperm(length, generator=generator(ORDER, seed, epoch))


class Draw:
    """What chance gives a rank's samples of one step, as the rank's slice of what it gives the whole batch.

    `indices`: int64 [B], scenes of this rank's part; a scene comes once an epoch, in a new order each time.
    """

    def __init__(self, seed: int, step: int, length: int, batch_size: int, rank: int = 0, world: int = 1):
        """`length` scenes, of which a step takes `batch_size` over all `world` ranks."""
        self._generator = generator(DRAW, seed, step)
        self._batch_size = batch_size
        part = batch_size // world
        self._slice = slice(rank * part, (rank + 1) * part)
        positions = range(step * batch_size, (step + 1) * batch_size)[self._slice]
        self.indices = torch.stack([_order(seed, p // length, length)[p % length] for p in positions])

    def integers(self, high: int) -> torch.Tensor:
        """int64 [B] in [0, high): for instance which of a scene's pictures or grasps to take."""
        return torch.randint(high, (self._batch_size,), generator=self._generator)[self._slice]

    def uniform(self, *shape: int) -> torch.Tensor:
        """float32 [B, *shape] in [0, 1)."""
        return torch.rand(self._batch_size, *shape, generator=self._generator)[self._slice]


def randomized(views: ViewSource, draw: Draw, shuffle_colours: bool) -> torch.Tensor:
    """A randomized picture of each scene of a step, uint8 [B, S, S, 3].

    With `shuffle_colours` red, green and blue change places, in each picture by a draw of its own.
    """
    pictures = views.batch("randomized", draw.indices)
    which = draw.integers(pictures.shape[1])
    chosen = pictures[torch.arange(len(which)), which]
    if not shuffle_colours:
        return chosen
    order = ORDERS[draw.integers(len(ORDERS))].to(chosen.device)
    return chosen.gather(-1, order[:, None, None].expand(chosen.shape))
