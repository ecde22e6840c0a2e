"""Work beside the page: each view has a lane, on which only its newest work is carried on.

A lane has one thread. Work that waits is replaced by newer work. Running work that has been
overtaken is cancelled: a fine picture at once, a quick one after a grace period, because while a
slider moves each quick picture is worth showing. Cancelled work shows nothing. A lane can wait
until a picture has been drawn, and only then begins the next one, with the newest values.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..interruption import Cancellation, heeding

# Seconds for which quick work may go on after it has been overtaken.
GRACE = 0.3


@dataclass(frozen=True, eq=False)
class Work:
    """Something to compute, and what the page does with it.

    Attributes
    ----------
    compute
        Runs on the lane's thread.
    show, refuse
        Get its result or its error, on the page's thread.
    quick
        Whether it is shown although newer work waits.
    """

    compute: Callable[[], Any]
    show: Callable[[Any], None]
    refuse: Callable[[Exception], None]
    quick: bool = True
    cancellation: Cancellation = field(default_factory=Cancellation)


class Lane:
    """A thread that does the newest work.

    Parameters
    ----------
    post
        Calls a function on the page's thread, soon; from any thread.
    grace
        Seconds for which overtaken quick work may go on.
    sent
        Gets the number of each picture that has been shown, on the page's thread. Then the next
        work begins only after `drawn` has got this number. None: it begins at once.
    patience
        Seconds after which the next work begins although `drawn` has not been called: an
        acknowledgement may be lost.
    """

    def __init__(
        self,
        post: Callable[[Callable[[], None]], None],
        grace: float = GRACE,
        *,
        sent: Callable[[int], None] | None = None,
        patience: float = 0.0,
    ) -> None:
        self._post, self._grace, self._sent, self._patience = post, grace, sent, patience
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._number = 0
        self._waiting: Work | None = None
        self._running: Work | None = None
        self._alive = False

    def submit(self, work: Work) -> None:
        """Do this work next, in place of all that waits."""
        with self._lock:
            # Where something waits already, it has overtaken what runs.
            if self._running is not None and self._waiting is None:
                self._overtake(self._running)
            self._waiting = work
            if not self._alive:
                self._alive = True
                threading.Thread(target=self._work, name="explorer", daemon=True).start()

    def cancel(self) -> None:
        """End the running work, and forget what waits."""
        with self._lock:
            self._waiting = None
            if self._running is not None:
                self._running.cancellation.cancel()
            self._ended.set()

    def drawn(self, number: Any) -> None:
        """Take note that the picture of a number has been drawn."""
        with self._lock:
            if number == self._number:
                self._ended.set()

    @property
    def busy(self) -> bool:
        """Whether anything runs or waits, or a picture has not been drawn yet."""
        with self._lock:
            return self._alive

    def _overtake(self, running: Work) -> None:
        if not running.quick or self._grace <= 0.0:
            running.cancellation.cancel()
            return
        timer = threading.Timer(self._grace, running.cancellation.cancel)
        timer.daemon = True
        timer.start()

    def _work(self) -> None:
        while True:
            with self._lock:
                work = self._running = self._waiting
                self._waiting = None
                if work is None:
                    self._alive = False
                    return
                self._number += 1
                self._ended.clear()
            if self._do(work) and self._sent is not None:
                self._ended.wait(self._patience)

    def _do(self, work: Work) -> bool:
        """Do some work; return whether anything of it is on its way to the page."""
        result: Any = None
        failure: Exception | None = None
        try:
            with heeding(work.cancellation):
                result = work.compute()
        except KeyboardInterrupt:
            # On a thread this is never Ctrl-C, but the cancellation. Public calls raise it as
            # `Interrupted`, parts of results as it is.
            return False
        except Exception as error:
            failure = error

        number = self._number

        def finish() -> None:
            # Whoever cancelled it wants to see neither its result nor its error.
            if work.cancellation.cancelled:
                self.drawn(number)
            elif failure is not None:
                work.refuse(failure)
                self.drawn(number)
            else:
                work.show(result)
                if self._sent is not None:
                    self._sent(number)

        self._post(finish)
        return True
