"""The command line with --units SI: what the Python functions give with units="SI"."""

import csv

import numpy as np
import pytest

import vibroimpact as vi
from command_lines import fields

FILE = """
[physical]
pendulum_mass = 0.3
oscillator_mass = 0.5
length = 0.2
torsional_stiffness = 1.5
stiffness = 40.0
torsional_damping = 0.004
damping = 0.05
gap = 0.1
restitution = 0.8
drive_frequency = 12.0
moment_amplitude = 0.4

[run]
initial = [0.1, 1.0, -0.02, 0.1]
periods = 60
keep = 20
"""
START = (0.1, 1.0, -0.02, 0.1)
RUN = {"initial": START, "units": "SI", "periods": 60, "keep": 20}


@pytest.fixture
def si(run_command, tmp_path, monkeypatch):
    """Run a command on the machine in SI; return what it prints."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "machine.toml").write_text(FILE, encoding="utf-8")

    def run(command, flags="", code=0):
        found, out, err = run_command(f"{command} --system machine.toml --units SI {flags}")
        assert found == code, err
        return out if code == 0 else err

    return run


@pytest.fixture
def machine(si, tmp_path):
    """The system of the file."""
    si("simulate", "--save run.npz")
    return vi.load(tmp_path / "run.npz").system


def read(path):
    """Return the columns of a table."""
    with open(path, encoding="utf-8", newline="") as file:
        rows = [*csv.DictReader(file)]
    return {name: [row[name] for row in rows] for name in rows[0]}


def numbers(table, name):
    return [float(text) for text in table[name]]


def test_a_run_is_printed_and_written_in_si(si, machine):
    printed = fields(si("simulate", "--csv impacts.csv --save run.npz --plot run.svg"))
    run = vi.simulate(machine, **RUN)
    assert vi.load("run.npz").impacts.tobytes() == run.impacts.tobytes()
    shown = run.in_si()
    table = read("impacts.csv")
    for name in ("time", "x1", "v1_pre", "v2_post", "impulse_normal", "energy_loss"):
        assert numbers(table, name) == shown.impacts[name].tolist()
    end = shown.final_state
    assert printed["state"] == (
        f"x1 = {end.x1!r}, v1 = {end.v1!r}, x2 = {end.x2!r}, v2 = {end.v2!r} at t = {end.time!r}"
    )
    si("simulate", "--time 2.5 --save short.npz")
    assert vi.load("short.npz").in_si().final_state.time == pytest.approx(2.5)


def test_a_flag_is_a_quantity_in_si(si, machine):
    si("simulate", "--drive-frequency 13 --law newton --save run.npz")
    changed = machine.replace(law="newton").replace(drive_frequency=13.0, units="SI")
    assert vi.load("run.npz").system == changed


def test_a_diagram_is_in_si(si, machine):
    flags = "--vary stiffness 35 45 4 --exponents --quiet --csv s.csv --points p.csv --plot d.svg"
    si("diagram", flags)
    diagram = vi.bifurcation_diagram(
        machine, **RUN, stiffness=np.linspace(35, 45, 4), exponents=True
    )
    section, points = read("s.csv"), read("p.csv")
    assert numbers(points, "stiffness") == np.linspace(35, 45, 4).tolist()
    first = diagram.run(0).in_si()
    shown = first.impacts[first.impacts["time"] >= first.kept_from]
    some = len(shown)
    for name, own in (("v1", "v1_pre"), ("v2", "v2_pre"), ("energy_loss", "energy_loss")):
        assert numbers(section, name)[:some] == pytest.approx(shown[own].tolist())
    # The unit of time is another one in each cell.
    rates = [diagram.system_at(i).scales.frequency for i in range(4)]
    assert len({*rates}) == 4
    assert numbers(points, "largest_exponent") == pytest.approx(diagram.largest_exponent * rates)


def test_a_chart_basins_and_exponents_are_in_si(si, machine):
    si("chart", "--vary drive-frequency 11 13 2 --vary damping 0.01 0.1 3 --quiet --csv c.csv")
    chart = vi.chart(
        machine,
        **RUN,
        exponents=True,
        drive_frequency=np.linspace(11, 13, 2),
        damping=np.linspace(0.01, 0.1, 3),
    )
    table = read("c.csv")
    assert table["label"] == chart.label.ravel().tolist()
    rate = machine.scales.frequency
    assert numbers(table, "largest_exponent") == pytest.approx(
        rate * chart.largest_exponent.ravel()
    )
    si(
        "basins",
        "--vary x2 0 0.08 3 --vary v2 -1 1 3 --periods 60 --keep 20 --scouts 9 --quiet --csv b.csv",
    )
    assert numbers(read("b.csv"), "v2") == [-1.0, 0.0, 1.0] * 3
    printed = fields(si("lyapunov", "--periods 200 --csv l.csv").replace("exponent ", "exponent_"))
    spectrum = vi.lyapunov_spectrum(machine, initial=START, units="SI", periods=200)
    assert float(printed["exponent_1"].split()[0]) == pytest.approx(
        rate * spectrum.exponents[0], rel=1e-5
    )
    assert numbers(read("l.csv"), "time") == pytest.approx(
        machine.scales.time * spectrum.history_time
    )
    si("lyapunov", "--vary gap 0.08 0.1 2 --periods 100 --quiet --csv v.csv")
    sweep = vi.lyapunov_spectrum(machine, initial=START, units="SI", periods=100, gap=[0.08, 0.1])
    assert numbers(read("v.csv"), "exponent_2") == pytest.approx(rate * sweep.exponents[:, 1])


def test_motions_and_branches_are_in_si(si, machine):
    si("orbits", "--periods 600 --csv o.csv --plot o.svg")
    motion = vi.simulate(machine, initial=START, units="SI", periods=600).refine()
    assert motion
    table = read("o.csv")
    start = [numbers(table, f"initial_{name}")[0] for name in ("x1", "v1", "x2", "v2")]
    assert start == machine.scales.to_si(motion.initial).tolist()
    assert numbers(table, "v2") == [motion.state[2] * machine.scales.speed]
    si("orbits", "--periods 600 --follow drive-frequency 11.9 12.1 --csv f.csv --plot f.svg")
    values = numbers(read("f.csv"), "drive_frequency")
    assert min(values) == pytest.approx(11.9)
    assert max(values) == pytest.approx(12.1)


@pytest.mark.parametrize(
    ("command", "flags", "said"),
    [
        ("simulate", "--mass-ratio 0.5", "unknown quantity mass_ratio"),
        ("diagram", "--vary mass-ratio 0.5 0.6 2", "allowed are pendulum-mass"),
        ("orbits", "--follow mass-ratio 0.5 0.6", "allowed are pendulum-mass"),
        ("basins", "--vary stiffness 1 2 3 --vary x1 0 1 3", "allowed are x1, v1, x2, v2"),
    ],
)
def test_what_is_no_quantity_is_refused(si, command, flags, said):
    assert said in si(command, flags, code=2)


def test_a_system_without_scales_is_refused(run_command):
    line = "simulate --mass-ratio 0.6 --initial 0 0.5 0 0 --periods 3 --units SI"
    code, _, err = run_command(line)
    assert code == 2
    assert "a table [physical]" in err
