"""Structures that are struck, their starts and short runs of them, for tests and calls."""

from functools import cache

import numpy as np

import vibroimpact as vi
from two_masses import structure

# A mass between a moving stop, on which it comes to rest, and a fixed one.
MOVING = vi.Structure(
    [[1]],
    [[1]],
    [vi.Stop([2], 0.6, 0.6, amplitude=0.4), vi.Stop([-1], 0.4, 0.9)],
    drive_amplitude=[1],
    drive_frequency=0.7,
)
# Two masses; the first rests on a stop with friction, on which it slides and sticks.
PRESSED = vi.Structure(
    np.eye(2),
    [[4, -1], [-1, 3]],
    [vi.Stop([1, 0], 0.1, 0.5, friction=0.3, tangent=[0, 1]), vi.Stop([0, 1], 2.0, 0.3)],
    damping_ratios=[0.02, 0.02],
    static_load=[2, 0.5],
    drive_amplitude=[0.5, 0.2],
    drive_frequency=1.0,
)
# A damped mass that settles on a 1-1 motion.
OSCILLATOR = vi.Structure(
    [[1]],
    [[1]],
    [vi.Stop([1], 0.3, 0.8)],
    damping_ratios=0.05,
    drive_amplitude=[1],
    drive_frequency=2.0,
)
# Three points of a beam of two modes, driven at its tip, which meets a stop.
BEAM = vi.Structure.from_modes(
    [1.0, 3.0],
    [[1.0, 1.0], [0.5, -1.0], [0.25, 2.0]],
    [vi.Stop([0, 0, 1], 0.3, 0.8)],
    modal_mass=[1.0, 4.0],
    damping_ratios=[0.02, 0.02],
    drive_amplitude=[0, 0, 4],
    drive_frequency=1.3,
)
# A mass that meets one stop once in every period.
SETTLING = vi.Structure(
    [[1]],
    [[1]],
    [vi.Stop([1], 0.3, 0.8)],
    damping_ratios=[0.05],
    drive_amplitude=[1],
    drive_frequency=2.0,
)
# Two masses, the second between two equal stops: q -> -q half a period later changes nothing.
MIRRORED = vi.Structure(
    [[1, 0], [0, 0.7]],
    [[5, -2], [-2, 2.5]],
    [vi.Stop([0, 1], 0.4, 0.75), vi.Stop([0, -1], 0.4, 0.75)],
    damping_ratios=[0.03, 0.03],
    drive_amplitude=[0.8, 0],
    drive_frequency=1.3,
)
REST = {1: np.zeros((2, 1)), 2: np.zeros((2, 2)), 3: np.zeros((2, 3))}


def onset_between(low, high, run):
    """Where complete chatter ends to be: the last number below with it, and the next one above.

    ``run(x)`` has chatter at ``low``, and none at ``high``.
    """

    def chatters(x):
        return (run(x).contacts["kind"] == vi.EventKind.CHATTER).any()

    assert chatters(low)
    assert not chatters(high)
    while low < (middle := (low + high) / 2) < high:
        low, high = (middle, high) if chatters(middle) else (low, middle)
    return low, high


@cache
def moving_run() -> vi.StructureRun:
    """A run with impacts on both stops and rest on one."""
    return vi.simulate(MOVING, initial=REST[1], periods=30, keep=10)


@cache
def pressed_run() -> vi.StructureRun:
    """A run with slide and stick."""
    return vi.simulate(PRESSED, initial=REST[2], periods=12)


@cache
def beam_run() -> vi.StructureRun:
    """A run of a beam from its modes."""
    return vi.simulate(BEAM, initial=REST[3], periods=12)


@cache
def masses_run() -> vi.StructureRun:
    """A run of two masses with friction in the impacts between them."""
    return vi.simulate(structure(), initial=REST[2], periods=40, keep=30)


@cache
def settled_run() -> vi.StructureRun:
    """A run that has settled on a motion of one impact in every period."""
    start, periods = REST[1], 200
    return vi.simulate(SETTLING, initial=start, periods=periods, keep=50)


@cache
def orbit() -> vi.StructureOrbit:
    """The motion of the settled run."""
    found = settled_run().refine()
    assert isinstance(found, vi.StructureOrbit)
    return found


@cache
def small_diagram() -> vi.StructureDiagram:
    """A diagram of three frequencies."""
    frequencies = [1.9, 2.0, 2.05]
    return vi.bifurcation_diagram(
        SETTLING, initial=REST[1], periods=200, keep=50, drive_frequency=frequencies
    )


@cache
def spectrum() -> vi.StructureSpectrum:
    """The exponents of the settled motion."""
    return vi.lyapunov_spectrum(SETTLING, initial=REST[1], periods=400, keep=200)


RUNS = {"moving": moving_run, "pressed": pressed_run, "beam": beam_run, "masses": masses_run}


def numbers_of(structure: vi.Structure) -> list[str]:
    """What a run of a structure is differentiated by, by name."""
    count = structure.coordinates
    names = ["drive_frequency", "phase", "gap"] if structure.drive_frequency else ["gap"]
    for place, stop in enumerate(structure.stops):
        names += [f"gap_{place}"]
        names += [f"restitution_{place}"] if 0 < stop.restitution < 1 else []
        names += [f"friction_{place}"] if stop.friction else []
    names += [f"stiffness[0,{count - 1}]", "mass[0,0]"]
    return [*names, *(f"{of}_{i}" for of in "qv" for i in range(count))]


def changed(structure, initial, name, step):
    """The structure and the start with one number changed."""
    initial = np.array(initial, dtype=float)
    if name[:2] in ("q_", "v_"):
        initial["qv".index(name[0]), int(name[2:])] += step
        return structure, initial
    if "[" in name:
        field, place = name.split("[")
        i, j = map(int, place.rstrip("]").split(","))
        matrix = np.array(getattr(structure, field))
        matrix[i, j] += step
        matrix[j, i] = matrix[i, j]
        return structure.replace(**{field: matrix}), initial
    if name.startswith(("gap", "restitution", "friction")) and "_" not in name:
        stops = [getattr(stop, name) for stop in structure.stops]
        changes = {f"{name}_{i}": value + step for i, value in enumerate(stops)}
        return structure.replace(**changes), initial
    if "_" in name and name.rpartition("_")[2].isdigit():
        field, _, place = name.rpartition("_")
        value = getattr(structure.stops[int(place)], field)
        return structure.replace(**{name: value + step}), initial
    return structure.replace(**{name: getattr(structure, name) + step}), initial
