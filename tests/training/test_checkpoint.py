"""Released checkpoints and what they refuse."""

from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file
from torch import nn

from vision_s2r.errors import UserError
from vision_s2r.training.checkpoint import Checkpoint, load, load_state, save, save_state


def written(path: Path, network: nn.Module) -> Path:
    tensors = {f"net.{k}": v for k, v in network.state_dict().items()}
    save(path, Checkpoint("translator", {"width": 4}, {"depth": [0.1, 2.0]}, {"step": 7}, tensors))
    return path


def test_a_checkpoint_comes_back_as_it_was(tmp_path: Path) -> None:
    network, other = nn.Linear(4, 2), nn.Linear(4, 2)
    checkpoint = load(written(tmp_path / "a.safetensors", network), "translator")
    checkpoint.restore("net", other)
    assert torch.equal(network.weight, other.weight)
    assert checkpoint.configuration == {"width": 4}
    assert checkpoint.normalization == {"depth": [0.1, 2.0]}
    assert checkpoint.training == {"step": 7}


def test_the_same_checkpoint_is_the_same_bytes(tmp_path: Path) -> None:
    network = nn.Linear(4, 2)
    assert len({written(tmp_path / f"{k}.safetensors", network).read_bytes() for k in range(20)}) == 1


def test_what_is_none_of_ours_is_one_clear_line(tmp_path: Path) -> None:
    ours = written(tmp_path / "ours.safetensors", nn.Linear(4, 2))
    text, foreign, cut = (tmp_path / name for name in ("text.safetensors", "foreign.safetensors", "cut.safetensors"))
    text.write_text("no tensors here")
    save_file({"a": torch.zeros(1)}, foreign)
    cut.write_bytes(ours.read_bytes()[:-4])
    cases = [
        (tmp_path / "none.safetensors", "translator", "there is no such checkpoint"),
        (text, "translator", "not a safetensors file"),
        (cut, "translator", "not a safetensors file, or a damaged one"),
        (foreign, "translator", "format is 'none': expected 'vision-s2r/checkpoint/1'"),
        (ours, "q_function", "holds a translator: expected a q_function"),
    ]
    for path, kind, message in cases:
        with pytest.raises(UserError, match=message) as error:
            load(path, kind)
        assert str(path) in str(error.value) and "\n" not in str(error.value)
    for network, name in ((nn.Linear(5, 2), "net.weight"), (nn.Linear(4, 2, bias=False), "net.bias")):
        with pytest.raises(UserError, match=f"tensor '{name}' is"):
            load(ours, "translator").restore("net", network)


def test_a_state_runs_no_code_when_read(tmp_path: Path) -> None:
    save_state(tmp_path / "good.pt", {"step": 3, "weights": torch.ones(2)})
    assert load_state(tmp_path / "good.pt")["step"] == 3
    torch.save({"step": Path("/")}, tmp_path / "bad.pt")
    with pytest.raises(UserError, match="not a training state"):
        load_state(tmp_path / "bad.pt")


def test_a_failed_write_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "last.pt"
    save_state(path, {"step": 1})

    def full(state: object, temporary: Path) -> None:
        temporary.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(torch, "save", full)
    with pytest.raises(UserError, match="No space left on device"):
        save_state(path, {"step": 2})
    assert load_state(path)["step"] == 1
    assert [p.name for p in tmp_path.iterdir()] == ["last.pt"]
