"""Actuator networks: that they learn what the analytic model lacks, and what is said of files that do not fit."""

import numpy as np
import pytest
import torch
from small import drive, logged

from vision_s2r.actuator.analytic import analytic_torque
from vision_s2r.actuator.config import PAPER_HISTORY, ActuatorTrainingConfig
from vision_s2r.actuator.network import ActuatorNetwork
from vision_s2r.actuator.training import fit, predict
from vision_s2r.errors import UserError
from vision_s2r.training.checkpoint import load, save


def test_a_network_learns_the_drive_and_comes_back_from_its_file(tmp_path):
    cfg = drive()
    log, held_out = logged(cfg, 40, 0), logged(cfg, 10, 2)
    network = fit(log, PAPER_HISTORY, cfg.sample_time, ActuatorTrainingConfig(steps=800, batch=512), 0)
    said = predict(network, held_out)
    off = np.abs(said - held_out.torque).mean()
    assert np.abs(analytic_torque(cfg, held_out) - held_out.torque).mean() > 3 * off
    network.save(tmp_path / "network.safetensors", {"steps": 800})
    np.testing.assert_array_equal(predict(ActuatorNetwork.load(tmp_path / "network.safetensors"), held_out), said)


def test_the_same_seed_gives_the_same_network():
    log, cfg = logged(drive(), 4, 0), ActuatorTrainingConfig(steps=20, batch=64)
    first, again, other = (fit(log, (0.0, 0.01), 0.005, cfg, seed).state_dict() for seed in (3, 3, 4))
    assert all(torch.equal(first[key], again[key]) for key in first)
    assert not torch.equal(first["layers.0.weight"], other["layers.0.weight"])


def test_a_file_of_another_observation_size_is_one_clear_line(tmp_path):
    path = tmp_path / "network.safetensors"
    ActuatorNetwork(PAPER_HISTORY, 0.005).save(path, {})
    with pytest.raises(UserError, match=r"sees \[0.0, 0.01, 0.02\] s ago, expected \[0.0, 0.01\]"):
        ActuatorNetwork.load(path, (0.0, 0.01))
    kept = load(path, "actuator")
    kept.configuration["history"] = [0.0, 0.01]
    save(path, kept)
    with pytest.raises(UserError, match="normalizes 6 inputs: its history of 2 has 4"):
        ActuatorNetwork.load(path)
    kept.normalization.update(mean=[0.0] * 4, whitening=np.eye(4).tolist())
    save(path, kept)
    with pytest.raises(UserError, match=r"tensor 'network.layers.0.weight' is \(32, 6\).* expects \(32, 4\)"):
        ActuatorNetwork.load(path)
    kept.configuration["history"] = [0.0, 0.007]
    save(path, kept)
    with pytest.raises(UserError, match="its header is that of no actuator network"):
        ActuatorNetwork.load(path)
