"""Tests of the runs with chatter and contact, and of the file tests/data/contact_reference.json.

The file's values are checked against what defines them (forces, margins, the constraint), against
the independent data of contact.json, and against what its generator writes. Needs python-flint.
"""

from __future__ import annotations

import json
from itertools import pairwise
from typing import Any

import pytest

pytest.importorskip("flint", reason="the high-precision reference needs python-flint")

from flint import arb, ctx

from vibroimpact.reference.flight import System, as_float, exact
from vibroimpact.reference.hybrid import follow, sections

from .generate import DATA
from .generate_contact import LARGEST_ERROR, NAME, scene_record
from .scenes import SCENES

#: Accuracy that contact.json states for itself.
SUPPLIED = 1e-10
#: Printed values carry 25 digits, and enter forces with factors of order 10.
PRINTED = 1e-22
#: Scenes that take less than a second each.
QUICK = ("bouncing_ball_0.5", "rest_constant_load", "painleve", "wall_at_rest_sticking",
         "start_touching_pressed", "start_touching_at_rest", "start_unloaded_pressed")  # fmt: skip

Row = dict[str, Any]


def load() -> dict[str, Row]:
    """The reference file."""
    data: dict[str, Row] = json.loads((DATA / NAME).read_text())
    return data


def number(text: str) -> arb:
    """A printed value."""
    return arb(exact(text))


def parameters(scene: Row) -> dict[str, arb]:
    """The ten numbers, float64."""
    return {name: arb(exact(as_float(text))) for name, text in scene["params"].items()}


def forces(scene: Row, phase: Row) -> tuple[arb, arb, arb, arb]:
    """Where a phase begins: sin x1, cos x1 and the free accelerations a1, a2."""
    p = parameters(scene)
    t, x1, v1, x2, v2 = (number(phase[key]) for key in ("t", "x1", "v1", "x2", "v2"))
    sin, cos = (x1.sin(), x1.cos()) if scene["contact"] == "oblique" else (arb(0), arb(1))
    drive = (p["omega"] * t + arb(exact(as_float(scene["phase"])))).cos()
    a1 = p["f1"] * drive - 2 * p["zeta1"] * p["omega0"] * v1 - p["omega0"] ** 2 * x1
    a2 = p["f2"] * drive - 2 * p["zeta2"] * v2 - x2
    return sin, cos, a1, a2


def resting_wall(scene: Row) -> bool:
    """Whether body 2 is a wall that never moves."""
    p = scene["params"]
    still = float(p["mbar"]) == float(p["f2"]) == 0
    return still and all(float(text) == 0 for text in scene["initial"][2:])


# --- against the supplied data ---------------------------------------------------------------


def test_runs_agree_with_the_supplied_contacts_to_their_accuracy() -> None:
    scenes = json.loads((DATA / "contact.json").read_text())
    assert len(scenes) == 4
    for scene in scenes.values():
        system = System.parse(scene["params"])
        run = follow(system, scene["initial"], sections(system, scene["periods"]))
        names = {"chatter": "contact", "slide_positive": "slide", "slide_negative": "slide"}
        events = [names.get(phase.event, phase.event) for phase in run.phases]
        assert events == [phase["event"] for phase in scene["phases"]]
        for ours, theirs in zip(run.phases, scene["phases"], strict=True):
            values = (ours.time, ours.state[0], ours.state[1])
            for value, key in zip(values, ("t", "x1", "v1"), strict=True):
                assert abs(float(value) - theirs[key]) < SUPPLIED
        for state, row in zip(run.samples, scene["stroboscopic"], strict=True):
            for value, given in zip(state, row, strict=True):
                assert abs(float(value) - given) < SUPPLIED


# --- the file --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", QUICK)
def test_file_is_what_the_generator_writes(name: str) -> None:
    assert scene_record(SCENES[name]) == load()[name]


def test_file_has_every_scene_and_its_errors_are_small() -> None:
    scenes = load()
    assert list(scenes) == list(SCENES)
    for name, scene in scenes.items():
        assert float(scene["error"]) < LARGEST_ERROR
        assert {key: float(text) for key, text in scene["params"].items()} == SCENES[
            name
        ].parameters()
        complete = scene["ending"] in ("completed", "rest")
        expected = len(scene["times"]) or scene["periods"]
        assert len(scene["stroboscopic"]) == len(scene["amplification"])
        assert len(scene["stroboscopic"]) == expected or not complete


def test_file_holds_what_it_is_for() -> None:
    scenes = load()
    pairs = {
        (a["event"], b["event"]) for scene in scenes.values() for a, b in pairwise(scene["phases"])
    }
    slides = ("slide_positive", "slide_negative")
    assert {("chatter", after) for after in (*slides, "stick")} <= pairs
    assert {("impact", after) for after in (*slides, "stick")} <= pairs
    assert {(slide, after) for slide in slides for after in ("stick", "release")} <= pairs
    assert {("stick", after) for after in (*slides, "release")} <= pairs
    assert {slides, slides[::-1]} <= pairs
    assert {scene["ending"] for scene in scenes.values()} == {"completed", "rest", "painleve"}
    for name in ("crossing_mu_0.3", "crossing_mu_0.5", "crossing_mu_0.9"):
        phases = scenes[name]["phases"]
        assert any(
            a["event"] in slides and float(a["x1"]) * float(b["x1"]) < 0
            for a, b in pairwise(phases)
        )


def test_phases_lie_on_the_contact() -> None:
    with ctx.workprec(200):
        for scene in load().values():
            delta = parameters(scene)["delta"]
            for phase in scene["phases"]:
                sin, cos, _, _ = forces(scene, phase)
                x1 = number(phase["x1"])
                tip = sin if scene["contact"] == "oblique" else x1
                assert abs(tip - number(phase["x2"]) - delta) < PRINTED
                if phase["event"] != "impact_at_start":
                    assert abs(number(phase["v1"]) * cos - number(phase["v2"])) < PRINTED


def test_forces_are_those_of_the_theory() -> None:
    counted = 0
    with ctx.workprec(200):
        for scene in load().values():
            p = parameters(scene)
            for phase in scene["phases"]:
                if phase["event"] not in ("slide_positive", "slide_negative", "release"):
                    continue
                sin, cos, a1, a2 = forces(scene, phase)
                free = a1 * cos - number(phase["v1"]) ** 2 * sin - a2
                s = 1 if phase["event"] == "slide_positive" else -1
                k = cos + p["mu"] * s * abs(sin)
                normal = number(phase["normal_force"])
                if phase["event"] == "release":
                    assert abs(free) < PRINTED
                    assert normal.is_zero()
                    continue
                assert abs(normal * (p["mbar"] + k * cos) - free) < PRINTED
                assert normal > 0 or phase["t"] == "0"
                if not sin.is_zero():
                    side = 1 if sin > 0 else -1
                    sliding = -p["mu"] * s * side * normal
                    assert abs(number(phase["friction_force"]) - sliding) < PRINTED
                v1 = number(phase["v1"])
                assert v1.is_zero() or (v1 > 0) == (s > 0)
                counted += 1
    assert counted > 150


def test_sticks_hold_by_force_and_end_at_the_edge_of_the_cone() -> None:
    counted = 0
    with ctx.workprec(200):
        for scene in load().values():
            p = parameters(scene)
            wall = resting_wall(scene)
            phases = scene["phases"]
            for phase, after in pairwise([*phases, None]):
                if phase["event"] != "stick":
                    continue
                sin, cos, a1, a2 = forces(scene, phase)
                normal, friction = number(phase["normal_force"]), number(phase["friction_force"])
                assert abs(a1 - normal * cos + friction * sin) < PRINTED
                assert wall or abs(a2 + p["mbar"] * normal) < PRINTED
                assert normal > 0
                assert abs(friction) <= p["mu"] * normal + PRINTED
                if after is None or after["event"] == "release":
                    continue
                assert after["x1"] == phase["x1"]
                sin, cos, a1, a2 = forces(scene, after)
                push = -a2 / p["mbar"]
                drive = a1 - push * cos
                assert abs(abs(drive) - p["mu"] * push * abs(sin)) < PRINTED
                assert (drive > 0) == (after["event"] == "slide_positive")
                counted += 1
    assert counted > 40
