"""Pictures one at a time: the next one is begun when the last has been drawn."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any


def _nobody(_number: int) -> None:
    """Ask nobody whether a picture has been drawn."""


class Pace:
    """Holds back the work after a picture until the picture has been drawn.

    Parameters
    ----------
    ask
        Gets the number of each picture that has been shown, on the page's thread. `drawn` must get
        this number when the picture has been drawn.
    patience
        Seconds after which the next work begins although `drawn` has not been called: an
        acknowledgement may be lost. With 0 it begins at once.
    """

    def __init__(self, ask: Callable[[int], None] = _nobody, patience: float = 0.0) -> None:
        self._ask, self._patience = ask, patience
        self._lock = threading.Lock()
        self._free = threading.Event()
        self._number = 0

    def begin(self) -> int:
        """Return the number of the next picture, for which the work begins now."""
        with self._lock:
            self._number += 1
            self._free.clear()
            return self._number

    def finish(self, number: int, show: Callable[[], bool]) -> None:
        """Show a picture on the page's thread, and ask when it has been drawn.

        Where there is nothing to draw, the next work need not wait: ``show`` returns False, or
        raises an error.
        """
        asked = False
        try:
            if show():
                self._ask(number)
                asked = True
        finally:
            if not asked:
                self.drawn(number)

    def drawn(self, number: Any) -> None:
        """Take note that the picture of a number has been drawn; another number changes nothing."""
        with self._lock:
            if number == self._number:
                self._free.set()

    def skip(self) -> None:
        """Let the next work begin whatever has been drawn."""
        self._free.set()

    def wait(self) -> bool:
        """Wait for the picture begun last; return whether it has been drawn."""
        return self._free.wait(self._patience)
