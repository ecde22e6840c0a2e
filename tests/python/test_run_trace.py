"""A run that comes back from a file or a pickle is differentiated along its own events."""

import copy
import json
import pickle
from functools import cache

import numpy as np
import pytest

import sizes
import vibroimpact as vi
from ctrl_c import asks_of
from random_structures import FAMILIES
from small_results import START
from struck import BEAM, MOVING, PRESSED, REST
from systems import PAPER
from two_masses import structure
from vibroimpact import archive

DAMPED = PAPER.replace(pendulum_damping=0.02, friction=0.1)


@cache
def runs() -> dict[str, vi.Run | vi.StructureRun]:
    """Runs that have kept all of their motion."""
    slides = DAMPED.replace(restitution=0.3, drive_frequency=0.6, force_amplitude=0.8)
    repeats = PAPER.replace(damping=(0.2, 0.2), restitution=0.5)
    systems = {
        "flights": (DAMPED, 40),
        "repeats": (repeats, 300),
        "chatter and contact": (slides, 30),
        "wall": (PAPER.replace(mass_ratio=0, contact="direct"), 20),
    }
    structures = {"moving": MOVING, "pressed": PRESSED, "beam": BEAM, "masses": structure()}
    settles = MOVING.replace(damping_ratios=0.2)
    return {
        name: vi.simulate(system, initial=START, periods=periods)
        for name, (system, periods) in systems.items()
    } | {
        name: vi.simulate(of, initial=REST[of.coordinates], periods=periods)
        for name, of, periods in (
            *((name, of, 25) for name, of in structures.items()),
            ("settles", settles, 200),
        )
    }


NAMES = (
    *("flights", "repeats", "chatter and contact", "wall"),
    *("moving", "pressed", "beam", "masses", "settles"),
)


def differentiated(run, *names: str) -> bytes:
    """All derivatives, to the bit."""
    found = run.sensitivity(*names or ("restitution", "drive_frequency", "gap"))
    inside = found.trajectory(np.linspace(run.kept_from, run.final_state.time, 9)[1:-1])
    tables = [*found.impacts, found.stroboscopic, found.final_state, inside]
    return b"".join(table.tobytes() for table in tables)


def saved(run, path):
    run.save(path)
    return vi.load(path)


def altered(run, path, change):
    """Write a file of a run whose content has been changed."""
    run.save(path)
    with np.load(path) as content:
        arrays = {name: content[name].copy() for name in content.files}
    metadata = json.loads(arrays.pop("metadata").item())
    change(metadata, arrays)
    np.savez(path, metadata=json.dumps(metadata), **arrays)
    return path


def without_trace(run, path):
    """The run from a file of the format before, which has no trace."""

    def older(metadata, arrays):
        del arrays["trace"], arrays["residuals"], metadata["checksum"]
        metadata["format_version"] = 3

    return vi.load(altered(run, path, older))


@pytest.mark.parametrize("name", NAMES)
def test_what_comes_back_has_the_same_derivatives_to_the_bit(name, tmp_path):
    run = runs()[name]
    assert set(runs()) == set(NAMES)
    text, _ = run._core.trace()
    assert bool(json.loads(text.tobytes())["copies"]) == (name in ("repeats", "moving", "settles"))
    assert len(run.impacts) > 5
    expected = differentiated(run)
    work = asks_of(lambda: run.sensitivity("gap"))
    file = tmp_path / "run.npz"
    once = saved(run, file)
    for back in (once, saved(once, file), pickle.loads(pickle.dumps(run)), copy.deepcopy(run)):
        assert back == run
        assert differentiated(back) == expected
        # Nothing is simulated: there is as much to ask for as of the run itself.
        assert asks_of(lambda back=back: back.sensitivity("gap")) == work


@pytest.mark.parametrize("family", FAMILIES)
def test_random_structures_come_back_with_their_derivatives(family):
    legs = 0
    for seed in range(sizes.either(25, 400)):
        made, initial = FAMILIES[family](seed)
        run = vi.simulate(made, initial=initial, time=2.4 * made.drive_period, max_events=200)
        back = pickle.loads(pickle.dumps(run))
        text, _ = run._core.trace()
        legs += len(json.loads(text.tobytes())["legs"])
        found = []
        for each in (run, back):
            try:
                found.append(differentiated(each, "gap", "q_0", "mass[0, 0]"))
            except vi.SimulationError as error:
                found.append(str(error))
        assert found[0] == found[1], (family, seed)
    assert legs > (0 if family == "linear" else 100)


@pytest.mark.parametrize("name", ["chatter and contact", "moving", "pressed", "masses"])
def test_a_file_without_a_trace_is_followed_again(name, tmp_path):
    run = runs()[name]
    back = without_trace(run, tmp_path / "old.npz")
    assert back == run
    assert back._core.trace() is None
    mine, its = (of.sensitivity("restitution", "gap") for of in (run, back))
    for one, other in zip(
        (*mine.impacts, mine.stroboscopic, mine.final_state),
        (*its.impacts, its.stroboscopic, its.final_state),
        strict=True,
    ):
        assert one.shape == other.shape
        assert np.abs(one - other).max() < 1e-9 * (1 + np.abs(one).max())
    # It is saved as it came.
    back.save(tmp_path / "again.npz")
    with np.load(tmp_path / "again.npz") as content:
        assert "trace" not in content.files
        assert "checksum" not in json.loads(content["metadata"].item())


def test_a_run_that_has_not_kept_all_has_no_trace(tmp_path):
    whole = runs()["flights"]
    less = vi.simulate(DAMPED, initial=START, periods=40, keep=10)
    for run in (less, whole.resume(periods=3)):
        assert run._core.trace() is None
        back = saved(run, tmp_path / "run.npz")
        assert differentiated(back) == differentiated(run)


def test_a_trace_is_small(tmp_path):
    for name, run in runs().items():
        text, residuals = run._core.trace()
        assert len(residuals) == len(run.events) - 1
        legs = json.loads(text.tobytes())["legs"] or []
        assert len(text) < 100 + 400 * len(legs)
        # Legs are of contact alone.
        assert len(run.contacts) > 0 or not legs, name
        run.save(tmp_path / "run.npz")
        archive.write(tmp_path / "without.npz", run._KIND, *run._tables())
        sizes_of = [(tmp_path / file).stat().st_size for file in ("run.npz", "without.npz")]
        # Beside two names in the archive.
        assert sizes_of[0] - sizes_of[1] < 700 + 9 * len(residuals) + 40 * len(legs), name


def _more(arrays, name, place, column=None, by=1e-3):
    row = arrays[name]
    if column is None:
        row[place] += by
    else:
        row[column][place] += by


CHANGES = {
    "a residual": lambda m, a: _more(a, "residuals", 3, by=1e-20),
    "residuals less one": lambda m, a: a.update(residuals=a["residuals"][:-1]),
    "no residuals": lambda m, a: a.pop("residuals"),
    "no trace": lambda m, a: a.pop("trace"),
    "neither": lambda m, a: [a.pop(name) for name in ("trace", "residuals")],
    "no checksum": lambda m, a: m.pop("checksum"),
    "a letter of the trace": lambda m, a: _more(a, "trace", 5, by=1),
    "a number of an impact": lambda m, a: _more(a, "impacts", 2, "time_in_period"),
    "a section": lambda m, a: _more(a, "stroboscopic", 1),
    "an event": lambda m, a: _more(a, "events", 2, "index", by=1),
    "the machine": lambda m, a: m["system"].update(phase=0.25),
    "how it was made": lambda m, a: m.update(
        core=m["core"].replace('"max_events":10', '"max_events":20')
    ),
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("name", ["chatter and contact", "moving", "beam"])
def test_an_altered_file_is_refused(name, change, tmp_path):
    path = altered(runs()[name], tmp_path / "run.npz", CHANGES[change])
    with pytest.raises(ValueError, match=r"run\.npz: .*(checksum|it has been altered)"):
        vi.load(path)


def test_the_trace_of_another_run_is_refused(tmp_path):
    one, other = (vi.simulate(MOVING, initial=[[0], [v]], periods=9) for v in (0.0, 1e-9))
    assert len(one.events) == len(other.events)
    text, residuals = other._core.trace()
    change = lambda m, a: a.update(trace=text, residuals=residuals)  # noqa: E731
    with pytest.raises(ValueError, match="altered"):
        vi.load(altered(one, tmp_path / "run.npz", change))


def _changed(trace, change):
    text, residuals = trace
    told, residuals = json.loads(text.tobytes()), residuals.copy()
    told, residuals = change(told, residuals) or (told, residuals)
    return np.frombuffer(json.dumps(told).encode(), np.uint8), residuals


def _copies(**one):
    given = {"first": 4, "events": 2, "periods": 1, "times": 3} | one
    return lambda told, residuals: told.update(copies=[given])


# An impact at a stop, and a state, that no structure here has.
_NO_STOP = {
    "WithImpact": dict.fromkeys(
        (
            "approach_velocity",
            "separation_velocity",
            "impulse_normal",
            "impulse_tangential",
            "energy_loss",
            "friction_loss",
        ),
        0.0,
    )
    | {"stop": 99, "regime": "Frictionless"}
}
_NO_COORDINATES = [
    {"period": 3, "time_in_period": 0.1, "residual": 0.0},
    {"q": [], "v": [0.0, 0.0, 0.0, 0.0]},
]

NONSENSE = {
    "residuals = 0 numbers": lambda told, rest: (told, rest[:0]),
    "residuals = ": lambda told, rest: rest.__setitem__(0, np.nan),
    "copies.0. = .*first: 1,": _copies(first=1),
    "copies.0. = .*events: 0,": _copies(events=0),
    "copies.0. = .*periods: 0,": _copies(periods=0),
    "copies.0. = .*times: 9": _copies(times=9_000_000_000_000_000_000),
    "copies.0. = .*times: 1000000": _copies(times=1_000_000),
    "legs.1. = ": lambda told, rest: told["legs"].reverse(),
    "legs.0. = after 123456789": lambda told, rest: told["legs"][0].update(events=123456789),
    "legs.0. = .*run's machine": lambda told, rest: told["legs"][0]["touching"].update(
        at=[[99, "closed"]]
    ),
    "legs.1. = .*run's machine": lambda told, rest: told["legs"][1]["touching"].update(
        were_closed=[99]
    ),
    "legs.2. = .*run's machine": lambda told, rest: told["legs"][2].update(at=_NO_COORDINATES),
    "legs.3. = .*run's machine": lambda told, rest: told["legs"][3].update(begins=_NO_STOP),
    "legs.4. = .*run's machine": lambda told, rest: told["legs"][4]["touching"].update(
        pending=[_NO_STOP["WithImpact"]]
    ),
    "unknown variant": lambda told, rest: told["legs"][0].update(begins="Later"),
}


@pytest.mark.parametrize("error", NONSENSE)
def test_a_trace_that_makes_no_sense_is_named(error):
    run = runs()["moving"]
    core = run._core
    tables = ("impacts", "events", "grazes", "contacts")
    parts = {name: getattr(core, name) for name in tables}
    trace = _changed(core.trace(), NONSENSE[error])
    with pytest.raises(ValueError, match=error):
        type(core).from_parts(
            run.system._compiled,
            core.to_json(),
            stroboscopic=core.stroboscopic,
            trace=trace,
            **parts,
        )


def test_rows_that_are_not_those_of_the_events_are_named():
    core = runs()["chatter and contact"]._core
    tables = ("impacts", "events", "grazes", "contacts", "stroboscopic")
    parts = {name: getattr(core, name) for name in tables}
    events = parts["events"].copy()
    events["index"][3] += 1
    for changed, error in (
        ({"events": events}, r"events\[3\] = "),
        ({"impacts": parts["impacts"][:-1].copy()}, "events = .* an event for each row"),
        ({"events": parts["events"][:-1].copy()}, r"events\[\d+\] = .* the stop as the last one"),
    ):
        with pytest.raises(vi.ParameterError, match=error):
            type(core).from_parts(core.to_json(), trace=core.trace(), **(parts | changed))


@pytest.mark.parametrize("table", ["impacts", "contacts"])
def test_rows_of_stops_that_there_are_not_are_named(table):
    run = runs()["moving"]
    core = run._core
    parts = {name: getattr(core, name) for name in ("impacts", "events", "grazes", "contacts")}
    parts[table] = {**parts[table], "stop": parts[table]["stop"] + 99}
    with pytest.raises(vi.ParameterError, match=r"rows = .* stops"):
        type(core).from_parts(
            run.system._compiled,
            core.to_json(),
            stroboscopic=core.stroboscopic,
            trace=core.trace(),
            **parts,
        )


@pytest.mark.parametrize("name", ["chatter and contact", "moving"])
def test_impacts_of_a_file_without_a_trace_are_compared_with_the_motion(name, tmp_path):
    def older(metadata, arrays):
        del arrays["trace"], arrays["residuals"], metadata["checksum"]
        arrays["impacts"]["time"][4] *= 1 + 1e-9

    back = vi.load(altered(runs()[name], tmp_path / "run.npz", older))
    with pytest.raises(vi.SimulationError, match="not the one of the run"):
        back.sensitivity("gap")
