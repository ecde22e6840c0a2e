"""Work beside the page: each view has a lane, on which only its newest work is carried on.

A lane has one thread. Work that waits is replaced by newer work. Running work that has been
overtaken is cancelled: a fine picture at once, a quick one after a grace period, because while a
slider moves each quick picture is worth showing. Cancelled work shows nothing. A lane with a pace
begins the next picture when the last one has been drawn, with the newest values.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from ..errors import unheard
from ..interruption import Cancellation, heeding
from .pace import Pace

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
    pace
        Says when the work after a picture may begin; without one it begins at once.
    """

    def __init__(
        self,
        post: Callable[[Callable[[], None]], None],
        grace: float = GRACE,
        *,
        pace: Pace | None = None,
    ) -> None:
        self._post, self._grace, self._pace = post, grace, pace or Pace()
        self._lock = threading.Lock()
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
            self._pace.skip()

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
                number = self._pace.begin()
            if self._do(work, number):
                self._pace.wait()

    def _do(self, work: Work, number: int) -> bool:
        """Do some work; return whether anything of it is on its way to the page."""
        result: Any = None
        failure: Exception | None = None
        try:
            with heeding(work.cancellation), unheard():
                result = work.compute()
        except KeyboardInterrupt:
            # On a thread this is never Ctrl-C, but the cancellation. Public calls raise it as
            # `Interrupted`, parts of results as it is.
            return False
        except Exception as error:
            failure = error

        def show() -> bool:
            # Whoever cancelled it wants to see neither its result nor its error.
            if work.cancellation.cancelled:
                return False
            if failure is not None:
                work.refuse(failure)
                return False
            work.show(result)
            return True

        self._post(partial(self._pace.finish, number, show))
        return True
