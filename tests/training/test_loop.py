"""The training loop, driven by a method of two small networks that take turns, as those of a GAN do."""

import os
import signal
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import pytest
import torch
from torch import Tensor, nn
from torch.nn.functional import mse_loss, softplus

from vision_s2r.errors import UserError
from vision_s2r.training import Batch, Draw, Method, Step, TrainingConfig, ViewSource, adamw, frozen, train
from vision_s2r.training.checkpoint import load, load_state
from vision_s2r.training.loop import learning_rate

needs_loggers = pytest.mark.skipif(
    not all(map(find_spec, ("pytorch_lightning", "wandb", "mlflow"))), reason="the extra `loggers` is not installed"
)
CFG = TrainingConfig(
    max_steps=12,
    batch_size=8,
    learning_rate=0.02,
    validate_every=4,
    metric="error",
    log_every=2,
    accelerator="cpu",
)


class Numbers:
    """Views whose canonical is a linear function of the randomized."""

    size, source_size, margin, names = 1, 1, 0, frozenset({"randomized", "canonical"})

    def __init__(self, scenes: int, seed: int):
        generator = torch.Generator().manual_seed(seed)
        inputs = torch.randn(scenes, 6, generator=generator)
        self._tensors = {"randomized": inputs, "canonical": inputs @ torch.arange(12.0).view(6, 2) / 6}

    def __len__(self) -> int:
        return len(self._tensors["canonical"])

    def batch(self, name: str, indices: Tensor) -> Tensor:
        return self._tensors[name][indices]


class Regression(Method):
    """`model` predicts the canonical, `critic` tells its predictions from it."""

    kind = "regression"

    def __init__(
        self,
        cfg: TrainingConfig,
        noise: float = 0.0,
        interrupt_at: int = -1,
        explode: bool = False,
        fine_tunes: bool = False,
    ):
        self.fine_tunes = fine_tunes
        self.networks = {
            "model": nn.Linear(6, 2),
            "critic": nn.Sequential(nn.Linear(8, 8), nn.ReLU(), nn.Linear(8, 1)),
        }
        self.optimizers = {name: adamw(network, cfg) for name, network in self.networks.items()}
        self.released = ("model",)
        self.configuration, self.normalization = {"noise": noise}, {"unit": "none"}
        self._interrupt_at, self._explode = interrupt_at, explode

    def batch(self, views: ViewSource, draw: Draw) -> Batch:
        batch = {name: views.batch(name, draw.indices) for name in ("randomized", "canonical")}
        return batch | {"jitter": 0.01 * draw.uniform(6) + draw.integers(2)[:, None]}

    def training_step(self, batch: Batch, step: Step) -> dict[str, Tensor]:
        if step.index == self._interrupt_at:
            os.kill(os.getpid(), signal.SIGINT)
        model, critic = self.networks["model"], self.networks["critic"]
        inputs, target = batch["randomized"] + 0.01 * batch["jitter"], batch["canonical"]
        noise = torch.randn(inputs.shape, generator=step.generator)
        output = model(inputs + self.configuration["noise"] * noise)
        with frozen(critic):
            adversarial = softplus(-critic(torch.cat([inputs, output], 1))).mean()
        error = mse_loss(output, target) * (torch.inf if self._explode else 1)
        step.optimize(error + 0.1 * adversarial, "model")
        real, fake = (critic(torch.cat([inputs, x], 1)) for x in (target, output.detach()))
        judged = softplus(-real).mean() + softplus(fake).mean()
        step.optimize(judged, "critic")
        return {"error": error, "critic": judged}

    def validate(self, views: ViewSource, generator: torch.Generator) -> dict[str, float]:
        everything = torch.arange(len(views))
        output = self.networks["model"](views.batch("randomized", everything))
        return {"error": float(mse_loss(output, views.batch("canonical", everything)))}

    def pictures(self, views: ViewSource, generator: torch.Generator) -> dict[str, Tensor]:
        return {"noise": torch.rand(3, 4, 4, generator=generator)}


def run(out: Path, cfg: TrainingConfig = CFG, seed: int = 1, **method: float) -> dict[str, Tensor]:
    """Trains and returns all networks' weights and the optimizers' tensors at the end."""
    train(partial(Regression, cfg, **method), Numbers(20, 0), Numbers(16, 1), cfg, out, seed)
    return weights(out)


def weights(out: Path) -> dict[str, Tensor]:
    state = load_state(out / "last.pt")
    found = {f"{n}.{k}": v for n, tensors in state["networks"].items() for k, v in tensors.items()}
    for name, optimizer in state["optimizers"].items():
        found |= {f"{name}.{i}.{k}": v for i, s in optimizer["state"].items() for k, v in s.items()}
    return found


def assert_same(a: dict[str, Tensor], b: dict[str, Tensor], exact: bool = True) -> None:
    tolerance = {"rtol": 0.0, "atol": 0.0} if exact else {"rtol": 1e-4, "atol": 1e-6}
    torch.testing.assert_close(a, b, **tolerance)


def test_a_run_learns_and_leaves_everything_a_reader_wants(tmp_path: Path) -> None:
    cfg = replace(CFG, max_steps=300, validate_every=100)
    result = train(partial(Regression, cfg), Numbers(20, 0), Numbers(16, 1), cfg, tmp_path, 1)
    untrained = torch.stack([Numbers(16, 1).batch("canonical", torch.arange(16))]).square().mean()
    assert result.steps == 300
    assert result.value < 0.05 * untrained
    best = load(result.best, "regression")
    assert set(best.tensors) == {"model.weight", "model.bias"}
    assert best.training["metric"] == "error" and best.training["value"] == result.value
    assert (tmp_path / "pictures" / "noise-0000100.png").stat().st_size > 0
    assert list((tmp_path / "logs").glob("events.*"))


@pytest.mark.slow
@needs_loggers
def test_curves_go_to_mlflow_by_one_key_and_go_on_in_the_same_run(tmp_path: Path) -> None:
    mlflow = pytest.importorskip("mlflow")
    cfg = replace(CFG, logger="mlflow")
    assert_same(in_two_parts(tmp_path / "run", cfg), run(tmp_path / "other"))
    client = mlflow.MlflowClient(f"sqlite:///{tmp_path / 'run' / 'logs' / 'mlflow.db'}")
    (only,) = client.search_runs([each.experiment_id for each in client.search_experiments()])
    steps = [point.step for point in client.get_metric_history(only.info.run_id, "loss/error")]
    assert steps == [2, 4, 6, 8, 10, 12] and only.info.status == "FINISHED"
    assert len(client.list_artifacts(only.info.run_id, "pictures")) == 3


@pytest.mark.slow
@needs_loggers
def test_curves_go_to_weights_and_biases_offline(tmp_path: Path) -> None:
    cfg = replace(CFG, logger="wandb")
    assert_same(in_two_parts(tmp_path, cfg), in_two_parts(tmp_path / "again", cfg))
    runs = list((tmp_path / "logs" / "wandb").glob("offline-run-*"))
    names = {path.name for each in runs for path in each.glob("run-*.wandb")}
    assert len(runs) == 2 and len(names) == 1  # one run in two parts, which `wandb sync` joins


def in_two_parts(out: Path, cfg: TrainingConfig) -> dict[str, Tensor]:
    for part in (0.5, 1.0):
        train(partial(Regression, cfg), Numbers(20, 0), Numbers(16, 1), cfg, out, 1, part)
    return weights(out)


def test_interrupted_and_resumed_equals_uninterrupted_bit_for_bit(tmp_path: Path) -> None:
    straight = run(tmp_path / "straight", noise=0.1)
    for at in (6, 7):  # between validations, twice
        with pytest.raises(KeyboardInterrupt):
            run(tmp_path / "resumed", noise=0.1, interrupt_at=at)
        assert load_state(tmp_path / "resumed" / "last.pt")["step"] == at + 1
    assert_same(run(tmp_path / "resumed", noise=0.1), straight)
    a, b = (load(tmp_path / name / "best.safetensors", "regression") for name in ("straight", "resumed"))
    assert_same(a.tensors, b.tensors)
    assert a.training == b.training


def test_views_on_the_device_are_read_once_and_train_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain, read = run(tmp_path / "plain"), []
    batch = Numbers.batch
    monkeypatch.setattr(Numbers, "batch", lambda self, name, rows: read.append(len(self)) or batch(self, name, rows))
    assert_same(run(tmp_path / "resident", replace(CFG, resident=True)), plain)
    assert read.count(20) == 4  # of each of the two tensors of the 20 scenes the first, then all


def test_a_run_in_parts_equals_one_in_a_piece(tmp_path: Path) -> None:
    build, numbers = partial(Regression, CFG, noise=0.1), (Numbers(20, 0), Numbers(16, 1))
    steps = [train(build, *numbers, CFG, tmp_path / "parts", 1, part).steps for part in (0.3, 0.5, 0.5, 1)]
    assert steps == [4, 6, 6, 12]
    assert_same(run(tmp_path / "piece", noise=0.1), weights(tmp_path / "parts"))


def test_the_seed_decides(tmp_path: Path) -> None:
    first = run(tmp_path / "a", noise=0.1)
    assert_same(run(tmp_path / "b", noise=0.1), first)
    with pytest.raises(AssertionError):
        assert_same(run(tmp_path / "c", seed=2, noise=0.1), first)


@pytest.mark.slow
def test_two_processes_make_the_updates_of_one(tmp_path: Path) -> None:
    one = run(tmp_path / "one")
    two = run(tmp_path / "two", replace(CFG, devices=2, strategy="ddp_spawn"))
    assert_same(one, two, exact=False)
    other = run(tmp_path / "half", replace(CFG, batch_size=4))  # what each process would do by itself
    with pytest.raises(AssertionError):
        assert_same(one, other, exact=False)


def test_trained_networks_that_no_step_makes_better_are_released_as_they_were(tmp_path: Path) -> None:
    cfg = replace(CFG, learning_rate=30.0)
    for fine_tunes in (True, False):
        build = partial(Regression, cfg, fine_tunes=fine_tunes)
        result = train(build, Numbers(20, 0), Numbers(16, 1), cfg, tmp_path / str(fine_tunes), 1)
        assert (load(result.best, "regression").training["step"] == 0) is fine_tunes


def test_a_finished_run_is_not_repeated(tmp_path: Path) -> None:
    run(tmp_path)
    before = (tmp_path / "last.pt").stat().st_mtime_ns
    run(tmp_path)
    assert (tmp_path / "last.pt").stat().st_mtime_ns == before


def test_a_changed_configuration_is_named(tmp_path: Path) -> None:
    run(tmp_path, noise=0.1)
    with pytest.raises(UserError, match=r"training\.learning_rate = 0\.02, now it is 0\.5"):
        run(tmp_path, replace(CFG, learning_rate=0.5), noise=0.1)
    with pytest.raises(UserError, match=r"regression\.noise = 0\.1, now it is 0\.2"):
        run(tmp_path, noise=0.2)


def test_minutes_end_a_run_and_it_says_how_many_steps_it_made(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    cfg = replace(CFG, max_steps=0, max_minutes=0.005)
    caplog.set_level("INFO")
    result = train(partial(Regression, cfg), Numbers(20, 0), Numbers(16, 1), cfg, tmp_path, 1)
    assert result.minutes >= 0.005
    assert f"{result.steps} steps in" in caplog.text
    assert load_state(tmp_path / "last.pt")["step"] == result.steps > 0


def test_a_loss_that_is_no_number_ends_the_run(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"loss 'error' is (nan|inf) at step 2"):
        run(tmp_path, explode=True)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"max_steps": 0}, "neither max_steps nor max_minutes"),
        ({"batch_size": 9, "devices": 2}, "multiple of the 2 processes"),
        ({"mode": "mim"}, "did you mean 'min'"),
        ({"metric": "eror"}, "did you mean 'error'"),
    ],
)
def test_bad_values_are_one_line(tmp_path: Path, change: dict[str, object], message: str) -> None:
    with pytest.raises(UserError, match=message) as error:
        run(tmp_path, replace(CFG, **change))
    assert "\n" not in str(error.value)


def test_an_epoch_takes_each_scene_once_whatever_the_ranks() -> None:
    steps = [Draw(3, step, length=12, batch_size=4) for step in range(3)]
    assert sorted(torch.cat([draw.indices for draw in steps]).tolist()) == list(range(12))
    whole = Draw(3, 7, length=12, batch_size=4)
    halves = [Draw(3, 7, length=12, batch_size=4, rank=rank, world=2) for rank in range(2)]
    assert torch.equal(whole.indices, torch.cat([h.indices for h in halves]))
    assert torch.equal(whole.integers(100), torch.cat([h.integers(100) for h in halves]))


def test_the_learning_rate_rises_then_falls_to_nothing() -> None:
    rates = [learning_rate(p / 100, warmup=0.1) for p in range(101)]
    assert rates[5] == pytest.approx(0.5) and max(rates) == rates[10] == 1.0
    assert rates[10:] == sorted(rates[10:], reverse=True) and rates[-1] == pytest.approx(0, abs=1e-12)
