"""The reference of the command line, from its own table."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the package of these pages, whatever is installed

from vision_s2r.commands.table import COMMANDS

HEAD = """# Commands

`vision-s2r COMMAND KEY=VALUE GROUP=NAME …`: any key of the configuration is an argument, any group of files below
`configs/` is chosen by name. `vision-s2r COMMAND --help` explains the keys that matter, `vision-s2r completion bash`
completes them. From a checkout, `python scripts/COMMAND.py` is the same.
"""


def page() -> str:
    """Every command with what it does, its configuration and its examples, in Markdown."""
    parts, group = [HEAD], ""
    for command in COMMANDS.values():
        if command.group != group:
            group = command.group
            parts.append(f"## {group}\n")
        parts.append(
            f"### {command.name}\n\n{command.help}. Keys: [{command.config}](configuration/{command.config}.md).\n"
        )
        if command.examples:
            lines = [f"vision-s2r {command.name} {words}  # {what}" for words, what in command.examples]
            parts.append("\n".join(["```bash", *lines, "```\n"]))
    return "\n".join(parts)
