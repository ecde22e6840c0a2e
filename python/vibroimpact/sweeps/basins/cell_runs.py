"""The run from one start of a picture of basins, made again."""

from typing import Any

import numpy as np

from ...simulation import simulated
from ..cell_runs import place_of
from ..grid_machine import with_coordinates
from ..machines import machine_of
from .results import Basins


def run_of_start(basins: Basins, *indices: int) -> Any:
    """Make the run of a cell again; see ``Basins.run``."""
    axes, settings = basins.axes, basins.settings
    place = place_of(basins.attractor.shape, tuple(axes), indices)
    values = {name: float(axes[name][k]) for name, k in zip(axes, place, strict=True)}
    machine = machine_of(basins.system)
    initial = np.array(settings.initial, dtype=float)[np.newaxis]
    own = {name: np.array([value]) for name, value in values.items()}
    initial = with_coordinates(machine, initial, own)[0].tolist()
    periods, settling = settings.periods, int(basins.settling[place])
    # A cell that has not arrived is followed again in each round, for twice as long.
    for _ in range(settings.rounds):
        if 0 <= settling <= periods:
            break
        periods *= 2
    return simulated(
        basins.system,
        initial=initial,
        periods=periods,
        keep=settings.keep,
        max_events=settings.max_events,
        chatter_tolerance=settings.chatter_tolerance,
        units=settings.units,
    )
