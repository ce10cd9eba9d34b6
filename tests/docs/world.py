"""A folder in which the pages' code runs, and what their commands and configurations are checked by."""

import copy
import functools
import math
import shutil
from pathlib import Path
from typing import Any

from evaluate.stand_ins import render_scenes, save_untrained_policy, save_untrained_translator
from hydra.core.override_parser.overrides_parser import OverridesParser
from identify.machines import a_log, steps
from omegaconf import DictConfig, OmegaConf
from recordings import EXAMPLES

from vision_s2r import cli, overrides
from vision_s2r.camera import load_config
from vision_s2r.commands.table import COMMANDS, FAMILIES
from vision_s2r.config_reference import CONFIGURATIONS
from vision_s2r.grasp import GraspConfig
from vision_s2r.networks.unet import NetworkConfig
from vision_s2r.paths import CONFIGS
from vision_s2r.recording import write
from vision_s2r.scene import SceneConfig


def make(folder: Path) -> Path:
    """Small recordings, renders and untrained checkpoints, where the pages look for them."""
    (folder / "recordings").mkdir()
    write(a_log({"viscous_damping": {"value": 0.13}}, steps(5, 240)), folder / "recordings" / "joint")
    shutil.copytree(EXAMPLES / "camera_no_gap", folder / "recordings" / "camera")
    render_scenes(folder / "renders" / "cpu" / "test", scenes=2)
    render_scenes(folder / "renders" / "released" / "128" / "seed-2-scenes-500", scenes=2, size=128)
    runs = folder / "outputs" / "cpu"
    save_untrained_policy(runs / "policy-0" / "best.safetensors", GraspConfig(picture="canonical"))
    save_untrained_translator(runs / "translator-0" / "best.safetensors", NetworkConfig(levels=2))
    (folder / "configs").symlink_to(CONFIGS)
    (folder / "logs").mkdir()
    rows = (f"{10 * k},{90 * math.sin(0.03 * k):.3f},{math.cos(0.03 * k):.4f}" for k in range(400))
    (folder / "logs" / "bench.csv").write_text("\n".join(["time (ms),angle (deg),amps", *rows]) + "\n")
    return folder


def compose(words: list[str]) -> None:
    """Compose what `vision-s2r` is asked for. Raises UserError, or KeyError where there is no such command."""
    size = 2 if words[0] in FAMILIES else 1
    command = COMMANDS[" ".join(words[:size])]
    schema, name = command.load()[1] or CONFIGURATIONS[command.config], command.config
    given, elements = overrides.split(schema, words[size:])
    parsed = OverridesParser.create().parse_overrides(given)
    names = {each.input_line: str(each.key_or_group) for each in parsed}
    groups = [each for each in parsed if (CONFIGS / names[each.input_line]).is_dir()]
    groups += [each for each in parsed if names[each.input_line].startswith("hydra.")]  # Hydra checks its own
    cfg = copy.deepcopy(_composed(schema, name, tuple(each.input_line for each in groups)))
    for each in parsed:
        if each not in groups:
            OmegaConf.update(cfg, each.key_or_group, each.value())  # raises for an unknown key or a wrong type
    for element in elements:
        overrides.add(cfg, element)


@functools.cache
def _composed(schema: type, name: str, groups: tuple[str, ...]) -> DictConfig:
    """The typed configuration of these groups; composing one takes half a second."""
    return OmegaConf.structured(cli.compose(schema, name, list(groups)))


def check_yaml(content: Any, code: str, folder: Path) -> None:
    """A camera's configuration loads, a scene's fits its schema; of the rest it is enough that it parses."""
    assert isinstance(content, dict)
    if "defaults" in content:  # a group's file: its keys are those of the schema
        keys = {key: value for key, value in content.items() if key != "defaults"}
        OmegaConf.merge(OmegaConf.structured(SceneConfig), keys)
    if "effects" in content:
        path = folder / "camera.yaml"
        path.write_text(code)
        load_config(path)
