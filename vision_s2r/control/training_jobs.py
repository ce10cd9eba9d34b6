"""The policies of a configuration, trained side by side."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from vision_s2r import parallel
from vision_s2r.cli import log_to_terminal
from vision_s2r.control.config import ControlConfig, PolicyConfig
from vision_s2r.control.effects import CONTROL_EFFECTS
from vision_s2r.control.machines import DrawnMachines, Machines
from vision_s2r.control.policy import Policy
from vision_s2r.control.training import Training, train
from vision_s2r.errors import UserError
from vision_s2r.joint import DYNAMICS, NominalJoint
from vision_s2r.randomize import Box, Posterior, effect_ranges, load_distribution


def nominal_of(cfg: ControlConfig) -> NominalJoint:
    """The joint as the simulator believes it to be."""
    return NominalJoint(**vars(cfg.nominal))


def box_of(cfg: ControlConfig, effects: Mapping[str, Mapping[str, object]]) -> Box:
    """Ranges to train in, beside which all is nominal; UserError where they cannot be."""
    return Box.of(effects, CONTROL_EFFECTS, nominal_values(cfg))


def reality_of(cfg: ControlConfig, effects: Mapping[str, Mapping[str, object]]) -> Box:
    """The same for ranges of real machines, which need not hold the nominal one."""
    return Box(CONTROL_EFFECTS, effect_ranges(effects, CONTROL_EFFECTS), nominal_values(cfg))


def nominal_values(cfg: ControlConfig) -> dict[str, dict[str, float]]:
    """The nominal joint by effect and parameter."""
    nominal = nominal_of(cfg)
    values = {name: getattr(nominal, name) for name in DYNAMICS}
    return {name: {"value": float(value)} for name, value in values.items() if value is not None}


def trained(
    cfg: ControlConfig, policies: Mapping[str, PolicyConfig], seeds: int, steps: int | None = None
) -> dict[str, list[Policy]]:
    """Each policy, `seeds` times, of as many steps as its method has by itself; what is there is not trained again."""
    return trained_on(cfg, {name: drawn(cfg, policy) for name, policy in policies.items()}, seeds, steps)


@dataclass(frozen=True)
class Source:
    """What a policy is trained on, machines for each seed; how many samples back it sees, and how it learns."""

    machines: Callable[[int], Machines]
    history: int
    method: str = "ppo"
    recurrent: bool = False


def drawn(cfg: ControlConfig, policy: PolicyConfig) -> Source:
    """Machines from the policy's ranges, or from the distribution in its file; UserError for one that has both."""
    if policy.recurrent and policy.method != "imitation":
        raise UserError(f"a policy that is recurrent and learns by method={policy.method}, expected imitation")
    if policy.distribution and policy.effects:
        raise UserError(f"a policy with effects and with distribution={policy.distribution}, expected one of them")
    distribution: Box | Posterior
    if policy.distribution:
        distribution = load_distribution(Path(policy.distribution), CONTROL_EFFECTS, nominal_values(cfg))
    else:
        distribution = box_of(cfg, policy.effects)
    return Source(lambda _: DrawnMachines(distribution), policy.history, policy.method, policy.recurrent)


def trained_on(
    cfg: ControlConfig, sources: Mapping[str, Source], seeds: int, steps: int | None = None
) -> dict[str, list[Policy]]:
    """A policy for each source, `seeds` times."""
    jobs = [(name, cfg.seed + k) for name in sources for k in range(seeds)]
    calls = (
        (
            cfg,
            sources[name].machines(seed),
            sources[name].history,
            _training(cfg, sources[name].method, steps),
            folder(cfg, name, seed),
            seed,
            sources[name].recurrent,
        )
        for name, seed in jobs
    )
    paths = parallel.run(_one, calls, cfg.jobs, cfg.backend)
    found: dict[str, list[Policy]] = {name: [] for name in sources}
    for (name, _), path in zip(jobs, paths, strict=True):
        found[name].append(Policy.load(path, cfg.task))
    return found


def folder(cfg: ControlConfig, name: str, seed: int) -> Path:
    """Where a policy is kept."""
    return Path(cfg.out) / f"{name.replace(' ', '_')}-{seed}"


def _training(cfg: ControlConfig, method: str, steps: int | None) -> Training:
    training: Training = cfg.imitation if method == "imitation" else cfg.training
    return training if steps is None else replace(training, steps=steps)


def _one(
    cfg: ControlConfig, machines: Machines, history: int, training: Training, out: Path, seed: int, recurrent: bool
) -> Path:
    log_to_terminal()
    return train(cfg.task, nominal_of(cfg), machines, history, training, out, seed, recurrent)
