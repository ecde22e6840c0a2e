"""Sustained contact in Fig. 7(c), which the paper's section 3 does not have (docs/theory.md, E8).

Its model is impacts and free flights. At low drive frequencies the impacts accumulate in every
drive period, infinitely many in a finite time, and sustained contact follows (section 5).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibroimpact import EventKind, Run, bifurcation_diagram, simulate

from .claims import Claim, Verdict
from .parameters import INITIAL, KEEP, LOW_EXAMPLES, LOW_RANGE, PERIODS, TRANSITIONS, Transition

FREQUENCIES = 161
"""Drive frequencies over `LOW_RANGE` at which chatter is looked for."""


@dataclass(frozen=True)
class SustainedContact:
    """What the low frequencies of a diagram show.

    `edge` is the frequency up to which every motion of the grid, from the lowest on, is a 1-inf:
    complete chatter in every drive period; None if the lowest is not. `examples` are runs at
    `LOW_EXAMPLES`.
    """

    frequencies: NDArray[np.float64]
    edge: float | None
    examples: list[Run]


def observe(
    transition: Transition, *, frequencies: int = FREQUENCIES, workers: int | None = None
) -> SustainedContact:
    """Simulate the low frequencies of a transition.

    Parameters
    ----------
    transition : Transition
        Whose system, at every frequency from the paper's initial state.
    frequencies : int
        Values over `LOW_RANGE`.
    workers : int, optional
        Threads; all cores by default.
    """
    grid = np.linspace(*LOW_RANGE, frequencies)
    diagram = bifurcation_diagram(
        transition.system,
        labels=False,
        drive_frequency=grid,
        initial=INITIAL,
        periods=PERIODS,
        keep=KEEP,
        workers=workers,
    )
    always = (diagram.m == 1) & (diagram.n == -1)
    first = int(np.argmin(np.append(always, False)))
    examples: list[Run] = [
        simulate(
            transition.system.replace(drive_frequency=frequency),
            initial=INITIAL,
            periods=PERIODS,
            keep=KEEP,
        )
        for frequency in LOW_EXAMPLES
    ]
    return SustainedContact(grid, float(grid[first - 1]) if first else None, examples)


def contact_share(run: Run) -> float:
    """Return the part of the kept time in sustained contact."""
    return run.time_in_contact / (run.final_state.time - run.kept_from)


def chattering_periods(run: Run) -> int:
    """Return in how many of the kept drive periods a complete chatter ends."""
    ends = run.contacts["kind"] == EventKind.CHATTER
    return len(np.unique(run.contacts["period"][ends]))


def evaluate(observed: SustainedContact) -> Claim:
    """Judge the statement that Fig. 7(c) has only impacts and free flights.

    `refuted` if complete chatter happens in every kept period of every example, `reproduced` if
    nowhere on the grid and in no example, otherwise `open`.

    Parameters
    ----------
    observed : SustainedContact
        Of `observe`.
    """
    (transition,) = [item for item in TRANSITIONS if item.id == "7c"]
    shares = ", ".join(
        f"{contact_share(run):.1%} at {run.system.drive_frequency:g}" for run in observed.examples
    )
    counts = [chattering_periods(run) for run in observed.examples]
    errors = [float(run.contacts["error"].max(initial=0.0)) for run in observed.examples]
    verdict: Verdict = "open"
    if min(counts) == KEEP:
        verdict = "refuted"
    elif max(counts) == 0 and observed.edge is None:
        verdict = "reproduced"
    found = "no complete chatter at the lowest frequency"
    edge = found
    if observed.edge is not None:
        found = f"1-inf up to omega = {observed.edge:g}"
        edge = f"complete chatter in every drive period up to omega = {observed.edge:g}"
    found = f"{found}; in contact {shares}"
    residuals = [run.period.residual for run in observed.examples if run.period.m is not None]
    listed = ", ".join(
        f"{count} of {KEEP} at {run.system.drive_frequency:g}"
        for count, run in zip(counts, observed.examples, strict=True)
    )
    step = observed.frequencies[1] - observed.frequencies[0]
    return Claim(
        id="7c-low",
        figure=7,
        source="Han, Jin & Hu (2004), section 3 and Fig. 7(c), low frequencies",
        paper_says="impacts and free flights only",
        found=found,
        residual=max(residuals) if len(residuals) == len(observed.examples) else None,
        reference={"label": "none", "note": "the paper's model ends where impacts accumulate"},
        verdict=verdict,
        decided_by=f"drive periods in which a complete chatter ends: {listed}",
        details=(
            f"{edge} (every label from {observed.frequencies[0]:g} on is 1-inf; "
            f"{len(observed.frequencies)} frequencies, step {step:g}); part of the drive period in "
            f"sustained contact: {shares}; bound of the error of a completed chatter: "
            f"{max(errors):.1g}"
        ),
        command=_command(transition),
    )


def _command(transition: Transition) -> str:
    """Return the command that computes the labels again."""
    flags = [
        f"--{name.replace('_', '-')} {value!r}"
        for name, value in transition.system.to_dict().items()
        if isinstance(value, float) and value != 0.0 and name != "drive_frequency"
    ]
    initial = " ".join(f"{value:g}" for value in INITIAL)
    low, high = LOW_RANGE
    return (
        f"vibroimpact diagram {' '.join(flags)} --initial {initial} "
        f"--vary drive-frequency {low:g} {high:g} {FREQUENCIES} "
        f"--periods {PERIODS} --keep {KEEP}"
    )
