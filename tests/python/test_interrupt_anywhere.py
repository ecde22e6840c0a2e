"""Ctrl-C at any place of a public call, counted from its beginning: it is `Interrupted` each time.

A place is an ask of the core, or the call of a function of the package: while arguments are
prepared, between the computations, while arrays are built of what they give.
"""

import itertools
import signal
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

import sizes
import vibroimpact as vi
from ctrl_c import interrupted
from systems import ROUGH
from vibroimpact import _core, interruption

PACKAGE = str(Path(vi.__file__).parent)
START = (0.0, 0.5, 0.0, 0.0)
FRICTIONLESS = ROUGH.replace(friction=0.0, drive_frequency=1.8)
MOTION = {"initial": START, "periods": 5, "keep": 5}

CALLS = {
    "simulate": lambda: vi.simulate(ROUGH, **MOTION).trajectory([0.0, 1.0]),
    "simulate several": lambda: vi.simulate(ROUGH, **MOTION | {"initial": [START] * 3}, workers=1),
    "sweep": lambda: vi.sweep(ROUGH, **MOTION, workers=1, gap=[0.5, 0.6], friction=[0.1, 0.2]),
    "bifurcation_diagram": lambda: vi.bifurcation_diagram(
        ROUGH, **MOTION, workers=1, refine=1, drive_frequency=[1.5, 1.6, 1.7]
    ),
    "chart": lambda: vi.chart(ROUGH, **MOTION, workers=1, gap=[0.5, 0.6], drive_frequency=[1.5]),
    "lyapunov_spectrum": lambda: vi.lyapunov_spectrum(
        ROUGH, initial=START, periods=40, keep=20, workers=1, gap=[0.5]
    ),
    "basins": lambda: vi.basins(
        FRICTIONLESS, periods=20, keep=8, scouts=1, workers=1, x1=[0.0, 0.1], v1=[0.5]
    ),
    "impact": lambda: vi.impact(ROUGH, x1=[0.0, 0.1], v1=0.5, v2=[-0.5, 0.0]),
    "impact_agreement": lambda: vi.impact_agreement(ROUGH, steps=(5, 10), cells=3),
    "motion_map": lambda: vi.motion_map(FRICTIONLESS, drive_frequency=[1.7, 1.8]),
    "periodic_motions": lambda: vi.periodic_motions(FRICTIONLESS),
    "follow_motion": lambda: vi.follow_motion(SETTLED, drive_frequency=(1.79, 1.81)),
}
SETTLED = vi.simulate(FRICTIONLESS, initial=START, periods=200, keep=20).refine()
# Places looked at one by one, and then by the ratio of their numbers.
FIRST, RATIO = sizes.either(20, 200), sizes.either(1.3, 1.02)


def places():
    """Give numbers of places, without end."""
    yield from range(1, FIRST)
    place = FIRST
    while True:
        yield place
        place = max(place + 1, round(RATIO * place))


class TooFewPlaces(Exception):
    """The call was over before the place was reached."""


@contextmanager
def ctrl_c_at_call(n):
    """Send SIGINT from the n-th call of a function of the package."""
    calls = itertools.count(1)

    def count(frame, event, _):
        file, name = frame.f_code.co_filename, frame.f_code.co_name
        # What makes Ctrl-C `Interrupted` is outside of the call; an error in a generator that is
        # given up, which counts as a call of it too, is printed by Python and lost.
        inside = file.startswith(PACKAGE) and file != interruption.__file__
        if event == "call" and inside and name != "<genexpr>" and next(calls) == n:
            sys.setprofile(None)
            signal.raise_signal(signal.SIGINT)

    sys.setprofile(count)
    try:
        yield
    finally:
        sys.setprofile(None)
    if next(calls) <= n:
        raise TooFewPlaces


@contextmanager
def ctrl_c_at_ask(n):
    """Let Ctrl-C come when the core asks for the n-th time."""
    _core._interrupt_at(n)
    try:
        yield
    finally:
        left = _core._interrupt_at(None)
    if left != 2**64 - 1:
        raise TooFewPlaces


@pytest.mark.parametrize("ctrl_c", [ctrl_c_at_call, ctrl_c_at_ask])
@pytest.mark.parametrize("name", CALLS)
def test_ctrl_c_anywhere_in(name, ctrl_c):
    call = CALLS[name]
    call()  # what it needs has been imported, and made once
    for n in places():
        try:
            with interrupted(), ctrl_c(n):
                call()
        except TooFewPlaces:
            break
    # Not every call is long enough for the core to ask.
    assert n > 10 or ctrl_c is ctrl_c_at_ask
