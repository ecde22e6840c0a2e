"""The benchmarks: the yardstick runs, the peers' law is the core's, scripts run with peers missing.

Nothing here asserts a time.
"""

import ctypes
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import vibroimpact as vi
from references import SYMBOLS, reference

BENCHES = Path(__file__).parents[2] / "benches"
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
        pytest.skip(why)
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


def test_bars_names_a_case_that_does_not_exist(bench, capsys):
    with pytest.raises(SystemExit):
        bench("bars").main(["--cases", "Fig. 11"])
    assert "no case of that name" in capsys.readouterr().err


def test_work_precision_writes_what_it_measures(tmp_path):
    command = [sys.executable, BENCHES / "work_precision", "--quick"]
    subprocess.run(
        [*command, "--scenes", "graze_1e-4", "--out", tmp_path], check=True, capture_output=True
    )
    text = (tmp_path / "work_precision.md").read_text(encoding="utf-8")
    assert "| graze_1e-4 | grazing |" in text
    # The pair of crossings lies within one step of SciPy's.
    assert "10 impacts of 11" in text
    assert (tmp_path / "work_precision.png").stat().st_size > 0
    assert (tmp_path / "work_precision.csv").read_text(encoding="utf-8").count("vibroimpact") == 1


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


def test_what_is_switched_off_leaves_the_base_scene_its_impacts(bench):
    cases = {saving.name: saving for saving in bench("savings").savings(60, 2)}
    for name in ("friction", "damping", "force on the second body", "label"):
        saving = cases[name]
        assert saving.on.impacts == pytest.approx(saving.off.impacts, abs=2)
        assert saving.on.impacts == pytest.approx(60, abs=3)
        assert saving.on.setup["periods"] == saving.off.setup["periods"]
        assert saving.on.setup != saving.off.setup
    assert cases["contact within reach"].off.impacts == 0
