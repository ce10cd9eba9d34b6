"""Completion for shells: a script that knows every command, choice and key, and asks nobody."""

from vision_s2r.commands.keys import groups, keys
from vision_s2r.commands.table import COMMANDS, FAMILIES, Command
from vision_s2r.errors import UserError, nearest

# Readline breaks words at "=" too: what is before it is not part of a candidate.
_BASH = """_vision_s2r() {{
  local line word given found before IFS=$' \\t\\n'
  line=${{COMP_LINE:0:COMP_POINT}}
  word=${{line##*[[:space:]]}}
  before=(${{line%"$word"}})
  given="${{before[*]:1}} "
{cases}
  COMPREPLY=($(compgen -W "$found" -- "$word"))
  if [[ $word == *=* ]]; then
    COMPREPLY=("${{COMPREPLY[@]#"${{word%%=*}}="}}")
    [[ -n ${{COMPREPLY[0]-}} ]] || COMPREPLY=()
  fi
}}
complete -o default -o nospace -F _vision_s2r vision-s2r
"""
_ZSH = """#compdef vision-s2r
_vision_s2r() {{
  local given found
  given="${{(j: :)words[2,CURRENT-1]}} "
{cases}
  if [[ $PREFIX == *=* && -z ${{(M)${{=found}}:#${{PREFIX}}?*}} ]]; then
    compset -P '*='
    _files
  else
    compadd -S '' -- ${{=found}}
  fi
}}
compdef _vision_s2r vision-s2r
"""
SHELLS = {"bash": _BASH, "zsh": _ZSH}


def script(shell: str) -> str:
    """What a shell evaluates to complete commands, choices and keys. Raises UserError for one that is not known."""
    if shell not in SHELLS:
        raise UserError(f"completion: no shell '{shell}': {nearest(shell, SHELLS)}")
    return SHELLS[shell].format(cases=_cases())


def _cases() -> str:
    """By what has been given so far, the words that may follow."""
    after: dict[str, list[str]] = {}  # words: what they follow
    for name, command in COMMANDS.items():
        after.setdefault(_words(command), []).append(name)
    for name in FAMILIES:
        after[" ".join(each.split()[1] for each in COMMANDS if each.split()[0] == name)] = [name]
    after[" ".join(SHELLS)] = ["completion"]
    first = dict.fromkeys(name.split()[0] for name in [*COMMANDS, "completion"])
    lines = [
        f"""    {"|".join(f"'{name} '*" for name in names)}) found='{words}' ;;""" for words, names in after.items()
    ]
    return "\n".join(['  case "$given" in', *lines, f"    *) found='{' '.join(first)}' ;;", "  esac"])


def _words(command: Command) -> str:
    choices = [f"{group.key}={option}" for group in groups(command) for option in group.options]
    given = [f"{key.name}=" for key in keys(command, every=True) if key.value is not None]
    return " ".join([*choices, *given, "--help", "--cfg", "--multirun"])
