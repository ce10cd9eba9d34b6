"""Files that are there whole or not at all."""

from pathlib import Path

from vision_s2r.errors import UserError


def write(path: Path, content: str | bytes) -> Path:
    """Write a file, and the folders above it; returns it. Raises UserError where it cannot be written."""
    temporary = path.with_name(path.name + ".tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)
        temporary.replace(path)
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error.strerror})") from error
    finally:
        temporary.unlink(missing_ok=True)
    return path
