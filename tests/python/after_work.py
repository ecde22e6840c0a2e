"""A timer that goes by what the process has worked, not by the clock alone.

On a busy machine a fixed time may be over before a call has begun what is to be interrupted.
"""

import threading
import time
from collections.abc import Callable

#: How often the work done is looked at, in seconds.
LOOK = 0.005


class AfterWork(threading.Thread):
    """Calls a function once so many seconds have passed and the process has computed for as long.

    Parameters
    ----------
    seconds
        Time and processor time, all threads together, from `start` on.
    call
        Called in this thread, if `cancel` has not been called before.
    """

    def __init__(self, seconds: float, call: Callable[[], object]) -> None:
        super().__init__(daemon=True)
        self._seconds, self._call = seconds, call
        self._cancelled = threading.Event()

    def run(self) -> None:
        """Wait, then call."""
        clocks = (time.monotonic, time.process_time)
        ends = [clock() + self._seconds for clock in clocks]
        while any(clock() < end for clock, end in zip(clocks, ends, strict=True)):
            if self._cancelled.wait(LOOK):
                return
        self._call()

    def cancel(self) -> None:
        """Do not call any more."""
        self._cancelled.set()
