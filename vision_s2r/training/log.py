"""What a run shows while it runs: TensorBoard, pictures on disk and a line of progress."""

from collections.abc import Mapping
from multiprocessing import current_process
from pathlib import Path
from types import TracebackType

from PIL import Image
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from torch import Tensor
from torch.utils.tensorboard import SummaryWriter

from vision_s2r.images import to_uint8


class RunLog:
    """Log of a run in the folder `out`: `logs/` for TensorBoard, `pictures/NAME-STEP.png`.

    Progress with the time left is shown on a terminal only. A context manager; a log that is not `active` (of
    any process but the leading one) does nothing.
    """

    def __init__(self, out: Path, step: int, active: bool):
        self._pictures = out / "pictures"
        # On resume, what a killed run logged after its last state is hidden.
        self._writer = SummaryWriter(out / "logs", purge_step=step) if active else None
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
        if self._writer:
            self._writer.close()

    def progress(self, part: float, step: int) -> None:
        """`part` of the run is done, [0, 1]."""
        self._bar.update(self._task, completed=part, description=f"step {step}")

    def scalars(self, group: str, values: Mapping[str, float], step: int) -> None:
        """Curves GROUP/NAME."""
        if self._writer:
            for name, value in values.items():
                self._writer.add_scalar(f"{group}/{name}", value, step)

    def pictures(self, pictures: Mapping[str, Tensor], step: int) -> None:
        """`pictures`: float [3, H, W] in [0, 1] by name."""
        if self._writer:
            for name, picture in pictures.items():
                self._writer.add_image(name, picture, step)
                self._pictures.mkdir(parents=True, exist_ok=True)
                pixels = to_uint8(picture).cpu().numpy()
                Image.fromarray(pixels).save(self._pictures / f"{name}-{step:07d}.png")
            self._writer.flush()
