"""The reference of every configuration key."""

from pathlib import Path

CONFIGS = Path(__file__).resolve().parents[2] / "configs"


def pages() -> dict[str, str]:
    """Pages in Markdown by name: a group of configs/, with its files."""
    groups = sorted({path.relative_to(CONFIGS).parts[0].removesuffix(".yaml") for path in CONFIGS.rglob("*.yaml")})
    return {group: _page(group) for group in groups}


def _page(group: str) -> str:
    paths = [path for path in (CONFIGS / f"{group}.yaml", *sorted((CONFIGS / group).glob("*.yaml"))) if path.exists()]
    parts = [f"## {path.relative_to(CONFIGS)}\n\n```yaml\n{path.read_text(encoding='utf-8')}```" for path in paths]
    return f"# {group}\n\n" + "\n\n".join(parts) + "\n"
