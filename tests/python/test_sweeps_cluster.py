"""Chunks on a local cluster of processes: the same bits, also when a worker is killed."""

import os
import signal
import sys
import threading
from contextlib import contextmanager

import dask
import numpy as np
import pytest
from distributed import Client, Future, LocalCluster, SchedulerPlugin
from distributed.scheduler import KilledWorker

import vibroimpact as vi
from struck import REST, SETTLING
from toy_task import GRID, Toy, assert_same, held, whole
from vibroimpact import sweeps
from vibroimpact.sweeps import Grid, cluster
from vibroimpact.sweeps.columns import Memory
from vibroimpact.sweeps.store import Store


@pytest.fixture(scope="module")
def client():
    # Some time after a worker was killed, a local cluster gives it up for good should it be away
    # just then, for having been killed once more: not here. A test that is left without any worker
    # ends, after longer than any slow machine takes to start one, before pytest ends all of them.
    patience = {
        "distributed.deploy.lost-worker-timeout": "1 hour",
        "distributed.scheduler.no-workers-timeout": "20 minutes",
    }
    with (
        dask.config.set(patience),
        LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", processes=True
        ) as processes,
        Client(processes) as client,
    ):
        yield client


class Losses(SchedulerPlugin):
    """Says when the scheduler has lost a worker, and has had another since."""

    name = "losses"

    def __init__(self):
        self.lost, self.replaced = False, threading.Event()

    def remove_worker(self, scheduler, worker, **_):
        self.lost = True

    def add_worker(self, scheduler, worker):
        if self.lost:
            self.replaced.set()


@contextmanager
def one_worker_lost(client):
    """Wait, after the block, until another worker stands in for the one that was killed in it."""
    before, losses = client.run(os.getpid).values(), Losses()
    scheduler = client.cluster.scheduler
    scheduler.add_plugin(losses)
    try:
        yield min(before)
        losses.replaced.wait()
    finally:
        scheduler.remove_plugin(losses.name)
    client.wait_for_workers(2)
    assert len({*before, *client.run(os.getpid).values()}) == 3


@pytest.fixture(scope="module")
def expected():
    """Return all cells of the grid, from one chunk, computed here."""
    return sweeps.compute(Toy(), whole, chunk=GRID.size)


def after_writes(monkeypatch, n, call, *arguments):
    """Let something happen when the n-th chunk is collected, while others are under way."""
    writes = []
    for sink in (Memory, Store):

        def write(self, index, result, plain=sink.write):
            plain(self, index, result)
            writes.append(index)
            if len(writes) == n:
                call(*arguments)

        monkeypatch.setattr(sink, "write", write)


@pytest.mark.parametrize("compute", [vi.sweep, vi.bifurcation_diagram])
@pytest.mark.parametrize("stored", [True, False])
def test_runs_on_a_cluster_that_loses_a_worker(
    client, tmp_path, system, initial, monkeypatch, compute, stored
):
    values = np.linspace(1.2, 2.0, 40)
    options = {"initial": initial, "periods": 60, "keep": 20, "drive_frequency": values}
    one_thread = compute(system, **options, workers=1)
    store = tmp_path / "runs.zarr" if stored else None
    with one_worker_lost(client) as worker:
        after_writes(monkeypatch, 2, os.kill, worker, signal.SIGKILL)
        found = compute(system, **options, client=client, chunk=2, store=store)
    assert_same(found.columns, one_thread.columns)


@pytest.mark.parametrize("chunk", [3, 11, None])
def test_a_cluster_gives_the_same_bits(client, expected, chunk):
    assert_same(sweeps.compute(Toy(), whole, client=client, chunk=chunk), expected)


def test_a_cluster_runs_structures(client, tmp_path):
    """Cells, functions of structures and the rows of diagrams have the bits of this process."""
    gaps = {"initial": REST[1], "periods": 30, "gap": [0.2, 0.25, 0.3]}
    by_function = gaps | {"system": lambda gap: SETTLING.replace(gap=gap)}
    for call, asked in (
        (vi.sweep, {"system": SETTLING, **gaps}),
        (vi.sweep, by_function),
        (vi.bifurcation_diagram, {"system": SETTLING, **gaps}),
    ):
        here = call(**asked)
        store = tmp_path / f"{call.__name__}-{callable(asked['system'])}"
        assert_same(call(**asked, client=client, chunk=1).columns, here.columns)
        assert_same(call(**asked, client=client, chunk=2, store=store).columns, here.columns)


@pytest.mark.parametrize("ragged", [True, False])
def test_a_cluster_fills_a_store(client, tmp_path, ragged):
    task = Toy(ragged=ragged)
    path = tmp_path / "toy.zarr"
    columns = sweeps.compute(task, whole, client=client, chunk=5, store=path)
    assert_same(columns, sweeps.compute(task, whole))


@pytest.mark.parametrize("stored", [True, False])
def test_a_worker_killed_in_the_middle(client, tmp_path, expected, stored):
    fuse = tmp_path / "fuse"
    fuse.touch()
    task = Toy(trouble="kill", at=40, fuse=fuse)
    store = tmp_path / "toy.zarr" if stored else None
    with one_worker_lost(client):
        assert_same(sweeps.compute(task, whole, client=client, chunk=5, store=store), expected)


def test_a_worker_killed_from_outside(client, tmp_path, expected, monkeypatch):
    path = tmp_path / "toy.zarr"
    with one_worker_lost(client) as worker:
        after_writes(monkeypatch, 4, os.kill, worker, signal.SIGKILL)
        columns = sweeps.compute(Toy(), whole, client=client, chunk=5, store=path)
    assert_same(columns, expected)


def test_a_chunk_that_kills_every_worker_is_an_error(client, tmp_path, expected):
    path = tmp_path / "toy.zarr"
    with pytest.raises(KilledWorker):
        sweeps.compute(Toy(trouble="kill", at=40), whole, client=client, chunk=5, store=path)
    assert_same(sweeps.compute(Toy(), whole, client=client, store=path), expected)


def test_rows_that_come_early_wait_for_the_first_chunk(client, tmp_path, expected, monkeypatch):
    gate = tmp_path / "gate"
    os.mkfifo(gate)
    plain, arrived = Future.result, []

    def result(future):
        # The first chunk stays at its gate until another has come.
        arrived.append(future)
        if len(arrived) == 1:
            with held(gate):
                pass
        return plain(future)

    monkeypatch.setattr(Future, "result", result)
    task = Toy(trouble="wait", at=0, gate=gate)
    path = tmp_path / "toy.zarr"
    assert_same(sweeps.compute(task, whole, client=client, chunk=5, store=path), expected)


def test_few_chunks_are_under_way_at_a_time(client):
    tiling = sweeps.Tiling.of(GRID.shape, 1)
    submitted = []

    class Counting:
        """Stands before the client and counts."""

        def __getattr__(self, name):
            return getattr(client, name)

        def submit(self, *arguments, **options):
            submitted.append(arguments[0].__name__)
            return client.submit(*arguments, **options)

    results = cluster.on_cluster(
        Toy(), tiling, range(len(tiling)), client=Counting(), workers=None, ordered=True
    )
    indices = []
    for index, _ in results:
        indices.append(index)
        assert submitted.count("_compute") <= len(indices) + 6
    assert indices == list(range(77))
    assert submitted.count("_compute") == 77


def test_functions_that_make_systems_stay_with_the_caller(client, tmp_path):
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.5,
        drive_frequency=1.8,
        moment_amplitude=1.0,
    )
    lock = threading.Lock()  # which cannot be sent

    def closer(by):
        with lock:
            return system.replace(gap=0.5 - by)

    asked = {"initial": (0.0, 0.5, 0.0, 0.0), "periods": 20, "by": [0.0, 0.1, 0.2, 0.3, 0.4]}
    here = vi.sweep(closer, **asked)
    there = vi.sweep(closer, **asked, client=client, chunk=2, store=tmp_path / "s")
    assert np.array_equal(there.final_states, here.final_states)
    assert there.system_at(3) == closer(0.3)


def test_a_branch_that_cannot_be_divided_is_one_chunk(client, expected):
    task = Toy(divisible=False, trouble="half", at=76)
    with pytest.raises(vi.Interrupted, match="after 38 of 77"):
        sweeps.compute(task, whole, client=client, chunk=5)


def test_the_error_of_a_task_comes_out_as_it_is(client, tmp_path, expected):
    path = tmp_path / "toy.zarr"
    with pytest.raises(ArithmeticError, match="cell 40"):
        sweeps.compute(Toy(trouble="raise", at=40), whole, client=client, chunk=5, store=path)
    # Rows come in order: nothing after the chunk that failed, which begins with cell 37.
    assert sweeps.open_columns(path).done <= 37
    assert_same(sweeps.compute(Toy(), whole, store=path), expected)


@pytest.mark.parametrize("stored", [True, False])
def test_ctrl_c_cancels_what_is_left(client, tmp_path, expected, stored, monkeypatch):
    store = tmp_path / "toy.zarr" if stored else None
    after_writes(monkeypatch, 4, signal.raise_signal, signal.SIGINT)
    with pytest.raises(vi.Interrupted) as caught:
        sweeps.compute(Toy(), whole, client=client, chunk=3, store=store)
    columns = caught.value.result
    done = columns["status"] == 1
    assert 8 <= done.sum() == columns.done <= 12
    assert columns["final"][done].tolist() == expected["final"][done].tolist()
    # The cluster is free for the next call.
    assert_same(sweeps.compute(Toy(), whole, client=client, store=store), expected)


def test_a_worker_of_another_version_is_refused():
    with pytest.raises(vi.SimulationError, match=r"a worker has .*, the client has 0\.0\.1"):
        cluster._compute(Toy(), "0.0.1", 0, 5, 1)


def test_bad_clients(client, monkeypatch):
    with pytest.raises(vi.ParameterError, match="client = 'tcp://localhost' is not allowed"):
        sweeps.compute(Toy(), whole, client="tcp://localhost")
    closed = Client(client.cluster)
    closed.close()
    with pytest.raises(vi.ParameterError, match=r"a running distributed\.Client"):
        sweeps.compute(Toy(), whole, client=closed)
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r"pip install distributed$"):
        sweeps.compute(Toy(), whole, client=client)


def test_a_grid_of_no_cells(client):
    assert sweeps.compute(Toy(Grid({"gap": []})), whole, client=client).complete
