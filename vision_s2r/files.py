"""Files that are there whole or not at all."""

import contextlib
import csv
import fcntl
import io
import json
import logging
import math
import secrets
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vision_s2r.errors import UserError

if TYPE_CHECKING:  # slow to import, and most who write files draw nothing
    from matplotlib.figure import Figure

log = logging.getLogger(__name__)


def write(path: Path, content: str | bytes) -> Path:
    """Write a file (text as UTF-8), and the folders above it; returns it. Raises UserError as `whole` does."""
    with whole(path) as temporary:
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def write_table(path: Path, records: Sequence[Mapping[str, Any]]) -> Path:
    """Write records as CSV, a line each under the keys of the last; returns the path. Raises UserError as `whole`."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(records[-1]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return write(path, text.getvalue())


def finite(data: Any) -> Any:
    """Plain data with None for numbers that are not finite, which JSON cannot hold."""
    if isinstance(data, dict):
        return {key: finite(value) for key, value in data.items()}
    if isinstance(data, list):
        return [finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def write_figure(path: Path, figure: "Figure", dpi: int) -> Path:
    """Write a figure as PNG; returns its path. Raises UserError as `whole` does."""
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=dpi)
    return write(path, content.getvalue())


def differing(path: Path, settings: Mapping[str, Any]) -> str | None:
    """The first key of plain `settings` in which those noted in a JSON file differ; None where they do not.

    Where there is no file yet, they are noted. Raises UserError as `whole` does.
    """
    content = json.dumps(settings, indent=1)
    if not path.exists():
        write(path, content)
        return None
    noted = json.loads(path.read_text())
    return next((name for name, value in json.loads(content).items() if noted.get(name) != value), None)


@contextlib.contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A name beside `path` to write a file under; it becomes `path` unless something is raised.

    The folders above it are made. Raises UserError where it cannot be written; what was there before stays.
    """
    temporary = path.with_name(f"{path.name}.{secrets.token_hex(4)}.tmp")  # two processes may write the same file
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        temporary.replace(path)
    except OSError as error:
        reason = error.strerror or error
        raise UserError(f"{path}: cannot be written ({reason}): what was there before is unchanged") from error
    finally:
        with contextlib.suppress(OSError):  # where a folder above it is a file, this too fails
            temporary.unlink()


@contextlib.contextmanager
def whole_folder(out: Path, *, replace: bool = False) -> Iterator[Path]:
    """A folder beside `out` to write into; it becomes `out` unless something is raised.

    What was in `out` is gone with `replace`. Raises UserError where there is something in it without, or it cannot be
    written.
    """
    try:
        if out.exists() and not replace and any(out.iterdir()):
            raise UserError(f"{out}: is not empty, expected a new folder")
        making = out.with_name(f"{out.name}.{secrets.token_hex(4)}.tmp")
        making.mkdir(parents=True)
    except OSError as error:
        raise UserError(f"{out}: cannot be written ({error.strerror})") from error
    try:
        yield making
        if out.exists():
            shutil.rmtree(out)
        making.rename(out)
    except OSError as error:
        raise UserError(f"{out}: cannot be written ({error.strerror or error})") from error
    finally:
        shutil.rmtree(making, ignore_errors=True)


@contextlib.contextmanager
def held(folder: Path) -> Iterator[None]:
    """Holds a folder, made where it is missing: whoever else would hold it waits until this one is done.

    Raises UserError where nothing can be written there.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / ".lock").open("w")
    except OSError as error:
        raise UserError(f"{folder}: cannot be written ({error.strerror})") from error
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            log.info("%s: another process works here and is waited for", folder)
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
