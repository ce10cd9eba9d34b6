"""What every command does around its task: compose a typed configuration, report mistakes in one line.

Exit codes: 0 done, 2 a mistake of the user's, 130 interrupted.
"""

import logging
import re
import sys
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, TypeVar

import hydra
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException, MissingConfigException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from vision_s2r.errors import UserError, nearest
from vision_s2r.options import validate
from vision_s2r.overrides import add, split
from vision_s2r.paths import CONFIGS

Schema = TypeVar("Schema")
MULTIRUN = ("--multirun", "-m")
_structured: Callable[..., Any] = cache(OmegaConf.structured)  # a sixth of the time that composing takes


def run(task: Callable[[Schema], Any], schema: type[Schema], name: str, arguments: list[str]) -> None:
    """Run `task` with configs/NAME.yaml, the arguments' overrides on top, as an instance of `schema`.

    Where there is a flag among the arguments, Hydra takes them all: a sweep, the configuration printed …
    """
    if not any(argument.startswith("-") for argument in arguments):
        log_to_terminal()
        or_exit(lambda: task(compose(schema, name, arguments)))
        return

    @hydra.main(version_base="1.3", config_path=str(CONFIGS), config_name=name)
    def one(cfg: DictConfig) -> None:
        log_to_terminal()
        or_exit(lambda: task(typed(cfg, schema, HydraConfig.get().overrides.task)))

    sys.argv[1:] = sorted(arguments, key=lambda argument: argument not in MULTIRUN)  # overrides may stand before it
    one()


def log_to_terminal() -> None:
    """Progress lines go to standard error; a process that has been told already stays as it is."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s", datefmt="%H:%M:%S")


def compose(schema: type[Schema], name: str = "config", overrides: list[str] | None = None) -> Schema:
    """The typed configuration that a command would get from these overrides.

    Raises UserError for a mistyped key, group or value, with the nearest valid one.
    """
    GlobalHydra.instance().clear()  # a command's own composition is over by then
    with hydra.initialize_config_dir(str(CONFIGS), version_base="1.3"):
        try:
            given, elements = split(schema, overrides or [])
            cfg = hydra.compose(name, given)
        except MissingConfigException as error:
            raise UserError(_missing(error)) from error
        except (HydraException, OmegaConfBaseException) as error:
            raise UserError(_explain(str(error), hydra.compose(name))) from error
        except AssertionError as error:  # omegaconf's own
            raise UserError(f"{' '.join(given):.80}: what this key is in is null, give that whole, {{…}}") from error
        except OSError as error:  # a key is looked for as a file
            raise UserError(f"a key of {max(overrides or [''], key=len):.40}…: {error.strerror}") from error
    for element in elements:
        add(cfg, element)
    return typed(cfg, schema, given)


def typed(cfg: DictConfig, schema: type[Schema], overrides: Sequence[str] = ()) -> Schema:
    """Check a composed configuration against the schema. Raises UserError for unknown keys, wrong types and values.

    `overrides`: those that it was composed with, for what they take out of the schema's own mappings (~policies.NAME).
    """
    try:
        merged = OmegaConf.merge(_structured(schema), cfg)
        found = OmegaConf.to_object(merged)
    except OmegaConfBaseException as error:
        key = getattr(error, "full_key", None)
        raise UserError(f"configuration key '{key}': {_first_line(error)}") from error
    for override in overrides:
        if override.startswith("~"):
            _remove(found, override[1:].partition("=")[0])
    validate(found)
    return found  # type: ignore[return-value]


def _remove(cfg: Any, key: str) -> None:
    """Take an element out of a mapping; keys of the schema's own stay."""
    *where, name = key.split(".")
    for part in where:
        cfg = cfg.get(part) if isinstance(cfg, dict) else getattr(cfg, part, None)
    if isinstance(cfg, dict):
        cfg.pop(name, None)


def or_exit(task: Callable[[], Any]) -> None:
    """Run a task; a mistake of the user's or an interrupt ends the process with one line and its exit code."""
    try:
        task()
    except UserError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("interrupted: the same command goes on where it stopped", file=sys.stderr)
        sys.exit(130)


def _explain(message: str, base: DictConfig) -> str:
    """Name the nearest valid key for an override that Hydra would not take."""
    found = re.search(r"(?:Could not override '|full_key: |In '.*?': Could not find ')([\w./]+)", message)
    if not found:
        return " ".join(message.split())
    keys = _keys(OmegaConf.to_container(base))
    key = found[1]
    if isinstance(OmegaConf.select(base, key), DictConfig):
        return f"configuration key '{key}': names are added to it: +{key}={{…}}"
    if key in keys:
        return f"configuration key '{key}': {message.splitlines()[0]}"
    return f"unknown configuration key '{key}': {nearest(key, keys)}"


def _missing(error: MissingConfigException) -> str:
    group, _, choice = (error.missing_cfg_file or "").rpartition("/")
    options = [path.stem for path in (CONFIGS / group).glob("*.yaml")]
    if not options:
        return " ".join(str(error).split())
    return f"no configuration '{choice}' in configs/{group}: {nearest(choice, options)}"


def _keys(data: Any, prefix: str = "") -> list[str]:
    if not isinstance(data, dict):
        return [prefix[:-1]]
    return [prefix[:-1], *(key for k, v in data.items() for key in _keys(v, f"{prefix}{k}."))]


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0]
