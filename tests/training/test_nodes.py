"""A training of two nodes under torchrun makes what one process makes, also where one of them is killed."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import torch

from vision_s2r import pipeline
from vision_s2r.cli import compose
from vision_s2r.config import Config
from vision_s2r.images import to_float
from vision_s2r.render import Views, render
from vision_s2r.training.checkpoint import load_state
from vision_s2r.translate import Translator

MARK = "MARK_OF_TEST"
STEPS = 32
KEYS = {"max_steps": STEPS, "validate_every": 4, "precision": "32-true"}
WORDS = ["experiment=debug", *(f"translate.training.{key}={value}" for key, value in KEYS.items())]
HALF = "translate.training.batch_size=2"  # what each node would do by itself
NODES = ["translate.training.num_nodes=2", "translate.training.strategy=ddp"]


@pytest.mark.slow
def test_two_nodes_go_on_after_a_killed_rank_to_what_one_process_makes(tmp_path: Path) -> None:
    words = [*WORDS, *(f"data.{name}.out={tmp_path / name}" for name in ("pairs", "validation"))]
    cfg = compose(Config, overrides=[*words, f"out={tmp_path / 'one'}"])
    for each in (cfg.data.pairs, cfg.data.validation):
        render(cfg.scene, each)
    one, two = pipeline.paired_translator(cfg, 0), tmp_path / "two" / "translator-0"
    said, command = tmp_path / "said.txt", ["translate", *words, *NODES, f"out={tmp_path / 'two'}"]
    with _torchrun(command, said) as nodes:
        while not (two / "last.pt").exists():
            assert all(node.poll() is None for node in nodes), said.read_text()
            time.sleep(0.1)
        os.kill(_rank(1, said), signal.SIGKILL)
        assert 0 not in [node.wait(200) for node in nodes]
    with _torchrun(command, said) as nodes:
        assert [node.wait(200) for node in nodes] == [0, 0], said.read_text()
    assert "going on at step" in said.read_text()
    assert load_state(two / "last.pt")["step"] == STEPS
    half = pipeline.paired_translator(compose(Config, overrides=[*words, HALF, f"out={tmp_path / 'half'}"]), 0)
    views = Views.open(cfg.data.validation.out)
    pictures = views.batch("randomized", torch.arange(len(views)))[:, 0, 4:-4, 4:-4]
    expected, found, other = (
        Translator.load(path).predict(to_float(pictures))["canonical"]
        for path in (one, two / "best.safetensors", half)  # weights before a normalization are anything
    )
    assert (found - expected).abs().max() < 1e-3 < (other - expected).abs().max()


@contextmanager
def _torchrun(command: list[str], said: Path) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Two nodes with a command of ours, a process each; what they say is appended to a file."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    words = [sys.executable, "-m", "torch.distributed.run", "--nnodes=2", "--nproc-per-node=1", "--rdzv-backend=c10d"]
    words += [f"--rdzv-endpoint={address}", "--local-addr=127.0.0.1", "-m", "vision_s2r", *command]
    environment = os.environ | {"GLOO_SOCKET_IFNAME": "lo", MARK: str(said)}
    with said.open("a") as file:
        nodes = [subprocess.Popen(words, env=environment, stdout=file, stderr=file) for _ in range(2)]
        try:
            yield nodes
        finally:
            for node in nodes:
                node.kill()


def _rank(rank: int, said: Path) -> int:
    """The process of this rank."""
    for process in Path("/proc").glob("[0-9]*"):
        try:
            environment = (process / "environ").read_bytes().split(b"\0")
        except OSError:  # it has ended, or is another user's
            continue
        if f"RANK={rank}".encode() in environment and f"{MARK}={said}".encode() in environment:
            return int(process.name)
    raise AssertionError(f"no process of rank {rank}")
