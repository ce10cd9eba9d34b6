"""The one exception for mistakes of the user's, which commands print as one line with exit code 2."""

import difflib
from collections.abc import Collection, Iterable
from typing import Any


class UserError(Exception):
    """Bad input. The message is one line: what is wrong, where, and what was expected.

    One line whatever is quoted in it: names come from files, and may hold any character.
    """

    def __init__(self, message: str):
        super().__init__(" ".join(message.splitlines()))


def nearest(name: str, known: Iterable[str]) -> str:
    """The known name closest to `name`, as a ready clause for an error message.

    Returns "did you mean 'x'?" where something is close, else "known: a, b, c".
    """
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    return f"did you mean '{close[0]}'?" if close else f"known: {', '.join(names)}"


def check_keys(content: Collection[Any], known: Iterable[str], where: str, required: Iterable[str] = ()) -> None:
    """UserError, which begins with `where`, for a key that is not known, with the nearest, and for one that lacks."""
    known = list(known)
    for key in content:
        if key not in known:
            raise UserError(f"{where}: unknown key '{key}', {nearest(str(key), known)}")
    missing = [key for key in required if key not in content]
    if missing:
        raise UserError(f"{where}: missing {', '.join(missing)}")
