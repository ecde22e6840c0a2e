"""Every event of structures against data of the reference simulator: structures_reference.json.

Damping that couples modes, closed sets, chatter, moving stops, slip and stick, several stops at one
instant, three laws (tests/reference/structure_cases.py). Tolerances are those of the other data
(tests/data/README.md); the end of a completed chatter has the error that its row states, and what
follows it has that error, grown.
"""

import numpy as np
import pytest

import vibroimpact as vi
from references import case_structure, reference

EPS = float(np.finfo(float).eps)
DATA = reference("structures_reference.json")


def story(run: vi.StructureRun) -> list[dict]:
    """The events of a run in order, with the fields of the data."""
    entries = []
    for event in run.events:
        kind, row = vi.EventKind(event["kind"]), event["index"]
        if kind == vi.EventKind.IMPACT:
            impact = run.impacts[row]
            names = ("q", "v_pre", "v_post", "impulse_normal", "impulse_tangential", "energy_loss")
            entry = {name: impact[name] for name in names}
            entry |= {
                "approach_velocity": impact["approach_velocity"],
                "regime": vi.Regime(impact["regime"]).name.lower(),
                "allowed": 0.0,
            }
        elif kind == vi.EventKind.STOP:
            continue
        else:
            change = run.contacts[row]
            entry = {"q": change["q"], "v": change["v"], "allowed": change["error"]}
        entries.append(
            entry | {"kind": kind.name.lower(), "time": event["time"], "stop": int(event["stop"])}
        )
    return entries


def listed_alike(entries: list[dict], rule: str) -> list[dict]:
    """The entries, where both sides tell the same in other rows.

    Stops that close at one instant are one row of a run, whose column tells all of them. Of impacts
    that happen together a run tells velocities between them, one impulse after another. A closed
    stop that an impact on itself opens has that impact's row, and no release.
    """
    kept: list[dict] = []
    struck: set[tuple[float, int]] = set()
    for entry in entries:
        place = (float(entry["time"]), entry["stop"])
        if entry["kind"] == "impact":
            struck.add(place)
        if entry["kind"] == "release" and place in struck:
            continue
        before = kept[-1] if kept else {"kind": "nothing", "time": -1.0}
        at_once = float(entry["time"]) == float(before["time"]) and entry["kind"] == before["kind"]
        if at_once and entry["kind"] == "closed":
            continue
        if entry["kind"] == "impact" and rule == "together":
            together = at_once and before["kind"] == "impact"
            before.pop("v_post", None) if together else None
            absent = {"approach_velocity", "energy_loss", *(("v_pre",) if together else ())}
            entry = {name: value for name, value in entry.items() if name not in absent}
        kept.append(entry)
    return kept


def without_skipped(wanted: list[dict], found: list[dict]) -> list[dict]:
    """The entries of the data without the impacts that a completed chatter leaves out."""
    kept, place = [], 0
    for entry in wanted:
        here = found[place] if place < len(found) else {"kind": "nothing"}
        if here["kind"] == "chatter" and entry["kind"] == "impact":
            assert entry["stop"] == here["stop"]
            continue
        kept.append(entry)
        place += 1
    return kept


@pytest.mark.parametrize("name", DATA)
def test_all_events_and_states_are_those_of_the_reference(name):
    case = DATA[name]
    structure = case_structure(case)
    length = {"periods": case["periods"]} if case["periods"] else {"time": case["times"][-1]}
    run = vi.simulate(structure, initial=case["initial"], **length)
    found = listed_alike(story(run), structure.simultaneous)
    wanted = without_skipped(listed_alike(case["story"], structure.simultaneous), found)
    assert [(e["kind"], e["stop"]) for e in found] == [(e["kind"], e["stop"]) for e in wanted]
    ending = "completed" if run.stop_reason == "rest" else run.stop_reason
    assert ending == case["ending"]
    allowed, grown, size = 0.0, 1.0, 1.0

    def near(got, exact, slow=1.0) -> None:
        nonlocal size
        got, exact = np.asarray(got, float), np.asarray(exact, float)
        size = max(size, np.abs(exact).max(initial=0.0))
        tolerance = 100 * EPS * grown * size / slow + 10 * allowed
        np.testing.assert_allclose(got, exact, rtol=0.0, atol=tolerance)

    for got, exact in zip(found, wanted, strict=True):
        grown = max(grown, exact["amplification"])
        allowed = max(allowed, got["allowed"])
        slow = min(got.get("approach_velocity", 1.0), 1.0) or 1.0
        assert got.get("regime") == exact.get("regime")
        for field in exact.keys() - {"kind", "stop", "regime", "amplification"}:
            near(got[field], exact[field], slow)
    grown = max([grown, *case["amplification"]])
    if case["periods"]:
        states = run.stroboscopic
    else:
        states = run.trajectory([time for time in case["times"] if time <= run.final_state.time])
    assert len(states) == len(case["states"])
    near(states, case["states"])


def test_the_data_have_every_kind_of_event_regime_and_end():
    entries = [entry for case in DATA.values() for entry in case["story"]]
    kinds = {entry["kind"] for entry in entries}
    assert kinds == {
        "impact",
        "chatter",
        "closed",
        "slide_positive",
        "slide_negative",
        "stick",
        "release",
    }
    assert {case["ending"] for case in DATA.values()} == {"completed", "simultaneous"}
    assert len({entry["regime"] for entry in entries if entry["kind"] == "impact"}) >= 3
