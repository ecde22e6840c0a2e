"""Work beside the page: each view has a lane, on which only its newest work is carried on.

A lane has one thread. Work that waits is replaced by newer work. Running work that has been
overtaken is cancelled: a fine picture at once, a quick one after a grace period, because while a
slider moves each quick picture is worth showing. Cancelled work shows nothing.
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
    """

    def __init__(self, post: Callable[[Callable[[], None]], None], grace: float = GRACE) -> None:
        self._post, self._grace = post, grace
        self._lock = threading.Lock()
        self._waiting: Work | None = None
        self._running: Work | None = None
        self._alive = False

    def submit(self, work: Work) -> None:
        """Do this work next, in place of all that waits."""
        with self._lock:
            self._waiting = work
            if self._running is not None:
                self._overtake(self._running)
            if not self._alive:
                self._alive = True
                threading.Thread(target=self._work, name="explorer", daemon=True).start()

    def cancel(self) -> None:
        """End the running work, and forget what waits."""
        with self._lock:
            self._waiting = None
            if self._running is not None:
                self._running.cancellation.cancel()

    @property
    def busy(self) -> bool:
        """Whether anything runs or waits."""
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
            self._do(work)

    def _do(self, work: Work) -> None:
        result: Any = None
        failure: Exception | None = None
        try:
            with heeding(work.cancellation):
                result = work.compute()
        except KeyboardInterrupt:
            # On a thread this is never Ctrl-C, but the cancellation. Public calls raise it as
            # `Interrupted`, parts of results as it is.
            return
        except Exception as error:
            failure = error

        def finish() -> None:
            # Whoever cancelled it wants to see neither its result nor its error.
            if work.cancellation.cancelled:
                return
            if failure is None:
                work.show(result)
            else:
                work.refuse(failure)

        self._post(finish)
