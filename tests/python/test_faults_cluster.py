"""A cluster that is lost in the middle: what is done is kept, and a store is gone on with."""

import asyncio
import logging
import os
import subprocess
import sys
import threading

import numpy as np
import pytest
from distributed import Client, Future, LocalCluster
from distributed.comm import CommClosedError

import vibroimpact as vi
from command_lines import DIAGRAM
from test_sweeps_cluster import after_writes
from toy_task import Toy, assert_same, whole
from vibroimpact import sweeps
from vibroimpact.cli import diagram, main
from vibroimpact.sweeps import cluster

SCHEDULER = "from distributed.cli.dask_scheduler import main; main()"
WORKER = "from distributed.cli.dask_worker import main; main()"

LOST = r"^the cluster was lost \(no connection to the scheduler\) after \d+ of 77 cells"


@pytest.fixture
def client():
    """Yield a client of a scheduler and a worker in threads of this process."""
    with (
        LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0"
        ) as threads,
        Client(threads) as client,
    ):
        yield client


@pytest.fixture
def scheduler(tmp_path):
    """Start a scheduler and a worker as processes; yield the first, with its file."""
    file = tmp_path / "scheduler.json"

    def start(code, *options):
        # Both unpickle the task.
        return subprocess.Popen(
            [sys.executable, "-c", code, "--scheduler-file", str(file), *options],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            cwd=tmp_path,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    process = start(SCHEDULER, "--port", "0", "--no-dashboard")
    worker = start(WORKER, "--nthreads", "1", "--no-nanny", "--no-dashboard")
    try:
        yield process, file
    finally:
        for one in (worker, process):
            one.kill()
            one.wait()


@pytest.mark.parametrize("how", ["killed", "closed"])
def test_a_scheduler_that_is_gone(request, tmp_path, monkeypatch, how):
    expected = sweeps.compute(Toy(), whole)
    store = tmp_path / "toy.zarr"
    # The client logs in vain that it would connect again.
    monkeypatch.setattr(logging.getLogger("distributed.client"), "disabled", True)
    if how == "killed":
        process, file = request.getfixturevalue("scheduler")
        client = Client(scheduler_file=str(file))
        client.wait_for_workers(1)
        end = process.kill
    else:
        client = request.getfixturevalue("client")
        end = client.close
    try:
        after_writes(monkeypatch, 4, end)
        with pytest.raises(vi.ClusterError, match=LOST) as caught:
            sweeps.compute(Toy(), whole, client=client, chunk=3, store=store)
    finally:
        client.close(timeout=1)
    columns = caught.value.result
    done = columns["status"] == 1
    assert 0 < done.sum() == columns.done < 77
    assert f"after {columns.done} of 77 cells; .result holds them, as does the store" in str(
        caught.value
    )
    assert columns["final"][done].tolist() == expected["final"][done].tolist()
    assert_same(sweeps.compute(Toy(), whole, store=store), expected)


def test_a_client_closed_while_a_result_travels(client, monkeypatch):
    async def cancelled():
        raise asyncio.CancelledError

    def result(future):
        # As when `close` cancels what `Future.result` waits for, but each time.
        try:
            return client.sync(cancelled)
        finally:
            client.close(timeout=1)

    monkeypatch.setattr(Future, "result", result)
    with pytest.raises(vi.ClusterError, match=LOST):
        sweeps.compute(Toy(), whole, client=client, chunk=3)


@pytest.mark.parametrize("kind", [ConnectionResetError, CommClosedError])
def test_a_connection_that_breaks_before_the_client_knows(client, monkeypatch, kind):
    def broken(*_):
        raise kind("Connection reset by peer")

    monkeypatch.setattr(Future, "result", broken)
    monkeypatch.setattr(client, "cancel", broken)
    with pytest.raises(vi.ClusterError, match=LOST) as caught:
        sweeps.compute(Toy(), whole, client=client, chunk=3)
    assert client.status == "running"
    assert isinstance(caught.value.__cause__.__cause__, kind)


def test_an_error_of_the_system_in_a_chunk_is_no_lost_cluster(client, monkeypatch):
    monkeypatch.setattr(Toy, "_iterate", lambda *_: os.stat("/nowhere"))
    with pytest.raises(FileNotFoundError, match="nowhere"):
        sweeps.compute(Toy(), whole, client=client, chunk=3)


@pytest.fixture
def lost(monkeypatch):
    """Let the cluster be lost after some chunks, each computed here."""
    number = threading.local()
    number.left = 2

    def on_cluster(task, tiling, todo, **_):
        for index in todo:
            if not number.left:
                raise vi.ClusterError("the cluster was lost (test)")
            number.left -= 1
            yield index, task.compute(*tiling.cells(index), workers=1, progress=None)

    monkeypatch.setattr(cluster, "on_cluster", on_cluster)
    monkeypatch.setattr(cluster, "check_client", lambda client: None)
    monkeypatch.setattr(cluster, "threads", lambda client: 1)


def test_a_refined_diagram_without_its_cluster_keeps_what_is_done(lost, system, initial):
    values = np.linspace(1.5, 1.6, 6)
    options = {"initial": initial, "periods": 60, "refine": 1, "drive_frequency": values}
    with pytest.raises(vi.ClusterError, match="after 4 of 6 cells") as caught:
        vi.bifurcation_diagram(system, **options, chunk=2, client="there")
    part = caught.value.result
    assert isinstance(part, vi.Diagram)
    assert (part.status != "pending").tolist() == [True] * 4 + [False] * 2


def test_a_command_without_its_cluster_writes_what_is_done(lost, tmp_path, monkeypatch, capsys):
    plain = diagram.bifurcation_diagram

    def with_client(*arguments, **options):
        return plain(*arguments, **options | {"client": "there", "chunk": 2})

    monkeypatch.setattr(diagram, "bifurcation_diagram", with_client)
    points = tmp_path / "points.csv"
    code = main([*DIAGRAM.split(), "--quiet", "--points", str(points)])
    assert code == 1
    assert capsys.readouterr().err == (
        "vibroimpact: the cluster was lost (test) after 4 of 5 cells\n"
    )
    assert points.read_text().count("completed") == 4
