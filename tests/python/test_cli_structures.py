"""Structures on the command line: the numbers are those of Python, and every slip is named."""

import csv
import json

import numpy as np
import pytest
from matplotlib.image import imread

import struck
import vibroimpact as vi
from command_lines import fields
from vibroimpact.cli import template
from vibroimpact.cli.system_file import read

FILE = """
[structure]
mass = [[1, 0], [0, 2]]
stiffness = [[2, -1], [-1, 1]]
damping_ratios = [0.05, 0.05]
static_load = [0.125, 0]
drive_amplitude = [1, [0, 1]]
drive_frequency = 1.06
phase = 0.5
law = "newton"
simultaneous = "sequence"

[[structure.stops]]
normal = [1, -1]
gap = 0.3
restitution = 0.7

[[structure.stops]]
normal = [0, 1]
gap = 0.6
restitution = 0.8
friction = 0.25
tangent = [1, 0]
amplitude = 0.0625
phase = -0.5

[run]
initial = [[0, 0.125], [0, 0]]
periods = 60
keep = 20
"""
MADE = vi.Structure(
    [[1, 0], [0, 2]],
    [[2, -1], [-1, 1]],
    [
        vi.Stop([1, -1], 0.3, 0.7),
        vi.Stop([0, 1], 0.6, 0.8, friction=0.25, tangent=[1, 0], amplitude=0.0625, phase=-0.5),
    ],
    damping_ratios=[0.05, 0.05],
    static_load=[0.125, 0],
    drive_amplitude=[1, 1j],
    drive_frequency=1.06,
    phase=0.5,
    law="newton",
    simultaneous="sequence",
)
START = [[0, 0.125], [0, 0]]
# A driven mass with one impact in every period; and the file of it.
PLAIN = struck.SETTLING
PLAIN_FILE = """
[structure]
mass = [[1]]
stiffness = [[1]]
damping_ratios = [0.05]
drive_amplitude = [1]
drive_frequency = 2.0
stops = [{normal = [1], gap = 0.3, restitution = 0.8}]

[run]
initial = [[0], [0]]
periods = 200
keep = 50
"""


@pytest.fixture
def rig(run_command, tmp_path, monkeypatch):
    """Run a command on a file of a structure; return what it prints."""
    monkeypatch.chdir(tmp_path)

    def run(line, *, text=FILE, code=0, name="rig.toml"):
        (tmp_path / name).write_text(text, encoding="utf-8")
        command, _, flags = line.partition(" ")
        found, out, err = run_command(f"{command} --system {name} {flags}")
        assert found == code, err
        return out if code in (0, 3) else err

    return run


def table(path):
    """Return the columns of a table."""
    with open(path, encoding="utf-8", newline="") as file:
        rows = [*csv.DictReader(file)]
    return {name: [row[name] for row in rows] for name in rows[0]}


def numbers(columns, name):
    return [float(text) for text in columns[name]]


def test_a_run_is_that_of_python(rig):
    printed = fields(rig("simulate --csv impacts.csv --save run.npz --plot run.png"))
    run = vi.simulate(MADE, initial=START, periods=60, keep=20)
    loaded = vi.load("run.npz")
    assert loaded == run
    assert loaded.system == MADE
    assert printed["label"] == run.label
    assert printed["impacts"].startswith(f"{run.impact_count}, {len(run.impacts)} kept")
    end = run.final_state
    state = f"q = {end.q.tolist()}, v = {end.v.tolist()} at t = {end.time!r}"
    assert printed["state"] == state
    columns = table("impacts.csv")
    assert numbers(columns, "stop") == run.impacts["stop"].tolist()
    for name in ("q", "v_pre", "v_post"):
        for i in (0, 1):
            assert numbers(columns, f"{name}_{i}") == run.impacts[name][:, i].tolist()
    for name in ("time", "approach_velocity", "impulse_normal", "impulse_tangential"):
        assert numbers(columns, name) == run.impacts[name].tolist()
    assert set(columns["regime"]) > {"frictionless"}
    assert imread("run.png").std() > 0.0


def test_flags_change_the_structure_of_a_file(rig):
    flags = "--gap 0.25 --set gap-1 0.5 --law poisson --simultaneous stop --drive-frequency 1.1"
    rig(f"simulate {flags} --initial 0.125 0 -0.25 0.5 --periods 8 --keep 2 --save run.npz")
    run = vi.load("run.npz")
    changes = {"gap": 0.25, "gap_1": 0.5, "law": "poisson", "simultaneous": "stop"}
    assert run.system == MADE.replace(**changes, drive_frequency=1.1)
    assert run.initial.tolist() == [[0.125, 0.0], [-0.25, 0.5]]
    assert run.final_state.period == 8


def test_a_number_that_is_set_or_varies_need_not_stand_in_the_file(rig):
    text = PLAIN_FILE.replace("gap = 0.3, ", "").replace("drive_frequency = 2.0\n", "")
    flags = "--set gap-0 0.3 --drive-frequency 2 --periods 5 --keep 5 --save run.npz"
    rig(f"simulate {flags}", text=text)
    assert vi.load("run.npz").system == PLAIN
    rig("diagram --vary gap 0.3 0.4 2 --drive-frequency 2 --quiet --points p.csv", text=text)
    assert numbers(table("p.csv"), "gap") == [0.3, 0.4]


@pytest.mark.parametrize("made", [MADE, PLAIN, struck.BEAM, struck.PRESSED, struck.MOVING])
def test_the_json_of_a_structure_is_a_file(rig, made):
    start = " ".join(["0"] * (2 * made.coordinates))
    line = f"simulate --initial {start} --periods 3 --save run.npz"
    rig(line, text=made.to_json(), name="made.json")
    assert vi.load("run.npz").system == made


def test_the_json_of_a_system_is_a_file(rig):
    system = vi.System(
        mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5, drive_frequency=1.8
    )
    line = "simulate --initial 0 0.5 0 0 --periods 3 --friction 0.25 --save run.npz"
    rig(line, text=system.to_json(), name="made.json")
    assert vi.load("run.npz").system == system.replace(friction=0.25)


def test_a_structure_from_its_modes(rig):
    basis = struck.BEAM._basis
    text = f"""
[structure]
frequencies = {basis.frequencies.tolist()}
shapes = {(basis.shapes * [1, 2]).tolist()}
modal_mass = [1, 4]
damping_ratios = [0.02, 0.02]
drive_amplitude = [0, 0, 4]
drive_frequency = 1.3
[[structure.stops]]
normal = [0, 0, 1]
gap = 0.3
restitution = 0.8
"""
    rig("simulate --initial 0 0 0 0 0 0 --periods 12 --save run.npz", text=text)
    assert vi.load("run.npz") == struck.beam_run()


def test_a_run_is_verified(rig):
    pytest.importorskip("flint")
    out = rig("simulate --periods 4 --keep 4 --verify 8 --quiet", text=PLAIN_FILE)
    assert "verified" in out


def test_a_diagram_is_that_of_python(rig):
    line = "diagram --vary gap-0 0.3 0.4 3 --start fresh backward --quiet"
    out = rig(f"{line} --csv s.csv --points p.csv --plot d.png")
    diagram = vi.bifurcation_diagram(
        MADE,
        initial=START,
        gap_0=np.linspace(0.3, 0.4, 3),
        start=("fresh", "backward"),
        periods=60,
        keep=20,
    )
    section, points = table("s.csv"), table("p.csv")
    assert fields(out)["completed"] == "6 of 6 cells"
    assert numbers(section, "gap_0") == diagram.impact_parameter.tolist()
    assert numbers(section, "branch") == np.repeat(diagram.branch, np.diff(diagram.offset)).tolist()
    assert numbers(section, "v_pre_1") == diagram.impacts["v_pre"][:, 1].tolist()
    assert numbers(section, "energy_loss") == diagram.impacts["energy_loss"].tolist()
    assert numbers(points, "gap_0") == diagram.parameter.tolist()
    assert points["label"] == diagram.label.tolist()
    assert imread("d.png").std() > 0.0


def test_a_diagram_is_refined_saved_stored_and_has_exponents(rig):
    line = "diagram --vary gap 0.1 0.7 3 --refine 1 --exponents --quiet --periods 100 --keep 40"
    rig(f"{line} --save d.npz --points p.csv --store d.zarr", text=PLAIN_FILE)
    diagram = vi.bifurcation_diagram(
        PLAIN,
        initial=[[0], [0]],
        gap=np.linspace(0.1, 0.7, 3),
        refine=1,
        exponents=True,
        periods=100,
        keep=40,
    )
    saved = vi.load("d.npz")
    assert len(saved) > 3
    assert saved.label.tolist() == diagram.label.tolist()
    assert saved.largest_exponent.tobytes() == diagram.largest_exponent.tobytes()
    points = table("p.csv")
    assert numbers(points, "gap") == diagram.parameter.tolist()
    assert numbers(points, "largest_exponent") == diagram.largest_exponent.tolist()


def test_the_phase_of_impacts_is_not_that_which_varies(rig):
    rig("diagram --vary phase 0 1 2 --quiet --save d.npz --csv s.csv", text=PLAIN_FILE)
    section, diagram = table("s.csv"), vi.load("d.npz")
    assert numbers(section, "phase") == diagram.impact_parameter.tolist()
    assert numbers(section, "impact_phase") == diagram.impacts["phase"].tolist()


def test_a_chart_is_that_of_python(rig):
    line = "chart --vary gap-0 0.3 0.4 2 --vary phase 0 1 2 --quiet --no-exponents"
    rig(f"{line} --csv c.csv --save c.npz --plot c.png")
    chart = vi.chart(
        MADE,
        initial=START,
        gap_0=[0.3, 0.4],
        phase=[0.0, 1.0],
        periods=60,
        keep=20,
        exponents=False,
    )
    columns = table("c.csv")
    assert columns["label"] == chart.label.ravel().tolist()
    assert numbers(columns, "contact_fraction") == chart.contact_fraction.ravel().tolist()
    assert np.array_equal(vi.load("c.npz").final_states, chart.final_states)
    assert imread("c.png").std() > 0.0


def test_exponents_over_a_number_are_those_of_python(rig):
    line = "lyapunov --vary gap-0 0.3 0.4 3 --periods 60 --initial 0 0 --csv e.csv --plot e.png"
    assert "exponent 1 > 0" in rig(line, text=PLAIN_FILE)
    gaps = np.linspace(0.3, 0.4, 3)
    swept = vi.lyapunov_spectrum(PLAIN, initial=[[0], [0]], periods=60, gap_0=gaps)
    for k in range(2):
        assert numbers(table("e.csv"), f"exponent_{k + 1}") == swept.exponents[:, k].tolist()
    assert imread("e.png").std() > 0.0


def test_basins_are_those_of_python(rig):
    line = "basins --vary q-0 -0.5 0.4 5 --vary v-0 -2 2 4 --scouts 20 --periods 300 --keep 60"
    rig(f"{line} --quiet --csv b.csv --plot b.png", text=PLAIN_FILE)
    plane = {"q_0": np.linspace(-0.5, 0.4, 5), "v_0": np.linspace(-2.0, 2.0, 4)}
    basins = vi.basins(PLAIN, **plane, scouts=20, periods=300, keep=60)
    assert table("b.csv")["attractor"] == [str(each) for each in basins.attractor.ravel()]
    assert imread("b.png").std() > 0.0


@pytest.mark.parametrize(
    ("flag", "impacts", "sections"),
    [
        ("", {}, 0),
        ("--value v-pre-1", {"value": "v_pre", "coordinate": 1}, 1),
        ("--value phase", {"value": "phase"}, 0),
    ],
)
def test_what_a_diagram_shows_can_be_chosen(rig, monkeypatch, flag, impacts, sections):
    calls = []
    monkeypatch.setattr(vi.plot, "bifurcation", lambda _, ax, **options: calls.append(options))
    rig(f"diagram --vary phase 0 1 2 --periods 4 --keep 2 --quiet {flag} --plot d.png")
    right = {"section": "stroboscopic", "legend": False, "coordinate": sections}
    assert calls == [impacts, right]


def test_exponents_are_those_of_python(rig):
    out = rig("lyapunov --periods 100 --csv l.csv --plot l.png", text=PLAIN_FILE)
    spectrum = vi.lyapunov_spectrum(PLAIN, initial=[[0], [0]], periods=100)
    columns = table("l.csv")
    assert numbers(columns, "time") == spectrum.history_time.tolist()
    assert numbers(columns, "exponent_2") == spectrum.history[:, 1].tolist()
    printed = fields(out.replace("exponent ", "exponent_"))
    assert float(printed["sum"]) == pytest.approx(spectrum.sum, rel=1e-8)
    assert float(printed["exponent_1"].split()[0]) == pytest.approx(spectrum.largest, rel=1e-5)
    assert imread("l.png").std() > 0.0
    one = rig("lyapunov --periods 100 --most 1", text=PLAIN_FILE)
    assert "exponent 1" in one
    assert "exponent 2" not in one
    assert "sum" not in one


def test_the_motion_settled_on(rig):
    out = rig("orbits --csv o.csv --plot o.png", text=PLAIN_FILE)
    motion = vi.simulate(PLAIN, initial=[[0], [0]], periods=200).refine()
    columns = table("o.csv")
    assert (columns["label"], columns["stability"]) == ([motion.label], [motion.stability])
    assert numbers(columns, "initial_q_0") == [motion.state[0, 0]]
    assert numbers(columns, "initial_v_0") == [motion.state[1, 0]]
    found = [
        complex(*(numbers(columns, f"multiplier_{k}_{part}")[0] for part in ("real", "imag")))
        for k in (1, 2)
    ]
    assert found == motion.multipliers.tolist()
    assert out.splitlines()[1].split() == ["1-1", f"{abs(found[0]):.9g}", "stable"]
    assert imread("o.png").std() > 0.0


def test_a_branch_with_its_bifurcations(rig):
    line = "orbits --follow drive-frequency 1.6 2.6 --value v-pre-0 --csv b.csv --plot b.png"
    out = rig(line, text=PLAIN_FILE)
    motion = vi.simulate(PLAIN, initial=[[0], [0]], periods=200).refine()
    branch = motion.follow(drive_frequency=(1.6, 2.6))
    columns = table("b.csv")
    points = columns["kind"].count("point")
    assert numbers(columns, "drive_frequency")[:points] == branch.values.tolist()
    last = branch.pieces[-1].motion(len(branch.pieces[-1].values) - 1)
    assert numbers(columns, "initial_q_0")[points - 1] == last.state[0, 0]
    assert columns["kind"][points:] == [str(found.kind) for found in branch.bifurcations]
    assert branch.bifurcations
    for printed, found in zip(out.splitlines()[1:], branch.bifurcations, strict=False):
        assert printed.split()[1:3] == [str(found.kind), repr(found.value)]
    assert imread("b.png").std() > 0.0


@pytest.mark.parametrize("example", template.EXAMPLES)
def test_examples_are_complete(run_command, tmp_path, example):
    path = tmp_path / "new.toml"
    assert run_command(f"template {example} --out", path) == (0, f"written: {path}\n", "")
    assert path.read_text(encoding="utf-8") == run_command(f"template {example}")[1]
    code, out, err = run_command("simulate --system", path)
    assert (code, err) == (0, "")
    assert fields(out)["stopped"] == "completed"
    code, _, err = run_command("template --out", path)
    assert code == 2
    assert "there is such a file" in err


def test_lines_of_the_example_that_are_comments_hold(tmp_path):
    text = template.STRUCTURE
    for line in ("# static_load", "# phase", "# law", "# simultaneous", "# friction", "# tangent"):
        assert text.count(f"\n{line}") >= 1
        text = text.replace(f"\n{line}", f"\n{line[2:]}")
    text = text.replace("tangent = [0.0, 0.0]", "tangent = [1.0, 0.0]")
    path = tmp_path / "rig.toml"
    path.write_text(text.replace("\n# amplitude", "\namplitude"), encoding="utf-8")
    made = read(path).machine.machine({}, {}, {})
    assert made.stops[1].friction == 0.2
    assert made.simultaneous == "stop"


def changed(old, new, text=FILE):
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (changed("stiffness = [[2, -1], [-1, 1]]", ""), ["[structure]: missing: stiffness"]),
        (changed("mass", "masss"), ["[structure]: unknown: masss, did you mean mass? allowed: "]),
        (changed("[[2, -1], [-1, 1]]", "[[2, -1], [1, 1]]"), ["stiffness[", "symmetric"]),
        (changed("[[2, -1], [-1, 1]]", "[[2, -1]]"), ["stiffness of shape (1, 2)", "(2, 2)"]),
        (changed("[[2, -1], [-1, 1]]", "[[2], [-1, 1]]"), ["stiffness"]),
        (changed("[[1, 0], [0, 2]]", "[[1, 0], [0, -2]]"), ["mass = a matrix whose leading minor"]),
        (changed("[[1, 0], [0, 2]]", "[[1, 2], [2, 2]]"), ["mass", "positive definite"]),
        (changed("[[1, 0], [0, 2]]", "[[nan, 0], [0, 2]]"), ["mass[0, 0] = nan", "finite"]),
        (changed("[[1, 0], [0, 2]]", '"M.csv"'), ["mass"]),
        (changed("[1, [0, 1]]", "[1, [0, 1, 2]]"), ["drive_amplitude[1] = [0, 1, 2]", "a pair"]),
        (changed("[1, [0, 1]]", "[1, [0, true]]"), ["drive_amplitude[1] = [0, True]", "a pair"]),
        (changed("[1, [0, 1]]", "[1, [0, nan]]"), ["drive_amplitude[1] = nanj"]),
        (changed("[1, [0, 1]]", f"[1, [0, 1{'0' * 400}]]"), ["drive_amplitude[1]", "a pair"]),
        (changed("[1, [0, 1]]", "[1]"), ["drive_amplitude of shape (1,)", "(2,)"]),
        (changed("gap = 0.3\n", ""), ["[structure]: stops[0]: missing: gap"]),
        (changed("gap = 0.3", "gap = inf"), ["stops[0].gap = inf"]),
        (changed("gap = 0.3", "gapp = 0.3"), ["stops[0]: unknown: gapp, did you mean gap?"]),
        (changed("[1, -1]\n", "[0, 0]\n"), ["stops[0].normal"]),
        (changed("[1, -1]\n", "[1]\n"), ["stops[0].normal of shape (1,)"]),
        (changed("tangent = [1, 0]\n", ""), ["stops[1].tangent = None", "friction > 0"]),
        (changed("restitution = 0.7", "restitution = 7"), ["stops[0].restitution = 7"]),
        (changed("[[structure.stops]]\nnormal = [1, -1]\ngap = 0.3\nrestitution = 0.7", ""), []),
        (changed('"newton"', '"hertz"'), ["law = 'hertz'", "'poisson'"]),
        (changed('"newton"', "newton"), ["not a TOML file", 'text needs quotes: law = "newton"']),
        (changed('"sequence"', '"both"'), ["simultaneous = 'both'"]),
        (changed("damping_ratios = [0.05, 0.05]", "damping_ratios = [0.05]"), ["damping_ratios"]),
        (changed("mass =", "frequencies = [1]\nmass ="), ["unknown: mass, stiffness", "shapes"]),
        (changed("[structure]", "[system]\n[structure]"), ["[system] and [structure], not both"]),
        (changed("[[0, 0.125], [0, 0]]", "[0, 0.125]"), ["initial of shape (2,)"]),
        (changed("[[0, 0.125], [0, 0]]", "[[0, 0.75], [0, 0]]"), ["initial"]),
        (changed("[[0, 0.125], [0, 0]]", "[[0, nan], [0, 0]]"), ["initial"]),
        ("[structure]", ["missing: mass, stiffness, stops"]),
        ("structure = 3", ["structure = 3", "a table"]),
        (changed("gap = 0.3", "gap = 0.3, restitution = 0.8}]\n[[", PLAIN_FILE), ["not a TOML"]),
        (
            changed("[{normal = [1], gap = 0.3, restitution = 0.8}]", "[1.0]", PLAIN_FILE),
            ["stops = [1.0]", "[[structure.stops]]"],
        ),
    ],
)
def test_slips_in_a_file_are_named(rig, text, words):
    if not words:  # one stop less is another structure, not a slip
        assert "completed" in rig("simulate", text=text)
        return
    err = rig("simulate", text=text, code=2)
    assert err.startswith("vibroimpact: ")
    assert err.count("\n") == 1
    for word in words:
        assert word in err
    if "initial" not in err:
        assert "rig.toml" in err


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", ["made.json: not a JSON file"]),
        ("3", ["made.json is not allowed; allowed: an object as to_json writes it"]),
        ("{}", ["made.json: missing system parameters"]),
        (json.dumps({"gapp": 1}), ["made.json: unknown: gapp, did you mean gap?"]),
        (json.dumps({"stops": []}), ["made.json, [structure]: missing: mass, stiffness"]),
    ],
)
def test_slips_in_a_json_are_named(rig, text, words):
    err = rig("simulate", text=text, name="made.json", code=2)
    for word in words:
        assert word in err


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("simulate --mass-ratio 0.6", "--mass-ratio 0.6 is not allowed with a structure; allowed"),
        ("simulate --contact direct", "--contact direct is not allowed with a structure"),
        ("simulate --units SI", "--units SI is not allowed here"),
        ("simulate --law paper", "law = 'paper'"),
        ("simulate --set gap-2 1", "--set gap-2: did you mean gap-0 or gap-1? allowed are drive-"),
        ("simulate --set gap-0 wide", "--set gap-0 wide: could not convert"),
        ("simulate --set gap-0 nan", "stops[0].gap = nan"),
        ("simulate --gap 0.3 --set gap 0.4", "--set gap: given twice"),
        ("simulate --initial 0 0 0", "--initial of 3 numbers"),
        ("simulate --initial 0 0", "initial of shape (2, 1)"),
        ("diagram --vary mass 1 2 3", "--vary mass: allowed are drive-frequency, phase, gap"),
        ("diagram --vary gap 1 2 3 --value x1 --plot d.png", "--value x1: "),
        ("lyapunov --most 5", "most = 5"),
        ("orbits --n 1", "--n is not for structures; allowed: a system of two bodies"),
        ("orbits --search 3", "--search is not for structures"),
        ("orbits --follow gap 0.1 0.2", "gap"),
        ("orbits --follow gap-0 0.4 0.5", "gap_0 = (0.4, 0.5)"),
        ("orbits --follow mass 0 1", "--follow mass: allowed are drive-frequency"),
        ("orbits --follow gap-0 0.2 0.4 --plot b.png --value energy-loss", "--value energy-loss: "),
        ("orbits --set drive-frequency 0", "drive_frequency = 0.0"),
        ("chart --vary gap 0 1 3 --vary q-0 0 1 3", "--vary q-0: "),
    ],
)
def test_what_a_structure_cannot_have_is_refused(rig, line, message):
    text = FILE if "drive-frequency 0" not in line else changed("amplitude = 0.0625\n", "")
    err = rig(line, text=text, code=2)
    assert message in err
    assert err.count("\n") == 1


def test_the_explorer_of_a_structure_begins_with_the_file_and_its_flags(rig):
    code = rig("explore --code --set gap-0 0.375")
    lines = code.partition("# The motion.")[0].splitlines()
    made = {}
    exec("\n".join(lines), made)
    assert made["structure"] == MADE.replace(gap_0=0.375)
    assert made["initial"] == [[0, 0.125], [0, 0]]
    assert "vi.plot.bifurcation(diagram" in code


def test_what_only_a_structure_has_is_refused(run_command):
    flags = "--mass-ratio 0.6 --frequency-ratio 2 --restitution 0.8 --gap 0.5 --initial 0 0 0 0"
    line = f"simulate {flags} --drive-frequency 1.8 --periods 3"
    code, _, err = run_command(f"{line} --simultaneous stop")
    assert code == 2
    assert "--simultaneous stop is not allowed with a system of two bodies; allowed: --" in err
    code, _, err = run_command(f"lyapunov {flags} --drive-frequency 1.8 --most 2")
    assert code == 2
    assert "most = 2" in err
    assert run_command(line.replace("--gap 0.5", "--set gap 0.5"))[0] == 0
