"""The engine of every computation over a grid: in chunks, with progress, interruptible.

The cells of a grid go to the task in chunks, one after the other, the compiled kernel using its
threads within a chunk; or to the workers of a Dask cluster. The numbers depend neither on the size
of the chunks nor on who computes them. Finished chunks are collected in memory or in a store.
"""

import os
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from functools import partial
from typing import Any, TypeVar

from numpy.typing import NDArray

from ..arguments import flag, optional_count, threads
from ..errors import ClusterError, Interrupted
from ..showing import counted
from . import cluster
from .columns import Columns, Memory
from .ctrl_c import ctrl_c_waits
from .fields import ChunkResult, Layout, Task
from .grid import Tiling
from .store import Store, open_columns

Result = TypeVar("Result")
Known = Callable[[int, int], dict[str, NDArray[Any]]]

# Drive periods that take very roughly half a second, at four million a second on each of two cores,
# and bounds to the cells of a chunk by default. Users see the chunks in their stores.
_PERIODS = 4e6
_FEWEST, _MOST = 64, 65536


def compute(
    task: Task,
    wrap: Callable[[Columns], Result],
    *,
    chunk: int | None = None,
    workers: int | None = None,
    progress: bool = False,
    client: Any = None,
    store: str | os.PathLike[str] | None = None,
    known: Known | None = None,
) -> Result:
    """Compute all cells of a task and return ``wrap(columns)``.

    Parameters
    ----------
    task
        What to compute.
    wrap
        Makes the caller's own result of the columns, complete or not; called once.
    chunk
        At most so many cells are computed, sent and stored together; by default about half a second
        of work. A store that exists keeps its size of chunks.
    workers
        Threads of the compiled kernel; default all cores, under ``client`` one per chunk.
    progress
        Show a progress bar.
    client
        A ``distributed.Client``: its workers compute the chunks. While there are none it waits, as
        long as Dask's setting ``distributed.scheduler.no-workers-timeout`` allows.
    store
        Directory of a Zarr store for the results. One that holds part of the same computation is
        completed.
    known
        Gives columns of the cells first ... last - 1 that are known before they are computed; those
        in a store must be the same.

    Raises
    ------
    ParameterError
        If an argument is out of range, or the store is damaged or holds something else.
    Interrupted
        After Ctrl-C; ``.result`` is ``wrap`` of what is done.
    ClusterError
        If the cluster is lost; ``.result`` as after Ctrl-C.
    OSError
        If the store cannot be written, or is gone; its content stays valid.
    """
    workers = threads(workers)
    chunk = optional_count("chunk", chunk, least=1)
    flag("progress", progress)
    layout = Layout.of(task)
    if client is not None:
        cluster.check_client(client)
    tiling = Tiling.of(task.grid.shape, _chunk(task, chunk, client))
    with (
        _sink(layout, tiling, store, wrap) as sink,
        _progress_bar(task, sink.done, shown=progress) as bar,
    ):
        if known is not None and isinstance(sink, Store):
            sink.compare(known)
        chunks = (task, sink.tiling, sink.todo())
        results = (
            _one_by_one(*chunks, workers, bar)
            if client is None
            else cluster.on_cluster(*chunks, client=client, workers=workers, ordered=sink.ordered)
        )
        try:
            with closing(results):
                for index, result in results:
                    layout.check(*sink.tiling.cells(index), result)
                    with ctrl_c_waits():  # so that no chunk is written incompletely
                        sink.write(index, result)
                    if bar is not None:
                        bar.update(sink.done - bar.n)
                    if result.interrupted:
                        raise KeyboardInterrupt
        except KeyboardInterrupt:
            message = f"interrupted after {_so_far(task, sink)}"
            raise Interrupted(message, wrap(sink.columns()), holds=_holds(sink)) from None
        except ClusterError as error:
            message = f"{error} after {_so_far(task, sink)}"
            raise ClusterError(message, wrap(sink.columns()), holds=_holds(sink)) from error
    return wrap(sink.columns())


def _so_far(task: Task, sink: Memory | Store) -> str:
    """Say how much is done."""
    return f"{sink.done} of {counted(task.grid.size, 'cell')}"


def _holds(sink: Memory | Store) -> str:
    """Say where what is done is."""
    stored = ", as does the store: call again to go on" if isinstance(sink, Store) else ""
    return f"them{stored}"


def _chunk(task: Task, chunk: int | None, client: Any) -> int:
    """Return how many cells a chunk has at most."""
    if not task.divisible:
        return max(task.grid.size, 1)
    if chunk is not None:
        return chunk
    most = min(int(_PERIODS / task.cost), _MOST)
    if client is not None:
        # Several chunks for each thread, so that all of them end at about the same time.
        most = min(most, task.grid.size // (4 * cluster.threads(client)))
    return max(most, _FEWEST)


def _sink(
    layout: Layout,
    tiling: Tiling,
    store: str | os.PathLike[str] | None,
    wrap: Callable[[Columns], Result],
) -> AbstractContextManager[Memory | Store]:
    """Return what collects the chunks."""
    if store is None:
        return nullcontext(Memory(layout, tiling))
    try:
        return Store(store, layout, tiling)
    except KeyboardInterrupt:
        # The store exists by now, but to check a large one takes a while.
        message = "interrupted while the store was opened"
        kept = wrap(open_columns(store))
        raise Interrupted(message, kept, holds="what is in it") from None


def _one_by_one(
    task: Task, tiling: Tiling, todo: Sequence[int], workers: int | None, bar: Any
) -> Generator[tuple[int, ChunkResult]]:
    """Compute the chunks here, one after the other."""
    for index in todo:
        first, last = tiling.cells(index)
        advance = None if bar is None else partial(_advance, bar, bar.n)
        here = task.within(first, last)
        yield index, here.compute(first, last, workers=workers, progress=advance)


def _advance(bar: Any, before: int, done: int) -> None:
    bar.update(before + done - bar.n)


@contextmanager
def _progress_bar(task: Task, done: int, *, shown: bool) -> Iterator[Any]:
    """Give a tqdm bar that counts cells, or None where none is wanted."""
    if not shown:
        yield None
        return
    from tqdm import tqdm  # here, to keep the import of the package light

    over = " x ".join(task.grid.axes)
    kind = task.kind.replace("_", " ")
    name = f"{kind} over {over}" if over else kind
    with tqdm(total=task.grid.size, initial=done, desc=name, unit="cell") as bar:
        yield bar
