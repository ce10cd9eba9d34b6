"""Training an actuator network on logs: least squares on the torque that the sensor showed."""

import numpy as np
import torch
from torch import nn

from vision_s2r.actuator.config import ActuatorTrainingConfig
from vision_s2r.actuator.log import DriveLog
from vision_s2r.actuator.network import ActuatorNetwork
from vision_s2r.errors import UserError
from vision_s2r.progress import tracked
from vision_s2r.threads import one_thread
from vision_s2r.training.loop import learning_rate


def inputs(log: DriveLog, lags: tuple[int, ...]) -> np.ndarray:
    """What a network sees, float32 [N, T, 2H]. Before the first sample everything was as it was then."""
    samples = np.arange(log.position.shape[1])[:, None] - np.array(lags)
    seen = np.maximum(samples, 0)
    return np.concatenate([log.error[:, seen], log.velocity[:, seen]], axis=2).astype(np.float32)


@one_thread()
def predict(network: ActuatorNetwork, log: DriveLog) -> np.ndarray:
    """Torques [N, T] (N·m) that the network says of a log's motions."""
    seen = torch.from_numpy(inputs(log, network.lags))
    with torch.no_grad():
        return network(seen.flatten(0, 1)).numpy().reshape(log.torque.shape)


@one_thread()
def fit(
    log: DriveLog, history: tuple[float, ...], sample_time: float, cfg: ActuatorTrainingConfig, seed: int
) -> ActuatorNetwork:
    """A network of this history (s ago), trained on a log. The same seed gives the same network.

    The mean is what least squares finds, and what conserves momentum where an impact may or may not come. Matrices of
    the hidden layers are trained by Muon (Jordan et al. 2024), which takes a third of Adam's steps here.
    """
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = ActuatorNetwork(history, sample_time)
    seen = inputs(log, network.lags)[:, network.lags[-1] :]
    x, y = seen.reshape(-1, seen.shape[2]), log.torque[:, network.lags[-1] :].astype(np.float32).reshape(-1)
    network.normalize(*_whitening(x), float(y.std()))
    x_all = (torch.from_numpy(x) - network.mean) @ network.whitening
    y_all = torch.from_numpy(y) / network.scale
    optimizers = _optimizers(network.layers, cfg)
    generator = torch.Generator().manual_seed(seed)
    for step in tracked(range(cfg.steps), cfg.steps, f"{len(history)} samples, seed {seed}"):
        for optimizer in optimizers:
            for group in optimizer.param_groups:
                group["lr"] = group["initial_lr"] * learning_rate((step + 1) / cfg.steps, cfg.warmup)
        batch = torch.randint(len(x_all), (cfg.batch,), generator=generator)
        loss = nn.functional.mse_loss(network.layers(x_all[batch])[:, 0], y_all[batch])
        for optimizer in optimizers:
            optimizer.zero_grad()
        loss.backward()
        for optimizer in optimizers:
            optimizer.step()
    if not loss.isfinite():
        raise UserError(f"training.learning_rate is {cfg.learning_rate:g}: training diverged, expected less")
    return network


def _whitening(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean [2H], and the matrix [2H, 2H] after which inputs [B, 2H] have unit covariance."""
    variances, directions = np.linalg.eigh(np.cov(x.T.astype(float)))
    return x.mean(axis=0, dtype=float), directions / np.sqrt(np.maximum(variances, 1e-12 * variances[-1]))


def _optimizers(layers: nn.Sequential, cfg: ActuatorTrainingConfig) -> list[torch.optim.Optimizer]:
    matrices = [p for p in layers.parameters() if p.ndim == 2 and len(p) > 1]
    others = [p for p in layers.parameters() if p.ndim == 1 or len(p) == 1]
    optimizers: list[torch.optim.Optimizer] = [
        torch.optim.Muon(matrices, lr=cfg.learning_rate, weight_decay=0.0),
        torch.optim.Adam(others, lr=cfg.learning_rate / 2),
    ]
    for optimizer in optimizers:
        for group in optimizer.param_groups:
            group["initial_lr"] = group["lr"]
    return optimizers
