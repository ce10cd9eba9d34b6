"""Two sets of pictures of one place: what their camera does shows, and contents differ where they are to."""

from pathlib import Path

import numpy as np
import pytest

from vision_s2r.gapbench.generate import unpaired
from vision_s2r.gapbench.generate.base import GeneratedMachine
from vision_s2r.recording import CameraRecording, read


def drawn(case: str, index: int, folder: Path) -> tuple[GeneratedMachine, CameraRecording]:
    machine = unpaired.machine(case, index, "tuning", np.random.default_rng(5))
    machine.write(folder)
    recording = read(folder)
    assert isinstance(recording, CameraRecording)
    return machine, recording


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=() if case == "single" else pytest.mark.slow) for case in unpaired.CASES]
)
def test_a_generated_pair_of_sets(case: str, tmp_path: Path) -> None:
    machine, recording = drawn(case, 0, tmp_path)
    answer = machine.answer
    assert recording.pairing == "unpaired" and recording.sim.shape == recording.real.shape == (20, 128, 128, 3)
    assert answer.group == "20 pictures a side"
    assert len(answer.effects) == {"single": 1, "pair": 2}.get(case, 0)
    assert bool(answer.unknown) == (case in ("unknown", "content"))
    assert not np.allclose(recording.sim[0], recording.real[0], atol=0.1)  # no scene in common


@pytest.mark.slow
def test_the_same_seed_draws_the_same_sets(tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("one", "other")]
    for folder in folders:
        folder.mkdir()
    (_, one), (_, other) = (drawn("pair", 3, folder) for folder in folders)
    assert np.array_equal(one.real, other.real) and np.array_equal(one.sim, other.sim)


def test_sets_are_of_20_100_and_500_pictures_whatever_is_taken_in_turn() -> None:
    for turn in (1, 3, 10, 11, 55):
        met = {(index % turn, unpaired.pictures_a_side(index, turn)) for index in range(3 * turn)}
        assert met == {(k, count) for k in range(turn) for count in (20, 100, 500)}


def test_a_fuller_table_has_more_on_it() -> None:
    rng = np.random.default_rng(0)
    look = unpaired.world(rng)
    assert (
        unpaired.fuller(look, rng).solids[0] >= look.solids[1] > look.solids[0] >= unpaired.emptier(look, rng).solids[1]
    )
    others = unpaired.other_things(look, rng)
    same = [np.array_equal(a, b) for a, b in zip(look.textures, others.textures, strict=True)]
    assert same[others.surface] and sum(same) == 2  # the table and the wall stay
