"""The card of an exported network."""

from pathlib import Path

from vision_s2r.export.graphs import Graph, Port


def card(name: str, graph: Graph, difference: float) -> str:
    """Markdown: what goes in and comes out, where it is from, and the card that its checkpoint has, if any."""
    source = graph.checkpoint.path
    lines = [f"# {name}", "", f"From {source.name}. At most {difference:.1e} from torch's outputs, float32.", ""]
    lines += ["| | name | shape | what |", "| --- | --- | --- | --- |"]
    lines += [_row("in", port) for port in graph.inputs] + [_row("out", port) for port in graph.outputs]
    lines += ["", *_facts(graph), *_own(source)]
    return "\n".join(lines) + "\n"


def _row(way: str, port: Port) -> str:
    return f"| {way} | `{port.name}` | {', '.join(map(str, port.shape))} | {port.meaning} |"


def _facts(graph: Graph) -> list[str]:
    """Of its training."""
    metrics = graph.checkpoint.training.get("metrics", {})
    listed = ", ".join(f"{name} {value:.4g}" for name, value in sorted(metrics.items()))
    return [f"Step {graph.checkpoint.training.get('step', '?')} of its training; on validation scenes: {listed}.", ""]


def _own(source: Path) -> list[str]:
    path = source.with_suffix(".md")
    return [path.read_text().replace("\n# ", "\n## ").replace("# ", "## ", 1)] if path.is_file() else []
