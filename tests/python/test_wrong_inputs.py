"""What an error says about a wrong input, and which inputs of another form are taken as meant."""

import argparse
import re
import sys
import tomllib
from typing import get_args

import numpy as np
import pytest
from packaging.requirements import Requirement

import repository
import vibroimpact as vi
from command_lines import ORBITS, SIMULATE
from systems import PAPER
from vibroimpact.cli import branches
from vibroimpact.cli.options import whole
from vibroimpact.extras import NEEDED, Extra, missing
from vibroimpact.system import CHOICES

START = (0.0, 0.5, 0.0, 0.0)


def simulated(**options) -> vi.Run:
    return vi.simulate(PAPER, initial=START, **options)


@pytest.mark.parametrize("name", ["contact", "law"])
def test_a_wrong_choice_is_answered_with_what_each_choice_means(name):
    with pytest.raises(vi.ParameterError) as caught:
        PAPER.replace(**{name: "stronge"})
    said = str(caught.value)
    assert said.startswith(f"{name} = 'stronge' is not allowed; allowed: ")
    for known, meaning in CHOICES[name].items():
        assert f"{known!r} ({meaning})" in said
    assert tuple(CHOICES[name]) == {"contact": vi._core.CONTACTS, "law": vi._core.LAWS}[name]


@pytest.mark.parametrize("part", [1e3, 600.0, np.float64(600.0), np.float32(600.0), 600])
def test_whole_floats_are_counts(part):
    run = simulated(periods=part, keep=part / 2)
    assert run.final_state.period == int(part)
    assert len(run.stroboscopic) == int(part) // 2
    assert (
        run.impacts.tobytes() == simulated(periods=int(part), keep=int(part) // 2).impacts.tobytes()
    )


def test_other_options_that_count_take_them_too():
    starts = np.array([START, START])
    pair = vi.simulate(PAPER, initial=starts, periods=5.0, workers=1.0, max_events=1e4)
    assert [run.final_state.period for run in pair] == [5, 5]
    values = {"drive_frequency": [1.8, 1.81], "periods": 60.0, "keep": 2e1, "chunk": 1.0}
    diagram = vi.bifurcation_diagram(PAPER, initial=START, workers=2.0, refine=1.0, **values)
    assert diagram.settings.periods == 60
    assert len(vi.impact(PAPER, x1=[0.1], v1=1.0, v2=0.0, steps=10.0)) == 1


@pytest.mark.parametrize("value", [600.5, np.nan, np.inf, 1e300, -1.0, 0.0])
def test_floats_that_are_no_count_are_refused(value):
    with pytest.raises(vi.ParameterError, match=f"^periods = {re.escape(repr(value))} is not"):
        simulated(periods=value)


@pytest.mark.parametrize(
    ("text", "number"), [("600", 600), ("1e3", 1000), ("600.0", 600), (" 7 ", 7), ("-3", -3)]
)
def test_a_word_of_the_command_line_is_a_whole_number(text, number):
    assert whole(text) == number


@pytest.mark.parametrize("text", ["1.5", "many", "nan", "inf", "", "1e-3"])
def test_other_words_are_named(run_command, capsys, text):
    with pytest.raises(SystemExit, match="2"):
        run_command(SIMULATE, "--periods", text)
    assert f"argument --periods: {text!r} is not a whole number" in capsys.readouterr().err
    with pytest.raises(argparse.ArgumentTypeError):
        whole(text)


def test_periods_on_the_command_line(run_command):
    plain = run_command(SIMULATE.replace("--periods 600", ""), "--periods", "1000")
    assert plain[0] == 0
    assert run_command(SIMULATE.replace("--periods 600", ""), "--periods", "1e3") == plain


def test_one_bad_start_among_many_is_named_by_its_place():
    starts = np.tile(START, (50, 1))
    starts[37, 0] = 1.5
    with pytest.raises(vi.StateError, match=r"^initial\[37\]: the initial state is penetrating: "):
        vi.simulate(PAPER, initial=starts, periods=1)
    starts[37, 0] = np.nan
    with pytest.raises(vi.StateError, match=r"^initial\[37\] = \(nan, 0\.5, 0\.0, 0\.0\) is not"):
        vi.simulate(PAPER, initial=starts, periods=1)


@pytest.mark.parametrize(
    ("initial", "place", "shown"),
    [
        ((0, "a", 0, 0), "[1]", "'a'"),
        ([START, (0, 0.5, None, 0)], "[1, 2]", "None"),
        ((0, 0, 0, 1j), "[3]", "1j"),
    ],
)
def test_what_is_no_number_in_a_start_is_named_by_its_place(initial, place, shown):
    said = f"^{re.escape(f'initial{place} = {shown} is not allowed; allowed: a real number')}"
    with pytest.raises(vi.StateError, match=said):
        vi.simulate(PAPER, initial=initial, periods=1)


@pytest.mark.parametrize(
    ("place", "bad", "message"),
    [
        (1, (1.5, 0, 0, 0), r"^starts\[1\]: the initial state is penetrating: "),
        (2, (np.nan, 0, 0, 0), r"^starts\[2\] = \(nan, 0\.0, 0\.0, 0\.0\) is not"),
        (None, (1.5, 0, 0, 0), r"^starts: the initial state is penetrating: "),
    ],
)
def test_a_bad_start_of_a_search_is_named_by_its_place(place, bad, message):
    starts = np.tile(START, (3, 1)).astype(float)
    starts[place] = bad
    with pytest.raises(vi.StateError, match=message):
        vi.search_motions(PAPER, starts=bad if place is None else starts, periods=8)


def test_all_starts_are_looked_at_before_anything_runs():
    starts = np.tile(START, (3, 1))
    starts[2, 0] = 1.5
    vi._core._interrupt_at(1 << 40)
    try:
        with pytest.raises(vi.StateError, match=r"^initial\[2\]"):
            vi.simulate(PAPER, initial=starts, periods=100)
    finally:
        left = vi._core._interrupt_at(None)
    assert left == 1 << 40


def test_an_angle_in_degrees_gets_a_word_on_radians():
    word = "(an angle x1 is in radians)"
    with pytest.raises(vi.StateError) as caught:
        vi.simulate(PAPER, initial=(45.0, 0.0, 0.0, 0.0), periods=1)
    assert word in str(caught.value)
    with pytest.raises(vi.StateError) as caught:
        vi.simulate(PAPER, initial=(1.0, 0.0, 0.0, 0.0), periods=1)
    assert word not in str(caught.value)


@pytest.mark.parametrize("keep", [0, 1, 2, 3])
def test_too_few_kept_periods_are_said_to_be_less_than_four(keep):
    run = simulated(periods=600, keep=keep)
    assert run.label == "unresolved"
    assert run.period.evidence.why == "too_few_sections"
    assert str(run.period.evidence).endswith("a label needs at least four kept drive periods")
    assert simulated(periods=600, keep=4).label == "1-1"


def test_rest_under_a_constant_load_has_no_period_to_count():
    ball = PAPER.replace(mass_ratio=0.0, drive_frequency=0.0, gap=0.0, contact="direct")
    run = vi.simulate(ball, initial=(0.0, 0.0, 0.0, 0.0), time=100.0)
    assert run.stop_reason == "rest"
    assert run.label == "unresolved"
    assert run.period.evidence.why == "no_drive_period"
    assert "no drive period" in str(run.period.evidence)
    # Under a drive there are periods, and nothing happens in them: a spring presses it to the wall.
    pressed = ball.replace(drive_frequency=1.0, moment_amplitude=0.0, gap=-0.2)
    run = vi.simulate(pressed, initial=(-0.2, 0.0, 0.0, 0.0), periods=50)
    assert (run.stop_reason, run.label) == ("rest", "1-0")


@pytest.mark.parametrize("forces", [False, True])
def test_one_time_gives_one_state(forces):
    run = simulated(periods=20)
    for time in (3.0, np.float64(3.0), np.array(3.0), 3):
        state = run.trajectory(time, forces=forces)
        assert state.shape == ((6,) if forces else (4,))
        assert state.tobytes() == run.trajectory([3.0], forces=forces)[0].tobytes()
    with pytest.raises(vi.ParameterError, match=r"^t = -1\.0 is not allowed; allowed: times in"):
        run.trajectory(-1.0, forces=forces)
    with pytest.raises(vi.ParameterError, match=r"^t = nan is not allowed"):
        run.trajectory(np.nan, forces=forces)


def test_one_time_of_a_periodic_motion_gives_one_state():
    motion = simulated(periods=600).refine()
    assert motion.trajectory(0.5).tobytes() == motion.trajectory([0.5])[0].tobytes()
    assert motion.trajectory(0.5).shape == (4,)


def test_advice_installs_what_the_extra_has():
    project = tomllib.loads((repository.root() / "pyproject.toml").read_text(encoding="utf-8"))
    extras = project["project"]["optional-dependencies"]
    assert set(get_args(Extra)) == set(NEEDED)
    for extra, (module, packages) in NEEDED.items():
        wanted = [Requirement(text) for text in extras[extra]]
        told = [Requirement(text.strip('"')) for text in packages.split()]
        assert {one.name for one in told} == {one.name for one in wanted}
        error = missing(extra, "this needs it")
        # In the environment that runs, whatever pip the shell finds first.
        assert str(error) == f"this needs it: {sys.executable} -m pip install {packages}"
        assert error.name == module


def test_no_advice_names_this_package_on_an_index():
    for folder, ending in (("python", "*.py"), ("docs", "*.md"), (".", "README.md")):
        for path in (
            (repository.root() / folder).rglob(ending)
            if folder != "."
            else ([repository.root() / ending])
        ):
            text = path.read_text(encoding="utf-8")
            assert not re.search(r"pip install ['\"]?vibroimpact", text), path


def test_docstrings_name_pages_not_files():
    # Files of the documentation are not in the wheel; the package's docstring says where they are.
    package = repository.root() / "python" / "vibroimpact"
    for path in package.rglob("*.py"):
        found = re.findall(r"docs/[\w./-]+", path.read_text(encoding="utf-8"))
        assert found == (["docs/theory.md"] if path == package / "__init__.py" else []), path


def test_equal_legs_in_a_row_are_counted(run_command):
    free = vi._core.Leg.impact(vi.Regime.FRICTIONLESS)
    slip = vi._core.Leg.impact(vi.Regime.SLIP, 1, -1)
    told = branches._legs([*[free] * 18, slip, slip, vi._core.Leg.CHATTER, free])
    assert told == "18 x frictionless, 2 x impact:slip:+-, chatter, frictionless"
    assert branches._legs([]) == ""
    code, out, _ = run_command(ORBITS + " --follow drive-frequency 1.4 1.9")
    assert code == 0
    assert max(map(len, out.splitlines())) < 160


def test_a_wall_at_rest_has_two_exponents(run_command):
    line = SIMULATE.replace("simulate", "lyapunov") + " --mass-ratio 0 --drive-frequency 2.5"
    code, out, _ = run_command(line)
    wall = PAPER.replace(mass_ratio=0.0, drive_frequency=2.5)
    spectrum = vi.lyapunov_spectrum(wall, initial=START, periods=600)
    printed = {
        name: text.strip() for name, text in (row.split("  ", 1) for row in out.splitlines())
    }
    assert code == 0
    assert "nan" not in out
    assert printed["exponent 3"] == printed["exponent 4"] == "(wall at rest: no exponent)"
    assert spectrum.missing.tolist() == [False, False, True, True]
    assert spectrum.sum == spectrum.exponents[:2].sum()
    assert float(printed["sum"]) == pytest.approx(spectrum.sum, rel=1e-8)
    assert "nan" not in repr(spectrum)


def test_chatter_has_inf_impacts_in_files(run_command, tmp_path):
    line = (
        "chart --mass-ratio 0.6 --frequency-ratio 2 --restitution 0.8 --moment-amplitude 1 "
        "--force-amplitude 1.5 --pendulum-damping 0.1 --oscillator-damping 0.1 --initial 0 0.5 0 0 "
        "--vary drive-frequency 0.25 0.3 2 --vary gap 0.5 0.6 2 --periods 60 --quiet --no-exponents"
    )
    code, _, err = run_command(line, "--csv", tmp_path / "c.csv", "--save", tmp_path / "c.npz")
    assert (code, err) == (0, "")
    rows = (tmp_path / "c.csv").read_text(encoding="utf-8").splitlines()
    column = rows[0].split(",").index("n")
    chart = vi.load(tmp_path / "c.npz")
    written = [row.split(",")[column] for row in rows[1:]]
    assert written == [label.split("-")[1] for label in chart.label.ravel()]
    assert "inf" in written
    assert -1 in chart.n
