"""Checkpoints: what is released (safetensors) and what a run resumes from.

A released checkpoint is a safetensors file whose header says, as JSON, what it is: `format`, `kind`,
`configuration`, `normalization`, `training`. Its tensors are named NETWORK.PARAMETER.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save as serialized
from torch import Tensor, nn

from vision_s2r.errors import UserError
from vision_s2r.files import whole
from vision_s2r.training.released import resolve

FORMAT = "vision-s2r/checkpoint/1"
_FIELDS = ("configuration", "normalization", "training")


@dataclass(frozen=True)
class Checkpoint:
    """A released checkpoint in memory."""

    kind: str  # "translator", "q_function"
    configuration: dict[str, Any]
    normalization: dict[str, Any]
    training: dict[str, Any]  # facts: step, metric and its value
    tensors: dict[str, Tensor] = field(repr=False)
    path: Path = Path()  # where it was loaded from

    def restore(self, name: str, network: nn.Module) -> None:
        """Loads network `name`'s weights into `network`. Raises UserError where tensors lack or differ."""
        prefix = f"{name}."
        state = {k.removeprefix(prefix): v for k, v in self.tensors.items() if k.startswith(prefix)}
        wanted = {k: tuple(v.shape) for k, v in network.state_dict().items()}
        found = {k: tuple(v.shape) for k, v in state.items()}
        for key in sorted(wanted.keys() | found.keys()):
            if wanted.get(key) != found.get(key):
                has, expected = (shapes.get(key, "nothing") for shapes in (found, wanted))
                raise UserError(f"{self.path}: tensor '{prefix}{key}' is {has}: its configuration expects {expected}")
        network.load_state_dict(state)


def _write(path: Path, write: Callable[[Path], object]) -> None:
    """Lets `write` make the file under a temporary name. Raises UserError where it cannot."""
    try:
        with whole(path) as temporary:
            write(temporary)
    # torch and safetensors report a full disk in their own exceptions
    except (RuntimeError, SafetensorError) as error:
        raise UserError(f"{path}: cannot be written ({error}): what was there before is unchanged") from error


def save(path: Path, checkpoint: Checkpoint) -> None:
    """Writes a released checkpoint; the same one is the same bytes. Raises UserError where it cannot be written."""
    metadata = {"format": FORMAT, "kind": checkpoint.kind}
    metadata |= {name: json.dumps(getattr(checkpoint, name), sort_keys=True) for name in _FIELDS}
    tensors = {k: v.detach().cpu().contiguous() for k, v in checkpoint.tensors.items()}
    _write(path, lambda temporary: temporary.write_bytes(_sorted_head(serialized(tensors, metadata))))


def _sorted_head(content: bytes) -> bytes:
    """A safetensors file with its metadata in order: the library has them in that of a hash, another each time."""
    end = 8 + int.from_bytes(content[:8], "little")
    head = json.loads(content[8:end])
    text = json.dumps({"__metadata__": dict(sorted(head.pop("__metadata__").items())), **head}).encode()
    text += b" " * (-len(text) % 8)  # tensors begin at a multiple of 8
    return len(text).to_bytes(8, "little") + text + content[end:]


def load(path: str | Path, kind: str) -> Checkpoint:
    """Reads a released checkpoint of the given kind, tensors on the CPU; `path`, or the name of one in the package.

    Raises UserError for a name that there is none of, a missing file, one that is no safetensors file or none of ours,
    and another kind.
    """
    path = resolve(path, kind)
    if not path.is_file():
        raise UserError(f"{path}: there is no such checkpoint: expected a {kind} (.safetensors)")
    try:
        with safe_open(path, framework="pt") as file:
            metadata = file.metadata() or {}
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (no mapping)
    except (SafetensorError, OSError) as error:
        raise UserError(f"{path}: not a safetensors file, or a damaged one ({error})") from error
    if metadata.get("format") != FORMAT:
        raise UserError(f"{path}: format is '{metadata.get('format', 'none')}': expected '{FORMAT}'")
    if metadata.get("kind") != kind:
        raise UserError(f"{path}: holds a {metadata.get('kind')}: expected a {kind}")
    try:
        configuration, normalization, training = (json.loads(metadata[name]) for name in _FIELDS)
    except (KeyError, json.JSONDecodeError) as error:
        raise UserError(f"{path}: its header is damaged ({error})") from error
    return Checkpoint(kind, configuration, normalization, training, tensors, path)


def save_state(path: Path, state: dict[str, Any]) -> None:
    """Writes what a run resumes from: tensors and plain values. Raises UserError where it cannot."""
    _write(path, lambda temporary: torch.save(state, temporary))


def load_state(path: Path) -> dict[str, Any]:
    """Reads what `save_state` wrote, on the CPU. Raises UserError where the file is none of that."""
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # of bytes that are no state, torch's reader raises whatever comes to pass
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise UserError(f"{path}: not a training state, or a damaged one ({reason})") from error
    if not isinstance(state, dict):
        raise UserError(f"{path}: holds a {type(state).__name__}: expected a training state")
    return state
