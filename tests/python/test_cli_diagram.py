"""`vibroimpact diagram`: what it counts, and that its files hold the diagram bit for bit."""

import csv
import io

import numpy as np
from matplotlib.image import imread

import vibroimpact as vi
from command_lines import DIAGRAM, fields
from vibroimpact.cli import diagram as command


def test_diagram_counts_motions_and_writes_its_files(run_command, tmp_path):
    code, out, err = run_command(
        DIAGRAM,
        "--csv",
        tmp_path / "d.csv",
        "--save",
        tmp_path / "d.npz",
        "--plot",
        tmp_path / "d.png",
    )
    assert (code, err) == (0, "")
    diagram = vi.load(tmp_path / "d.npz")
    assert diagram.parameter.tolist() == np.linspace(1.7, 1.9, 5).tolist()
    printed = fields(out)
    assert printed["completed"] == f"{np.count_nonzero(diagram.status == 'completed')} of 5 values"
    for m, n in set(zip(diagram.m.tolist(), diagram.n.tolist(), strict=True)):
        if m:
            count = np.count_nonzero((diagram.m == m) & (diagram.n == n))
            assert printed[f"{m}-{n}"] == f"{count} values"
    rows = list(csv.DictReader(io.StringIO((tmp_path / "d.csv").read_text(encoding="utf-8"))))
    assert [float(row["x1"]) for row in rows] == diagram.x1.tolist()
    assert [float(row["drive_frequency"]) for row in rows] == diagram.impact_parameter.tolist()
    assert imread(tmp_path / "d.png").std() > 0.0


def test_an_interrupted_diagram_is_saved_as_far_as_it_got(run_command, monkeypatch, tmp_path):
    whole = command.bifurcation_diagram

    def interrupted(*arguments, **options):
        raise vi.Interrupted("interrupted after some points", whole(*arguments, **options))

    monkeypatch.setattr(command, "bifurcation_diagram", interrupted)
    code, out, err = run_command(DIAGRAM, "--save", tmp_path / "part.npz")
    assert (code, err) == (130, "vibroimpact: interrupted after some points\n")
    assert "of 5 values" in out
    assert len(vi.load(tmp_path / "part.npz")) == 5
