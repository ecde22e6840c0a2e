"""The run from one start of a picture of basins, made again."""

from ...run import Run
from ...simulation import simulate
from ..cell_runs import place_of
from ..columns import COORDINATES
from .results import Basins


def run_of_start(basins: Basins, *indices: int) -> Run:
    """Make the run of a cell again; see ``Basins.run``."""
    axes, settings = basins.axes, basins.settings
    place = place_of(basins.attractor.shape, tuple(axes), indices)
    values = {name: float(axes[name][k]) for name, k in zip(axes, place, strict=True)}
    initial = [
        values.get(name, given) for name, given in zip(COORDINATES, settings.initial, strict=True)
    ]
    periods, settling = settings.periods, int(basins.settling[place])
    # A cell that has not arrived is followed again in each round, for twice as long.
    for _ in range(settings.rounds):
        if 0 <= settling <= periods:
            break
        periods *= 2
    run: Run = simulate(
        basins.system,
        initial=initial,
        periods=periods,
        keep=settings.keep,
        max_events=settings.max_events,
        chatter_tolerance=settings.chatter_tolerance,
        units=settings.units,
    )
    return run
