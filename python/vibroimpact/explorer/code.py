"""The Python that makes the views of a state: it runs as it stands, and gives the same numbers."""

from __future__ import annotations

from . import compute
from .state import Axis, State

_SECTION = {"stroboscopic": "section='stroboscopic'"}


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
        "import matplotlib.pyplot as plt",
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
        *_verdict(state),
        "",
        "# Its views, for print.",
        *_in_print(_motion_pictures(state)),
    ]
    files = ["motion.pdf"]
    if state.system.drive_frequency > 0.0:
        computed, drawn = _MAPS[state.map](state, detail)
        lines += ["", *computed, *_in_print(drawn)]
        files += [f"{state.map}.pdf"]
    lines += ["", f"print('written: {', '.join(files)}')"]
    return "\n".join(lines) + "\n"


def _in_print(lines: list[str]) -> list[str]:
    """Return lines that draw, in the style for print."""
    return ["with vi.plot.publication_style():", *(f"    {line}" for line in lines)]


def _fields(state: State) -> str:
    rows = "".join(f"\n    {name}={value!r}," for name, value in state.system.to_dict().items())
    return f"{rows}\n"


def _verdict(state: State) -> list[str]:
    """Return lines that print what the page says of the motion."""
    lines = ["print(run.label)"]
    if state.system.drive_frequency > 0.0:
        lines += [
            "cell = vi.sweep(",
            f"    system, initial=initial, periods={compute.PERIODS}, keep={compute.KEEP},",
            f"    exponents=True, max_events={compute.MOST_EVENTS},",
            "    drive_frequency=[system.drive_frequency],",
            ")",
            "exponent, error = cell.largest_exponent[0], cell.exponent_error[0]",
            "print(f'largest exponent {exponent:.6g} +- {error:.1g} per unit of time 1/omega_2')",
            "if run.period.m is not None and (motion := run.refine()):",
            "    print('multipliers', ', '.join(f'{one:.4g}' for one in motion.multipliers))",
            "    print('stable' if motion.stable else 'unstable')",
        ]
    return lines


def _motion_pictures(state: State) -> list[str]:
    driven = state.system.drive_frequency > 0.0
    section = "x='phase', y='approach_velocity'" if driven else "x='time', y='approach_velocity'"
    if driven:
        part, size = f"periods={compute.SHOWN}", "2, 2, figsize=(7.1, 5.4)"
    else:
        part, size = "window=(run.kept_from, run.final_state.time)", "1, 3, figsize=(7.1, 2.7)"
    lines = [
        f"figure, axes = plt.subplots({size}, layout='constrained')",
        "panels = axes.flat",
        f"vi.plot.time_history(run, {part}, color='regime', ax=panels[0])",
        f"vi.plot.phase_portrait(run, {part}, ax=panels[1])",
        f"vi.plot.impact_section(run, {section}, color='regime', ax=panels[2])",
    ]
    if driven:
        lines += [
            "vi.plot.stroboscopic(run, ax=panels[3])",
            "# The time in drive periods, as on the page.",
            "panels[0].xaxis.set_major_locator(plt.MultipleLocator(2 * system.drive_period))",
            "panels[0].xaxis.set_major_formatter(lambda t, _: f'{t / system.drive_period:.0f}')",
            "panels[0].set_xlabel('time in drive periods')",
        ]
    return [*lines, "figure.savefig('motion.pdf')"]


def _diagram(state: State, detail: compute.Detail) -> tuple[list[str], list[str]]:
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
    shown = _SECTION.get(state.value, f"value={state.value!r}")
    color = "" if state.value in _SECTION else ", color='regime'"
    drawn = [f"ax = vi.plot.bifurcation(diagram, {shown}{color})"]
    if state.branch:
        lines += [
            "",
            "# The branch of its periodic motion, stable and unstable.",
            "branch = vi.follow_motion(",
            f"    run.refine(), max_points={compute.MOST_POINTS},",
            f"    {state.vary.name}=({state.vary.low!r}, {state.vary.high!r}),",
            ")",
        ]
        rough = state.system.friction > 0.0 or state.vary.name == "friction"
        if color and rough:
            # The key of the branch stands above the picture, so that of the regimes is left out.
            drawn = [
                f"ax = vi.plot.bifurcation(diagram, {shown}{color}, legend=False)",
                f"vi.plot.branches(branch, {shown}, ax=ax)",
            ]
        else:
            # On black points no branch would be seen; these are grey.
            drawn = [f"ax = vi.plot.branches(branch, diagram=diagram, {shown})"]
    return lines, [*drawn, "ax.figure.savefig('diagram.pdf')"]


def _chart(state: State, detail: compute.Detail) -> tuple[list[str], list[str]]:
    lines = [
        "# The chart.",
        "chart = vi.chart(",
        "    system, initial=initial,",
        f"    periods={detail.periods}, keep={detail.keep}, exponents=False,",
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
