"""The engine behind every computation over a grid: chunks, progress, Ctrl-C, columns."""

import math
import pickle
import signal

import numpy as np
import pytest

import vibroimpact as vi
from toy_task import GRID, ROWS, Toy, assert_same, whole
from vibroimpact import sweeps
from vibroimpact.sweeps import STATUS, Field, Grid, Layout, RowGroup, Tiling
from vibroimpact.sweeps.columns import Memory


@pytest.fixture(scope="module")
def expected():
    """Return all cells of the grid, from one chunk."""
    return sweeps.compute(Toy(GRID), whole, chunk=GRID.size)


def test_cells_run_through_the_last_axis_fastest():
    wanted = np.meshgrid(*GRID.axes.values(), indexing="ij")
    values = GRID.values(0, GRID.size)
    for name, array in zip(GRID.axes, wanted, strict=True):
        assert values[name].tolist() == array.ravel().tolist()
    part = GRID.values(9, 25)
    assert all(part[name].tolist() == values[name][9:25].tolist() for name in part)
    assert GRID.shape == (7, 11)
    assert GRID.size == 77


def test_the_values_of_a_huge_grid_cost_no_memory():
    axis = np.linspace(0.0, 1.0, 10**6)
    grid = Grid({"gap": axis, "restitution": axis, "friction": axis})
    values = grid.values(10**18 - 2, 10**18)
    assert [array.tolist() for array in values.values()] == [
        [1.0, 1.0],
        [1.0, 1.0],
        [axis[-2], 1.0],
    ]


def test_a_grid_cannot_be_changed_and_can_be_pickled():
    with pytest.raises(ValueError, match="read-only"):
        GRID.axes["gap"][0] = 2.0
    again = pickle.loads(pickle.dumps(GRID))
    assert {name: axis.tolist() for name, axis in again.axes.items()} == {
        name: axis.tolist() for name, axis in GRID.axes.items()
    }


@pytest.mark.parametrize(
    ("axes", "match"),
    [
        ({"gap": [0.1, math.nan]}, r"gap\[1\] = nan"),
        ({"gap": [[0.1]]}, r"gap of shape \(1, 1\)"),
        ({"a/b": [0.1]}, "'a/b' is not allowed"),
    ],
)
def test_bad_axes(axes, match):
    with pytest.raises(vi.ParameterError, match=match):
        Grid(axes)


@pytest.mark.parametrize("shape", [(), (1,), (13,), (7, 11), (5, 1, 9), (3, 4, 5), (0, 3), (3, 0)])
@pytest.mark.parametrize("most", [1, 2, 5, 12, 1000])
def test_tiles_are_ranges_of_cells_and_blocks_of_the_grid(shape, most):
    tiling = Tiling.of(shape, most)
    numbers = np.arange(math.prod(shape)).reshape(shape)
    reached = 0
    for index in range(len(tiling)):
        first, last = tiling.cells(index)
        assert first == reached
        assert 0 < last - first <= most
        block = numbers[tiling.slices(index)]
        assert block.ravel().tolist() == list(range(first, last))
        assert tiling.view(index, np.arange(first, last)).tolist() == block.tolist()
        reached = last
    assert reached == math.prod(shape)


def test_tiles_are_nearly_equal():
    tiling = Tiling.of((1000, 1000), 3333)
    assert tiling.tile == (3, 1000)
    assert Tiling.of((1000, 1000), 300).tile == (1, 250)
    assert len(Tiling.of((10**6, 10**6), 65536)) == 10**6 * 16


def test_columns_have_the_shape_of_the_grid(expected):
    assert expected["status"].shape == (7, 11)
    assert expected["visits"].shape == (7, 11, 2)
    assert expected["peak_offset"].shape == (78,)
    assert expected["peak"].shape == (expected["peak_offset"][-1], 2)
    assert expected["peak_count"].sum() == len(expected["step"]) > 100
    assert expected.complete
    assert expected.done == 77
    assert "final" in expected
    assert "x1" not in expected
    with pytest.raises(KeyError, match="'x1' is none of status"):
        expected["x1"]
    with pytest.raises(ValueError, match="read-only"):
        expected["final"][0] = 1.0
    assert repr(expected) == "<Columns of a toy, 7 gap x 11 restitution, 77 done>"


def test_a_cell_owns_its_rows(expected):
    alone = sweeps.compute(
        Toy(Grid({"gap": GRID.axes["gap"][2:3], "restitution": GRID.axes["restitution"][5:6]})),
        whole,
    )
    cell = 2 * 11 + 5
    begin, end = expected["peak_offset"][cell : cell + 2]
    assert end > begin
    assert expected["step"][begin:end].tolist() == alone["step"].tolist()
    assert expected["final"][2, 5] == alone["final"][0, 0]


@pytest.mark.parametrize("chunk", [1, 3, 11, 30, None])
def test_the_numbers_do_not_depend_on_the_chunks(expected, chunk):
    assert_same(sweeps.compute(Toy(GRID), whole, chunk=chunk, workers=2), expected)


def test_the_default_chunk_follows_from_the_cost():
    class Counting(Toy):
        def compute(self, first, last, **options):
            sizes.append(last - first)
            return super().compute(first, last, **options)

    sizes: list[int] = []
    grid = Grid({"gap": np.linspace(0.0, 1.0, 1000)})
    sweeps.compute(Counting(grid, steps=1), whole)
    assert sizes == [500, 500]  # at most 4e6 periods, that is 800 cells
    sizes.clear()
    sweeps.compute(Counting(grid, steps=1, divisible=False), whole, chunk=10)
    assert sizes == [1000]


@pytest.mark.parametrize("axes", [{}, {"gap": []}, {"gap": [0.5], "restitution": []}])
def test_grids_of_one_cell_and_of_none(axes):
    columns = sweeps.compute(Toy(Grid(axes)), whole)
    assert columns.complete
    assert columns.done == (0 if axes else 1)
    assert columns["visits"].shape == (*columns.grid.shape, 2)
    assert len(columns["peak_offset"]) == columns.done + 1


def test_ctrl_c_between_chunks_gives_what_is_done(expected):
    with pytest.raises(vi.Interrupted, match=r"after 33 of 77 cells; \.result") as caught:
        sweeps.compute(Toy(GRID, trouble="ctrl_c", at=40), whole, chunk=11)
    columns = caught.value.result
    assert not columns.complete
    assert columns["status"].ravel().tolist() == [1] * 33 + [0] * 44
    assert np.isnan(columns["final"].ravel()[33:]).all()
    assert columns["final"].ravel()[:33].tolist() == expected["final"].ravel()[:33].tolist()
    rows = expected["peak_offset"][33]
    assert columns["step"].tolist() == expected["step"][:rows].tolist()
    assert set(columns["peak_offset"][33:]) == {rows}


def test_ctrl_c_within_a_chunk_gives_its_part(expected):
    with pytest.raises(vi.Interrupted, match="after 38 of 77 cells") as caught:
        sweeps.compute(Toy(GRID, trouble="half", at=40), lambda columns: [columns], chunk=11)
    [columns] = caught.value.result
    assert columns["final"].ravel()[:38].tolist() == expected["final"].ravel()[:38].tolist()
    assert columns["peak"].tolist() == expected["peak"][: expected["peak_offset"][38]].tolist()


def test_ctrl_c_waits_for_the_chunk_that_is_being_written(monkeypatch):
    plain = Memory.write

    def write(self, index, result):
        if index == 2:
            signal.raise_signal(signal.SIGINT)
        plain(self, index, result)

    monkeypatch.setattr(Memory, "write", write)
    handler = signal.getsignal(signal.SIGINT)
    with pytest.raises(vi.Interrupted, match="after 33 of 77 cells"):
        sweeps.compute(Toy(GRID), whole, chunk=11)
    assert signal.getsignal(signal.SIGINT) is handler


def test_the_error_of_a_task_comes_out_as_it_is():
    with pytest.raises(ArithmeticError, match="cell 40"):
        sweeps.compute(Toy(GRID, trouble="raise", at=40), whole)


def test_the_progress_bar_counts_cells(capsys):
    sweeps.compute(Toy(GRID), whole, chunk=11, progress=True)
    shown = capsys.readouterr().err
    assert "toy over gap x restitution" in shown
    assert "77/77" in shown
    sweeps.compute(Toy(GRID), whole)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"chunk": 0}, "chunk = 0"),
        ({"chunk": 1.5}, "chunk = 1.5"),
        ({"workers": 0}, "workers = 0"),
        ({"workers": True}, "workers = True"),
        ({"progress": "yes"}, "progress = 'yes'"),
    ],
)
def test_bad_options(options, match):
    with pytest.raises(vi.ParameterError, match=match):
        sweeps.compute(Toy(GRID, trouble="raise"), whole, **options)


def _single(result):
    result.columns["final"] = result.columns["final"].astype(np.float32)


def _one_row_too_few(result):
    result.rows["peak"][0][3] += 1


def _pending(result):
    result.columns["status"][3] = 0


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (
            _single,
            r"final must be float64 \(77,\), got float32 \(77,\)",
        ),
        (_one_row_too_few, "step must be int32"),
        (_pending, "some are left pending"),
    ],
)
def test_a_task_that_returns_something_else_is_found_out(change, match):
    class Wrong(Toy):
        def compute(self, first, last, **options):
            result = super().compute(first, last, **options)
            change(result)
            return result

    with pytest.raises(TypeError, match=match):
        sweeps.compute(Wrong(GRID), whole)


def test_names_that_would_meet_are_refused():
    twice = RowGroup("step", (Field("final", "float64", "the name of a field of the cells"),))
    with pytest.raises(ValueError, match="names meet"):
        Layout("toy", GRID, Toy(GRID).fields, (twice,), {})
    with pytest.raises(vi.ParameterError, match="name of an axis = 'final'"):
        Layout("toy", Grid({"final": [1.0]}), Toy(GRID).fields, (ROWS,), {})
    with pytest.raises(ValueError, match="STATUS"):
        Layout("toy", GRID, (Field("final", "float64", ""),), (), {})
    with pytest.raises(ValueError, match="not a field"):
        Field("label", "U8", "text")


def test_fields_describe_themselves():
    assert math.isnan(Field("a", "float32", "").fill)
    assert Field("a", "int64", "").fill == 0
    assert Field("a", "int64", "", fill=-1).fill == -1
    assert STATUS.attributes()["flag_meanings"].split()[1] == "completed"
    assert STATUS.attributes()["flag_values"] == list(range(len(sweeps.STATUS_NAMES)))
