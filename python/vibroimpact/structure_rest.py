"""Where a structure rests without its drive: pressed on its stops by preloads and static loads.

    K q = c - sum_j n_j P_j,   P_j >= 0,   g_j = n_j . q - gap_j - A_j cos phi_j <= 0,   P_j g_j = 0

the minimum of q K q/2 - c . q under the conditions of the stops: by one set of stops that are held
after another, as it is wanted for a message, and of few stops.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from .modal_basis import Matrices, ModalBasis
from .stop import Stop

Array = NDArray[np.float64]

# Of more stops not all sets are tried.
_MOST_STOPS = 10
# Coordinates that a message shows.
_MOST_SHOWN = 8
# What is zero, as part of the largest number.
_ROUNDING = 1e-9


def gaps_at(stops: Sequence[Stop], q: Array) -> Array:
    """Return the gap functions of all stops at t = 0."""
    return np.array(
        [stop.normal @ q - stop.gap - stop.amplitude * np.cos(stop.phase) for stop in stops]
    )


def rest_on_stops(
    basis: Matrices | ModalBasis, stops: Sequence[Stop], static_load: Array
) -> Array | None:
    """Return where it rests, (n,), its stops as they are at t = 0; None if that is not found."""
    _, stiffness = basis.matrices
    load = basis.on("static_load", static_load)
    rows = np.array([basis.on("normal", stop.normal) for stop in stops]).reshape(len(stops), -1)
    reach = -gaps_at(stops, np.zeros(len(static_load)))
    for count in range(min(len(stops), len(load)) + 1 if len(stops) <= _MOST_STOPS else 0):
        for held in map(list, combinations(range(len(stops)), count)):
            system = np.block([[stiffness, rows[held].T], [rows[held], np.zeros((count, count))]])
            wanted = np.concatenate([load, reach[held]])
            found = np.linalg.lstsq(system, wanted, rcond=None)[0]
            left = np.abs(system @ found - wanted).max(initial=0.0)
            q, forces = found[: len(load)], found[len(load) :]
            over = (rows @ q - reach).max(initial=0.0)
            size = np.abs(wanted).max(initial=0.0) + np.abs(system @ found).max(initial=0.0)
            holds = left <= _ROUNDING * size and forces.min(initial=0.0) >= 0.0
            if holds and over <= _ROUNDING * np.abs(reach).max(initial=0.0):
                return basis.physical(q)
    return None


def where_to_begin(
    basis: Matrices | ModalBasis, stops: Sequence[Stop], static_load: Array, starts: Array
) -> str:
    """Return what to add to the error about starts of which some lie inside a stop."""
    for q in starts.reshape(-1, 2, len(static_load))[:, 0]:
        over = gaps_at(stops, q)
        if not (over > 0.0).any():
            continue
        if q.any():
            place = int(over.argmax())
            reach = stops[place].normal @ q - over[place]
            return f", which is normal . q <= {reach:.6g} there"
        # At 0 it lies inside stops that press on it.
        rest = rest_on_stops(basis, stops, static_load)
        if rest is None or len(rest) > _MOST_SHOWN:
            return "; stops press on it at q = 0, which is not where it rests"
        return f"; stops press on it at q = 0: it rests at q = {[float(f'{x:.6g}') for x in rest]}"
    return ""
