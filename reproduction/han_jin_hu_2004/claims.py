"""What the paper says of its named motions beside what the simulation finds.

A verdict is computed: `reproduced` if the labels agree; otherwise an experiment of `evidence` must
decide. `corrected`: the motion exists, but not where the paper puts it; `refuted`: what the paper
says does not happen; `open`: the experiment does not decide.
"""

import itertools
import json
import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from typing import Any, Literal

import numpy as np

from vibroimpact import Run

from . import evidence
from .evidence import Coexistence
from .parameters import INITIAL, KEEP, PERIODS, Motion

Verdict = Literal["reproduced", "corrected", "refuted", "open"]

# Growth of a perturbation of 1e-9 within 600 periods: on a chaotic orbit it grows to the size of
# the attractor, on a periodic or quasi-periodic one it stays near its size after the transient.
_SEPARATED = 1e6
_BOUNDED = 1e3
# Sections one period apart that differ by less are those of a periodic motion, in the long run.
_SETTLED = 1e-9
# With one of these labels among the motions from other starts, one of them may be chaotic.
_CHAOS_OR_LIKE_IT = frozenset({"chaotic", "quasi-periodic", "unresolved"})
# What the end of an id says of its figure.
_PARTS = {
    "quoted": "quoted motion",
    "by (45)": "stability by eq. (45)",
    "low": "low frequencies",
}
# Of the table for the terminal: its width, the columns that may be broken, what is between columns.
_COLUMNS, _PAPER, _FOUND, _GAP = 100, 1, 2, "  "


@dataclass(frozen=True)
class Claim:
    """One line of claims.json.

    `residual` is that of `PeriodReport`, or of `PeriodicMotion` for an algebraic solution, None
    without a period; `figure` is None for a conclusion. `decided_by` is the evidence on which the
    verdict depends, `details` are further numbers, perhaps none; `theorem` says what is proved.
    """

    id: str
    figure: int | None
    source: str
    paper_says: str
    found: str
    residual: float | None
    reference: dict[str, Any]
    verdict: Verdict
    decided_by: str
    details: str
    command: str
    theorem: str = ""

    @property
    def evidence(self) -> str:
        """The whole evidence."""
        shown = f"theorem: {self.theorem}" if self.theorem else ""
        return "; ".join(filter(None, (self.decided_by, self.details, shown)))


def references() -> dict[str, dict[str, Any]]:
    """Return the high-precision reference of each motion, by id (reference.json)."""
    text = files(__package__).joinpath("reference.json").read_text(encoding="utf-8")
    motions: dict[str, dict[str, Any]] = json.loads(text)["motions"]
    return motions


def evaluate(
    motion: Motion,
    run: Run,
    *,
    coexistence: Coexistence | None = None,
    long_run: Run | None = None,
) -> Claim:
    """Compare one motion with the paper and with the reference.

    Parameters
    ----------
    motion : Motion
        What the paper says.
    run : Run
        The motion from the paper's initial state over `PERIODS` drive periods, `KEEP` kept.
    coexistence : Coexistence, optional
        Motions reached from other starts, for a motion whose label is not the paper's: by
        `coexisting`, where the paper says "chaotic" by `coexisting_chaos`.
    long_run : Run, optional
        The motion over a longer time, for a claim of chaos or about impacts that stop; for the
        latter it must have kept all impacts.

    Raises
    ------
    KeyError
        If there is no reference for the motion.
    """
    reference = references()[motion.id]
    found, more = run.label, ""
    if motion.paper_says == "chaotic":
        verdict, text, more = _judge_growth(motion, found, long_run, coexistence)
    elif long_run is not None:
        verdict, text, more = _judge_counts(long_run)
        found = f"{long_run.impact_count} impacts by period {evidence.drive_periods(long_run)}"
    elif found == motion.paper_says:
        verdict, text = "reproduced", "the same label from the paper's start"
    elif coexistence is not None:
        verdict, text = _judge_coexistence(coexistence)
    else:
        verdict, text = "open", "another label, and no other start was tried"
    period = run.period
    return Claim(
        id=motion.id,
        figure=motion.figure,
        source=motion.source,
        paper_says=motion.paper_says,
        found=found,
        residual=period.residual if period.m is not None else None,
        reference=reference,
        verdict=verdict,
        decided_by=text,
        details="; ".join(filter(None, (more, _comparison(run, reference)))),
        command=_command(motion),
    )


def _judge_growth(
    motion: Motion, found: str, long_run: Run | None, coexistence: Coexistence | None
) -> tuple[Verdict, str, str]:
    """Judge "chaotic": from the paper's start by label and growth, else from other starts.

    That the motion from the paper's start is another one needs two things: a nearby orbit stays
    near, and the motion settles on a period. Little growth alone could be weak chaos.
    """
    growth = evidence.amplification(motion.system, periods=PERIODS)
    largest = float(growth.max(initial=0.0))
    decisive = (
        f"a perturbation grows {largest:.2g}-fold within {len(growth)} periods (chaos needs "
        f"{_SEPARATED:.0e})"
    )
    text = (
        f"the perturbation is of {evidence.PERTURBATION:g}, and {float(growth[-1]):.2g}-fold after "
        f"{len(growth)} periods"
    )
    settled = False
    if long_run is not None:
        period = long_run.period
        after = f"{long_run.label} after {evidence.drive_periods(long_run)} periods"
        if period.m is not None:
            settled = period.residual < _SETTLED
            after += f" with a residual of {period.residual:.1e}"
        decisive = f"{after}, and {decisive}"
    decisive = f"from the paper's start {decisive}"
    if found == "chaotic" and largest > _SEPARATED and not settled:
        return "reproduced", decisive, text
    other = found != "chaotic" and largest < _BOUNDED and settled
    if coexistence is None:
        return "open", decisive, f"{text}; no other start was tried"
    decisive += (
        f", while {coexistence.share} random starts are on a chaotic motion after "
        f"{evidence.START_PERIODS} periods"
    )
    run, spectrum = coexistence.run, coexistence.spectrum
    if run is not None and spectrum is not None:
        decisive += f", its largest exponent {spectrum.exponents[0]:.2g} +- {spectrum.error[0]:.1g}"
        start = ", ".join(map(repr, run.initial))
        text += (
            f"; the first chaotic motion starts from ({start}), and its exponent is measured over "
            f"{spectrum.time / motion.system.drive_period:.0f} periods"
        )
    verdict: Verdict = "open"
    if other and coexistence.is_chaotic:
        verdict = "corrected"
    elif other and _CHAOS_OR_LIKE_IT.isdisjoint(coexistence.labels):
        verdict = "refuted"
    return verdict, decisive, text


def _judge_counts(run: Run) -> tuple[Verdict, str, str]:
    """Judge "impacts stop" by whether contacts come again and again.

    Counts beyond some 2,000 periods depend on rounding: the motion is sensitive until impacts die
    out geometrically. That none of them is the last one does not depend on it (`recurrence`).
    """
    counts = evidence.impacts_by(run)
    listed = ", ".join(f"{count} by {horizon}" for horizon, count in counts.items())
    text = f"impacts by drive period: {listed}"
    repeats, wait = evidence.recurrence(run.system), evidence.longest_wait(run)
    again = repeats is not None and wait <= repeats
    if again:
        text += (
            f", and no wait for a contact exceeds {repeats} periods, when free motion repeats, so "
            "that no impact can be the last"
        )
    more = (
        f"counts beyond some 2,000 periods depend on the last bits; {len(run.grazes)} grazes; "
        f"the longest wait for a contact is {wait:.4g} periods"
    )
    if run.stop_reason != "completed":
        return "open", text, more
    if len(set(counts.values())) == 1:
        return "reproduced", text, more
    refuted = again or all(np.diff(list(counts.values())) > 0)
    return ("refuted" if refuted else "open"), text, more


def _judge_coexistence(coexistence: Coexistence) -> tuple[Verdict, str]:
    """Judge a period by whether some other start leads to it."""
    text = (
        f"{coexistence.share} random starts settle on {coexistence.wanted} "
        f"within {evidence.START_PERIODS} periods"
    )
    if coexistence.run is None:
        return "open", text
    start = ", ".join(f"{value:.6g}" for value in coexistence.run.initial)
    return "corrected", f"{text}, the first of them from ({start})"


def _comparison(run: Run, reference: Mapping[str, Any]) -> str:
    """Say how counts and final state compare with the reference."""
    end = run.final_state
    state = np.array([end.x1, end.v1, end.x2, end.v2])
    error = float(np.abs(state - np.array(reference["state"], dtype=float)).max())
    periods = evidence.drive_periods(run)
    text = (
        f"{run.impact_count} impacts in {periods} periods, {len(run.impacts)} in the last "
        f"{KEEP} (reference {reference['impacts']}, {reference['impacts_last_100']}); "
        f"final state {error:.1g} from the reference"
    )
    return f"{text} ({reference['note']})" if "note" in reference else text


def _command(motion: Motion) -> str:
    """Return the command that computes the label again."""
    flags = [
        f"--{name.replace('_', '-')} {value!r}"
        for name, value in motion.system.to_dict().items()
        if isinstance(value, float) and value != 0.0
    ]
    initial = " ".join(f"{value:g}" for value in INITIAL)
    return (
        f"vibroimpact simulate {' '.join(flags)} --initial {initial} "
        f"--periods {PERIODS} --keep {KEEP}"
    )


def to_json(claims: Sequence[Claim]) -> str:
    """Return the content of claims.json."""
    return json.dumps([asdict(claim) for claim in claims], indent=1, allow_nan=False) + "\n"


def table(claims: Sequence[Claim]) -> str:
    """Return a short table for the terminal; what is long goes on below."""
    heads = ("figure or statement", "paper", "found", "residual", "verdict")
    rows = [
        (_title(claim), claim.paper_says, claim.found, _number(claim.residual), claim.verdict)
        for claim in claims
    ]
    widths = [max(len(row[column]) for row in (heads, *rows)) for column in range(len(heads))]
    rest = _COLUMNS - len(_GAP) * (len(heads) - 1)
    rest -= sum(width for column, width in enumerate(widths) if column not in (_PAPER, _FOUND))
    widths[_PAPER] = min(widths[_PAPER], max(rest // 2, rest - widths[_FOUND]))
    widths[_FOUND] = min(widths[_FOUND], rest - widths[_PAPER])
    lines: list[str] = []
    for row in (heads, tuple("-" * width for width in widths), *rows):
        cells = [textwrap.wrap(text, width) for text, width in zip(row, widths, strict=True)]
        for texts in itertools.zip_longest(*cells, fillvalue=""):
            padded = [text.ljust(width) for text, width in zip(texts, widths, strict=True)]
            lines.append(_GAP.join(padded).rstrip())
    return "\n".join(lines)


def to_markdown(claims: Sequence[Claim]) -> str:
    """Return the content of claims.md."""
    heads = (
        *("figure or statement", "paper says", "found", "residual"),
        *("reference", "verdict", "decided by"),
    )
    lines = [
        "# The paper's named motions, recomputed",
        "",
        "Paper: Han, Jin & Hu (2004). Labels are m-n: m drive periods and n impacts per orbit. The",
        f"residual is the largest change of the stroboscopic state over m periods after {PERIODS}",
        "drive periods, of an algebraic solution that of its conditions of periodicity: it tells",
        "how far a motion has settled, and no verdict rests on it, but on what the last column",
        "names, the start of its evidence. The reference was computed in 400-bit arithmetic, that",
        "of a conclusion and of Figs. 2 and 3 as the evidence says. Verdicts: reproduced, as the",
        "paper says; corrected, something else from the stated start, but what the paper shows",
        "coexists; refuted, the evidence speaks against the paper; open, it does not decide.",
        "",
        f"| {' | '.join(heads)} |",
        f"|{'---|' * len(heads)}",
    ]
    for claim in claims:
        lines.append(
            f"| {_title(claim)} | {claim.paper_says} | {claim.found} | {_number(claim.residual)} "
            f"| {claim.reference['label']} | {claim.verdict} | {claim.decided_by} |"
        )
    for claim in claims:
        lines += [
            "",
            f"## {_title(claim)}: {claim.verdict}",
            "",
            f"{claim.evidence[0].upper()}{claim.evidence[1:]}.",
            "",
            f"Source: {claim.source}. Command:",
            "",
            f"    {claim.command}",
        ]
    return "\n".join(lines) + "\n"


def _title(claim: Claim) -> str:
    """Return how a reader names a claim: 5a is Fig. 5(a), conclusion-1 Conclusion 1."""
    if claim.figure is None:
        return claim.id.capitalize().replace("-", " ")
    panel, *part = re.split(r"[ -]", claim.id, maxsplit=1)
    figure = re.sub(r"(?<=\d)([a-z])$", r"(\1)", panel)
    return ", ".join([f"Fig. {figure}", *(_PARTS[each] for each in part)])


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.1e}"
