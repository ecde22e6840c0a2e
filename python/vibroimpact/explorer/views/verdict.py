"""What the motion of the page is: label, largest exponent, multipliers, and how its run ended."""

from __future__ import annotations

import html
import math

from ..._core import EvidenceKind
from ...run import Evidence
from ..compute import Verdict
from ..machine import Motion
from . import parts


class VerdictView:
    """A few lines of text."""

    def __init__(self) -> None:
        self.text = parts.text(sizing_mode="stretch_width", name="verdict")

    def show(self, motion: Motion, verdict: Verdict | None) -> None:
        """Say what a motion is; without a verdict, how its run ended.

        The number of impacts comes with the verdict: a text that changes is a new layout.
        """
        run, machine = motion.run, motion.machine
        rows = [("run", f"{run.stop_reason}")]
        label = "…"
        if verdict is not None:
            rows = [("run", f"{run.stop_reason}, {run.impact_count} impacts"), *machine.facts(run)]
            if run.stop_reason not in _ENDS:
                rows[0] = ("run", run.stop_detail)
            # Without a drive period there is nothing that a label could count.
            label = verdict.label if machine.driven else run.stop_reason
            rows += [("evidence", evidence_text(run.period.evidence))] if machine.driven else []
            if not math.isnan(verdict.exponent):
                shown = parts.with_error(verdict.exponent, verdict.error)
                rows += [("largest exponent", f"{shown} {machine.rate}")]
            elif verdict.unknown:
                rows += [("largest exponent", verdict.unknown)]
            if verdict.periodic is not None:
                texts = [complex_text(one) for one in verdict.periodic.multipliers[:_MOST]]
                numbers = ", ".join(one.translate(_TOGETHER) for one in texts)
                more = ", …" if len(verdict.periodic.multipliers) > _MOST else ""
                rows += [("multipliers", f"{numbers}{more} ({verdict.stability})")]
        lines = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{html.escape(value)}</td></tr>"
            for name, value in rows
        )
        shown = html.escape(label).replace("-inf", "-∞")
        self.text.text = f'<div class="label">{shown}</div><table>{lines}</table>'


# Ends of runs that need no more words.
_ENDS = ("completed", "rest")
# Multipliers that are written out; they come by descending modulus.
_MOST = 6
_GROWTH = {
    EvidenceKind.GROWTH_BOUNDED: "no return; perturbations do not grow",
    EvidenceKind.GROWTH_EXPONENTIAL: "no return; perturbations grow exponentially",
}
# Keeps the parts of a complex number on one line, also after a minus sign.
_TOGETHER = str.maketrans({" ": "\N{NO-BREAK SPACE}", "-": "-\N{WORD JOINER}"})
_SHRINKS = (
    "the sections draw together by ",
    "the distance between sections shrinks by the factor ",
)


def evidence_text(evidence: Evidence) -> str:
    """Return what a label stands on in words; a growth with the digits that its error leaves."""
    if evidence.kind == EvidenceKind.CONVERGING:
        # The text has the rate, and how much further a run went to see it.
        return str(evidence).replace(*_SHRINKS)
    growth, error = evidence.growth, evidence.growth_error
    if (
        evidence.kind not in _GROWTH
        or growth is None
        or error is None
        or not evidence.growth_periods
    ):
        return str(evidence)
    measured = f"{parts.with_error(growth, error)} per drive period over {evidence.growth_periods}"
    return f"{_GROWTH[evidence.kind]}: {measured}"


def complex_text(value: complex) -> str:
    """Return a multiplier in words: four digits, the imaginary part where there is one."""
    real, imag = float(value.real), float(value.imag)
    if imag == 0.0:
        return f"{real:.4g}"
    return f"{real:.4g} {'+' if imag > 0.0 else '-'} {abs(imag):.4g}i"
