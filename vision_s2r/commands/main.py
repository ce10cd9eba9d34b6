"""From what was typed to what runs."""

import itertools
import os
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

from vision_s2r.commands import help as texts
from vision_s2r.commands.completion import script
from vision_s2r.commands.table import COMMANDS, FAMILIES, Command
from vision_s2r.errors import UserError, nearest

HELP = ("--help", "-h")


def main(*words: str) -> None:
    """Do what the command line says; `words` stand before its arguments, as in scripts/diagnose.py.

    Ends the process with 2 for a mistake of the user's, 130 where it was interrupted.
    """
    try:
        _dispatch([*words, *sys.argv[1:]])
    except UserError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:  # of `vision-s2r --help | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _dispatch(arguments: list[str]) -> None:
    first = arguments[0] if arguments else HELP[0]
    if first in HELP:
        print(texts.overview())
    elif first == "--version":
        print(f"{texts.PROGRAM} {version('vision-s2r')}")
    elif first == "completion":
        print(script(" ".join(arguments[1:])), end="")
    elif first in FAMILIES and (len(arguments) == 1 or arguments[1] in HELP):
        print(texts.family(first))
    else:
        command, rest = _chosen(arguments)
        if any(argument in HELP for argument in rest):
            print(texts.of(command))
        else:
            run(command, rest)


def _chosen(arguments: list[str]) -> tuple[Command, list[str]]:
    """The command that the arguments begin with, and those after it. Raises UserError with the nearest."""
    first, *rest = arguments
    if first not in FAMILIES:
        return _named(first, {name: each for name, each in COMMANDS.items() if " " not in name} | FAMILIES), rest
    members = {name.split()[1]: each for name, each in COMMANDS.items() if name.split()[0] == first}
    return _named(rest[0], members, f"{first}: "), rest[1:]


def _named(name: str, known: dict[str, Any], where: str = "") -> Command:
    if name not in known:
        raise UserError(f"{where}no command '{name}': {nearest(name, known)}")
    return known[name]


def run(command: Command, arguments: list[str]) -> None:
    """Import what a command needs, and run it with these overrides; what it returns is printed, a path a line."""
    from vision_s2r import cli  # Hydra takes longer to import than all help takes to print

    task, schema = command.load()
    bare = list(itertools.takewhile(lambda argument: "=" not in argument and not argument.startswith("-"), arguments))
    named = [f"{key}={word}" for key, word in zip(command.words, bare, strict=False)]
    arguments = named + arguments[len(named) :]
    if schema:
        cli.run(lambda cfg: _show(task(cfg), command.result), schema, command.config, arguments)
    else:
        cli.log_to_terminal()
        cli.or_exit(lambda: _show(task(arguments), command.result))


def _show(found: Any, called: str) -> None:
    for path in found if isinstance(found, list) else [found]:
        if isinstance(path, Path):
            print(f"{called}: {path}" if called else path)
