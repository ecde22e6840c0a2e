"""One quick valid call of every function of records and fits; see `valid_calls`."""

from functools import cache
from typing import Any

import numpy as np

import vibroimpact as vi
from small_results import START, folder, run
from systems import ROUGH


@cache
def heard() -> vi.Record:
    """Times of impacts of a short run, and what is measured of it."""
    return vi.measure(run(), "impact_times", noise=1e-3)


@cache
def found() -> vi.Fit:
    """The fit of a short record, with values of another kind beside it."""
    values = vi.measure(run(), "x1", noise=1e-3, sampling=1.0)
    return vi.fit(
        [heard(), values], run().system, unknown=["restitution", "gap"], initial=run().initial
    )


@cache
def expected() -> vi.ExpectedErrors:
    """The errors that such a record would leave."""
    return vi.expected_errors(run(), heard(), unknown=["restitution", "gap"])


def _table() -> str:
    path = folder() / "record.csv"
    path.write_text("time,x1\n0.0,0.0\n0.5,0.2\n", encoding="utf-8")
    return str(path)


def _saved() -> str:
    path = folder() / "saved_fit.npz"
    found().save(path)
    return str(path)


def fitting_calls() -> dict[str, tuple[Any, ...]]:
    """Return the calls by name: function, arguments, kinds, and what refusals call arguments."""
    start = {"system": ROUGH, "initial": START}
    short = vi.Record("x1", [0.5, 1.0, 1.5], np.array([0.1, 0.2, 0.1]), sigma=1.0)
    return {
        "Record": (
            vi.Record,
            {"kind": "x1", "times": [0.0, 1.0], "values": [0.0, 0.5], "sigma": 0.1},
            {
                "kind": "a word of a list",
                "times": "axis",
                "values": "axis",
                "sigma": "errors or none",
                "resolution": "object or none",
                "name": "name or none",
            },
        ),
        "Record.from_csv": (
            vi.Record.from_csv,
            {"path": _table(), "kind": "x1"},
            {
                "path": "path",
                **dict.fromkeys(("kind", "time", "delimiter"), "a word of a list"),
                "value": "object or none",
                "sigma": "errors or none",
                "resolution": "object or none",
                "name": "name or none",
                "skip_empty": "python's true or false",
            },
            # With another delimiter there is no column.
            {"delimiter": "time|delimiter"},
        ),
        "measure": (
            vi.measure,
            {"run": run(), "what": "x1", "at": [0.5, 1.0]},
            {
                "run": "object",
                "what": "object",
                "noise": "number >= 0",
                "at": "axis or none",
                "sampling": "object or none",
                "jitter": "number >= 0",
                "resolution": "object or none",
                "seed": "whole number",
            },
        ),
        "fit": (
            vi.fit,
            {"record": short, **start, "unknown": ["gap"], "starts": 1},
            {
                "record": "object",
                "system": "object",
                "unknown": "object",
                "initial": "state",
                "loss": "object",
                "starts": "whole number",
                "seed": "whole number",
                "units": "object or none",
            },
        ),
        "expected_errors": (
            vi.expected_errors,
            {"run": run(), "record": heard(), "unknown": ["gap"]},
            dict.fromkeys(("run", "record", "unknown"), "object") | {"system": "object or none"},
        ),
        "Fit.sample": (
            found().sample,
            {"count": 2},
            {"count": "whole number", "seed": "whole number"},
        ),
        "Fit.save": (found().save, {"path": folder() / "fit.npz"}, {"path": "path"}),
        "Fit.load": (vi.Fit.load, {"path": _saved()}, {"path": "path that is missing"}),
    }
