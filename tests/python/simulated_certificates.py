"""Whether simulation, which shares nothing with a proof, finds what a certificate states."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import vibroimpact as vi
from vibroimpact.proof.certificate import exact
from vibroimpact.system import SYMBOLS

# How far a simulation may be from a candidate that it confirms.
NEAR = 1e-6
# Of differences that give multipliers.
STEP = 1e-6

Problem = dict[str, Any]


def number(exactly: str) -> float:
    """The double next to an exact number."""
    fraction = exact(exactly)
    return int(fraction.p) / int(fraction.q)


def built(machine: Problem, turn: float) -> vi.System | vi.Structure:
    """The machine of a certificate with its phases moved on by `turn`."""
    if machine["kind"] == "two bodies":
        values = {SYMBOLS[name]: number(x) for name, x in machine["numbers"].items()}
        values["phase"] = (values["phase"] + turn) % (2.0 * math.pi)
        return vi.System(**values, contact=machine["contact"], law=machine["law"])

    def array(given: Any) -> Any:
        return [array(one) for one in given] if isinstance(given, list) else number(given)

    stops = []
    for stop in machine["stops"]:
        given = {name: array(x) for name, x in stop.items()}
        given["phase"] += turn
        if not given["friction"]:
            del given["friction"], given["tangent"]
        stops.append(vi.Stop(**given))
    damping = {x: array(machine[x]) for x in ("damping", "damping_ratios") if x in machine}
    if not np.any(list(damping.values())):
        damping = {}
    return vi.Structure(
        array(machine["mass"]),
        array(machine["stiffness"]),
        stops,
        **damping,
        static_load=array(machine["static_load"]),
        drive_amplitude=np.array(array(machine["drive_amplitude"])) @ [1, 1j],
        drive_frequency=number(machine["drive_frequency"]),
        phase=(number(machine["phase"]) + turn) % (2.0 * math.pi),
        law=machine["law"],
    )


def started(problem: Problem, nodes: Any) -> tuple[vi.System | vi.Structure, Any]:
    """The machine at the instant of the first node, and a start just after that impact."""
    machine, size = problem["machine"], nodes.shape[1] // 2
    two = machine["kind"] == "two bodies"
    omega = number(machine["numbers"]["omega"] if two else machine["drive_frequency"])
    system = built(machine, omega * nodes[0, -1])
    q, v = nodes[0, :size], nodes[0, size:-1]
    if isinstance(system, vi.Structure):
        normal = np.array(system.stops[problem["legs"][-1][0]].normal)
        return system, np.array([q - 1e-13 * normal / (normal @ normal), v])
    x2, v2 = (q[1], v[1]) if size == 2 else (system.static_force, 0.0)
    tip = math.sin(q[0]) if system.contact == "oblique" else q[0]
    over = max(0.0, tip - x2 - system.gap) + 1e-13
    if size == 2:
        return system, (q[0], v[0], x2 + over, v2)
    return system, (q[0] - over * np.sign(np.cos(q[0]) if tip != q[0] else 1), v[0], x2, v2)


def multipliers(problem: Problem, z: Any) -> Any:
    """Those of a motion, by central differences of simulated states between two impacts."""
    nodes = np.array([float(x) for x in np.ravel(z)]).reshape(len(problem["legs"]), -1)
    m, size = problem["m"], nodes.shape[1] // 2
    system, start = started(problem, nodes)
    run = vi.simulate(system, initial=start, periods=m + 1, keep=m + 1)
    later = run.impacts[0]["time"] / 2.0
    middle = np.asarray(run.trajectory([later])[0])
    turned = built(problem["machine"], system.drive_frequency * (nodes[0, -1] + later))
    free = range(middle.size) if size > 1 or isinstance(system, vi.Structure) else (0, 1)
    columns = []
    for i in free:
        ends = []
        for sign in (1.0, -1.0):
            moved = middle.copy()
            moved.ravel()[i] += sign * STEP
            found = vi.simulate(turned, initial=moved, periods=m, keep=m).stroboscopic[-1]
            ends.append(np.ravel(found)[[*free]])
        columns.append((ends[0] - ends[1]) / (2.0 * STEP))
    return np.linalg.eigvals(np.array(columns).T)


def _slip(structure: Any, hit: Any) -> float:
    """The slip velocity before an impact of a structure."""
    return float(structure.stops[hit["stop"]].tangent @ hit["v_pre"])


def is_motion(problem: Problem, z: Any) -> bool:
    """Whether simulation confirms a candidate."""
    machine, legs = problem["machine"], problem["legs"]
    nodes = np.array([float(x) for x in np.ravel(z)]).reshape(len(legs), -1)
    two, count, size = machine["kind"] == "two bodies", len(legs), nodes.shape[1] // 2
    for shift in range(1, count):
        again = problem["m"] * shift % count == 0 and legs == legs[shift:] + legs[:shift]
        if again and np.abs(np.roll(nodes, -shift, 0) - nodes)[:, :-1].max() < NEAR:
            return False  # it has a shorter period
    try:
        system, start = started(problem, nodes)
        run = vi.simulate(system, initial=start, periods=problem["m"] + 1, keep=problem["m"] + 1)
    except (vi.SimulationError, ValueError):
        return False
    hits = run.impacts[:count]
    if len(hits) < count:
        return False
    for k, (hit, (stop, regime)) in enumerate(zip(hits, legs, strict=True)):
        after = nodes[(k + 1) % count]
        whole = problem["m"] * system.drive_period if k == count - 1 else 0.0
        time = after[-1] + whole - nodes[0, -1]
        kind, _, way = regime.partition(" ")
        same = abs(hit["time"] - time) < NEAR and vi.Regime(hit["regime"]).name.lower() == kind
        names = ("x1", "x2", "v1_post", "v2_post") if size == 2 else ("x1", "v1_post")
        if two:
            state = [hit[name] for name in names]
        else:
            same, state = same and hit["stop"] == stop, [*hit["q"], *hit["v_post"]]
        if way and same:
            slip = math.sin(hit["x1"]) * hit["v1_pre"] if two else _slip(system, hit)
            same = slip > 0.0 if way == "+" else slip < 0.0
        if not same or np.abs(state - after[:-1]).max() > NEAR * max(1.0, np.abs(after).max()):
            return False
    return True
