"""`vibroimpact chart`: its cells, on paper and in the files."""

import csv
import io

import numpy as np
import pytest
from matplotlib.image import imread

import vibroimpact as vi
from command_lines import CHART, fields


@pytest.fixture
def expected() -> vi.Chart:
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.5,
        moment_amplitude=1.0,
        drive_frequency=1.8,
    )
    return vi.chart(
        system,
        initial=(0.0, 0.5, 0.0, 0.0),
        periods=60,
        keep=20,
        drive_frequency=np.linspace(1.7, 1.9, 4),
        gap=np.linspace(0.4, 0.5, 3),
    )


def test_the_cells_are_those_of_the_function(run_command, expected, tmp_path):
    code, out, err = run_command(CHART, "--csv", tmp_path / "c.csv", "--save", tmp_path / "c.npz")
    assert (code, err) == (0, "")
    rows = list(csv.DictReader(io.StringIO((tmp_path / "c.csv").read_text(encoding="utf-8"))))
    axes = np.meshgrid(*expected.axes.values(), indexing="ij")
    for name, values in zip(expected.axes, axes, strict=True):
        assert [float(row[name]) for row in rows] == values.ravel().tolist()
    for name in ("label", "status", "m", "n"):
        assert [row[name] for row in rows] == [str(v) for v in getattr(expected, name).ravel()]
    for name in ("residual", "largest_exponent", "exponent_error"):
        values = [float(row[name]) for row in rows]
        assert np.array_equal(values, getattr(expected, name).ravel(), equal_nan=True)
    loaded = vi.load(tmp_path / "c.npz")
    assert np.array_equal(loaded.label, expected.label)
    assert fields(out)["completed"] == "12 of 12 cells"


def test_exponents_can_be_left_out(run_command):
    code, out, _ = run_command(CHART + " --no-exponents --csv -")
    assert code == 0
    assert "largest_exponent" not in out.splitlines()[0]


def test_labels_can_be_left_out(run_command):
    code, out, _ = run_command(CHART + " --no-labels --csv -")
    assert code == 0
    rows = list(csv.DictReader(io.StringIO(out)))
    assert "largest_exponent" not in rows[0]
    labels = {row["label"] for row in rows}
    assert "unresolved" in labels
    assert not labels & {"chaotic", "quasi-periodic"}


@pytest.mark.parametrize("flags", ["", "--no-exponents", "--no-labels"])
def test_a_chart_is_drawn(run_command, tmp_path, flags):
    assert run_command(f"{CHART} {flags}", "--plot", tmp_path / "c.png")[0] == 0
    assert imread(tmp_path / "c.png").std() > 0.0
