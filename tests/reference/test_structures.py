"""The reference for structures: the supplied data, the pendulum's reference, and known cases.

Needs python-flint. tests/data/README.md says how the data were made.
"""

from __future__ import annotations

import doctest
import random
from fractions import Fraction
from typing import Any

import pytest

import sizes

pytest.importorskip("flint", reason="the high-precision reference needs python-flint")

from flint import arb, ctx, fmpq

from vibroimpact.reference.contact import Undecided
from vibroimpact.reference.flight import Number, System, exact
from vibroimpact.reference.hybrid import follow, sections
from vibroimpact.reference.simulate import simulate
from vibroimpact.reference.structure import (
    Change,
    Impact,
    Structure,
    StructureRun,
    simulate_structure,
)
from vibroimpact.reference.structure import simulate as simulate_module
from vibroimpact.reference.structure.flow import Flow, Generator, column

from .structure_scenes import head_on, scenes, structure

#: The supplied flights have 25 digits.
CLOSE = 1e-20
#: The supplied data of sustained contact are good to some 4e-11.
ROUGH = 1e-9


def near(found: arb, wanted: Any, tolerance: float) -> bool:
    """Whether a ball, and all of it, is within a tolerance of a number, relative to max(1, it)."""
    value = arb(wanted) if isinstance(wanted, str) else arb(exact(wanted))
    return bool(abs(found - value) < tolerance * max(1.0, abs(float(wanted))))


def all_near(found: Any, wanted: Any, tolerance: float) -> bool:
    """The same for sequences."""
    return all(near(p, q, tolerance) for p, q in zip(found, wanted, strict=True))


def sections_agree(run: StructureRun, wanted: list[Any], tolerance: float) -> None:
    """The states after each period are those of the data."""
    assert run.ending == "completed"
    for state, rows in zip(run.states, wanted, strict=True):
        for part, row in zip(state, rows, strict=True):
            assert all_near(part, row, tolerance)


@pytest.mark.parametrize(
    ("name", "number"),
    [("structures.json", k) for k in sizes.either([0, 4, 7, 15, 24, 32], list(range(40)))]
    + [("structures_friction.json", k) for k in sizes.either([0, 8, 11, 17], list(range(20)))],
)
def test_supplied_structures_to_twenty_digits(name: str, number: int) -> None:
    scene = scenes(name)[number]
    run = simulate_structure(structure(scene), scene["initial"], periods=scene["periods"])
    assert run.proved == len(run.story) == len(scene["impacts"])
    assert run.proved_states == scene["periods"]
    with ctx.workprec(run.precision):
        for impact, wanted in zip(run.impacts, scene["impacts"], strict=True):
            assert (impact.stop, impact.regime) == (wanted["stop"], wanted["regime"])
            assert near(impact.time, wanted["time"], CLOSE)
            assert all_near(impact.q, wanted["q"], CLOSE)
            assert all_near(impact.v_pre, wanted["v_pre"], CLOSE)
            assert all_near(impact.v_post, wanted["v_post"], CLOSE)
            assert near(impact.impulse_normal, wanted["impulse_normal"], CLOSE)
            assert near(impact.impulse_tangential, wanted["impulse_tangential"], CLOSE)
            assert impact.energy_loss > 0
        sections_agree(run, scene["stroboscopic"], CLOSE)


@pytest.mark.parametrize("number", sizes.either([0, 6, 7, 10], list(range(12))))
def test_supplied_structures_with_sustained_contact(number: int) -> None:
    scene = scenes("structures_contact.json")[number]
    run = simulate_structure(structure(scene), scene["initial"], periods=scene["periods"])
    # the data leave out impacts with u < 1e-6, and name a stop by its coordinate
    coordinates = [stop["coordinate"] for stop in scene["stops"]]
    found: list[Impact | Change] = []
    chatters = 0
    with ctx.workprec(run.precision):
        for entry in run.story:
            if not (isinstance(entry, Impact) and entry.approach_velocity < 1e-6):
                found.append(entry)
        listed = [e for e in found if not (isinstance(e, Change) and e.kind == "chatter")]
        for k, (one, wanted) in enumerate(zip(listed, scene["events"], strict=True)):
            if isinstance(one, Impact):
                assert wanted["kind"] == "impact"
                assert coordinates[one.stop] == wanted["stop"]
                assert near(one.approach_velocity, wanted["u"], ROUGH)
                assert near(one.time, wanted["time"], ROUGH)
                continue
            assert (one.kind, coordinates[one.stop]) == (wanted["kind"], wanted["stop"])
            if isinstance(found[found.index(one) - 1], Change) and one.kind == "closed":
                # The data close a stop where u has fallen to some 4e-8, not at the limit: up to a
                # fiftieth of the time that is left after the last listed impact, u > 1e-6.
                since = one.time - listed[k - 1].time
                assert abs(one.time - arb(exact(wanted["time"]))) < since / 50
                chatters += 1
            else:
                assert near(one.time, wanted["time"], ROUGH)
        sections_agree(run, scene["stroboscopic"], ROUGH)
        limits = [e for e in run.story if isinstance(e, Change) and e.kind == "chatter"]
        assert chatters == len(limits)
        # the stated error of a run through chatter
        for state in run.states:
            assert all(value.rad() < 1e-40 for part in state for value in part)


def test_the_stated_error_of_a_chatter_is_no_lie() -> None:
    scene = scenes("structures_contact.json")[7]
    made = structure(scene)
    run, finer = (
        simulate_structure(made, scene["initial"], periods=3, precision=bits) for bits in (300, 600)
    )
    assert run.proved < len(run.story)
    limits = [[entry for entry in each.story if isinstance(entry, Change)] for each in (run, finer)]
    with ctx.workprec(600):
        for one, two in zip(*limits, strict=True):
            assert one.kind == two.kind
            assert one.time.contains(two.time.mid())
            assert one.time.rad() < 1e-25
            for part, other in zip(one.state, two.state, strict=True):
                assert all(p.contains(q.mid()) for p, q in zip(part, other, strict=True))


# --- two bodies head on: the pendulum's reference ------------------------------------------------


PAIR: dict[str, Number] = {
    "mbar": "0.6", "omega0": 2, "r": "0.8", "delta": "0.3", "zeta1": "0.02", "zeta2": "0.05",
    "f1": 1, "f2": "0.4", "omega": "1.25", "mu": 0, "c1": "-0.3", "c2": "-0.2",
}  # fmt: skip


@pytest.mark.parametrize("number", range(sizes.either(3, 12)))
def test_two_bodies_head_on_are_those_of_the_other_reference(number: int) -> None:
    rng = random.Random(number)
    changes: dict[str, Number] = {
        "mbar": Fraction(rng.randint(2, 20), 10),
        "omega0": Fraction(rng.randint(5, 30), 10),
        "r": Fraction(rng.randint(6, 10), 10),
        "omega": Fraction(rng.randint(5, 25), 10),
    }
    values = PAIR | changes
    start: list[Number] = ["0", Fraction(rng.randint(-9, 9), 10), "0.1", "0.2"]
    wanted = simulate(System.parse(values, "direct"), start, periods=5)
    run = simulate_structure(head_on(values), [start[::2], start[1::2]], periods=5)
    assert len(run.impacts) == len(wanted.impacts) > 0
    with ctx.workprec(run.precision):
        for one, two in zip(run.impacts, wanted.impacts, strict=True):
            assert two.impulse is not None
            assert (one.period, one.regime) == (two.period, two.regime)
            pairs = [
                (one.time, two.time),
                (one.q[0], two.x1),
                (one.q[1], two.x2),
                (one.v_pre[0], two.v1_pre),
                (one.v_post[1], two.v2_post),
                (one.impulse_normal, two.impulse),
            ]
            assert all(p.overlaps(q) and p.rad() + q.rad() < 1e-60 for p, q in pairs)
        for (q, v), (x1, v1, x2, v2) in zip(run.states, wanted.stroboscopic, strict=True):
            for p, other in zip((*q, *v), (x1, x2, v1, v2), strict=True):
                assert p.overlaps(other)
                assert p.rad() + other.rad() < 1e-60


def test_chatter_and_contact_head_on_are_those_of_the_other_reference() -> None:
    values = PAIR | {"r": "0.3", "f1": 0, "c1": "2.5", "f2": "2.5", "omega": "0.5", "delta": "0.1"}
    system = System.parse(values, "direct")
    start: list[Number] = ["0", "0.4", "0.1", "0"]
    wanted = follow(system, start, sections(system, 3))
    run = simulate_structure(head_on(values), [start[::2], start[1::2]], periods=3)
    changes = [entry for entry in run.story if isinstance(entry, Change)]
    # without friction the other reference calls a closed stop a slide in the direction of v1
    names = {"slide_positive": "closed", "slide_negative": "closed"}
    kinds = [names.get(phase.event, phase.event) for phase in wanted.phases]
    assert [entry.kind for entry in changes] == kinds
    assert {"chatter", "closed", "release"} <= set(kinds)
    with ctx.workprec(run.precision):
        for one, two in zip(changes, wanted.phases, strict=True):
            assert abs(one.time - two.time) < 1e-38
            for p, other in zip((*one.state[0], *one.state[1]), _ordered(two.state), strict=True):
                assert abs(p - other) < 1e-38
        for state, other_state in zip(run.states, wanted.samples, strict=True):
            for p, other in zip((*state[0], *state[1]), _ordered(other_state), strict=True):
                assert abs(p - other) < 1e-38


def _ordered(state: Any) -> tuple[arb, ...]:
    x1, v1, x2, v2 = state
    return x1, x2, v1, v2


# --- flights -------------------------------------------------------------------------------------


def test_modal_damping_is_that_of_a_matrix_of_the_modes() -> None:
    # C = alpha M + beta K has the ratios (alpha/w + beta w)/2
    mass = [["1.3", "0.2", 0], ["0.2", "0.9", "-0.1"], [0, "-0.1", "2"]]
    stiffness = [[3, -1, 0], [-1, 2, -1], [0, -1, 4]]
    plain = {"mass": mass, "stiffness": stiffness, "stops": []}
    with ctx.workprec(300):
        bare = Structure.parse(plain)
        inner = bare.compliance() * bare.stiffness
        squares = sorted(float(root.real) for root, _ in inner.charpoly().complex_roots())
        ratios = [(0.25 / w + 0.125 * w) / 2 for w in (square**0.5 for square in squares)]
        found = Structure.parse(plain | {"damping_ratios": ratios}).damping_balls()
        for i in range(3):
            for j in range(3):
                wanted = bare.mass[i, j] / 4 + bare.stiffness[i, j] / 8
                assert abs(found[i, j] - arb(wanted)) < 1e-14  # the ratios are floats
                assert found[i, j].rad() < 1e-80


def test_repeated_frequencies_share_a_ratio() -> None:
    same = {"mass": [[1, 0], [0, 1]], "stiffness": [[4, 0], [0, 4]], "stops": []}
    with ctx.workprec(200):
        found = Structure.parse(same | {"damping_ratios": ["0.1", "0.1"]}).damping_balls()
        assert abs(found[0, 0] - arb("0.4")) < 1e-50
        assert abs(found[0, 1]) < 1e-50
        with pytest.raises(ValueError, match="repeated frequencies"):
            Structure.parse(same | {"damping_ratios": ["0.1", "0.2"]}).damping_balls()


def test_flows_are_matrix_exponentials() -> None:
    # resonance, a rigid body and critical damping: times short and long, points and balls
    values = {
        "mass": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "stiffness": [[1, 0, 0], [0, 0, 0], [0, 0, 4]],
        "damping": [[0, 0, 0], [0, "0.3", 0], [0, 0, 4]],
        "static_load": [0, "0.7", 1],
        "drive_amplitude": [1, 0.5 + 0.25j, 0],
        "drive_frequency": 1,
        "stops": [],
    }
    with ctx.workprec(300):
        generator = Generator(Structure.parse(values).free(), 3)
        start = column([arb(k) for k in (1, 2, 3, -1, 0, 1, 1, 1, 0)])
        flow = Flow(generator, start)
        for time in (fmpq(1, 1000), fmpq(3, 7), fmpq(50, 3)):
            wanted = (generator.matrix * arb(time)).exp() * start
            blurred = flow.state(arb(time) + arb(0, 1e-70))
            for i in range(9):
                found = flow.state(time)[i, 0]
                assert found.overlaps(wanted[i, 0])
                assert found.rad() < 1e-75
                assert blurred[i, 0].contains(found.mid())
                assert blurred[i, 0].rad() < 1e-65
        # q1'' + q1 = cos t from (1, -1)
        t = arb(fmpq(50, 3))
        first = t.cos() - t.sin() + t * t.sin() / 2
        assert abs(flow.state(fmpq(50, 3))[0, 0] - first) < 1e-70
        # the bound of an interval holds at its ends
        wide = flow.wide(fmpq(2), fmpq(1, 16))
        for place in (fmpq(31, 16), fmpq(33, 16)):
            assert all(wide[i, 0].contains(flow.state(place)[i, 0]) for i in range(9))


# --- what is not decided, and bad input ----------------------------------------------------------


def test_an_exact_graze_is_undecided() -> None:
    # q = -cos t touches 1 at t = pi, with q' = 0
    values = {"mass": [[1]], "stiffness": [[1]]}
    stop = {"normal": [1], "gap": 1, "restitution": "0.5"}
    with pytest.raises(Undecided):
        simulate_structure(
            Structure.parse(values | {"stops": [stop]}), [[-1], [0]], times=[4], cap=800
        )
    for gap, count in (("0.99999999999999999999", 1), ("1.00000000000000000001", 0)):
        made = Structure.parse(values | {"stops": [stop | {"gap": gap}]})
        assert len(simulate_structure(made, [[-1], [0]], times=[4]).impacts) == count


def test_a_graze_after_the_first_contact_does_not_matter() -> None:
    # q1 - q2 from rest at 0 would touch 0 again at 2 pi/sqrt(3), exactly; q2 meets its stop before
    values: dict[str, Any] = {
        "mass": [[1, 0], [0, 1]],
        "stiffness": [[2, -1], [-1, 2]],
        "static_load": [0, 1],
        "drive_amplitude": [1, 1],
        "drive_frequency": "0.5",
        "stops": [
            {"normal": [1, -1], "gap": 0, "restitution": 0},
            {"normal": [0, 1], "gap": "0.3", "restitution": 0},
        ],
    }
    run = simulate_structure(Structure.parse(values), [[0, 0], [0, 0]], times=[4])
    assert run.impacts[0].stop == 1
    assert run.impacts[0].time < 0.6
    without = Structure.parse(values | {"stops": values["stops"][:1]})
    with pytest.raises(Undecided):
        simulate_structure(without, [[0, 0], [0, 0]], times=[4], cap=400)


def test_a_contact_that_ends_in_the_fourth_derivative() -> None:
    # q1 = t^2/2 and q2'' = 1 - q2 from rest, side by side: g = q2 - q1 = -t^4/24 + ...
    values = {
        "mass": [[1, 0], [0, 1]],
        "stiffness": [[0, 0], [0, 1]],
        "static_load": [1, 1],
        "stops": [{"normal": [-1, 1], "gap": 0, "restitution": 0}],
    }
    run = simulate_structure(Structure.parse(values), [[0, 0], [0, 0]], times=[1])
    assert (run.ending, run.story) == ("completed", [])
    with ctx.workprec(run.precision):
        assert abs(run.states[0][0][1] - (1 - arb(1).cos())) < 1e-100


def test_the_precision_doubles_until_all_is_decided() -> None:
    scene = scenes("structures.json")[7]
    made = structure(scene)
    with pytest.raises(Undecided):
        simulate_structure(made, scene["initial"], periods=scene["periods"], precision=64, cap=64)
    run = simulate_structure(made, scene["initial"], periods=scene["periods"], precision=64)
    assert run.precision > 64
    assert len(run.impacts) == len(scene["impacts"])


def test_a_run_ends_at_its_cap_of_events() -> None:
    scene = scenes("structures.json")[0]
    run = simulate_structure(structure(scene), scene["initial"], periods=11, max_events=4)
    assert (run.ending, len(run.impacts)) == ("event_cap", 4)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass": [[0]]}, "singular"),
        ({"mass": [[1, 0]]}, "not square"),
        ({"damping": [[0]], "damping_ratios": [0]}, "exclude"),
        ({"damping_ratios": [0, 0]}, "coordinates"),
        ({"simultaneous": "both"}, "simultaneous is 'both'"),
        ({"law": "paper"}, "law is 'paper'"),
        ({"stops": [{"normal": [1, 0], "gap": 0, "restitution": 0}]}, "a row of 2"),
        ({"stops": [{"normal": [1], "gap": 0, "restitution": 0, "friction": 1}]}, "a tangent"),
    ],
)
def test_bad_structures_are_named(changes: dict[str, Any], message: str) -> None:
    good: dict[str, Any] = {"mass": [[1]], "stiffness": [[1]], "stops": []}
    with pytest.raises(ValueError, match=message):
        Structure.parse(good | changes)


def test_bad_starts_are_named() -> None:
    stop = {"normal": [1], "gap": 0, "restitution": 0}
    made = Structure.parse({"mass": [[1]], "stiffness": [[1]], "stops": [stop]})
    with pytest.raises(ValueError, match="g > 0 at stop 0"):
        simulate_structure(made, [[1], [0]], times=[1])
    with pytest.raises(ValueError, match="no period"):
        simulate_structure(made, [[-1], [0]], periods=1)
    with pytest.raises(ValueError, match="not both"):
        simulate_structure(made, [[-1], [0]])
    with pytest.raises(ValueError, match="1 coordinates"):
        simulate_structure(made, [[-1, 0], [0]], times=[1])


def test_the_example_runs() -> None:
    outcome = doctest.testmod(simulate_module)
    assert (outcome.attempted > 0, outcome.failed) == (True, 0)
