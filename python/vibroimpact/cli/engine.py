"""Flags of the computations over a grid: threads, progress, a store, a Dask cluster."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..errors import ParameterError
from ..extras import missing
from . import options as shared

# Seconds to wait for a scheduler.
_PATIENCE = 10
HELP = """\
--store DIR.zarr keeps the results as they come, with parameters, version and
status: a Zarr store, for vibroimpact.load or xarray. The same command with the
same store goes on where an interrupted or killed one has ended, to the same
bits. With --scheduler a Dask cluster computes the cells, to the same bits."""
FLAGS = ("chunk", "store", "scheduler")


def add_engine(command: argparse.ArgumentParser) -> None:
    """Add the flags."""
    group = command.add_argument_group("computing")
    group.add_argument(
        "--workers", type=shared.whole, metavar="N", help="threads (default: all cores)"
    )
    group.add_argument(
        "--chunk",
        type=shared.whole,
        metavar="N",
        help="cells computed and stored together (default: about a second of work)",
    )
    group.add_argument(
        "--store", type=Path, metavar="DIR.zarr", help="keep results in a Zarr store; resume it"
    )
    group.add_argument(
        "--scheduler", metavar="ADDRESS", help="of a Dask cluster, e.g. tcp://10.0.0.1:8786"
    )
    group.add_argument("--quiet", action="store_true", help="show no progress")


@contextmanager
def engine(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Give the arguments that the computation takes, connected to the cluster if there is one.

    Raises
    ------
    ParameterError
        If the scheduler does not answer.
    ImportError
        If Dask is not installed.
    """
    arguments = {
        "progress": not options.quiet,
        "workers": options.workers,
        "chunk": options.chunk,
        "store": options.store,
    }
    if options.scheduler is None:
        yield arguments
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise missing("dask", "--scheduler needs Dask") from error
    try:
        client = Client(options.scheduler, timeout=_PATIENCE)
    except (OSError, ValueError) as error:
        raise ParameterError(f"--scheduler {options.scheduler}: {error}") from error
    with client:
        yield arguments | {"client": client}
