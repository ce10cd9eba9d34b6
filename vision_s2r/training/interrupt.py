"""Ctrl-C between two steps, so that what is saved is whole."""

import signal
import threading
from types import FrameType
from typing import Any


class Interrupt:
    """Notes the first Ctrl-C, for the loop to end between two steps; the second ends at once.

    Only the leading process listens: a terminal sends Ctrl-C to all, and they must stop after the same step.
    """

    def __init__(self, leads: bool):
        self.requested = False
        self._handler = self._note if leads else signal.SIG_IGN
        self._before: Any = None

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True

    def __enter__(self) -> "Interrupt":
        if threading.current_thread() is threading.main_thread():  # elsewhere Python allows no handlers
            self._before = signal.signal(signal.SIGINT, self._handler)
        return self

    def __exit__(self, *_: object) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)
