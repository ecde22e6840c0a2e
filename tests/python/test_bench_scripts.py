"""The benchmarks: the yardstick runs, the peers' law is the core's, scripts run with peers missing.

Nothing here asserts a time.
"""

import ctypes
import importlib.util
import json
import math
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest

import repository
import vibroimpact as vi
from references import reference
from vibroimpact.system import SYMBOLS

BENCHES = repository.root() / "benches"
EPS = np.finfo(float).eps
# Packages that the peers need, apart from SciPy, which is there for other tests too.
OPTIONAL = ("heyoka", "numba", "sksundae")


@pytest.fixture
def compiler(bench):
    if bench("native").compiler() is None:
        pytest.skip("no C compiler")


def runs():
    """The scenes of bench_scenes.json, with their systems."""
    for name, scene in reference("bench_scenes.json").items():
        numbers = {SYMBOLS[symbol]: float(text) for symbol, text in scene["params"].items()}
        yield pytest.param(scene, vi.System(**numbers), id=name)


@pytest.mark.usefixtures("compiler")
def test_the_yardstick_compiles_and_measures(bench):
    assert bench("yardstick").yardstick(1_000) > 0.0


@pytest.fixture(params=["Python", "C"])
def law(request, bench):
    """The peers' impact law; that in C is CVODE's."""
    if request.param == "Python":
        return bench("peers.law").resolve
    request.getfixturevalue("compiler")
    native = bench("native").load(BENCHES / "peers" / "law.c").impact_law
    native.argtypes = (*[ctypes.c_double] * 3, ctypes.POINTER(ctypes.c_double))

    def resolve(given, x1, v1, v2):
        state = (ctypes.c_double * 4)(x1, v1, 0.0, v2)
        native(given["mass_ratio"], given["restitution"], given["friction"], state)
        return state[1], state[3]

    return resolve


def test_the_peers_law_is_that_of_the_core(law):
    generator = np.random.default_rng(20261)
    seen = set()
    for _ in range(300):
        given = {
            "mass_ratio": generator.uniform(0.05, 3.0),
            "restitution": generator.uniform(0.0, 1.0),
            "friction": generator.choice([0.0, generator.uniform(0.0, 3.0)]),
        }
        x1, v1, v2 = generator.uniform(-4.0, 4.0), *generator.uniform(-2.0, 2.0, 2)
        if v1 * math.cos(x1) <= v2:
            v1, v2 = -v1, -v2
        system = vi.System(frequency_ratio=2.0, gap=0.5, drive_frequency=1.0, **given)
        ours = vi.impact(system, x1=x1, v1=v1, v2=v2)
        seen.add(int(ours["regime"]))
        theirs = law(given, x1, v1, v2)
        # Impulses grow as the effective mass falls.
        scale = max(1.0, float(ours["impulse_normal"]))
        assert theirs[0] == pytest.approx(float(ours["v1_post"]), abs=1e-13 * scale**2)
        assert theirs[1] == pytest.approx(float(ours["v2_post"]), abs=1e-13 * scale**2)
    assert seen == set(range(6))


@pytest.mark.parametrize(("scene", "system"), [*runs()])
def test_the_core_follows_the_references(scene, system):
    initial = [float(text) for text in scene["initial"]]
    run = vi.simulate(system, initial=initial, periods=scene["periods"])
    assert len(run.impacts) == len(scene["impacts"])
    exact = np.array([[float(text) for text in row] for row in scene["stroboscopic"]])
    growth = np.array(scene["amplification"])
    since = np.array([max(growth[k] / growth[: k + 1]) for k in range(len(growth))])
    allowed = 100 * EPS * np.maximum(1.0, np.maximum(growth, since))
    assert (abs(run.stroboscopic - exact) <= allowed[:, None] * np.maximum(1.0, abs(exact))).all()


def test_the_references_are_what_their_script_computes(bench):
    mp = pytest.importorskip("mpmath")
    script = bench("reference_runs")
    scene = reference("bench_scenes.json")["fig7b_1.56"]
    with mp.workdps(40):
        p = script.numbers(scene["params"])
        impacts, rows = script.run(p, [mp.mpf(text) for text in scene["initial"]], 2)
        assert [script.text(t) for t, _, _ in impacts] == [i["t"] for i in scene["impacts"][:2]]
        assert [[script.text(x) for x in row] for row in rows] == scene["stroboscopic"][:2]


@pytest.mark.parametrize("name", ["heyoka_batch", "heyoka_events", "numba_flights"])
def test_a_peer_computes_the_sections_that_are_asked_for(bench, name):
    _check_sections(bench, name)


def test_scipy_computes_the_sections_that_are_asked_for(bench):
    _check_sections(bench, "scipy_events")


@pytest.mark.usefixtures("compiler")
def test_cvode_computes_the_sections_that_are_asked_for(bench):
    _check_sections(bench, "cvode_events")


def _check_sections(bench, name):
    peer = bench(f"peers.{name}")
    if why := peer.missing():
        pytest.skip(f"{name}: {why}")
    (scene,) = bench("scenes").read_scenes(["fig7b_1.08"])
    solve = peer.prepare(scene.problem)
    # Another frequency beside it: a batch keeps them apart.
    omega = scene.problem.frequency
    wanted, other = solve([omega, 1.5 * omega], 6, 4)
    system = vi.System(**scene.problem.parameters)
    run = vi.simulate(system, initial=scene.problem.initial, periods=6, keep=4)
    assert wanted.stroboscopic == pytest.approx(run.stroboscopic, abs=1e-8)
    columns = np.column_stack([run.impacts[c] for c in ("x1", "v1_pre", "v2_pre")])
    assert wanted.impact_section[:, :3] == pytest.approx(columns, abs=1e-8)
    turn = np.exp(1j * wanted.impact_section[:, 3]) - np.exp(1j * run.impacts["phase"])
    assert abs(turn).max() < 1e-8
    assert wanted.impacts == scene.impacts(6)
    assert wanted.finished
    assert abs(other.stroboscopic - wanted.stroboscopic).max() > 1e-3
    fine = solve([omega], 6, 4, 8)[0]
    assert fine.stroboscopic[7::8] == pytest.approx(wanted.stroboscopic, abs=1e-8)


@pytest.mark.usefixtures("compiler")
def test_bars_run_with_peers_missing(bench, monkeypatch, tmp_path, capsys):
    for package in OPTIONAL:
        monkeypatch.setitem(sys.modules, package, None)
        monkeypatch.delitem(sys.modules, f"{package}.cvode", raising=False)
    bars = bench("bars")
    cvode = bench("peers.cvode_events")
    cvode._driver.cache_clear()
    bars.main(["--quick", "--cases", "Fig. 7(b)", "5a", "--out", str(tmp_path)])
    printed = capsys.readouterr().out
    assert printed.strip() == (tmp_path / "bars.md").read_text(encoding="utf-8").strip()
    head, rule, sweep, single = [line for line in printed.splitlines() if "|" in line][:4]
    assert head.count("|") == rule.count("|") == sweep.count("|") == single.count("|")
    # heyoka.py's batch and scalar, Numba, CVODE; a single run has no batch.
    assert sweep.count("not installed") == 4
    assert single.count("not installed") == 3
    results = json.loads((tmp_path / "bars.json").read_text(encoding="utf-8"))
    for result in results:
        assert result["error"] < 1e-13
        assert result["peers"]["SciPy"]["missed"] == "nothing"
        assert result["peers"]["SciPy"]["error"] < 1e-9
    several = {"one", "threads", "processes"} if bench("machine").cores() > 1 else set()
    assert [set(result["two cores"]) for result in results] == [several, set()]


def test_bars_names_a_case_that_does_not_exist(bench, capsys):
    with pytest.raises(SystemExit):
        bench("bars").main(["--cases", "Fig. 11"])
    assert "no case of that name" in capsys.readouterr().err


def test_work_precision_writes_what_it_measures(tmp_path):
    command = [sys.executable, BENCHES / "work_precision", "--quick"]
    scenes = ("--scenes", "graze_1e-4", "graze_1e-8")
    done = subprocess.run(
        [*command, *scenes, "--out", tmp_path], check=True, capture_output=True, text=True
    )
    assert "2/2: grazing, contact 1e-8 deep ... " in done.stderr
    text = (tmp_path / "work_precision.md").read_text(encoding="utf-8")
    assert "| graze_1e-4 | grazing |" in text
    # The pair of crossings lies within one step of SciPy's.
    assert "10 impacts of 11" in text
    assert (tmp_path / "work_precision.csv").read_text(encoding="utf-8").count("vibroimpact") == 2
    # One scene of each kind in the README's table, and in the smaller of the diagrams.
    table = (tmp_path / "readme_table.md").read_text(encoding="utf-8")
    assert "| grazing: contact 1e-4 deep |" in table
    assert "1e-8 deep" not in table
    assert "scenes without complete chatter (2): vibroimpact 0 of 2," in table
    widths = [
        plt.imread(tmp_path / f"work_precision{which}.png").shape[1] for which in ("", "_all")
    ]
    assert 0 < widths[0] <= widths[1]


@pytest.fixture
def work_precision(bench, monkeypatch):
    """Import a module of the folder work_precision."""
    monkeypatch.syspath_prepend(str(BENCHES / "work_precision"))
    return bench


@pytest.fixture
def point(work_precision):
    """Return a point of the diagram, by default one of a run that missed nothing."""

    def make(solver, error, ratio, **given):
        usual = {
            "scene": "fig5a",
            "kind": "periodic",
            "title": "Fig. 5(a), 1-1",
            "periods": 25,
            "tolerance": None,
            "seconds": 1e-5 * ratio,
            "impacts": 26,
            "impacts_expected": 26,
            "evaluations": 0,
            "false_events": 0,
            "penetration": 0.0,
            "missed": "",
            "rounds": 3,
        }
        row = work_precision("measure").Row
        return row(solver=solver, error=error, ratio=ratio, **{**usual, **given})

    return make


def test_the_readme_table_gives_each_peer_its_best_run(work_precision, point):
    chatter = {"scene": "friction_stick_slip", "kind": "stick-slip", "title": "friction 0.3"}
    chatter |= {"impacts_expected": None}
    lost = chatter | {"missed": "the lasting contact"}
    given_up = chatter | {"missed": "given up: too many contacts"}
    rows = [
        point("vibroimpact", 2e-15, 1.0),
        # Fastest of those accurate enough, not the fastest nor the most accurate.
        point("SciPy DOP853", 1e-5, 200.0),
        point("SciPy DOP853", 4e-9, 949.0),
        point("SciPy DOP853", 1e-12, 3000.0),
        # A run that missed a contact does not count, however small its error.
        point("heyoka.py", 1e-9, 3.0, missed="25 impacts of 26"),
        point("heyoka.py", 2e-10, 8.04),
        # None accurate enough: the most accurate.
        point("CVODE", 3e-5, 20.0),
        point("CVODE", 5e-7, 44.0),
        point("vibroimpact", 3e-16, 1.0, **chatter),
        point("SciPy DOP853", 1e-1, 40.0, **lost),
        point("heyoka.py", math.inf, 4.0, **given_up),
        point("CVODE", 1e-1, 9.0, **lost),
    ]
    measured = work_precision("measure").Measured(rows, {"Numba": "not installed"})
    lines = work_precision("readme_table").markdown(measured).splitlines()
    assert "medians of 3 rounds" in lines[0]
    # The machine is named.
    assert work_precision("machine").processor() in lines[0]
    table = [line for line in lines if line.startswith("|")]
    assert len(table) == 4
    assert table[2] == (
        "| periodic: Fig. 5(a), 1-1 | 2e-15 | 950 (4e-9) | 8 (2e-10) | 44 (5e-7) | not installed "
        "| heyoka.py 1 of 2 |"
    )
    assert table[3] == (
        "| stick-slip: friction 0.3 | 3e-16 | - | - | - | not installed | all runs of every peer |"
    )
    assert lines[-2].endswith(
        "scenes without complete chatter (1): "
        "vibroimpact 0 of 1, heyoka.py 1 of 2, CVODE 0 of 2, SciPy DOP853 0 of 3."
    )
    assert lines[-1].endswith(
        "scenes with complete chatter (1): "
        "vibroimpact 0 of 1, heyoka.py 1 of 1, CVODE 1 of 1, SciPy DOP853 1 of 1."
    )


def test_the_readme_table_leaves_out_what_is_right_by_chance(work_precision, point):
    rows = [
        point("vibroimpact", 1e-15, 1.0),
        point("CVODE", 2e-1, 10.0),
        point("CVODE", 1e-3, 20.0, missed="25 impacts of 26"),
    ]
    measured = work_precision("measure").Measured(rows, {})
    text = work_precision("readme_table").markdown(measured)
    assert "| 1e-15 | - | - | - | - | CVODE 1 of 2 |" in text


def test_the_readme_table_does_not_hide_a_miss_of_vibroimpact(work_precision, point):
    missed = {"missed": "25 impacts of 26"}
    rows = [point("vibroimpact", 1e-3, 1.0, **missed), point("CVODE", 1e-3, 9.0, **missed)]
    measured = work_precision("measure").Measured(rows, {})
    text = work_precision("readme_table").markdown(measured)
    assert "| vibroimpact 1 of 1, CVODE 1 of 1 |" in text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.775, "0.78"), (5.04, "5"), (12.4, "12"), (99.6, "100"), (949.0, "950"), (2123.0, "2,100")],
)
def test_a_ratio_of_times_has_two_digits(work_precision, value, text):
    assert work_precision("wording").times(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(2.4e-15, "2e-15"), (0.0, "0"), (1.0, "1e0"), (math.inf, "none"), (math.nan, "none")],
)
def test_an_error_has_one_digit(work_precision, value, text):
    assert work_precision("wording").short_error(value) == text


def test_the_diagram_shows_every_run(work_precision, point):
    rows = [
        point("vibroimpact", 0.0, 1.0),
        point("CVODE", 1e-6, 20.0),
        point("CVODE", 1e-2, 10.0, missed="25 impacts of 26"),
        point("Numba", math.inf, 5.0, missed="given up: too many contacts"),
    ]
    figure, ax = plt.subplots()
    work_precision("diagram").panel(ax, rows)
    shown = {
        (line.get_marker(), line.get_markerfacecolor(), *place)
        for line in ax.lines
        for place in zip(*line.get_data(), strict=True)
        if line.get_marker() not in ("None", None)
    }
    seconds = [row.seconds / row.periods for row in rows]
    assert shown == {
        ("*", "#000000", 1e-17, seconds[0]),
        ("o", "#009E73", 1e-6, seconds[1]),
        ("o", "white", 1e-2, seconds[2]),
        ("P", "white", 1e4, seconds[3]),
    }
    low, high = ax.get_xlim()
    assert all(low < x < high for _, _, x, _ in shown)
    plt.close(figure)


@pytest.mark.usefixtures("compiler")
def test_savings_measure_pairs_that_differ_in_one_thing(bench, tmp_path, capsys):
    bench("savings").main(["--quick", "--out", str(tmp_path)])
    printed = capsys.readouterr().out
    assert printed.strip() == (tmp_path / "savings.md").read_text(encoding="utf-8").strip()
    results = json.loads((tmp_path / "savings.json").read_text(encoding="utf-8"))
    assert printed.count("\n| ") == 2 + len(results)
    for result in results:
        # The Rust library alone can leave the sections out.
        timed = result["name"] != "stroboscopic section"
        assert bool(result["seconds"]) == timed, result["name"]
        assert result["instructions"] == {"on": None, "off": None}


def test_labels_are_timed_beside_the_same_sweep_without_them(bench, tmp_path, capsys):
    labels = bench("labels")
    labels.main(["--quick", "--out", str(tmp_path)])
    printed = capsys.readouterr().out
    assert printed.strip() == (tmp_path / "labels.md").read_text(encoding="utf-8").strip()
    results = json.loads((tmp_path / "labels.json").read_text(encoding="utf-8"))
    names = {result["name"] for result in results}
    assert names >= {f"Fig. {name}" for name in labels.BARS} | labels.CHARTS.keys()
    for result in results:
        assert {"plain", "labels and exponents"} <= result["seconds"].keys()
        assert all(len(seconds) == 1 for seconds in result["seconds"].values())


def test_what_is_switched_off_leaves_the_base_scene_its_impacts(bench):
    cases = {saving.name: saving for saving in bench("savings").savings(60, 2)}
    for name in ("friction", "damping", "force on the second body", "label"):
        saving = cases[name]
        assert saving.on.impacts == pytest.approx(saving.off.impacts, abs=2)
        assert saving.on.impacts == pytest.approx(60, abs=3)
        assert saving.on.setup["periods"] == saving.off.setup["periods"]
        assert saving.on.setup != saving.off.setup
    assert cases["contact within reach"].off.impacts == 0


@pytest.fixture
def structures(bench, monkeypatch):
    """Import a module of the benchmarks of structures."""
    monkeypatch.syspath_prepend(str(BENCHES / "structures"))
    return bench


@pytest.mark.parametrize("name", ["two", "twenty"])
def test_the_core_follows_the_exact_motions_of_the_structures(structures, name):
    (scene,) = (s for s in structures("structure_scenes").read_scenes() if s.name == name)
    outcome = structures("solvers").core(scene)(scene.periods)
    assert outcome.impacts == scene.impacts > 40
    assert scene.error(outcome.state.tolist()) < 1e-13


def test_peers_follow_a_structure_with_stops(structures):
    scene = structures("structure_scenes").read_scenes()[0]
    for peer in structures("solvers").PEERS:
        if not peer.missing():
            outcome = peer.prepare(scene, peer.TOLERANCES[1])(scene.periods)
            assert (outcome.impacts, outcome.ended) == (scene.impacts, ""), peer.NAME
            assert scene.error(outcome.state.tolist()) < 1e-8, peer.NAME


def test_the_scenes_of_structures_are_those_of_their_script(structures):
    exact = structures("exact_scenes")
    kept = json.loads(exact.SCENES.read_text(encoding="utf-8"))
    for name, scene in (("two", exact.two_stops()), ("twenty", exact.many_stops())):
        assert scene.items() <= kept[name].items()


def test_the_report_of_structures_has_every_run_and_who_is_missing(structures, monkeypatch):
    solvers = structures("solvers")
    for peer in solvers.PEERS[:2]:
        monkeypatch.setattr(peer, "missing", lambda: "not installed")
    monkeypatch.setattr(solvers, "SHORTEST", 1e-9)
    monkeypatch.setattr(solvers, "TIMES_LONGER", 1)
    scene = structures("structure_scenes").read_scenes()[0]
    rows = solvers.measure_scene(scene, 1, longest=0.0)
    assert [row.solver for row in rows] == ["vibroimpact", "SciPy DOP853"]
    swept = [solvers.Swept("System", 1, (200.0,), (300.0,))]
    spec = importlib.util.spec_from_file_location("main", BENCHES / "structures" / "__main__.py")
    main = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(main)
    text = main.report(rows, swept)
    assert text.count("heyoka.py: not installed") == text.count("Numba: not installed") == 1
    assert text.count("41 of 41") == 2
    assert "| System | 1 | 200 | 300 |" in text
