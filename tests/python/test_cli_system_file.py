"""System files: the same as flags, flags before them, and every slip named."""

import numpy as np
import pytest

import vibroimpact as vi
from command_lines import SIMULATE, example_file
from vibroimpact.cli.system_file import RUN_KEYS, read

PHYSICAL = """
[physical]
pendulum_mass = 0.3
oscillator_mass = 0.5
length = 0.2
torsional_stiffness = 1.5
stiffness = 40
gap = 0.1
restitution = 0.8
drive_frequency = 16.0
moment_amplitude = 0.9
"""
RUN = """
[run]
initial = [0, 0.5, 0, 0]
periods = 20
keep = 5
"""


@pytest.fixture
def saved(run_command, tmp_path, monkeypatch):
    """Simulate with a system file and flags; return the run."""
    monkeypatch.chdir(tmp_path)

    def simulate(text: str, flags: str = "") -> vi.Run:
        (tmp_path / "system.toml").write_text(text, encoding="utf-8")
        code, _, err = run_command(f"simulate --system system.toml --save run.npz {flags}")
        assert (code, err) == (0, "")
        return vi.load("run.npz")

    return simulate


def test_a_file_gives_what_flags_give(saved, run_command):
    from_file = saved(example_file())
    assert run_command(SIMULATE, "--save", "flags.npz")[0] == 0
    from_flags = vi.load("flags.npz")
    assert from_file.system == from_flags.system
    assert from_file.impacts.tobytes() == from_flags.impacts.tobytes()


def test_constant_loads_in_files_and_flags(saved):
    text = example_file().replace("moment_amplitude", "static_moment = 0.25\nmoment_amplitude")
    run = saved(text, "--static-force -0.125")
    assert (run.system.static_moment, run.system.static_force) == (0.25, -0.125)
    text = PHYSICAL + "static_moment = 0.3\nstatic_force = -2.0\n" + RUN
    system = saved(text).system
    assert system.static_moment == pytest.approx(0.3 / (0.3 * 0.2**2 * 80), rel=1e-15)
    assert system.static_force == pytest.approx(-2.0 / (40 * 0.2), rel=1e-15)


def test_flags_come_before_the_file(saved):
    run = saved(example_file(), "--gap 0.25 --initial 0 0.1 0 0 --periods 30 --keep 10")
    assert run.system.gap == 0.25
    assert run.system.drive_frequency == 1.8
    assert run.initial == (0.0, 0.1, 0.0, 0.0)
    assert run.final_state.period == 30
    assert run.kept_from == pytest.approx(20 * run.system.drive_period, rel=1e-15)


def test_a_time_replaces_the_periods_of_the_file(saved):
    assert saved(example_file(), "--time 2.5").final_state.time == 2.5


def test_periods_replace_the_time_of_the_file(saved):
    text = example_file().replace("periods = 600\nkeep = 100", "time = 2.5")
    assert saved(text).final_state.time == 2.5
    assert saved(text, "--periods 3").final_state.period == 3


def test_damping_is_a_pair_that_a_flag_can_override_in_part(saved):
    text = example_file().replace("[system]", "[system]\ndamping = [0.01, 0.02]\n#")
    assert saved(text).system.damping == (0.01, 0.02)
    assert saved(text, "--oscillator-damping 0.5").system.damping == (0.01, 0.5)


def test_physical_quantities_and_flags_on_top(saved):
    system = vi.System.from_physical(
        pendulum_mass=0.3,
        oscillator_mass=0.5,
        length=0.2,
        torsional_stiffness=1.5,
        stiffness=40,
        gap=0.1,
        restitution=0.8,
        drive_frequency=16.0,
        moment_amplitude=0.9,
    )
    assert saved(PHYSICAL + RUN).system == system
    assert saved(PHYSICAL + RUN, "--friction 0.3").system == system.replace(friction=0.3)


def test_a_gap_in_millimetres_is_one_line_on_the_error_stream(run_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (PHYSICAL + RUN).replace("gap = 0.1", "gap = 100")
    (tmp_path / "rig.toml").write_text(text, encoding="utf-8")
    code, _, err = run_command("simulate --system rig.toml --units SI")
    assert code == 0
    assert err.startswith("vibroimpact: rig.toml: gap = 100.0 m is larger than length = 0.2 m: ")
    assert err.count("\n") == 1


def test_all_options_of_a_run_can_stand_in_the_file(saved):
    text = example_file() + "max_events = 90\nchatter_tolerance = 1e-10\nsection_phase = 0.5\n"
    initial = (0.0, 0.5, 0.0, 0.0)
    run = saved(text.replace("periods = 600\nkeep = 100", "periods = 60"))
    expected = vi.simulate(
        run.system,
        initial=initial,
        periods=60,
        max_events=90,
        chatter_tolerance=1e-10,
        section_phase=0.5,
    )
    assert run.stroboscopic.tobytes() == expected.stroboscopic.tobytes()
    assert run.stroboscopic[0].tolist() != list(initial)
    assert set(RUN_KEYS) == {
        "initial",
        "periods",
        "time",
        "keep",
        "max_events",
        "chatter_tolerance",
    } | {"section_phase"}


def test_a_swept_parameter_need_not_stand_in_the_file(run_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = example_file().replace("drive_frequency = 1.8\n", "")
    (tmp_path / "system.toml").write_text(text, encoding="utf-8")
    line = "--system system.toml --vary drive-frequency 1.7 1.9 3 --quiet --save d.npz"
    assert run_command(f"diagram {line}")[0] == 0
    diagram = vi.load("d.npz")
    assert (diagram.settings.periods, diagram.settings.keep) == (600, 100)
    assert diagram.parameter.tolist() == np.linspace(1.7, 1.9, 3).tolist()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("gap = ", ["not a TOML file"]),
        ("[system]\nlaw = newton", ["not a TOML file", 'text needs quotes: law = "newton"']),
        ("[system]\ngap = nan\nlaw= hertz # no", ["line 3", 'quotes: law = "hertz"\n']),
        ("[system]\nfricton = 1", ["unknown: fricton, did you mean friction? allowed: mass_ratio"]),
        ("gap = 0.5", ["unknown: gap", "allowed: system, physical, structure, run"]),
        ("[systems]", ["unknown: systems", "allowed: system, physical, structure, run"]),
        ("system = 3", ["system = 3", "a table"]),
        ("[system]\nmass = 1\nmas = 2", ["[system]: unknown: mas, mass", "mass_ratio", "damping"]),
        ("[run]\nperiod = 3", ["[run]: unknown: period", "periods", "section_phase"]),
        ("[system]\n[physical]", ["one of the tables [system] and [physical]"]),
        ("[physical]\nlength = 1", ["[physical]: missing: drive_frequency, gap, oscillator_mass"]),
        (PHYSICAL + "mass_ratio = 1", ["[physical]: unknown: mass_ratio", "pendulum_mass"]),
        (PHYSICAL.replace("stiffness = 40", "stiffness = -40"), ["stiffness = -40", "> 0"]),
        ("[system]\ndamping = 0.1", ["damping = 0.1", "pendulum_damping, oscillator_damping"]),
        ("[system]\ndamping = [0, 0]\npendulum_damping = 0", ["damping = [0, 0]"]),
        ("[system]\ngap = nan", ["missing system parameters"]),
        (example_file().replace("gap = 0.5", "gap = nan"), ["gap = nan"]),
        (example_file().replace("gap = 0.5", "gap = '0.5'"), ["gap = '0.5'"]),
        (example_file().replace("gap = 0.5", "gap = true"), ["gap = True"]),
        (example_file().replace("periods = 600", "periods = 600.5"), ["periods = 600.5"]),
        (example_file().replace("0.5, 0.0, 0.0]", "0.5]"), ["initial of shape (2,)"]),
        (example_file() + "time = 5.0", ["exactly one of --periods and --time, got both"]),
    ],
)
def test_slips_in_a_file_are_named(run_command, text, words, tmp_path):
    path = tmp_path / "system.toml"
    path.write_text(text, encoding="utf-8")
    code, out, err = run_command("simulate --system", path)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    for word in words:
        assert word in err


def test_bytes_that_are_no_text_are_named(tmp_path):
    path = tmp_path / "system.toml"
    path.write_bytes(b"\xff\xfe[system]")
    with pytest.raises(vi.ParameterError, match="not a TOML file"):
        read(path)


def test_a_restitution_that_depends_on_the_speed(saved):
    table = "{ speeds = [0.05, 1.0], values = [0.9, 0.5] }"
    run = saved(example_file().replace("restitution = 0.8", f"restitution = {table}"))
    assert run.system.restitution == vi.RestitutionTable([0.05, 1.0], [0.9, 0.5])


def test_numbers_of_a_curve_are_set_by_flags(run_command, tmp_path):
    path = tmp_path / "curve.toml"
    path.write_text(
        "[system]\nmass_ratio = 0.6\nfrequency_ratio = 2\ngap = 0.5\ndrive_frequency = 1.8\n"
        "moment_amplitude = 1\n"
        "restitution = { speeds = [0.5, 2.0, 4.5], values = [0.8, 0.65, 0.5] }\n" + RUN,
        encoding="utf-8",
    )
    command = f"simulate --system {path} --set r-1"
    code, out, err = run_command(command, 0.6)
    assert (code, err) == (0, "")
    other = path.with_name("other.toml")
    other.write_text(path.read_text(encoding="utf-8").replace("0.65", "0.6"), encoding="utf-8")
    assert run_command(f"simulate --system {other}")[1] == out
    code, _, err = run_command(command, 1.5)
    assert code == 2
    assert "r_1 = 1.5 is not allowed" in err
