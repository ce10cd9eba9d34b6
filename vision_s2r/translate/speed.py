"""How many pictures a second a translator's network trains on and translates, alone: the batch lies ready."""

from collections.abc import Callable, Mapping

import numpy as np
import torch
from lightning_fabric import Fabric
from torch import Tensor

from vision_s2r.training import ViewSource, precision
from vision_s2r.training.data import VALIDATION, generator
from vision_s2r.translate import ceiling, losses
from vision_s2r.translate.config import TranslateConfig
from vision_s2r.translate.rcan import Rcan

ROUNDS = 5


def measure(
    trainings: Mapping[str, tuple[TranslateConfig, Callable[[], Rcan]]], views: ViewSource, seconds: float
) -> dict[str, dict[str, float]]:
    """Of each network its parameters, `step_pictures_per_second`, `inference_pictures_per_second` and `…_milliseconds`.

    And `step_operations` (a picture, of convolutions and matrix products), `step_operations_per_second`, and the
    `ceiling_operations_per_second` of the machine (`vision_s2r.translate.ceiling`).
    A step is forward, losses, backward and update, as the loop does them. Inference is in full precision, as a released
    translator's. All have the batch size of their training and `seconds` in all, in turns; medians over rounds.
    """
    calls = {
        (name, what): call for name, training in trainings.items() for what, call in _calls(*training, views).items()
    }
    for call in calls.values():
        call()  # what is made once, is
    share = seconds / 2 / ROUNDS
    fastest = {name: _ceiling(cfg, seconds / 4) for name, (cfg, _) in trainings.items()}
    rounds = [{key: ceiling.per_second(call, share) for key, call in calls.items()} for _ in range(ROUNDS)]
    found: dict[str, dict[str, float]] = {}
    for name, (cfg, build) in trainings.items():
        batch = min(cfg.training.batch_size, len(views))
        step, inference = (batch * float(np.median([r[name, what] for r in rounds])) for what in ("step", "inference"))
        count = ceiling.operations(calls[name, "step"]) / batch
        found[name] = {
            "parameters": sum(p.numel() for p in build().networks["unet"].parameters()),
            "step_pictures_per_second": step,
            "step_operations": count,
            "step_operations_per_second": count * step,
            "ceiling_operations_per_second": fastest[name],
            "inference_pictures_per_second": inference,
            "inference_milliseconds": 1e3 / inference,
        }
    return found


def _ceiling(cfg: TranslateConfig, seconds: float) -> float:
    device = Fabric(accelerator=cfg.training.accelerator, devices=1).device
    return ceiling.measure(precision.is_mixed(cfg.training, device), cfg.training.batch_size, device, seconds)


def _calls(cfg: TranslateConfig, build: Callable[[], Rcan], views: ViewSource) -> dict[str, Callable[[], None]]:
    """A training step, and a translation, of the same batch."""
    training, method = cfg.training, build()
    fabric = Fabric(accelerator=training.accelerator, devices=1, precision=precision.resolved(training))  # type: ignore[arg-type]
    method.device = fabric.device
    bare = method.networks["unet"]
    network, optimizer = fabric.setup(bare, method.optimizers["unet"])
    indices = torch.arange(min(training.batch_size, len(views)))
    source, target = method.held_out(views, indices, generator(VALIDATION))

    def step() -> None:
        bare.train()
        loss = losses.weighted(cfg.loss, losses.supervised(cfg.loss, network(source), target))
        optimizer.zero_grad()
        fabric.backward(loss)
        if training.clip:
            fabric.clip_gradients(network, optimizer, max_norm=training.clip, error_if_nonfinite=False)
        optimizer.step()
        _wait(source)

    @torch.no_grad()
    def inference() -> None:
        bare.eval()
        bare(source)
        _wait(source)

    return {"step": step, "inference": inference}


def _wait(tensor: Tensor) -> None:
    """Until the device has done what it was told."""
    if tensor.is_cuda:
        torch.cuda.synchronize(tensor.device)
