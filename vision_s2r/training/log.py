"""What a run shows while it runs: curves and pictures by a logger of Lightning's, pictures on disk, and progress."""

import os
import secrets
from collections.abc import Callable, Mapping
from multiprocessing import current_process
from pathlib import Path
from types import TracebackType
from typing import Any

from PIL import Image
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from torch import Tensor

from vision_s2r.errors import UserError
from vision_s2r.files import write
from vision_s2r.images import to_uint8
from vision_s2r.lazy import import_torchvision

LOGS = "logs"
RUN = "run-id.txt"  # of a logger that counts runs: what is resumed goes on under the same one


class RunLog:
    """Log of a run in the folder `out`: `logs/` by the named logger, `pictures/NAME-STEP.png`.

    Progress with the time left is shown on a terminal only. A context manager; a log that is not `active` (of
    any process but the leading one) does nothing. Raises UserError where the logger's packages are missing.
    """

    def __init__(self, out: Path, step: int, active: bool, logger: str = "tensorboard"):
        self._pictures = out / "pictures"
        try:
            self._logger = _LOGGERS[logger](out, step) if active else None
        except ImportError as error:
            raise UserError(f"training.logger = {logger} needs pip install 'vision-s2r[loggers]' ({error})") from error
        console = Console(stderr=True)
        columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
        arrow = TextColumn(f"→ {out}")
        alone = current_process().name == "MainProcess"  # bars of several processes would overwrite each other
        self._bar = Progress(*columns, arrow, console=console, disable=not (active and alone and console.is_terminal))
        self._task = self._bar.add_task("", total=1.0)

    def __enter__(self) -> "RunLog":
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()
        if self._logger:
            self._logger.finalize("success" if kind is None else "failed")
            # Of Weights & Biases, which would go on with the next training of the process.
            getattr(self._logger.experiment, "finish", lambda: None)()

    def progress(self, part: float, step: int) -> None:
        """`part` of the run is done, [0, 1]."""
        self._bar.update(self._task, completed=part, description=f"step {step}")

    def scalars(self, group: str, values: Mapping[str, float], step: int) -> None:
        """Curves GROUP/NAME."""
        if self._logger:
            self._logger.log_metrics({f"{group}/{name}": value for name, value in values.items()}, step)

    def pictures(self, pictures: Mapping[str, Tensor], step: int) -> None:
        """`pictures`: float [3, H, W] in [0, 1] by name."""
        if self._logger:
            for name, picture in pictures.items():
                self._pictures.mkdir(parents=True, exist_ok=True)
                pixels = to_uint8(picture).cpu().numpy()
                path = self._pictures / f"{name}-{step:07d}.png"
                Image.fromarray(pixels).save(path)
                self._show(name, picture, path, step)

    def _show(self, name: str, picture: Tensor, path: Path, step: int) -> None:
        assert self._logger
        if hasattr(self._logger.experiment, "add_image"):  # TensorBoard's
            self._logger.experiment.add_image(name, picture, step)
            self._logger.experiment.flush()
        elif hasattr(self._logger, "log_image"):
            self._logger.log_image(name, [str(path)], step=step)
        else:
            self._logger.experiment.log_artifact(self._logger.run_id, str(path), "pictures")


def _tensorboard(out: Path, step: int) -> Any:
    from lightning_fabric.loggers import TensorBoardLogger  # seconds

    # On resume, what a killed run logged after its last state is hidden.
    return TensorBoardLogger(out, name=LOGS, version="", purge_step=step)


def _wandb(out: Path, step: int) -> Any:
    """Offline: `wandb sync OUT/logs/wandb/offline-*` sends it where the user likes."""
    loggers = _lightning()
    (out / LOGS).mkdir(parents=True, exist_ok=True)
    run = _run(out, lambda: secrets.token_hex(4))
    return loggers.WandbLogger(
        name=out.name, save_dir=out / LOGS, offline=True, project="vision-s2r", id=run, resume="allow"
    )


def _mlflow(out: Path, step: int) -> Any:
    """Into a file; MLFLOW_TRACKING_URI names a server instead."""
    logs = (out / LOGS).absolute()
    logs.mkdir(parents=True, exist_ok=True)
    uri = os.environ.get("MLFLOW_TRACKING_URI")
    there = None if uri else (logs / "artifacts").as_uri()
    noted = logs / RUN
    known = noted.read_text() if noted.exists() else None
    loggers = _lightning()
    logger = loggers.MLFlowLogger(
        "vision-s2r", out.name, uri or f"sqlite:///{logs / 'mlflow.db'}", run_id=known, artifact_location=there
    )
    _run(out, lambda: str(logger.run_id))
    return logger


def _lightning() -> Any:
    import_torchvision()  # its metrics want it
    from pytorch_lightning import loggers

    return loggers


_LOGGERS: dict[str, Callable[[Path, int], Any]] = {"tensorboard": _tensorboard, "wandb": _wandb, "mlflow": _mlflow}


def _run(out: Path, new: Callable[[], str]) -> str:
    """The run's name with its logger; a new one is noted."""
    path = out / LOGS / RUN
    return path.read_text() if path.exists() else write(path, new()).read_text()
