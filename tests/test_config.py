"""Every key has one default and one comment, in its dataclass; a file of configs/ says only what differs from them."""

import importlib
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from omegaconf import OmegaConf

from vision_s2r.cli import compose
from vision_s2r.commands.keys import TABLE
from vision_s2r.config import Config
from vision_s2r.config_reference import CONFIGURATIONS, config_reference, key_table
from vision_s2r.diagnose.config import DiagnoseConfig, SearchConfig
from vision_s2r.errors import UserError
from vision_s2r.paths import CONFIGS


@cache
def by_itself(schema: type) -> dict[str, Any]:
    return OmegaConf.to_container(OmegaConf.structured(schema))


def own(path: Path) -> dict[str, Any]:
    """What a file sets itself, from the root of the configuration on."""
    content = OmegaConf.to_container(OmegaConf.load(path))
    for name in ("defaults", "hydra"):
        content.pop(name, None)
    package = re.match(r"# @package (\S+)", path.read_text())
    where = package[1] if package else "_global_" if path.parent == CONFIGS else path.parent.name
    return content if where == "_global_" else {where: content}


def before(path: Path) -> dict[str, Any]:
    """What a file is on top of: the defaults, what the files set that it names, and for an experiment the table."""
    name = path.stem if path.parent == CONFIGS else path.parent.name
    found = by_itself(CONFIGURATIONS.get(name, Config))
    parents = [path.parent / f"{each}.yaml" for each in OmegaConf.load(path).get("defaults", [])]
    if name == "experiment":
        parents.append(CONFIGS / "evaluate" / "default.yaml")
    for parent in filter(Path.exists, parents):
        found = OmegaConf.to_container(OmegaConf.merge(found, before(parent), own(parent)))
    return found


def leaves(content: Any, where: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in content.items():
        if isinstance(value, dict) and value:
            yield from leaves(value, f"{where}{name}.")
        else:
            yield f"{where}{name}", value


@pytest.mark.parametrize("path", sorted(CONFIGS.rglob("*.yaml")), ids=lambda path: str(path.relative_to(CONFIGS)))
def test_no_file_repeats_a_default(path):
    defaults = dict(leaves(before(path)))
    assert not [key for key, value in leaves(own(path)) if defaults.get(key, ...) == value]


def test_a_configuration_in_memory_is_the_command_lines():
    """Where no group sets anything else; the camera's search was only ever measured with few sets."""
    found = compose(DiagnoseConfig, "diagnose")
    assert found == DiagnoseConfig() and found.camera == SearchConfig(
        folds=2, beam=1, breadth=4, contenders=2, hidden=False, beside=True, known=True
    )
    for name in ("replay", "identify", "metrics", "actuator", "control"):
        assert compose(CONFIGURATIONS[name], name) == CONFIGURATIONS[name]()
    visual = compose(Config, overrides=["~experiment"])
    for name in ("scene", "render", "data", "translate", "adapt", "grasp", "benchmark", "finetune"):
        assert getattr(visual, name) == getattr(Config(), name), name


def test_what_extends_the_visual_pipeline_has_its_experiments():
    cfg = compose(CONFIGURATIONS["close_gap"], "close_gap", ["experiment=demo", "recording=DIR"])
    assert cfg.close_gap.withheld == 1 and cfg.name == "demo" and cfg.recording == "DIR"
    full = compose(CONFIGURATIONS["close_gap"], "close_gap")
    assert full.close_gap == CONFIGURATIONS["close_gap"]().close_gap and full.translate.training.max_steps == 6200


def test_the_table_of_the_help_is_up_to_date():
    assert TABLE.read_text(encoding="utf-8") == key_table(), "run python -m vision_s2r.config_reference"


def test_every_key_has_a_comment_and_the_reference_has_every_key():
    text = "".join(config_reference().values())
    for path in Path("vision_s2r").rglob("config.py"):
        module = importlib.import_module(".".join(path.with_suffix("").parts))
        for name, found in vars(module).items():
            if is_dataclass(found) and name.endswith("Config") and found.__module__ == module.__name__:
                for each in fields(found):
                    assert each.metadata["option"].comment.strip(), f"{name}.{each.name}"
                    assert re.search(rf"(# |[`.]){each.name}\b", text), f"{name}.{each.name}"


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("render.scenes=0", "render.scenes = 0: expected at least 1"),
        ("data.train.size=8", "data.train.size = 8: expected at least 16"),
        ("grasp.training.warmup=1", "grasp.training.warmup = 1.0: expected 0 to below 1"),
        ("grasp.form=crp", "grasp.form = 'crp': did you mean 'crop'?"),
        ("see" + 400 * "9" + "=1", "9…: File name too long"),
        ("grasp.crop.resolution=[10,16]", "expected 2 values, multiples of 4, 8 to 256"),
        ("baseline.front.width=12", "baseline.front.width = 12: expected multiples of 8, above 0"),
        ("evaluate.rows.rcan.picture=canonicl", "evaluate.rows.rcan.picture = 'canonicl': did you mean 'canonical'?"),
        ("finetune.counts=[5,0]", "finetune.counts = [5, 0]: expected rising, each once, at least 0"),
        ("translate.loss.depth=nan", "translate.loss.depth = nan: expected at least 0"),
    ],
)
def test_a_value_that_cannot_be_is_one_line_with_key_value_and_what_is_expected(override, message):
    with pytest.raises(UserError, match=re.escape(message)):
        compose(Config, overrides=[override])


def test_the_keys_of_what_the_user_names_are_checked():
    with pytest.raises(UserError, match=r"counts\.single = -1: expected at least 0"):
        compose(CONFIGURATIONS["gapbench"], "gapbench", ["counts.single=-1"])
    with pytest.raises(UserError, match=r"policies\.mine\.history = -1: expected at least 0"):
        compose(CONFIGURATIONS["control"], "control", ["+policies.mine.history=-1"])


def test_what_the_command_line_takes_out_of_a_mapping_is_gone():
    found = compose(CONFIGURATIONS["control"], "control", ["~policies.history", "~truth.coulomb_friction"])
    assert "history" not in found.policies and len(found.policies) > 1
    assert set(found.truth) == {"viscous_damping"}
