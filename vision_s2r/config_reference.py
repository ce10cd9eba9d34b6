"""The reference of every configuration key: what it is, its default, what it may be.

`python -m vision_s2r.config_reference` writes the table that the command line's help reads: it is to be there without
importing what the configurations belong to.
"""

import inspect
import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, is_dataclass
from pathlib import Path
from typing import Any, get_args, get_type_hints

import yaml

from vision_s2r.ablation.config import AblationStudyConfig
from vision_s2r.actuator.config import ActuatorConfig
from vision_s2r.close_gap.config import CloseGapStudyConfig
from vision_s2r.commands.keys import TABLE
from vision_s2r.config import Config
from vision_s2r.control.config import ControlConfig
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.replay import ReplayConfig
from vision_s2r.export.config import ExportConfig
from vision_s2r.export.lerobot import LeRobotConfig
from vision_s2r.export.rerun import RerunConfig
from vision_s2r.files import write
from vision_s2r.gapbench.config import GapbenchConfig
from vision_s2r.hardware.config import HardwareConfig
from vision_s2r.identify.config import IdentifyConfig
from vision_s2r.imports.config import ImportConfig
from vision_s2r.metrics.config import MetricsConfig
from vision_s2r.options import declared
from vision_s2r.paths import CONFIGS
from vision_s2r.reliability.config import ReliabilityConfig
from vision_s2r.translate.video import VideoConfig

# By file of configs/: the configuration that it composes.
CONFIGURATIONS: dict[str, type] = {
    "config": Config,
    "ablation": AblationStudyConfig,
    "close_gap": CloseGapStudyConfig,
    "diagnose": DiagnoseConfig,
    "replay": ReplayConfig,
    "import": ImportConfig,
    "export": ExportConfig,
    "reliability": ReliabilityConfig,
    "export_lerobot": LeRobotConfig,
    "export_rerun": RerunConfig,
    "translate_video": VideoConfig,
    "identify": IdentifyConfig,
    "gapbench": GapbenchConfig,
    "hardware": HardwareConfig,
    "metrics": MetricsConfig,
    "actuator": ActuatorConfig,
    "control": ControlConfig,
}


@dataclass(frozen=True)
class ReferenceRow:
    """One key."""

    key: str  # NAME in it stands for what the user may choose
    default: str | None  # as it is given on the command line; None where it holds other keys
    values: str  # what it may be, in words; empty: anything of its type
    comment: str


def key_table() -> str:
    """The keys of every configuration, with defaults and comments, as JSON."""
    found = {
        name: [[row.key, row.default, row.comment] for row in _own(schema)] for name, schema in CONFIGURATIONS.items()
    }
    lines = (f" {json.dumps(name)}: [\n{_lines(rows)}\n ]" for name, rows in found.items())
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _lines(rows: Iterable[list[str | None]]) -> str:
    return ",\n".join(f"  {json.dumps(row, ensure_ascii=False)}" for row in rows)


def config_reference() -> dict[str, str]:
    """Pages in Markdown by name: each configuration, and each part of the visual pipeline's.

    A page has every key, and what each file of the group of that name sets.
    """
    visual = Config()
    pages = {"config": _page("config", inspect.getdoc(Config), _rows(visual, deep=False), "experiment")}
    parts = [(name, part, limits) for name, part, limits in declared(visual) if is_dataclass(part)]
    for k, (name, part, limits) in enumerate(parts):
        text = f"{limits.comment} {inspect.getdoc(type(part))}"
        like = next((other for other, before, _ in parts[:k] if before == part), None)
        if like:
            pages[name] = f"# {name}\n\n{limits.comment} Keys as those of [{like}]({like}.md).\n"
        else:
            pages[name] = _page(name, text, _rows(part, f"{name}."), name)
    for name, schema in CONFIGURATIONS.items():
        if schema is not Config:
            pages[name] = _page(name, inspect.getdoc(schema), _own(schema), name)
    return pages


def _page(name: str, text: str | None, rows: Iterator[ReferenceRow], group: str) -> str:
    files = map(_file, sorted((CONFIGS / group).glob("*.yaml")))
    return "\n\n".join([f"# {name}", str(text), _markdown(rows), *files]) + "\n"


def _own(schema: type) -> Iterator[ReferenceRow]:
    """Every key of a configuration that is not one of the visual pipeline's, which it extends."""
    visual = {row.key for row in _rows(Config())} if issubclass(schema, Config) and schema is not Config else set()
    return (row for row in _rows(schema()) if row.key not in visual)


def _rows(cfg: object, where: str = "", deep: bool = True) -> Iterator[ReferenceRow]:
    """Every key of a configuration, if `deep` of its parts too."""
    hints = get_type_hints(type(cfg))
    for name, value, limits in declared(cfg):
        key = where + name
        if is_dataclass(value):
            if deep:
                yield ReferenceRow(key, None, "", limits.comment)
                yield from _rows(value, f"{key}.")
            continue
        yield ReferenceRow(key, _plain(value), limits.expected(isinstance(value, list)), limits.comment)
        element = get_args(hints[name])[-1:]
        if isinstance(value, dict) and is_dataclass(element[0]):
            yield from _rows(element[0](), f"{key}.NAME.")  # type: ignore[operator]  # its class


def _plain(value: Any) -> str:
    """A value as it is given on the command line."""
    if isinstance(value, dict):
        value = {name: each if isinstance(each, (dict, list, int)) else asdict(each) for name, each in value.items()}
    text = yaml.safe_dump(value, default_flow_style=True, width=10_000, sort_keys=False, allow_unicode=True)
    return text.removesuffix("...\n").strip()


def _markdown(rows: Iterable[ReferenceRow]) -> str:
    lines = ["| Key | Default | Values | |", "|---|---|---|---|"]
    for row in rows:
        default = f"`{row.default}`" if row.default is not None else ""
        cells = (each.replace("|", "\\|") for each in (f"`{row.key}`", default, row.values, row.comment))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _file(path: Path) -> str:
    """A file of a group: its first comment, and what it sets."""
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("# @package")]
    comment = []
    while lines and lines[0].startswith("#"):
        comment.append(lines.pop(0).removeprefix("#").strip())
    body = "\n".join(lines).strip()
    code = f"\n\n```yaml\n{body}\n```" if body else ""
    return f"**`{path.parent.name}={path.stem}`** {' '.join(comment)}{code}"


if __name__ == "__main__":
    print(write(TABLE, key_table()))
