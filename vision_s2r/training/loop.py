"""The one training loop, on Lightning Fabric.

It ends after `max_steps` or `max_minutes`. A run limited by steps is reproducible and continues exactly where it
was interrupted; one limited by minutes makes as many steps as the machine allows, and says how many.
"""

import json
import logging
import math
import time
from collections import defaultdict
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager, nullcontext
from dataclasses import asdict
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import torch
from torch import Tensor

from vision_s2r.errors import UserError, nearest
from vision_s2r.files import held
from vision_s2r.training import checkpoint, precision
from vision_s2r.training.config import TrainingConfig, check
from vision_s2r.training.data import STEP, VALIDATION, Draw, Resident, ViewSource, generator
from vision_s2r.training.interrupt import Interrupt
from vision_s2r.training.log import RunLog
from vision_s2r.training.method import Batch, Method

if TYPE_CHECKING:
    from lightning_fabric import Fabric

log = logging.getLogger(__name__)

BEST, LAST = "best.safetensors", "last.pt"
CHANGE_NOTHING = ("logger", "resident")  # of a run: where it logs, and from where it reads


class TrainingResult(NamedTuple):
    """What a finished run made."""

    best: Path  # released checkpoint
    value: float  # its metric
    steps: int  # of the whole run
    minutes: float  # wall clock, validations included


def train(
    build: Callable[[], Method],
    views: ViewSource,
    validation: ViewSource,
    cfg: TrainingConfig,
    out: Path,
    seed: int,
    part: float = 1.0,
) -> TrainingResult:
    """Trains what `build` makes, or goes on with the run found in `out`; a finished one is returned as it is.

    A run that another process is at is waited for. With `part` below 1 it pauses when that part of it is done, the
    state saved; nothing may be released by then. With `strategy=ddp_spawn` everything passed here is pickled into the
    processes. On Ctrl-C the step under way is finished, the state saved and KeyboardInterrupt raised.

    Raises UserError where a configuration value is out of range or another than that of the run in `out`, the
    metric is unknown, a loss is no longer finite, or a file cannot be written.
    """
    from lightning_fabric import Fabric  # seconds, which whoever only uses networks does not wait for

    check(cfg)
    if not len(views) or not len(validation):
        raise UserError("training: there are no views: expected at least one scene to train and one to validate on")
    fabric = Fabric(
        accelerator=cfg.accelerator,
        devices=cfg.devices,
        num_nodes=cfg.num_nodes,
        strategy=cfg.strategy,
        precision=precision.resolved(cfg),  # type: ignore[arg-type]  # one of Fabric's own
    )
    run = partial(_run, build=build, views=views, validation=validation, cfg=cfg, out=out, seed=seed, part=part)
    return fabric.launch(run)


def _run(
    fabric: "Fabric",
    build: Callable[[], Method],
    views: ViewSource,
    validation: ViewSource,
    cfg: TrainingConfig,
    out: Path,
    seed: int,
    part: float,
) -> TrainingResult:
    with torch.random.fork_rng(devices=[]):  # initial weights are drawn from the global generator
        torch.manual_seed(seed)
        method = build()
    run = _Run(fabric, method, views, validation, cfg, out, seed)
    with held(out) if fabric.is_global_zero else nullcontext():
        fabric.barrier()
        if (out / LAST).exists():
            run.resume()
        if run.done:
            log.info("%s: finished at step %d, not repeated", out, run.step)
        else:
            run.loop(part)
    result = fabric.broadcast(TrainingResult(out / BEST, run.best, run.step, run.seconds / 60))
    if cfg.strategy == "ddp_spawn" and torch.distributed.is_initialized():
        # Gloo's threads drop what was broadcast while this waits. One that did so later would want Python's lock, which
        # the end of this process holds while it waits for that thread.
        fabric.barrier()
        time.sleep(0.5)
        torch.distributed.destroy_process_group()  # else its threads are ended by force, and may abort the process
    return result


def learning_rate(progress: float, warmup: float) -> float:
    """Factor on the learning rate: a linear rise over `warmup`, then half a cosine down to 0.

    `progress`: part of the run that is done, [0, 1]. SGDR (Loshchilov and Hutter 2017) without restarts.
    """
    if progress < warmup:
        return progress / warmup
    return 0.5 * (1 + math.cos(math.pi * min(1.0, (progress - warmup) / (1 - warmup))))


class _Step:
    """`training.method.Step`."""

    def __init__(self, fabric: "Fabric", method: Method, clip: float, index: int, progress: float, seed: int):
        self.index = index
        self.progress = progress
        self.generator, self.shared = (generator(STEP, seed, index, rank) for rank in (fabric.global_rank, 0))
        self._fabric, self._method, self._clip = fabric, method, clip

    def rows(self, count: int) -> tuple[int, Tensor]:
        return count * self._fabric.world_size, count * self._fabric.global_rank + torch.arange(count)

    def optimize(self, loss: Tensor, *names: str) -> None:
        networks, optimizers = self._method.networks, self._method.optimizers
        for name in names:
            optimizers[name].zero_grad()
        self._fabric.backward(loss)
        for name in names:
            if self._clip:
                self._fabric.clip_gradients(
                    networks[name], optimizers[name], max_norm=self._clip, error_if_nonfinite=False
                )
            optimizers[name].step()


class _Run:
    """A run and its state: networks, optimizers, what the method remembers, and these four."""

    def __init__(
        self,
        fabric: "Fabric",
        method: Method,
        views: ViewSource,
        validation: ViewSource,
        cfg: TrainingConfig,
        out: Path,
        seed: int,
    ):
        self.step = 0  # steps made
        self.seconds = 0.0  # wall clock
        self.best = math.inf if cfg.mode == "min" else -math.inf
        self.done = False

        self._fabric, self._method, self._cfg, self._out, self._seed = fabric, method, cfg, out, seed
        self._views = Resident(views, fabric.device) if cfg.resident else views
        self._validation = validation
        self._validated = -1  # step of the last validation
        self._losses: dict[str, list[Tensor]] = defaultdict(list)
        data = {name: _facts(v) for name, v in (("views", views), ("validation", validation))}
        settings = {key: value for key, value in asdict(cfg).items() if key not in CHANGE_NOTHING}
        self._configuration = json.dumps(
            {"seed": seed, "training": settings, "data": data, method.kind: method.configuration}
        )
        self._bare = dict(method.networks)  # without Fabric's wrappers
        for name, network in method.networks.items():
            if name in method.optimizers:
                wrapped = fabric.setup(network, method.optimizers[name])
                method.networks[name], method.optimizers[name] = wrapped
            else:
                method.networks[name] = fabric.to_device(network)
        for optimizer in method.optimizers.values():
            for group in optimizer.param_groups:
                group["initial_lr"] = group["lr"]
        method.device = fabric.device

    def resume(self) -> None:
        """Takes up the state in the folder. Raises UserError where it is another run's."""
        path = self._out / LAST
        state = checkpoint.load_state(path)
        try:
            _compare(self._out, json.loads(state["configuration"]), json.loads(self._configuration))
            for name, network in self._bare.items():
                network.load_state_dict(state["networks"][name])
            for name, optimizer in self._method.optimizers.items():
                optimizer.load_state_dict(state["optimizers"][name])
            self._method.restore(state.get("method", {}))
            self.step, self.seconds, self.best = state["step"], state["seconds"], state["best"]
            self.done = state["done"]
        except KeyError as error:
            raise UserError(f"{path}: lacks {error}: expected the state of a training run") from error
        if self.done and not (self._out / BEST).exists():
            raise UserError(f"{self._out}: finished, but its {BEST} is gone: remove the folder to train again")

    def loop(self, part: float) -> None:
        """Trains to the end and leaves the best and the last checkpoint; or up to `part` of the run, and the last."""
        if self.step:
            log.info("%s: going on at step %d", self._out, self.step)
        self._started = time.perf_counter() - self.seconds
        with RunLog(self._out, self.step, self._leads, self._cfg.logger) as self._log:
            if self._method.fine_tunes and not self.step:
                self._validate()
            with closing(self._batches()) as batches, Interrupt(self._leads) as interrupt:
                for batch in batches:
                    self.seconds = time.perf_counter() - self._started
                    progress, stop = self._agree(self._progress(), interrupt.requested)
                    self._log.progress(progress, self.step)
                    if stop:
                        self._save()
                        log.warning("%s: interrupted at step %d; run it again to go on", self._out, self.step)
                        raise KeyboardInterrupt
                    if progress >= min(part, 1):
                        break
                    self._train_step(batch, progress)
                    if self.step % self._cfg.validate_every == 0:
                        self._validate()
                        self._save()
            if progress >= 1:
                self._finish()
            else:
                self._save()

    @property
    def _leads(self) -> bool:
        """Whether this process is the one that validates, writes and talks."""
        return self._fabric.is_global_zero

    def _progress(self) -> float:
        """Part of the run that is done, [0, 1]."""
        steps, minutes = self._cfg.max_steps, self._cfg.max_minutes
        return max(self.step / steps if steps else 0.0, self.seconds / 60 / minutes if minutes else 0.0)

    def _agree(self, progress: float, stop: bool) -> tuple[float, bool]:
        """Both as the leading process sees them: clocks and signals differ between processes."""
        return self._fabric.broadcast((progress, stop)) if self._fabric.world_size > 1 else (progress, stop)

    def _batches(self) -> Generator[Batch, None, None]:
        """The batches from this step on, on the device, each read while the one before it is trained on."""

        def read(step: int) -> Batch:
            world, rank = self._fabric.world_size, self._fabric.global_rank
            draw = Draw(self._seed, step, len(self._views), self._cfg.batch_size, rank, world)
            return self._method.batch(self._views, draw)

        with ThreadPoolExecutor(1, "batches") as pool:
            ahead = pool.submit(read, self.step)
            for step in count(self.step + 1):
                batch, ahead = ahead.result(), pool.submit(read, step)
                yield self._fabric.to_device(batch)

    def _train_step(self, batch: Batch, progress: float) -> None:
        """One step of the method at the learning rate of the moment."""
        cfg = self._cfg
        # Half a step on, so that the first is not made at a rate of 0.
        ahead = progress + 0.5 / cfg.max_steps if cfg.max_steps else progress
        for optimizer in self._method.optimizers.values():
            for group in optimizer.param_groups:
                group["lr"] = group["initial_lr"] * learning_rate(ahead, cfg.warmup)
        step = _Step(self._fabric, self._method, cfg.clip, self.step, progress, self._seed)
        for name, loss in self._method.training_step(batch, step).items():
            self._losses[name].append(loss.detach())
        self.step += 1
        if self.step % cfg.log_every == 0:
            self._log_losses()

    def _log_losses(self) -> None:
        """Means since the last time."""
        means = {}
        for name, losses in self._losses.items():
            mean = float(torch.stack(losses).float().mean())
            if not math.isfinite(mean):
                raise UserError(f"training: loss '{name}' is {mean} at step {self.step}: lower the learning rate")
            means[name] = mean
        rates = {name: o.param_groups[0]["lr"] for name, o in self._method.optimizers.items()}
        self._log.scalars("loss", means, self.step)
        self._log.scalars("learning_rate", rates, self.step)
        self._losses.clear()

    def _validate(self) -> None:
        """Metrics and pictures, by the leading process; keeps the networks if they are the best so far."""
        if self._leads:
            with self._evaluating():
                metrics = self._method.validate(self._validation, generator(VALIDATION, self._seed))
                pictures = self._method.pictures(self._validation, generator(VALIDATION, self._seed))
            self._log.scalars("validation", metrics, self.step)
            self._log.pictures(pictures, self.step)
            self._keep(metrics)
        self._validated = self.step
        self._fabric.barrier()

    @contextmanager
    def _evaluating(self) -> Iterator[None]:
        """Networks as a released checkpoint has them: unwrapped, evaluation mode, full precision, not compiled."""
        wrapped, self._method.networks = self._method.networks, self._bare
        try:
            for network in self._bare.values():
                network.eval()
            plain = torch.compiler.set_stance("force_eager") if self._cfg.compile else nullcontext()
            with torch.no_grad(), plain:
                yield
        finally:
            self._method.networks = wrapped
            for name in self._method.optimizers:
                self._bare[name].train()

    def _keep(self, metrics: dict[str, float]) -> None:
        """Releases the networks as the best checkpoint if they are."""
        name = self._cfg.metric
        if name not in metrics:
            raise UserError(f"training.metric = '{name}': no such validation metric, {nearest(name, metrics)}")
        value = metrics[name]
        better = value < self.best if self._cfg.mode == "min" else value > self.best
        line = ", ".join(f"{k} {v:.4g}" for k, v in metrics.items())
        log.info("%s: step %d, %s%s", self._out, self.step, line, " (best)" if better else "")
        if not better:
            return
        self.best = value
        facts = {
            "step": self.step,
            "seed": self._seed,
            "batch_size": self._cfg.batch_size,
            "metrics": metrics,
        }
        tensors = {f"{n}.{k}": v for n in self._method.released for k, v in self._bare[n].state_dict().items()}
        released = checkpoint.Checkpoint(
            kind=self._method.kind,
            configuration=self._method.configuration,
            normalization=self._method.normalization,
            training=facts | {"metric": name, "value": value},
            tensors=tensors,
        )
        checkpoint.save(self._out / BEST, released)

    def _save(self) -> None:
        """Writes what the run resumes from."""
        self.seconds = time.perf_counter() - self._started
        if self._leads:
            optimizers = self._method.optimizers
            state = {
                "configuration": self._configuration,
                "step": self.step,
                "seconds": self.seconds,
                "best": self.best,
                "done": self.done,
                "networks": {name: network.state_dict() for name, network in self._bare.items()},
                "optimizers": {name: optimizer.state_dict() for name, optimizer in optimizers.items()},
                "method": self._method.state(),
            }
            checkpoint.save_state(self._out / LAST, state)
        self._fabric.barrier()

    def _finish(self) -> None:
        if self._validated != self.step:
            self._validate()
        if self._leads and math.isinf(self.best):
            raise UserError(f"{self._out}: {self._cfg.metric} was never a number: nothing to release")
        self.done = True
        self._save()
        minutes, name, best = self.seconds / 60, self._cfg.metric, self.best
        log.info("%s: %d steps in %.1f min, best %s %.4g", self._out, self.step, minutes, name, best)


def _facts(views: ViewSource) -> dict[str, int]:
    return {key: getattr(views, key) for key in ("size", "source_size", "margin")} | {"scenes": len(views)}


def _compare(out: Path, before: dict[str, Any], now: dict[str, Any]) -> None:
    """Raises UserError naming the first key in which two configurations differ."""
    old, new = dict(_flatten(before)), dict(_flatten(now))
    for key in sorted(old.keys() | new.keys()):
        if old.get(key) != new.get(key):
            raise UserError(
                f"{out}: was begun with {key} = {old.get(key)}, now it is {new.get(key)}: "
                "expected the same configuration, or another folder"
            )


def _flatten(tree: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _flatten(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
