"""Two threads of one call against one thread, and against two processes.

The processes know nothing of each other: what they do together is what the machine has to give.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from time import perf_counter

from rounds import Timing, measure

# Turns shorter than this say more of when the machine wakes its cores than of the work.
TURN = 0.25
# The call: so many workers, every so many-th frequency from that place on.
Call = Callable[[int, int, int], object]


def two_cores(call: Call, rounds: int, *, turn: float = TURN) -> dict[str, Timing]:
    """Measure ``call`` on one thread, on two, and its halves in two processes, in alternation.

    ``call`` is pickled. Seconds are those of the whole work, its arrays included.
    """
    start = perf_counter()
    call(1, 0, 1)
    repeats = max(1, round(turn / (perf_counter() - start)))
    with _two_processes(call, repeats) as halves:
        jobs: dict[str, Callable[[], object]] = {
            "one": lambda: _repeat(call, repeats, 1),
            "threads": lambda: _repeat(call, repeats, 2),
            "processes": halves,
        }
        return measure(jobs, rounds, shortest=0.0)


@contextmanager
def _two_processes(call: Call, repeats: int) -> Iterator[Callable[[], object]]:
    # Spawned: a forked process would share this one's threads and locks.
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:

        def halves() -> None:
            parts = [pool.submit(_repeat, call, repeats, 1, place, 2) for place in (0, 1)]
            for part in parts:
                part.result()

        yield halves


def _repeat(call: Call, repeats: int, workers: int, place: int = 0, step: int = 1) -> None:
    for _ in range(repeats):
        call(workers, place, step)
