"""`vibroimpact basins`: its attractors and cells are those of the function."""

import csv
import io

import numpy as np
import pytest
from matplotlib.image import imread

import vibroimpact as vi
from command_lines import BASINS
from vibroimpact.cli import basins as command


@pytest.fixture(scope="module")
def expected() -> vi.Basins:
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.5,
        moment_amplitude=1.0,
        drive_frequency=1.5752,
        friction=0.5,
    )
    return vi.basins(system, scouts=60, x1=np.linspace(-0.3, 1.2, 12), x2=np.linspace(-1.0, 1.0, 9))


def test_the_cells_are_those_of_the_function(run_command, expected, tmp_path):
    code, out, err = run_command(BASINS, "--csv", tmp_path / "b.csv", "--plot", tmp_path / "b.png")
    assert (code, err) == (0, "")
    rows = list(csv.DictReader(io.StringIO((tmp_path / "b.csv").read_text(encoding="utf-8"))))
    axes = np.meshgrid(*expected.axes.values(), indexing="ij")
    for name, values in zip(expected.axes, axes, strict=True):
        assert [float(row[name]) for row in rows] == values.ravel().tolist()
    for name in ("attractor", "label", "status", "settling"):
        assert [row[name] for row in rows] == [str(v) for v in getattr(expected, name).ravel()]
    lines = out.splitlines()
    for number, (found, share) in enumerate(
        zip(expected.attractors, expected.shares, strict=True), start=1
    ):
        assert lines[number].split() == [str(number - 1), found.label, f"{share:.4g}", "yes"]
    overlap = np.count_nonzero(expected.status == "overlap")
    assert overlap > 0
    assert lines[-1] == f"overlap: {overlap} of {len(expected)} cells"
    assert imread(tmp_path / "b.png").std() > 0.0


def test_cells_without_an_attractor_give_code_3(run_command, monkeypatch, expected):
    status = expected.status_code.copy()
    attractor = expected.attractor.copy()
    attractor[0, 0] = -1
    status[0, 0] = vi.sweeps.STATUS_NAMES.index("unresolved")
    shown = ("system", "axes", "attractors", "settling", "settings")
    part = vi.Basins(
        attractor=attractor,
        status_code=status,
        **{name: getattr(expected, name) for name in shown},
    )
    monkeypatch.setattr(command, "basins", lambda *_, **__: part)
    code, out, _ = run_command(BASINS)
    assert code == 3
    assert "unresolved: 1 of 108 cells" in out


def test_large_planes_are_measured(run_command, monkeypatch, expected):
    monkeypatch.setattr(command, "MEASURED", 9)
    out = run_command(BASINS)[1]
    uncertainty, entropy = expected.uncertainty_exponent(), expected.entropy()
    assert out.splitlines()[-1] == (
        f"uncertainty exponent {uncertainty.exponent:.3f} +- {uncertainty.error:.1g}; "
        f"boundary entropy {entropy.boundary_entropy:.3f} +- {entropy.boundary_error:.1g}"
    )


def test_a_store_is_filled(run_command, tmp_path):
    expected = run_command(BASINS + " --csv -")[1]
    for _ in range(2):
        assert run_command(BASINS + " --csv - --store", tmp_path / "b.zarr")[1] == expected
    assert (tmp_path / "b.zarr").is_dir()
