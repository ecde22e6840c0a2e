"""The chunks of a computation on the workers of a Dask cluster.

Only few chunks are computed at a time, and fewer results wait here. If a worker dies, Dask gives
its work to another one; because the numbers of a chunk depend on its place only, they have the same
bits.
"""

from collections.abc import Generator, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from typing import Any

from .. import _core
from ..arguments import reject
from ..errors import ClusterError, SimulationError
from ..extras import missing
from .fields import ChunkResult, Task
from .grid import Tiling

# Submitted chunks for each thread of the cluster: one is computed, the others avoid waiting.
_AHEAD = 3


def check_client(client: Any) -> None:
    """Refuse what is not a client that can be waited for.

    Raises
    ------
    ParameterError
        If ``client`` is not a running, synchronous ``distributed.Client``.
    ImportError
        If Dask's ``distributed`` is not installed.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise missing("dask", "a cluster needs Dask") from error
    if not isinstance(client, Client) or client.asynchronous or client.status != "running":
        reject("client", client, "a running distributed.Client that is not asynchronous")


def threads(client: Any) -> int:
    """Return the threads of all workers there are now, at least one."""
    return max(1, int(sum(client.nthreads().values())))


def on_cluster(
    task: Task,
    tiling: Tiling,
    todo: Sequence[int],
    *,
    client: Any,
    workers: int | None,
    ordered: bool,
) -> Generator[tuple[int, ChunkResult]]:
    """Compute the chunks ``todo`` on the cluster; yield each as it is done, or in their order.

    When the generator is closed, submitted chunks are cancelled. An error of a chunk is raised
    unchanged, also Dask's own error if several workers died while they computed a chunk.

    Raises
    ------
    ClusterError
        If the scheduler is gone, the client was closed, or its work was cancelled.
    """
    import distributed

    # The task is sent once, as the result of a computation, so that it can be computed again; data
    # could not.
    whole = task.within(0, 0) is task
    remote = client.submit(_same, task, pure=False) if whole else None
    left, order = iter(todo), iter(todo)
    awaited = next(order, None)
    running: dict[Any, int] = {}
    arrivals = distributed.as_completed()
    waiting: dict[int, ChunkResult] = {}
    latest: Any = None
    try:
        while True:
            if client.status != "running":
                raise ConnectionError(f"the client is {client.status}")
            # Chunks that wait for an earlier one count as well, so that memory is bounded.
            room = _AHEAD * threads(client) - len(running) - len(waiting)
            for _, index in zip(range(room), left, strict=False):
                cells = tiling.cells(index)
                # What functions make for a chunk is sent with it.
                here = remote if whole else task.within(*cells)
                where = (*cells, 1 if workers is None else workers)
                future = client.submit(_compute, here, _core.__version__, *where, pure=False)
                running[future] = index
                arrivals.add(future)
            if not running:
                return
            latest = next(arrivals)
            index, result = running.pop(latest), latest.result()
            if not ordered:
                yield index, result
                continue
            waiting[index] = result
            while awaited in waiting:
                yield awaited, waiting.pop(awaited)
                awaited = next(order, None)
    except Exception as error:
        # Without a scheduler Dask's calls raise errors of many kinds, perhaps an OSError before the
        # client notices the loss.
        connected = client.status == "running" and not isinstance(error, OSError)
        of_chunk = latest is not None and latest.status == "error"
        if of_chunk or (connected and not isinstance(error, CancelledError)):
            raise
        why = "its work was cancelled" if connected else "no connection to the scheduler"
        raise ClusterError(f"the cluster was lost ({why})") from error
    finally:
        if client.status == "running":
            with suppress(Exception):  # it may be gone by now
                client.cancel([*([] if remote is None else [remote]), *running])


def _same(task: Task) -> Task:
    return task


def _compute(task: Task, version: str, first: int, last: int, workers: int) -> ChunkResult:
    """Compute a chunk on a worker, with the version that the client has."""
    if version != _core.__version__:
        raise SimulationError(
            f"a worker has vibroimpact {_core.__version__}, the client has {version}"
        )
    return task.compute(first, last, workers=workers, progress=None)
