"""Rendering is resumable, repeatable and never hands out damaged data."""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch
from safetensors import SafetensorError

from vision_s2r.cli import compose
from vision_s2r.config import Config
from vision_s2r.errors import UserError
from vision_s2r.images import reduced
from vision_s2r.render import RenderConfig, Views, render
from vision_s2r.render import shard as shards
from vision_s2r.render.manifest import Manifest
from vision_s2r.scene import CLASSES, SceneConfig, attempt, sample_state

SCENE = SceneConfig()


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    folder = tmp_path_factory.mktemp("renders") / "whole"
    return RenderConfig(
        out=str(folder), scenes=5, size=32, margin=4, views=1, real=True, grasps=2, shard_size=2, workers=1
    )


@pytest.fixture(scope="module")
def views(config):
    return Views.open(render(SCENE, config))


def test_what_is_rendered_is_what_was_asked_for(views, config):
    assert len(views) == 5 and (views.size, views.margin) == (32, 4)
    assert views.all("randomized").shape == (5, 1, 40, 40, 3)
    assert views.all("canonical").shape == (5, 32, 32, 3)
    assert views.states() == [sample_state(SCENE, 0, index) for index in range(5)]
    state, grasp = views.states()[3], views.all("grasps")[3, 1].numpy()
    assert attempt(SCENE, state, grasp).success == bool(views.all("success")[3, 1])
    assert torch.equal(views.subset([4, 2]).all("depth"), views.batch("depth", torch.tensor([4, 2])))
    with pytest.raises(UserError, match="did you mean 'canonical'"):
        views.all("canonicl")


def test_source_pictures_of_more_pixels_show_the_same(views, config, tmp_path):
    large = Views.open(render(SCENE, replace(config, out=str(tmp_path), source_scale=2, margin=8, grasps=0)))
    assert (large.size, large.source_size) == (32, 64) and views.source_size == 32
    assert torch.equal(large.all("canonical"), views.all("canonical"))
    for name in ("real", "randomized"):
        same = reduced(large.all(name).flatten(0, -4), 40).float() - views.all(name).flatten(0, -4)
        other = views.all(name).flatten(0, -4).float() - views.all(name).flatten(0, -4).roll(1, 0)
        assert same.abs().mean() < 0.3 * other.abs().mean()


def test_workers_and_shards_change_nothing(views, config, tmp_path):
    other = replace(config, out=str(tmp_path), workers=2, shard_size=3)
    again = Views.open(render(SCENE, other))
    for name in views.names:
        assert torch.equal(again.all(name), views.all(name)), name


def test_interrupted_anywhere_it_goes_on_to_the_same_result(views, config, tmp_path):
    def stop(*_):
        raise KeyboardInterrupt

    part = replace(config, out=str(tmp_path))
    with pytest.MonkeyPatch.context() as patch:
        real_write = shards.write
        calls = []

        def write(path, tensors):
            calls.append(path)
            return real_write(path, tensors) if len(calls) < 2 else stop()

        patch.setattr(shards, "write", write)
        with pytest.raises(KeyboardInterrupt):
            render(SCENE, part)
    with pytest.raises(UserError, match="2 shards missing"):
        Views.open(tmp_path)
    render(SCENE, part)
    assert Manifest.load(tmp_path).checksums == views.manifest.checksums


def test_a_damaged_shard_is_named_and_rendered_again(config, tmp_path, capfd):
    cfg = replace(config, out=str(tmp_path), grasps=0, real=False)
    render(SCENE, cfg)
    whole = Manifest.load(tmp_path).checksums
    path = tmp_path / "shard-00001.safetensors"
    data = bytearray(path.read_bytes())
    data[-7] ^= 1
    path.write_bytes(data)
    with pytest.raises(UserError, match=r"shard-00001\.safetensors is damaged"):
        Views.open(tmp_path)
    render(SCENE, cfg)
    assert "shard-00001.safetensors is damaged" in capfd.readouterr().err
    assert Manifest.load(tmp_path).checksums == whole
    Views.open(tmp_path)


def test_a_folder_of_another_configuration_is_refused(views, config):
    with pytest.raises(UserError, match=r"render\.size is 32 there, 48 here"):
        render(SCENE, replace(config, size=48))
    other = SceneConfig()
    other.physics.object_friction = 0.1
    with pytest.raises(UserError, match=r"physics\.object_friction is 0\.7 there, 0\.1 here"):
        render(other, config)


@pytest.mark.parametrize(
    "error",
    [OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), SafetensorError("I/O error: No space left on device")],
    ids=["of the system", "of safetensors"],
)
def test_a_full_disk_is_one_clear_line_and_loses_nothing(config, tmp_path, monkeypatch, error):
    cfg = replace(config, out=str(tmp_path), grasps=0)
    save = shards.save_file

    def full(tensors, path):
        if "00001" in str(path):
            path.write_bytes(b"part")
            raise error
        save(tensors, path)

    with monkeypatch.context() as patch:
        patch.setattr(shards, "save_file", full)
        with pytest.raises(UserError, match="No space left"):
            render(SCENE, cfg)
    assert not list(tmp_path.glob("*.tmp"))
    assert len(Manifest.load(tmp_path).checksums) == 1
    render(SCENE, cfg)
    assert len(Views.open(tmp_path)) == 5


@pytest.mark.slow
def test_a_killed_script_goes_on(tmp_path):
    """A real interrupt of the real script, at whatever it is doing."""
    command = [sys.executable, "scripts/render.py", "render.scenes=8", "render.shard_size=1", "render.workers=2"]
    command += ["render.size=32", "render.grasps=4", f"render.out={tmp_path}"]
    # Whoever runs the tests in the background may have told them to ignore interrupts, and children inherit that.
    listens = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, preexec_fn=listens)
    deadline = time.monotonic() + 120
    while not list(tmp_path.glob("shard-*.safetensors")) and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 130 and "goes on" in errors and "Traceback" not in errors
    cfg = compose(Config, overrides=[*command[2:], "render.workers=1"])
    render(cfg.scene, cfg.render)
    assert len(Views.open(tmp_path)) == 8
    assert (tmp_path / "contact_sheet.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("change", "message"),
    [({"scenes": 0}, "render.scenes = 0"), ({"workers": 0}, "render.workers"), ({"size": 3}, "at least 16")],
)
def test_bad_values_are_one_clear_line(config, tmp_path, change, message):
    with pytest.raises(UserError, match=message):
        render(SCENE, replace(config, out=str(tmp_path), **change))


def test_missing_and_foreign_manifests(tmp_path):
    with pytest.raises(UserError, match=r"vision-s2r render` wrote"):
        Views.open(tmp_path)
    (tmp_path / "manifest.json").write_text("[]")
    with pytest.raises(UserError, match="expected format"):
        Views.open(tmp_path)


@pytest.mark.parametrize(
    ("render", "checksums", "message"),
    [
        ({"scenes": 10**30}, {}, "is not finished, 4999"),  # each of them was looked for
        ({"scenes": 4, "shard_size": 5}, {}, r"shard-00000.safetensors: \[2\] scenes, expected 4 by the manifest"),
        ({}, {"-1": ""}, "checksums of shard -1, expected numbers from 0"),
    ],
)
def test_manifests_that_are_not_of_their_shards(config, views, tmp_path, render, checksums, message):
    shutil.copytree(config.out, tmp_path / "renders")
    path = tmp_path / "renders" / "manifest.json"
    content = json.loads(path.read_text())
    path.write_text(
        json.dumps(content | {"render": content["render"] | render, "checksums": {**content["checksums"], **checksums}})
    )
    with pytest.raises(UserError, match=message):
        Views.open(path.parent)


def test_depth_is_metres(views):
    depth = views.all("depth").numpy()
    assert depth.min() > 0.4 and depth.max() < 1.0 and depth.dtype == np.float32


def test_quarter_turns_of_a_settled_scene(tmp_path):
    cfg = RenderConfig(
        out=str(tmp_path / "one"), scenes=8, size=32, margin=4, turns=4, views=1, grasps=0, shard_size=8, workers=1
    )
    views = Views.open(render(SCENE, cfg))
    settled, states = sample_state(SCENE, 0, 1), views.states()[4:]
    for k, state in enumerate(states):
        assert state.object_ids == settled.object_ids
        for turned, pose in zip(state.object_poses, settled.object_poses, strict=True):
            place = np.linalg.matrix_power([[0, -1], [1, 0]], k) @ pose[:2]
            assert np.allclose(turned[:3], [*place, pose[2]], atol=1e-9)
    assert len({state.camera for state in states}) == 4 and len({state.arm_joints for state in states}) == 4
    area = (views.all("segmentation")[4:] == CLASSES.index("object")).float().mean((1, 2))
    assert float(area.min()) > 0.7 * float(area.max()) > 0  # but for the arm, and perspective
    again = Views.open(render(SCENE, replace(cfg, out=str(tmp_path / "other"), shard_size=4)))
    assert all(torch.equal(again.all(name), views.all(name)) for name in views.names)
    with pytest.raises(UserError, match="turns = 3"):
        render(SCENE, replace(cfg, turns=3))
