"""Derivatives of the columns of a table of impacts: of a System, and of a Structure."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..by_numbers import Basis
from ..run import Run

Array = NDArray[np.float64]


def of_columns(run: Any, sensitivity: Any, basis: Basis) -> dict[str, Array]:
    """Return the derivatives of columns of ``run.impacts`` by their names, (n, ..., columns)."""
    made = _of_system if isinstance(run, Run) else _of_structure
    return made(run, sensitivity, basis)


def beside_impacts(run: Any) -> tuple[Array, Array]:
    """Return the states just before and just after the impacts, as rows of a trajectory."""
    impacts = run.impacts
    if isinstance(run, Run):
        before, after = (
            np.column_stack([impacts[name] for name in ("x1", f"v1_{side}", "x2", f"v2_{side}")])
            for side in ("pre", "post")
        )
        return before, after
    before, after = (np.stack([impacts["q"], impacts[f"v_{s}"]], axis=1) for s in ("pre", "post"))
    return before, after


def _of_system(run: Run, sensitivity: Any, basis: Basis) -> dict[str, Array]:
    impacts, system = run.impacts, run.system
    time, before, after = sensitivity.impacts
    found = {"time": time}
    for place, name in enumerate(("x1", "v1_pre", "x2", "v2_pre")):
        found[name] = before[:, place]
    found |= {"v1_post": after[:, 1], "v2_post": after[:, 3]}
    x1, v1 = (np.asarray(impacts[name])[:, None] for name in ("x1", "v1_pre"))
    curvature = -system.tip(x1) if system.contact == "oblique" else 0.0
    turned = curvature * v1 * found["x1"]
    found["approach_velocity"] = turned + system.slope(x1) * found["v1_pre"] - found["v2_pre"]
    ratio, moved = system.mass_ratio, basis.slopes("mass_ratio")
    if ratio == 0.0 and moved.any():
        return found  # the energy of what becomes a wall has no derivative
    lost = np.zeros_like(time)
    for side, sign in (("pre", 1.0), ("post", -1.0)):
        v1, v2 = (np.asarray(impacts[f"{name}_{side}"])[:, None] for name in ("v1", "v2"))
        lost += sign * v1 * found[f"v1_{side}"]
        if ratio > 0.0:  # a wall has no energy
            lost += sign * (v2 * found[f"v2_{side}"] / ratio - v2**2 * moved / (2.0 * ratio**2))
    found["energy_loss"] = lost
    return found


def _of_structure(run: Any, sensitivity: Any, basis: Basis) -> dict[str, Array]:
    impacts, structure = run.impacts, run.system
    time, before, after = sensitivity.impacts
    count = structure.coordinates
    q, before_v, after_v = before[:, :count], before[:, count:], after[:, count:]
    found = {"time": time, "q": q, "v_pre": before_v, "v_post": after_v}
    approach = np.zeros_like(time)
    rate = basis.slopes("drive_frequency")
    omega, turn = structure.drive_frequency, np.asarray(impacts["time"])[:, None]
    for place, stop in enumerate(structure.stops):
        here = np.flatnonzero(impacts["stop"] == place)
        approach[here] = np.einsum("j,njk->nk", stop.normal, before_v[here])
        # The stop moves: u = n . v + a omega sin(omega t + phase).
        t = turn[here]
        phase = omega * t + stop.phase
        moved = rate * t + omega * time[here] + basis.slopes(f"phase_{place}")
        swing = stop.amplitude * rate + basis.slopes(f"amplitude_{place}") * omega
        approach[here] += swing * np.sin(phase) + stop.amplitude * omega * np.cos(phase) * moved
    found["approach_velocity"] = approach
    if any(stop.amplitude for stop in structure.stops):
        return found  # a moving stop does work
    mass, moved = (
        structure._basis.matrices[0],
        basis.slopes("mass", (len(structure._basis.matrices[0]),) * 2),
    )
    lost = np.zeros_like(time)
    for side, sign, rates in (("pre", 1.0, before_v), ("post", -1.0, after_v)):
        v = structure._basis.near(np.asarray(impacts[f"v_{side}"]))
        dv = structure._basis.near(rates.transpose(0, 2, 1))
        lost += sign * np.einsum("ni,ij,nkj->nk", v, mass, dv)
        lost += sign * 0.5 * np.einsum("ni,ijk,nj->nk", v, moved, v)
    found["energy_loss"] = lost
    return found
