"""Stores and clusters of the command line: resumed, and the same bits."""

import pytest
from distributed import LocalCluster

import vibroimpact as vi
from command_lines import CHART, DIAGRAM
from vibroimpact.cli import chart as command
from vibroimpact.sweeps.cells import CellTask


def test_a_store_is_resumed(run_command, tmp_path, monkeypatch):
    expected = run_command(CHART + " --csv -")[1]
    store = tmp_path / "c.zarr"
    whole = command.chart
    chunks = []

    def stopped_after_one(system, **options):
        compute = CellTask.compute

        def counted(task, *arguments, **more):
            if chunks:
                raise KeyboardInterrupt
            chunks.append(arguments)
            return compute(task, *arguments, **more)

        with monkeypatch.context() as patch:
            patch.setattr(CellTask, "compute", counted)
            return whole(system, **options)

    monkeypatch.setattr(command, "chart", stopped_after_one)
    code, out, err = run_command(CHART + " --chunk 5 --store", store)
    assert code == 130
    assert "pending" in out
    assert err.endswith(f"; the same command goes on with {store}\n")
    monkeypatch.setattr(command, "chart", whole)
    code, out, _ = run_command(CHART + " --csv - --store", store)
    assert (code, out) == (0, expected)
    assert vi.load(store).complete


def test_a_store_of_something_else_is_refused(run_command, tmp_path):
    store = tmp_path / "c.zarr"
    assert run_command(CHART + " --store", store)[0] == 0
    code, _, err = run_command(CHART + " --restitution 0.7 --store", store)
    assert code == 2
    assert err.count("\n") == 1


def test_a_cluster_gives_the_same_bits(run_command):
    expected = run_command(DIAGRAM + " --csv -")[1]
    # Any free port: without an address distributed insists on one that others may have.
    with LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=":0") as cluster:
        code, out, _ = run_command(
            DIAGRAM + " --chunk 2 --csv - --scheduler", cluster.scheduler_address
        )
    assert (code, out) == (0, expected)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "foo://nowhere:1"])
def test_a_scheduler_that_does_not_answer_is_bad_input(run_command, monkeypatch, address):
    monkeypatch.setattr("vibroimpact.cli.engine._PATIENCE", 1)
    code, _, err = run_command(DIAGRAM + f" --scheduler {address}")
    assert code == 2
    assert f"--scheduler {address}" in err
