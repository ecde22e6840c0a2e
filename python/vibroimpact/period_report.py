"""What is said of a motion: its period m-n, its label, and the evidence for both."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields

from . import _core
from ._core import EvidenceKind, WhyUndecided
from .interruption import interruptible


@interruptible
@dataclass(frozen=True, kw_only=True)
class Evidence:
    """The evidence for the label of a motion, with its numbers.

    Attributes
    ----------
    kind
        ``returned``: the sections return to within rounding. ``converging``: they approach each
        other geometrically, or the motion approaches an orbit that Newton's method has found, as
        `text` says. ``growth_bounded``, ``growth_exponential``: no return, and a small
        perturbation grows no faster than a shear, or exponentially. ``undecided``: none of these.
    further
        Of ``returned`` and ``converging``: drive periods by which the motion was followed beyond
        the run to see it; 0 in the run itself.
    rate
        Of ``converging``: the factor by which the sections' extent, or the distance from the orbit,
        shrinks per drive period.
    growth, growth_error, growth_periods
        Where it was measured, and the motion does not repeat: the mean logarithmic growth of a
        small perturbation per drive period, its standard error, and the periods it is taken over.
    why
        Of ``undecided``: why.
    text
        The evidence in words, for people.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> str(run.period.evidence.kind)
    'converging'
    """

    kind: EvidenceKind
    further: int = 0
    rate: float | None = None
    growth: float | None = None
    growth_error: float | None = None
    growth_periods: int | None = None
    why: WhyUndecided | None = None
    text: str = field(default="", compare=False)

    def __str__(self) -> str:
        """Say it in words."""
        return self.text or str(self.kind)


@dataclass(frozen=True, kw_only=True)
class PeriodReport:
    """The period m-n of a motion, with the evidence for it.

    Attributes
    ----------
    m, n
        Drive periods and impacts per orbit; None where no period was found. n is ``math.inf`` for
        a motion with complete chatter, infinitely many impacts in a finite time.
    residual
        Largest difference between sections m periods apart: of the kept ones; of those of later
        periods where ``evidence.further`` is not 0.
    evidence
        The evidence for the label.
    label
        ``"3-4"``, ``"1-0"``, ``"2-inf"``, ``"quasi-periodic"``, ``"chaotic"`` or
        ``"unresolved"``; `evidence` says why it is that, as with fewer than four kept periods.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> run.period.m, run.period.n, run.period.label
    (1, 1, '1-1')
    """

    m: int | None
    n: int | float | None
    residual: float
    evidence: Evidence
    label: str


def as_period_report(core: _core.PeriodReport) -> PeriodReport:
    """Return what the compiled core says of a motion."""
    evidence = {each.name: getattr(core, each.name) for each in fields(Evidence)}
    n = core.n
    return PeriodReport(
        m=core.m,
        n=int(n) if n is not None and math.isfinite(n) else n,
        residual=core.residual,
        evidence=Evidence(**evidence),
        label=core.label,
    )
