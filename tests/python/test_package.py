"""The package as a whole: exports, light import, parts that are loaded on first use."""

import dataclasses
import inspect
import subprocess
import sys
import typing

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact import orbits, sweeps

# What an extra or a figure needs, and no simulation.
PACKAGES = ("distributed", "matplotlib", "tqdm", "xarray", "zarr")


def _run(code: str, *, strip: bool = True) -> str:
    """Run code in a fresh interpreter with warnings as errors; return what it prints."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip() if strip else done.stdout


def test_every_export_exists_and_is_documented():
    for name in vi.__all__:
        assert getattr(vi, name).__doc__, name
    assert set(vi.__all__) <= set(dir(vi))


def test_results_with_arrays_have_a_repr_of_their_own():
    public = [getattr(part, name) for part in (vi, sweeps, orbits) for name in part.__all__]
    classes = [
        cls
        for cls in public
        if dataclasses.is_dataclass(cls)
        and any(
            typing.get_origin(kind) is np.ndarray for kind in typing.get_type_hints(cls).values()
        )
    ]
    assert {vi.MotionSearch, vi.ManifoldSide, orbits.Piece, vi.LyapunovSpectrum} <= {*classes}
    for cls in classes:
        # That of a dataclass is wrapped, and prints every array.
        assert not hasattr(cls.__repr__, "__wrapped__"), cls


def test_a_repr_says_in_one_line_what_was_found(system):
    def text(result):
        assert "\n" not in repr(result)
        return repr(result)

    system = system.replace(friction=0.0, drive_frequency=1.8)
    search = vi.search_motions(system, starts=4, periods=200)
    assert text(search) == "<MotionSearch from 4 starts: 1-1 100.0%>"
    motions = vi.periodic_motions(system)
    stable = sum(motion.stable and motion.admissible for motion in motions)
    assert f": {len(motions)} solutions, " in text(motions)
    assert f"{stable} of these stable; 0 intervals undecided>" in text(motions)
    branch = vi.follow_motion(search.motions[0], drive_frequency=(1.7, 1.9))
    first, last = branch.pieces[0].values[[0, -1]]
    assert text(branch.pieces[0]).startswith(
        f"<Piece 1-1, drive_frequency {first:g} ... {last:g}, "
    )
    side = orbits.ManifoldSide(
        points=np.zeros((3, 4)),
        breaks=np.array([1]),
        length=1.5,
        end="length",
        attractors=(search.motions[0], "chaotic"),
    )
    assert text(side) == "<ManifoldSide of length 1.5, 3 points, ends: length, to 1-1, chaotic>"
    meeting = orbits.CodimensionTwo(
        kind="cusp",
        values=np.array([1.5, 2]),
        motion=search.motions[0],
        test="fold",
        test_value=0.0,
    )
    assert text(meeting) == "<cusp of 1-1 at (1.5, 2)>"
    columns = vi.sweep(system, initial=(0, 0.5, 0, 0), periods=1, gap=[0.5, 0.6]).columns
    assert text(columns.grid) == "<Grid 2 gap>"
    assert text(columns.layout).startswith("<Layout of a sweep, <Grid 2 gap>: status, motion, m, n")


def test_signatures_are_short_enough_for_help():
    # ArrayLike spelled out is 300 characters of unions; annotations stay the names they are.
    public = [
        getattr(part, name) for part in (vi, vi.plot, sweeps, orbits) for name in part.__all__
    ]
    functions = {found for found in public if inspect.isfunction(found)}
    for cls in filter(inspect.isclass, public):
        functions |= {each for _, each in inspect.getmembers(cls, inspect.isfunction)}
    assert {vi.sweep, vi.simulate, vi.impact, vi.Run.trajectory, vi.plot.basins} <= functions
    for function in functions:
        text = str(inspect.signature(function))
        assert len(text) < 1500, function
        assert "SupportsArray" not in text, function


def test_import_loads_numpy_and_what_a_simulation_needs():
    code = """
import sys
before = set(sys.modules)
import vibroimpact
new = set(sys.modules) - before
print(*sorted({name.partition(".")[0] for name in new} - sys.stdlib_module_names))
print(*sorted(name.partition(".")[2] for name in new if name.startswith("vibroimpact.")))
print(*sorted({"asyncio", "difflib", "tempfile", "unittest", "zipfile"} & new))
"""
    packages, modules, slow = _run(code, strip=False).splitlines()
    assert packages == "numpy vibroimpact"
    needed = (
        "_core archived arguments by_value errors extras hints horizons impacts interruption "
        "keyword_types machine machine_kinds made_with mechanics period_report physical "
        "quadrature restitution run run_parts run_record run_trace scales showing simulation "
        "system tables verbs"
    )
    assert modules == needed
    assert slow == ""


@pytest.mark.parametrize(
    ("used", "loaded"),
    [
        ("vi.simulate", "matplotlib sweeps orbits continuation plot"),
        ("vi.periodic_motion", "matplotlib sweeps single_impact plot"),
        ("vi.basins", "matplotlib tqdm xarray zarr distributed plot"),
        ("vi.sweeps.STATUS_NAMES", "matplotlib tqdm xarray zarr distributed plot"),
        ("vi.load", "matplotlib zarr plot"),
    ],
)
def test_first_use_does_not_load(used, loaded):
    names = [name if name in PACKAGES else f"vibroimpact.{name}" for name in loaded.split()]
    code = f"import sys, vibroimpact as vi; {used}; print(*set(sys.modules) & {{*{names}}})"
    assert _run(code) == ""


@pytest.mark.parametrize("name", ["orbits", "plot", "single_impact", "sweeps"])
def test_parts_are_loaded_on_first_use(name):
    code = f"import sys, vibroimpact as vi; vi.{name}; print('vibroimpact.{name}' in sys.modules)"
    assert _run(code) == "True"


def test_everything_can_be_imported_by_name():
    code = "from vibroimpact import *; import vibroimpact as vi; print({*vi.__all__} <= {*dir()})"
    assert _run(code) == "True"


def test_unknown_attributes_are_attribute_errors():
    with pytest.raises(AttributeError, match="colour"):
        vi.colour  # noqa: B018


def test_enums_have_the_numbers_of_the_files():
    assert [(regime.name.lower(), regime.value) for regime in vi.Regime] == [
        ("frictionless", 0),
        ("slip", 1),
        ("reversal_approach", 2),
        ("reversal_restitution", 3),
        ("stick_approach", 4),
        ("stick_restitution", 5),
    ]
    assert [(kind.name.lower(), kind.value) for kind in vi.EventKind] == [
        ("impact", 0),
        ("graze", 1),
        ("chatter", 2),
        ("slide_positive", 3),
        ("slide_negative", 4),
        ("stick", 5),
        ("release", 6),
        ("stop", 7),
        ("closed", 8),
    ]
