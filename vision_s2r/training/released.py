"""Checkpoints that come with the package, by name: `Translator.load("bin-64")`."""

from pathlib import Path

from vision_s2r.errors import UserError, nearest

WEIGHTS = Path(__file__).resolve().parents[1] / "weights"


def names(kind: str) -> list[str]:
    """Of the released checkpoints of a kind."""
    return sorted(path.stem for path in (WEIGHTS / kind).glob("*.safetensors"))


def resolve(path: str | Path, kind: str) -> Path:
    """The file of a released checkpoint's name; any other path as it is.

    A name has no folder and no ending. Raises UserError, with the names there are, where it is none of the kind.
    """
    path = Path(path)
    if path.suffix or len(path.parts) != 1 or path.exists():
        return path
    known = names(kind)
    if path.name not in known:
        listed = ", ".join(known) or "none"
        raise UserError(f"no released {kind} '{path}', {nearest(path.name, known)} (released: {listed})")
    return WEIGHTS / kind / f"{path}.safetensors"
