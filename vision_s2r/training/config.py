"""What the training loop is told, whatever it trains."""

from dataclasses import dataclass

from vision_s2r.errors import UserError, nearest

MODES = ("min", "max")
PRECISIONS = ("32-true", "bf16-mixed")


@dataclass
class TrainingConfig:
    """One run of the loop. `max_steps`, `max_minutes` or both are set; the first to be reached ends it."""

    max_steps: int = 0  # optimization steps; 0: no limit
    max_minutes: float = 0.0  # wall-clock minutes, validation included; 0: no limit
    batch_size: int = 32  # samples a step over all processes together
    learning_rate: float = 1e-3  # of every optimizer that sets no other, at its highest
    weight_decay: float = 1e-4  # decoupled (AdamW)
    warmup: float = 0.03  # part of the run over which the learning rate rises from 0
    clip: float = 1.0  # largest norm of a network's gradient; 0: any
    validate_every: int = 500  # steps between validations; the state for resuming is saved at each
    metric: str = ""  # validation metric that chooses the best checkpoint
    mode: str = "min"  # min | max of it is best
    log_every: int = 50  # steps between lines of losses in TensorBoard
    accelerator: str = "auto"  # auto | cpu | cuda | …, as Lightning Fabric names them
    devices: int = 1  # processes a node, one a device
    num_nodes: int = 1
    strategy: str = "auto"  # auto | ddp | ddp_spawn: how processes share the work
    precision: str = "32-true"  # 32-true | bf16-mixed


def check(cfg: TrainingConfig) -> None:
    """Raises UserError where a value is out of its range."""
    if cfg.max_steps <= 0 and cfg.max_minutes <= 0:
        raise UserError("training: neither max_steps nor max_minutes is set: expected at least one above 0")
    for key in ("batch_size", "learning_rate", "validate_every", "log_every", "devices", "num_nodes"):
        if getattr(cfg, key) <= 0:
            raise UserError(f"training.{key} = {getattr(cfg, key)}: expected a number above 0")
    for key in ("max_steps", "max_minutes", "weight_decay", "clip"):
        if getattr(cfg, key) < 0:
            raise UserError(f"training.{key} = {getattr(cfg, key)}: expected a number of 0 or more")
    if not 0 <= cfg.warmup < 1:
        raise UserError(f"training.warmup = {cfg.warmup}: expected a part of the run, 0 ≤ warmup < 1")
    for key, known in (("mode", MODES), ("precision", PRECISIONS)):
        if getattr(cfg, key) not in known:
            raise UserError(f"training.{key} = '{getattr(cfg, key)}': {nearest(getattr(cfg, key), known)}")
    processes = cfg.devices * cfg.num_nodes
    if cfg.batch_size % processes:
        raise UserError(f"training.batch_size = {cfg.batch_size}: expected a multiple of the {processes} processes")
