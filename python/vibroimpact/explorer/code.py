"""The Python that makes the views of a state: it runs as it stands, and gives the same numbers."""

from __future__ import annotations

from . import compute
from .state import Axis, State

_SECTION = {"stroboscopic": 'section="stroboscopic"'}


def python_code(state: State) -> str:
    """Return a script that computes and draws what the page shows, as text.

    Parameters
    ----------
    state
        The state of the page.
    """
    detail = compute.FINE[state.map]
    options = compute.run_options(state.system)
    run = ", ".join(f"{name}={value!r}" for name, value in options.items())
    lines = [
        "import numpy as np",
        "import vibroimpact as vi",
        "",
        f"system = vi.System({_fields(state)})",
        f"initial = {state.initial!r}",
        "",
        "# The motion.",
        "run = vi.simulate(",
        f"    system, initial=initial, {run}, max_events={compute.MOST_EVENTS}",
        ")",
        "print(run.label)",
        *_motion_picture(state),
    ]
    if state.system.drive_frequency > 0.0:
        lines += ["", *_MAPS[state.map](state, detail)]
    return "\n".join(lines) + "\n"


def _fields(state: State) -> str:
    rows = "".join(f"\n    {name}={value!r}," for name, value in state.system.to_dict().items())
    return f"{rows}\n"


def _motion_picture(state: State) -> list[str]:
    if state.system.drive_frequency == 0.0:
        window = "window=(run.kept_from, run.final_state.time)"
        return [f"vi.plot.time_history(run, {window}).figure.savefig('motion.pdf')"]
    return ["vi.plot.phase_portrait(run).figure.savefig('motion.pdf')"]


def _diagram(state: State, detail: compute.Detail) -> list[str]:
    begin = "initial"
    lines = ["# The bifurcation diagram."]
    if state.origin is not None:
        begin = repr(state.origin)
        lines += ["# The motion above is that of a column, which starts where the one before ends."]
    lines += [
        "diagram = vi.bifurcation_diagram(",
        f"    system, initial={begin},",
        f"    periods={detail.periods}, keep={detail.keep}, start={state.start!r}, labels=False,",
        f"    max_events={compute.MOST_EVENTS},",
        f"    {_values(state.vary, detail.columns)},",
        ")",
    ]
    drawn = _SECTION.get(state.value, f"value={state.value!r}")
    if state.branch:
        section = ", " + _SECTION["stroboscopic"] if state.value == "stroboscopic" else ""
        lines += [
            "",
            "# The branch of its periodic motion, stable and unstable.",
            "branch = vi.follow_motion(",
            f"    run.refine(), max_points={compute.MOST_POINTS},",
            f"    {state.vary.name}=({state.vary.low!r}, {state.vary.high!r}),",
            ")",
            f"ax = vi.plot.branches(branch, diagram=diagram{section})",
        ]
    else:
        lines += [f"ax = vi.plot.bifurcation(diagram, {drawn})"]
    return [*lines, "ax.figure.savefig('diagram.pdf')"]


def _chart(state: State, detail: compute.Detail) -> list[str]:
    return [
        "# The chart.",
        "chart = vi.chart(",
        "    system, initial=initial,",
        f"    periods={detail.periods}, keep={detail.keep}, exponents=False,",
        f"    max_events={compute.MOST_EVENTS},",
        f"    {_values(state.across, detail.columns)},",
        f"    {_values(state.upward, detail.rows)},",
        ")",
        "vi.plot.chart(chart).figure.savefig('chart.pdf')",
    ]


def _basins(state: State, detail: compute.Detail) -> list[str]:
    return [
        "# The basins of attraction.",
        "basins = vi.basins(",
        "    system, initial=initial,",
        f"    periods={detail.periods}, keep={detail.keep}, scouts={compute.SCOUTS}, rounds=0,",
        f"    max_events={compute.MOST_EVENTS},",
        f"    {_values(state.right, detail.columns)},",
        f"    {_values(state.up, detail.rows)},",
        ")",
        "vi.plot.basins(basins).figure.savefig('basins.pdf')",
    ]


_MAPS = {"diagram": _diagram, "chart": _chart, "basins": _basins}


def _values(axis: Axis, count: int) -> str:
    return f"{axis.name}=np.linspace({axis.low!r}, {axis.high!r}, {count})"
