"""`vibroimpact diagram`: what it counts, and that its files hold the diagram bit for bit."""

import csv
import io

import numpy as np
import pytest
from matplotlib.image import imread

import vibroimpact as vi
from command_lines import DIAGRAM, example_file, fields
from vibroimpact.cli import diagram as command


def written(path) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))


def test_diagram_counts_motions_and_writes_its_files(run_command, tmp_path):
    code, out, err = run_command(
        DIAGRAM,
        *("--csv", tmp_path / "d.csv", "--points", tmp_path / "p.csv"),
        *("--save", tmp_path / "d.npz", "--plot", tmp_path / "d.png"),
    )
    assert (code, err) == (0, "")
    diagram = vi.load(tmp_path / "d.npz")
    assert diagram.parameter.tolist() == np.linspace(1.7, 1.9, 5).tolist()
    printed = fields(out)
    assert printed["completed"] == f"{np.count_nonzero(diagram.status == 'completed')} of 5 cells"
    for label in set(diagram.label.tolist()):
        count = np.count_nonzero(diagram.label == label)
        assert printed[label] == f"{count} {'cell' if count == 1 else 'cells'}"
    rows = written(tmp_path / "d.csv")
    for name in ("x1", "v1", "v2", "phase", "approach_velocity", "energy_loss"):
        assert [float(row[name]) for row in rows] == getattr(diagram, name).tolist()
    assert [float(row["drive_frequency"]) for row in rows] == diagram.impact_parameter.tolist()
    assert {row["regime"] for row in rows} == {"frictionless"}
    points = written(tmp_path / "p.csv")
    assert [float(row["drive_frequency"]) for row in points] == diagram.parameter.tolist()
    for name in ("label", "status", "m", "n"):
        assert [row[name] for row in points] == list(map(str, getattr(diagram, name).tolist()))
    assert imread(tmp_path / "d.png").std() > 0.0


@pytest.mark.parametrize(("asked", "drawn"), [([], None), (["--value", "phase"], "phase")])
def test_the_value_that_is_drawn_can_be_chosen(run_command, tmp_path, monkeypatch, asked, drawn):
    values = []
    real = vi.plot.bifurcation

    def watched(diagram, **options):
        values.append(options.get("value"))
        return real(diagram, **options)

    monkeypatch.setattr(vi.plot, "bifurcation", watched)
    assert run_command(DIAGRAM, *asked, "--plot", tmp_path / "d.png")[0] == 0
    assert values == [drawn, None]


def test_a_value_needs_a_picture(run_command):
    code, _, err = run_command(DIAGRAM, "--value", "phase")
    assert code == 2
    assert "--value goes with --plot only" in err


def test_the_phase_of_impacts_is_not_that_which_varies(run_command, tmp_path):
    line = DIAGRAM.replace("--vary drive-frequency 1.7 1.9 5", "--vary phase 0 1 3")
    paths = ("--csv", tmp_path / "d.csv", "--save", tmp_path / "d.npz")
    assert run_command(line + " --drive-frequency 1.8", *paths)[0] == 0
    rows, diagram = written(tmp_path / "d.csv"), vi.load(tmp_path / "d.npz")
    assert [float(row["phase"]) for row in rows] == diagram.impact_parameter.tolist()
    assert [float(row["impact_phase"]) for row in rows] == diagram.phase.tolist()


def test_branches_refinement_and_exponents(run_command, tmp_path):
    line = DIAGRAM + " --friction 0.5 --vary drive-frequency 1.5 1.6 9"
    line = line.replace("--vary drive-frequency 1.7 1.9 5", "")
    paths = ("--save", tmp_path / "d.npz", "--csv", tmp_path / "d.csv")
    assert run_command(line + " --start forward backward --exponents", *paths)[0] == 0
    followed = vi.load(tmp_path / "d.npz")
    assert followed.settings.start == ("forward", "backward")
    assert len(followed) == 2 * 9
    owners = [int(row["branch"]) for row in written(tmp_path / "d.csv")]
    assert owners == np.repeat(followed.branch, np.diff(followed.offset)).tolist()
    assert run_command(line + " --exponents --points", tmp_path / "p.csv", *paths)[0] == 0
    exponents = [float(row["largest_exponent"]) for row in written(tmp_path / "p.csv")]
    assert exponents == vi.load(tmp_path / "d.npz").largest_exponent.tolist()
    assert run_command(line + " --refine 2 --no-labels", *paths)[0] == 0
    refined = vi.load(tmp_path / "d.npz")
    assert len(refined) > 9
    assert not refined.settings.labels


def test_several_initial_states_come_from_a_file(run_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = example_file().replace("[0.0, 0.5, 0.0, 0.0]", "[[0, 0.5, 0, 0], [0, 0.1, 0, 0]]")
    (tmp_path / "two.toml").write_text(text, encoding="utf-8")
    line = "diagram --system two.toml --vary drive-frequency 1.7 1.9 3 --quiet --save d.npz"
    assert run_command(line)[0] == 0
    assert vi.load("d.npz").settings.initial == ((0.0, 0.5, 0.0, 0.0), (0.0, 0.1, 0.0, 0.0))


def test_an_interrupted_diagram_is_saved_as_far_as_it_got(run_command, monkeypatch, tmp_path):
    whole = command.bifurcation_diagram

    def interrupted(*arguments, **options):
        raise vi.Interrupted("interrupted after some points", whole(*arguments, **options))

    monkeypatch.setattr(command, "bifurcation_diagram", interrupted)
    code, out, err = run_command(DIAGRAM, "--save", tmp_path / "part.npz")
    assert (code, err) == (130, "vibroimpact: interrupted after some points\n")
    assert "of 5 cells" in out
    assert len(vi.load(tmp_path / "part.npz")) == 5
