"""Every argument of every public function with values of every kind.

A value is refused by an error that names the argument, the value and what is allowed, before any
work; or it is taken, and every number of the result is a number. Nothing else may come of it: no
panic, no other error, no NaN.
"""

import inspect
import re
import sys

import numpy as np
import pytest

import vibroimpact as vi
from any_values import NOT_TRIED, TAKES, VALUES
from complete_results import assert_complete
from valid_calls import Call, calls, public_callables
from vibroimpact import _core
from vibroimpact.arguments import LONGEST
from vibroimpact.keyword_types import Axes, Changes, StopChanges, StructureChanges

# Of the numbers some are such gaps.
pytestmark = pytest.mark.filterwarnings(
    "ignore:gap = .* the tip cannot reach:UserWarning",
    "ignore:.* no run, status overlap:UserWarning",
)

CALLS = calls()
# Functions that are not called here, and why.
ELSEWHERE = {
    **dict.fromkeys(
        (f"{name}.run" for name in ("Basins", "Chart", "Diagram", "LyapunovSweep", "Sweep")),
        "test_cell_runs.py",
    ),
    **dict.fromkeys(
        (f"{name}.plot" for name in vi.__all__ if hasattr(getattr(vi, name), "plot")),
        "test_showing.py",
    ),
    **dict.fromkeys(("Run.animate", "StructureRun.animate"), "test_animation.py"),
    "Run.sensitivity": "takes names without keywords; test_sensitivity.py refuses bad ones",
    "StructureRun.sensitivity": "as that of a Run; test_structure_sensitivity.py refuses bad ones",
    "Run.integral": "that of a StructureRun is the same",
    "explore": "serves a page; test_explorer.py refuses its bad arguments",
    "Attractor.holds": "takes the tails of runs that basins keep, which no caller has",
    **dict.fromkeys(
        (
            *("System.tip", "System.slope", "System.gap_function", "System.gap_rate"),
            *("System.gap_acceleration", "System.accelerations", "System.free_flight"),
        ),
        "test_mechanics.py",
    ),
    **dict.fromkeys(
        (*("Scales.of", "Scales.to_si", "Scales.from_si", "RunInSI.trajectory"),),
        "test_units.py",
    ),
    **dict.fromkeys(
        (
            f"{name}.system_at"
            for name in ("Sweep", "Chart", "Diagram", "StructureDiagram", "LyapunovSweep")
        ),
        "test_made_systems.py",
    ),
}
_TYPES = (Axes, Changes, StopChanges, StructureChanges)
LISTED = {name for names in _TYPES for name in names.__annotations__}
# What is raised where an argument is out of range, and where a computation leaves that of floats.
REFUSALS = (vi.ParameterError, vi.StateError)
ENDS = (*REFUSALS, vi.SimulationError)
# Where work begins, for what is refused before any.
WORK = [
    *((_core, name) for name in ("simulate", "simulate_with_sensitivity", "sweep", "arrivals")),
    (_core, "lyapunov_spectrum"),
    ("orbits.shooting", "solve_orbit"),
    ("orbits.branches", "followed"),
    ("orbits.regions", "Walk"),
    ("orbits.borders", "follow_curve"),
    ("orbits.manifolds", "first_piece"),
    ("single_impact.motions", "solve_many"),
    ("single_impact.motion_map", "solve_many"),
    ("whole_file", "_replacing"),
]
# What is known of a value only when its work has begun.
LATE = {
    ("unstable_manifold", "section_phase"): "whether the motion is in flight there",
}


@pytest.fixture
def work(monkeypatch):
    """Return a list of the work that was begun."""
    begun: list[str] = []

    def counted(name, plain):
        def counting(*arguments, **options):
            # A run of no length is how a start is looked at.
            if options.get("time") != 0.0:
                begun.append(name)
            return plain(*arguments, **options)

        return counting

    for owner, name in WORK:
        if isinstance(owner, str):
            owner = sys.modules[f"vibroimpact.{owner}"]
        monkeypatch.setattr(owner, name, counted(name, getattr(owner, name)))
    return begun


def shown(value: object, message: str) -> bool:
    """Whether a message shows a value: itself, its shape, its type, or the bad number in it."""
    # A long one is cut.
    texts = {repr(value)[:LONGEST], str(value)}
    if isinstance(value, np.ndarray | np.generic):
        texts |= {f"shape {value.shape}", f"type {value.dtype}", repr(value.tolist())}
        texts |= {repr(part) for part in np.atleast_1d(value)}
        texts |= {text for part in np.ravel(value).tolist() for text in (repr(part), str(part))}
        if value.dtype.kind == "u":
            texts |= {f"{float(part):.0f}" for part in np.ravel(value)}
    if isinstance(value, bytes):
        texts.add(repr(np.asarray(value).tolist()))
    if isinstance(value, dict | set | list):
        texts |= {"shape (0,)", *map(repr, value)}
    # The number that is not finite, or the state that it is in.
    if isinstance(value, int | float):
        texts |= {repr(value + 0.0)} if isinstance(value, float) else set()
        texts |= {"1.7e308"} if value == 1.7e308 else set()
    texts |= {" = nan", " = inf", " = -inf", " = ("}
    return any(text in message.replace("e+", "e") or text in message for text in texts)


def fault(error: Exception, call: Call, argument: str, value: object) -> str | None:
    """Return what a refusal does not say: the argument, the value, and what is allowed."""
    message = str(error)
    if not re.search(rf"\b({call.called.get(argument, argument)})\b", message):
        return f"not named in {message!r}"
    if not re.search(r"allowed: .|got|unknown|missing|not the JSON", message):
        return f"what is allowed is not said in {message!r}"
    elsewhere = argument in call.called or re.search("got|unknown", message)
    if not elsewhere and not shown(value, message):
        return f"not shown in {message!r}"
    return None


def test_every_public_function_has_a_call():
    named = {name.partition(":")[0] for name in CALLS}
    assert {name for name, _ in public_callables()} == {*named, *ELSEWHERE}


@pytest.mark.parametrize("name", CALLS)
def test_every_argument_has_a_kind(name):
    call = CALLS[name]
    parameters = inspect.signature(call.function).parameters.values()
    # What is given by its place alone is also one of the keywords (`branch.at(1.545)`).
    other = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.POSITIONAL_ONLY)
    own = {one.name for one in parameters if one.kind not in other}
    if any(one.kind is one.VAR_KEYWORD for one in parameters):
        # What can be varied is listed in signatures, for completion; a call varies some of it.
        own -= LISTED - {*call.kinds}
    more = {*call.kinds} - own
    assert own <= {*call.kinds}
    assert {*call.arguments} <= {*call.kinds}
    assert not more or any(one.kind is one.VAR_KEYWORD for one in parameters)
    assert {*call.kinds.values()} <= {*TAKES}


@pytest.mark.parametrize("name", CALLS)
def test_a_valid_call_is_taken(name):
    assert_complete(CALLS[name]())


@pytest.mark.parametrize(
    ("name", "argument"), [(name, arg) for name, call in CALLS.items() for arg in call.kinds]
)
def test_what_an_argument_does_not_take_is_refused_before_any_work(
    name, argument, work, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)  # words are paths
    call = CALLS[name]
    faults = []
    kind = call.kinds[argument]
    for what in sorted(VALUES.keys() - TAKES[kind]):
        if (kind, what) in NOT_TRIED or (what == "none" and argument not in call.arguments):
            continue  # None is then its own default, or what stands for it
        value = VALUES[what]
        try:
            call(**{argument: value})
            faults.append(f"{what}: taken")
        except REFUSALS as error:
            if told := fault(error, call, argument, value):
                faults.append(f"{what}: {told}")
        except Exception as error:
            faults.append(f"{what}: {error!r}")
        if work and (name, argument) not in LATE:
            faults.append(f"{what}: after {work}")
        work.clear()
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize(
    ("name", "argument"),
    [(name, arg) for name, call in CALLS.items() for arg in call.kinds if TAKES[call.kinds[arg]]],
)
def test_what_an_argument_takes_gives_numbers(name, argument, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    call = CALLS[name]
    # A file may be missing, or hold something else.
    ends = (*ENDS, OSError, ValueError) if call.kinds[argument].startswith("path") else ENDS
    faults = []
    for what in sorted(TAKES[call.kinds[argument]]):
        try:
            assert_complete(call(**{argument: VALUES[what]}))
        except ends as error:
            faults += [] if str(error) else [f"{what}: an error without words"]
        except Exception as error:
            faults.append(f"{what}: {error!r}")
    assert not faults, "\n".join(faults)
