"""The Python that makes the views of a state: it runs as it stands, and gives the same numbers."""

from __future__ import annotations

from typing import Any

from . import compute
from .axis import Axis
from .machine import Machine
from .state import State

_COLOR = ", color='regime'"


def python_code(state: State) -> str:
    """Return a script that computes and draws what the page shows, as text.

    Parameters
    ----------
    state
        The state of the page.
    """
    machine = state.machine
    options = compute.run_options(machine)
    run = ", ".join(f"{name}={value!r}" for name, value in options.items())
    lines = [
        "import matplotlib.pyplot as plt",
        "import numpy as np",
        "import vibroimpact as vi",
        "",
        *machine.definition(),
        f"initial = {machine.start_code(state.initial)}",
        "",
        "# The motion.",
        "run = vi.simulate(",
        f"    {machine.noun}, initial=initial, {run}, max_events={compute.MOST_EVENTS}",
        ")",
        *_all_of_it(machine, options),
        "print(run.label)",
    ]
    if machine.driven:
        lines += machine.exponent_code(compute.PERIODS, compute.KEEP, compute.MOST_EVENTS)
    lines += ["", "# Its views, for print.", *_in_print(_motion_pictures(state))]
    files = ["motion.pdf"]
    if machine.driven:
        computed, drawn = _MAPS[state.map](state, compute.detail(state, compute.FINE))
        lines += ["", *computed, *_in_print(drawn)]
        files += [f"{state.map}.pdf"]
    lines += ["", f"print('written: {', '.join(files)}')"]
    return "\n".join(lines) + "\n"


def _all_of_it(machine: Machine, options: dict[str, Any]) -> list[str]:
    """Return lines that keep all of a run that has ended before the part to be kept."""
    if "keep" not in options:
        return []
    return [
        "if run.kept_from >= run.final_state.time:  # it has ended early",
        "    run = vi.simulate(",
        f"        {machine.noun}, initial=initial, periods={options['periods']},",
        f"        max_events={compute.MOST_EVENTS},",
        "    )",
    ]


def _in_print(lines: list[str]) -> list[str]:
    """Return lines that draw, in the style for print."""
    return ["with vi.plot.publication_style():", *(f"    {line}" for line in lines)]


def _motion_pictures(state: State) -> list[str]:
    machine = state.machine
    lines = machine.pictures(state.shown, compute.SHOWN)
    if machine.driven:
        period = f"{machine.noun}.drive_period"
        lines += [
            "# The time in drive periods, as on the page.",
            f"panels[0].xaxis.set_major_locator(plt.MultipleLocator(2 * {period}))",
            f"panels[0].xaxis.set_major_formatter(lambda t, _: f'{{t / {period}:.0f}}')",
            "panels[0].set_xlabel('time in drive periods')",
        ]
    return [*lines, "figure.savefig('motion.pdf')"]


def _diagram(state: State, detail: compute.Detail) -> tuple[list[str], list[str]]:
    machine = state.machine
    begin = "initial"
    lines = ["# The bifurcation diagram."]
    if state.origin is not None:
        begin = machine.start_code(state.origin)
        lines += ["# The motion above is that of a column, which starts where the one before ends."]
    lines += [
        "diagram = vi.bifurcation_diagram(",
        f"    {machine.family_code(state.vary.name)},",
        f"    initial={begin},",
        f"    periods={detail.periods}, keep={detail.keep}, start={state.start!r}, labels=False,",
        f"    max_events={compute.MOST_EVENTS},",
        f"    {_values(state.vary, detail.columns)},",
        ")",
    ]
    call, shown = machine.drawn_code(state.value, state.shown)
    drawn = [f"ax = {call}(diagram, {shown})"]
    if state.branch:
        lines += [
            "",
            "# The branch of its periodic motion, stable and unstable.",
            "branch = vi.follow_motion(",
            f"    run.refine(), max_points={compute.MOST_POINTS},",
            f"    {state.vary.name}=({state.vary.low!r}, {state.vary.high!r}),",
            ")",
        ]
        plain = shown.replace(_COLOR, "")
        rough = state.system.friction > 0.0 or state.vary.name == "friction"
        if plain != shown and rough:
            # The key of the branch stands above the picture, so that of the regimes is left out.
            drawn = [
                f"ax = {call}(diagram, {shown}, legend=False)",
                f"vi.plot.branches(branch, {plain}, ax=ax)",
            ]
        else:
            # On black points no branch would be seen; these are grey.
            drawn = [f"ax = vi.plot.branches(branch, diagram=diagram, {plain})"]
    return lines, [*drawn, "ax.figure.savefig('diagram.pdf')"]


def _chart(state: State, detail: compute.Detail) -> tuple[list[str], list[str]]:
    lines = [
        "# The chart.",
        "chart = vi.chart(",
        f"    {state.machine.family_code(state.across.name, state.upward.name)},",
        f"    initial=initial, periods={detail.periods}, keep={detail.keep}, exponents=False,",
        f"    max_events={compute.MOST_EVENTS},",
        f"    {_values(state.across, detail.columns)},",
        f"    {_values(state.upward, detail.rows)},",
        ")",
    ]
    return lines, ["vi.plot.chart(chart).figure.savefig('chart.pdf')"]


def _basins(state: State, detail: compute.Detail) -> tuple[list[str], list[str]]:
    lines = [
        "# The basins of attraction.",
        "basins = vi.basins(",
        "    system, initial=initial,",
        f"    periods={detail.periods}, keep={detail.keep}, scouts={compute.SCOUTS}, rounds=0,",
        f"    max_events={compute.MOST_EVENTS},",
        f"    {_values(state.right, detail.columns)},",
        f"    {_values(state.up, detail.rows)},",
        ")",
    ]
    return lines, ["vi.plot.basins(basins).figure.savefig('basins.pdf')"]


_MAPS = {"diagram": _diagram, "chart": _chart, "basins": _basins}


def _values(axis: Axis, count: int) -> str:
    return f"{axis.name}=np.linspace({axis.low!r}, {axis.high!r}, {count})"
