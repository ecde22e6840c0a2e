"""Tests of the reference itself: against the supplied data, against a second formula, and by proof.

Needs python-flint. The reference data in tests/data are made by generate.py or supplied with the
project's theory; see tests/data/README.md.
"""

from __future__ import annotations

import json
import math
import random
from typing import Any

import pytest

import sizes

pytest.importorskip("flint", reason="the high-precision reference needs python-flint")

from flint import arb, arb_poly, ctx, fmpq

from vibroimpact.reference.contact import first_contact
from vibroimpact.reference.flight import Flight, Number, System, exact
from vibroimpact.reference.impact import LAWS, Impact, Jammed, paper, poisson

from .certify import COLUMNS, certify
from .generate import DATA, flight_cases, flight_record
from .ladder import digits
from .supplied import LARGEST_UNITS, compare, units

Row = dict[str, Any]


def load(name: str) -> Any:
    """One of the data files."""
    return json.loads((DATA / name).read_text())


def system(contact: str = "oblique", **changes: Number) -> System:
    """The paper's usual parameters with changes."""
    plain: dict[str, Number] = {
        "mbar": "0.6", "omega0": 2, "r": "0.8", "delta": "0.5", "zeta1": 0, "zeta2": 0,
        "f1": 1, "f2": 0, "omega": "1.25", "mu": 0,
    }  # fmt: skip
    return System.parse(plain | changes, contact)


def graze_flight(row: Row) -> Flight:
    """The flight of a row of near_grazes.json."""
    x1, v1, x2, v2, phase = (exact(float(row[key])) for key in ("x1", "v1", "x2", "v2", "phase"))
    start = (x1, v1, None if row["touching"] else x2, v2)
    parameters = {key: float(text) for key, text in row["parameters"].items()}
    return Flight(System.parse(parameters, row["contact"]), start, phase)


def somewhere(rng: random.Random, size: float) -> tuple[fmpq, fmpq, fmpq, fmpq]:
    """A random state (x1, v1, x2, v2) within +-size."""
    x1, v1, x2, v2 = (exact(rng.uniform(-size, size)) for _ in range(4))
    return x1, v1, x2, v2


# --- flights ---------------------------------------------------------------------------------


def test_closed_form_and_matrix_exponential_agree_on_the_whole_sweep() -> None:
    with ctx.workprec(512):
        for case in flight_cases():
            one = case.body().state(case.elapsed(), *case.start())
            two = case.body().state_closed(case.elapsed(), *case.start())
            size = (abs(one[0]) + abs(one[1])).lower()
            for p, q in zip(one, two, strict=True):
                assert p.overlaps(q), case
                assert (p - q).abs_upper() < size * arb(2) ** -100, case


def test_the_quick_form_is_the_matrix_exponential_and_as_tight() -> None:
    quick = 0
    with ctx.workprec(256):
        for case in flight_cases():
            body = case.body()
            one = body.state(case.elapsed(), *case.start())
            two = body.state_quick(case.elapsed(), *case.start())
            quick += any(p.mid() != q.mid() for p, q in zip(one, two, strict=True))
            size = abs(one[0]) + abs(one[1]) + 1
            for p, q in zip(one, two, strict=True):
                assert p.overlaps(q), case
                assert q.rad() < p.rad() * 2**10 + size * arb(2) ** -236, case
    assert quick > 150


def test_flight_file_is_what_the_generator_writes() -> None:
    rows = load("flights.json")
    cases = list(flight_cases())
    assert len(rows) == len(cases) > 600
    for index in range(0, len(cases), 25):
        assert flight_record(cases[index]) == rows[index]


def test_gap_series_encloses_the_gap_and_its_derivative() -> None:
    rng = random.Random(3)
    with ctx.workprec(128):
        for contact in ("oblique", "direct"):
            for _ in range(40):
                flight = Flight(
                    system(contact, omega0=rng.uniform(0, 3), zeta1=rng.uniform(0, 3), f2=1),
                    somewhere(rng, 1),
                    fmpq(1),
                )
                centre, h = exact(rng.uniform(1, 9)), exact(rng.uniform(0.01, 0.3) / flight.rate)
                poly = arb_poly(flight.gap_series(centre, h, 12))
                assert poly(arb(h)).rad() < 1e-5
                for share in (-1.0, -0.7, 0.1, 0.9, 1.0):
                    s = h * exact(share)
                    assert poly(arb(s)).overlaps(flight.gap(centre + s))
                    x1, v1, _, v2 = flight.state(centre + s)
                    slope = v1 * (x1.cos() if contact == "oblique" else 1) - v2
                    assert poly.derivative()(arb(s)).overlaps(slope)


# --- contacts --------------------------------------------------------------------------------


def test_ladder_of_near_grazes_is_certified() -> None:
    rows = load("near_grazes.json")
    assert len(rows) == 260
    for row in rows:
        flight, end = graze_flight(row), exact(float(row["t_end"]))
        found = first_contact(flight, end, touching=int(row["touching"]), precision=64)
        with ctx.workprec(256):
            height = flight.gap(exact(row["hump_time"]))
            assert units(height, row["hump_height"]) < 0.6
            assert abs(float(row["hump_height"]) / float(row["rung"]) - 1) < 0.02
            if row["contact_time"] is None:
                assert found.kind == "none"
                continue
            assert found.kind == "contact"
            assert found.time is not None
            assert (found.time - arb(exact(row["contact_time"]))).abs_upper() < 1e-9
            step = fmpq(1, 10**20)
            for root, sign in zip(row["roots"], (1, -1), strict=False):
                assert (
                    sign * flight.gap(exact(root) - step)
                    < 0
                    < sign * flight.gap(exact(root) + step)
                )


def test_contact_time_to_25_digits_from_any_starting_precision() -> None:
    for row in load("near_grazes.json")[::13]:
        flight, end = graze_flight(row), exact(float(row["t_end"]))
        if row["contact_time"] is None:
            continue
        for precision in (160, 333):
            found = first_contact(
                flight, end, touching=int(row["touching"]), precision=precision, cap=precision
            )
            assert found.time is not None
            assert digits(found.time) == row["contact_time"]


def test_first_contact_agrees_with_a_dense_search() -> None:
    rng = random.Random(11)
    for _ in range(sizes.either(25, 60)):
        contact = rng.choice(("oblique", "direct"))
        parameters = system(
            contact, omega0=rng.uniform(0, 4), zeta1=rng.choice((0, rng.uniform(0, 2))),
            f2=rng.uniform(-2, 2), omega=rng.uniform(0, 3), delta=1,
        )  # fmt: skip
        flight = Flight(parameters, somewhere(rng, 0.4), exact(rng.uniform(0, 6)))
        found = first_contact(flight, fmpq(20))
        grid = [fmpq(j, 50) for j in range(1, 1001)]
        with ctx.workprec(80):
            above = [t for t in grid if flight.gap(t) > 0]
        if found.time is None:
            assert not above
        else:
            # sampling may overlook a contact that the proof finds, never the reverse
            assert not above or found.time < arb(above[0])
            assert found.u is not None
            assert found.u > 0
            assert flight.gap(found.time).contains(0)


def test_bouncing_ball_reaches_the_wall_at_the_published_time() -> None:
    ball = system("direct", mbar=0, omega0=0, omega=0, f1="9.8", delta=1, r="0.5")
    found = first_contact(Flight(ball, (fmpq(0), fmpq(0), fmpq(0), fmpq(0)), fmpq(0)), fmpq(2))
    assert found.time is not None
    assert abs(float(found.time) - 0.4517539514526256) < 1e-15


def test_starts_in_contact() -> None:
    wall = system("direct", mbar=0, omega0=0, omega=0, delta=0)
    zero = fmpq(0)

    def after(v1: fmpq, touching: int, parameters: System = wall) -> Any:
        flight = Flight(parameters, (zero, v1, None, zero), zero)
        return first_contact(flight, fmpq(10), touching=touching)

    # g = -t + t^2/2: the root at 0 is not a contact, the next is at 2
    found = after(fmpq(-1), 1)
    assert found.kind == "contact"
    assert abs(float(found.time) - 2) < 1e-15
    # the same with a flight as short as 2e-12
    found = after(fmpq(-1, 10**12), 1)
    assert found.kind == "contact"
    assert abs(float(found.time) - 2e-12) < 1e-27
    # g = g' = 0: separation if g'' < 0, contact if g'' > 0
    assert after(zero, 2, system("direct", mbar=0, omega0=0, omega=0, f1=-1)).kind == "none"
    assert after(zero, 2).kind == "immediate"
    with pytest.raises(ValueError, match="at the start"):
        after(fmpq(1), 1)
    # g = g' = g'' = 0, g''' = -f1 omega sin(phase) < 0 or > 0: x1 = f1 (t - sin t) -/+
    for f1, kind in ((-1, "none"), (1, "immediate")):
        released = system("direct", mbar=0, omega0=0, omega=1, f1=f1, delta=0)
        with ctx.workprec(128):
            flight = Flight(released, (zero, zero, None, zero), -arb.pi() / 2)
        assert first_contact(flight, fmpq(10), touching=3, cap=128).kind == kind


def test_penetrating_start_is_an_error() -> None:
    flight = Flight(system(), (fmpq(1), fmpq(0), fmpq(0), fmpq(0)), fmpq(0))
    with pytest.raises(ValueError, match="g > 0"):
        first_contact(flight, fmpq(1))


def test_exact_graze_is_reported_as_undecided() -> None:
    # g = -1 + t - t^2/4 touches 0 at t = 2
    parameters = system("direct", mbar=0, omega0=0, omega=0, f1="-0.5", delta=1)
    flight = Flight(parameters, (fmpq(0), fmpq(1), fmpq(0), fmpq(0)), fmpq(0))
    found = first_contact(flight, fmpq(3), cap=512)
    assert found.kind == "undecided"
    assert found.precision == 512
    assert found.time is not None
    assert abs(float(found.time) - 2) < 1e-12


# --- impacts ---------------------------------------------------------------------------------


def impact_input(row: Row) -> tuple[System, arb, arb, arb]:
    """System and pre-impact state of a row of impacts.json, its decimals taken exactly."""
    parameters = system(**{key: str(row[key]) for key in ("mbar", "r", "mu")})
    x1, v1, v2 = (arb(exact(str(row[key]))) for key in ("x1", "v1_pre", "v2_pre"))
    return parameters, x1, v1, v2


def test_poisson_reproduces_the_supplied_impacts() -> None:
    rows = load("impacts.json")
    with ctx.workprec(300):
        for row in rows:
            outcome = poisson(*impact_input(row))
            assert outcome.regime == row["regime"]
            assert units(outcome.v1, row["v1_post"]) < 0.6
            assert units(outcome.v2, row["v2_post"]) < 0.6


def test_paper_formulas_equal_the_walk_where_they_should_and_not_elsewhere() -> None:
    same = different = 0
    with ctx.workprec(300):
        for row in load("impacts.json"):
            given = impact_input(row)
            x1, v1 = row["x1"], row["v1_pre"]
            if row["mu"] == 0 or v1 == 0 or row["regime"].startswith("stick"):
                continue
            ours, printed = poisson(*given), paper(*given)
            equal = abs(ours.v1 - printed.v1) < 1e-60 and abs(ours.v2 - printed.v2) < 1e-60
            if 0 < x1 < math.pi and v1 * math.cos(x1) > 0:
                assert equal
                assert ours.regime == printed.regime
                same += 1
            elif x1 < 0:
                different += not equal
    assert same > 50
    assert different > 50


def test_printed_impulses_balance_the_momentum_of_body_2() -> None:
    met: set[str] = set()
    with ctx.workprec(300):
        for row in load("impacts.json"):
            exact_system, x1, v1, v2 = impact_input(row)
            if row["v1_pre"] == 0:
                continue  # (10) has no sign there, which (14) takes as squared
            printed = paper(exact_system, x1, v1, v2)
            assert printed.impulse is not None
            assert abs(v2 + arb(exact_system.mbar) * printed.impulse - printed.v2) < 1e-60
            met.add(printed.regime)
    assert met >= {"reversal_approach", "reversal_restitution", "slip"}


def test_printed_law_is_the_common_one_head_on() -> None:
    with ctx.workprec(300):
        given = (system("direct"), arb("0.3"), arb("0.7"), arb("-0.2"))
        ours, printed = poisson(*given), paper(*given)
        assert printed.regime == ours.regime == "frictionless"
        for name in ("v1", "v2", "impulse", "approach"):
            assert abs(getattr(ours, name) - getattr(printed, name)) < 1e-80, name


def test_a_tip_that_sticks_on_a_wall_ends_the_walk() -> None:
    # slip ends in restitution, and no further impulse changes u: docs/theory.md, section 4
    moving = system(mbar=0, mu=2, r="0.9")
    with ctx.workprec(300):
        for wall, returns in ((arb("0.05"), True), (arb(0), False)):
            given = (moving, arb("0.8"), arb("1.9"), wall)
            for law in ("newton", "energetic"):
                outcome = LAWS[law](*given)
                assert outcome.regime == "stick_restitution"
                assert outcome.v1 == 0
                assert outcome.impulse is not None
                assert outcome.switch is not None
                further = outcome.impulse - outcome.switch
                assert (further > 0) == (law == "energetic" and returns)
                if further > 0:
                    u, bent, _ = approach_velocities(given, outcome)
                    assert outcome.approach is not None
                    gained = u * outcome.approach / 2
                    back = -bent * (outcome.switch - outcome.approach) / 2 - bent * further
                    assert abs(back - arb(moving.r) ** 2 * gained) < 1e-80


def approach_velocities(given: tuple[System, arb, arb, arb], outcome: Impact) -> list[arb]:
    """Of an impact whose slip ends: u before it, when slip ends, and after it."""
    _, x1, v1, v2 = given
    mbar, cos = arb(given[0].mbar), x1.cos()
    assert outcome.switch is not None
    return [v1 * cos - v2, -v2 - mbar * outcome.switch, outcome.v1 * cos - outcome.v2]


def test_laws_return_what_they_say() -> None:
    rows = [row for row in load("impacts.json") if row["v1_pre"] != 0]
    bent = dict.fromkeys(("poisson", "newton", "energetic"), 0)
    with ctx.workprec(300):
        for row in rows:
            given, r = impact_input(row), arb(exact(str(row["r"])))
            for law in bent:
                outcome = LAWS[law](*given)
                assert outcome.regime == row["regime"]
                if row["regime"] in ("slip", "frictionless"):
                    assert abs(outcome.v1 - poisson(*given).v1) < 1e-60
                    continue
                if row["mbar"] == 0:
                    continue  # no work is returned by a wall at rest that holds the tip
                before, bend, after = approach_velocities(given, outcome)
                p, middle, end = outcome.switch, outcome.approach, outcome.impulse
                assert p is not None
                assert middle is not None
                assert end is not None
                # int u dP of the broken line through these three points, u = 0 at `middle`
                if row["regime"].endswith("approach"):
                    approach = (before + bend) * p / 2 + bend * (middle - p) / 2
                    restitution = -after * (end - middle) / 2
                else:
                    approach = before * middle / 2
                    restitution = -bend * (p - middle) / 2 - (bend + after) * (end - p) / 2
                miss = {
                    "poisson": end - (1 + r) * middle,
                    "newton": after + r * before,
                    "energetic": restitution - r**2 * approach,
                }
                assert abs(miss[law]) < 1e-60
                bent[law] += 1
    assert min(bent.values()) > 100


def test_wall_at_rest_and_jamming() -> None:
    wall = system(mbar=0, mu=2, r="0.5")
    with ctx.workprec(128):
        x1, zero = arb(1), arb(0)
        # P* = P_f identically: decided as restitution, not by rounding
        assert poisson(wall, x1, arb(1), zero).regime == "stick_restitution"
        with pytest.raises(Jammed):
            poisson(wall, x1, arb(1), arb(-1))
        with pytest.raises(ValueError, match="approach"):
            poisson(wall, x1, arb(-1), zero)


# --- runs ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["paper_scenes.json", "random.json"])
def test_runs_reproduce_every_printed_digit(name: str) -> None:
    scenes = load(name)
    scenes = list(scenes.values() if isinstance(scenes, dict) else scenes)
    for scene in scenes[:: sizes.either(6, 1)]:
        _, worst = compare(scene)
        assert worst < LARGEST_UNITS, scene["params"]


# --- certifying foreign results --------------------------------------------------------------


def csv_row(row: Row, found: str) -> dict[str, str]:
    """A row of near_grazes.json as a line of the CSV that certify reads."""
    values = {key: row[key] for key in ("x1", "v1", "x2", "v2", "t_end", "contact")}
    values |= {"id": row["ladder"] + row["rung"], "phase0": float(row["phase"]).hex()}
    values |= {"c1": "0", "c2": "0"} | row["parameters"]
    values |= {"touching": str(int(row["touching"])), "found": found}
    assert set(values) == set(COLUMNS)
    return values


def verdict(row: Row, found: str) -> str:
    """The one verdict on a row."""
    return next(iter(certify([csv_row(row, found)]).counts))


def test_certify_judges_right_and_wrong_results() -> None:
    for row in load("near_grazes.json")[::7]:
        if abs(float(row["rung"])) < 1e-13:  # about the graze threshold: see the next test
            continue
        time, hump = row["contact_time"], float(row["hump_time"])
        assert verdict(row, "none" if time is None else repr(float(time))) == "agree"
        assert verdict(row, "graze") == "spurious"
        if row["roots"]:
            assert verdict(row, "none") == "missed"
            assert verdict(row, "20.0") == "later"
            if float(row["rung"]) > 1e-9:
                assert verdict(row, repr(0.9 * float(time) + 0.1 * hump)) == "inaccurate"
        else:
            assert verdict(row, repr(hump)) == ("spurious" if time is None else "earlier")
            if time is not None:
                assert verdict(row, "none") == "missed"


def test_certify_calls_the_lowest_humps_grazes() -> None:
    # 1e-14 is 45 eps, below 64 eps (|sin x1| + |x2| + |delta|) if the sum exceeds 0.71
    rows = [row for row in load("near_grazes.json") if row["rung"] in ("1e-14", "-1e-14")]
    kinds = [verdict(row, "graze") for row in rows]
    assert kinds.count("graze") >= 12
