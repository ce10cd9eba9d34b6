"""Compiled work in equal shares, by threads of our own.

numba's are none for it: its default layer must not be entered from two threads at once.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def in_shares(share: Callable[[int], None], threads: int) -> None:
    """Do `share(0)` to `share(threads - 1)`, at the same time."""
    if threads == 1:
        share(0)
        return
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(share, range(threads)))
