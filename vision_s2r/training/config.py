"""What the training loop is told, whatever it trains."""

from dataclasses import dataclass

from vision_s2r.errors import UserError
from vision_s2r.options import option, validate

MODES = ("min", "max")
LOGGERS = ("tensorboard", "wandb", "mlflow")
PRECISIONS = ("auto", "32-true", "bf16-mixed")


@dataclass
class TrainingConfig:
    """One run of the loop. `max_steps`, `max_minutes` or both are set; the first to be reached ends it."""

    max_steps: int = option(0, "Optimization steps; 0: no limit. The first limit to be reached ends the run.", low=0)
    max_minutes: float = option(0.0, "Wall-clock minutes, validation included; 0: no limit.", low=0)
    batch_size: int = option(32, "Samples (of policies: scenes) a step, over all processes together.", above=0)
    learning_rate: float = option(
        1e-3,
        "Of every optimizer that sets no other, at its highest: it rises from 0 over the warm-up and falls to 0 along "
        "half a cosine.",
        above=0,
    )
    muon: float = option(
        0.0,
        "Of Muon, at its highest, which then takes the kernels of residual blocks; 0: AdamW takes them.",
        low=0,
    )
    weight_decay: float = option(1e-4, "Decoupled weight decay (AdamW), of matrices and kernels.", low=0)
    warmup: float = option(0.03, "Part of the run over which the learning rate rises from 0.", low=0, below=1)
    clip: float = option(1.0, "Largest norm of a network's gradient; 0: any.", low=0)
    validate_every: int = option(
        500, "Steps between validations; the state that a run resumes from is saved at each.", above=0
    )
    metric: str = option("", "Validation metric that chooses the best checkpoint.")
    mode: str = option("min", "Whether the least or the most of the metric is best.", choices=MODES)
    log_every: int = option(50, "Steps between points of the loss curves.", above=0)
    logger: str = option(
        "tensorboard",
        "Where curves and pictures go, in OUT/logs: TensorBoard, Weights & Biases (offline) or MLflow.",
        choices=LOGGERS,
    )
    accelerator: str = option("auto", "Where it runs, in the words of Lightning Fabric: auto, cpu, cuda, …")
    devices: int = option(1, "Processes a node, one a device.", above=0)
    num_nodes: int = option(1, "Machines.", above=0)
    strategy: str = option("auto", "How processes share the work: auto, ddp, ddp_spawn.")
    resident: bool = option(
        False, "Whether the views lie on the device whole: a GPU then waits for no disk, where its memory holds them."
    )
    compile: bool = option(
        False,
        "Whether torch compiles the U-Net that is trained: most of a minute first, then half of its time on an H100.",
    )
    precision: str = option(
        "32-true",
        "Arithmetic of training; auto: bf16-mixed where the processor or the GPU multiplies bfloat16 itself, which is "
        "faster there, else 32-true.",
        choices=PRECISIONS,
    )


def check(cfg: TrainingConfig) -> None:
    """Raises UserError where a value is out of its range, or two contradict each other."""
    validate(cfg, "training")
    if not cfg.max_steps and not cfg.max_minutes:
        raise UserError("training: neither max_steps nor max_minutes is set: expected at least one above 0")
    processes = cfg.devices * cfg.num_nodes
    if cfg.batch_size % processes:
        raise UserError(f"training.batch_size = {cfg.batch_size}: expected a multiple of the {processes} processes")
