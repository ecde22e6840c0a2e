"""Tests of the periodic motions and of the file tests/data/orbits_reference.json.

What the generator writes, and what is known in closed form: the product of the multipliers
(docs/theory.md, section 7), the multipliers of a motion without impact, period and events.
"""

from __future__ import annotations

import json
from typing import Any

import pytest

pytest.importorskip("flint", reason="the high-precision reference needs python-flint")

from flint import acb, arb, ctx

from vibroimpact.reference.flight import as_float, exact

from .generate import DATA
from .generate_orbits import NAME, scene_record
from .orbit_scenes import SCENES

#: Printed values carry 25 digits.
PRINTED = 1e-23
#: Motions of every law, without contact, that take less than two seconds each.
QUICK = ("5a", "9_3_one_one", "slip_stick_restitution", "newton_stick_approach",
         "energetic_reversals", "wall_oblique", "no_impact")  # fmt: skip

Row = dict[str, Any]


def load() -> dict[str, Row]:
    """The reference file."""
    data: dict[str, Row] = json.loads((DATA / NAME).read_text())
    return data


def number(text: str) -> arb:
    """A printed value."""
    return arb(exact(text))


def parameters(row: Row) -> dict[str, arb]:
    """The ten numbers, float64."""
    return {name: arb(exact(as_float(text))) for name, text in row["params"].items()}


def test_file_holds_every_motion() -> None:
    data = load()
    assert list(data) == list(SCENES)
    for name, row in data.items():
        hits = [event for event in row["events"] if event["event"] == "impact"]
        chatters = any(event["event"] == "chatter" for event in row["events"])
        assert row["n"] == ("inf" if chatters else len(hits)), name
        times = [float(event["t"]) for event in row["events"]]
        assert times == sorted(times), name
        assert len(row["stroboscopic"]) == row["m"], name


@pytest.mark.parametrize("name", QUICK)
def test_file_is_what_the_generator_writes(name: str) -> None:
    written, row = load()[name], scene_record(SCENES[name])
    errors = ("error", "multiplier_error")
    assert {k: v for k, v in row.items() if k not in errors} == {
        k: v for k, v in written.items() if k not in errors
    }


def test_product_of_multipliers_in_slip() -> None:
    checked = 0
    with ctx.workprec(200):
        for name, row in load().items():
            if not all(event["regime"] in ("slip", "frictionless") for event in row["events"]):
                continue
            p = parameters(row)
            loss = p["zeta1"] * p["omega0"] + (p["zeta2"] if len(row["multipliers"]) == 4 else 0)
            time = 2 * arb.pi() * row["m"] / p["omega"]
            expected = p["r"] ** (2 * row["n"]) * (-2 * loss * time).exp()
            product = acb(1)
            for real, imag in row["multipliers"]:
                product *= acb(number(real), number(imag))
            assert abs(product - expected) < PRINTED, name
            assert abs(number(row["product"]) - expected) < PRINTED, name
            checked += 1
    assert checked > 10


def test_multipliers_without_impact() -> None:
    row = load()["no_impact"]
    with ctx.workprec(200):
        p = parameters(row)
        time = 2 * arb.pi() / p["omega"]
        expected = []
        for zeta, omega0 in ((p["zeta1"], p["omega0"]), (p["zeta2"], arb(1))):
            root = acb(-zeta * omega0 * time, omega0 * (1 - zeta**2).sqrt() * time).exp()
            expected += [root, root.conjugate()]
        for real, imag in row["multipliers"]:
            found = acb(number(real), number(imag))
            assert sum(1 for root in expected if abs(found - root) < PRINTED) == 1
