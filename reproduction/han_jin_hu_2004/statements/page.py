"""docs/claims.md from the claims: a table for each part of the paper, then the evidence."""

from collections.abc import Mapping

from ..claims import Claim, Verdict
from . import GROUPS, STATEMENTS

WORDS: dict[Verdict, str] = {
    "reproduced": "reproduced",
    "corrected": "reproduced with correction",
    "refuted": "refuted",
    "open": "not decided",
}
"""The verdicts in words."""

_INTRODUCTION = """\
# The paper's claims

Every statement of W. Han, D. P. Jin, H. Y. Hu, *Dynamics of an oblique-impact vibrating system of
two degrees of freedom* (2004), what was computed for it, and the verdict. Statements are in our
words; the abstract repeats what other sections say, and is judged with them. No verdict is typed
in: `make claims`, which is `vibroimpact claims --markdown docs/claims.md`, computes them all and
writes this page.

| verdict | meaning | statements |
|---|---|---|
{counts}
{total}

How far the verdicts go:

- A number counts as reproduced if it agrees to its printed digits, a formula if it agrees to
  rounding with something computed otherwise, a label m-n if it is the same from the paper's start.
- The paper gives no data, and no ranges of axes. Words like "most" or "larger" are judged by counts
  over grids of ours, "near" as within 0.1 of a frequency. "Easily" is at more than 20%,
  "ubiquitous" at more than 50%, "strict" and "very difficult" at less than 2% (refuted from 20%
  on), "mainly" at more than 90%; the evidence below gives the counts.
- A motion that is observed is judged where the paper names a frequency of it; elsewhere any
  frequency will do.
- Only the text of the paper was at hand, not its pictures: how they look is not decided.
- Corrections are explained with the [errata](theory.md#8-errata-of-the-paper), E1 to E15.
- A *theorem*: the motions that the computation found are proved in ball arithmetic, existence,
  order of impacts and stability, for the parameters as doubles ([how](proofs.md)). It needs
  python-flint; without it the mark is left out. That a motion is reached from the paper's start,
  and that other motions are chaotic, is not proved.
- Under the impact law as printed some motions are lost because its friction drives the slip where
  sin theta < 0. The evidence says where this bears on a verdict.
- Counts and states that rest on chaotic motions, or on undamped ones over thousands of drive
  periods (Fig. 10), change with the last bits of a computation: a little from machine to machine
  and from version to version.

Each command prints its statement with the finding, the verdict and the evidence; those of figures
as a whole draw them. All statements take some two minutes on two cores.
"""


def to_markdown(claims: Mapping[str, Claim]) -> str:
    """Return the page.

    Parameters
    ----------
    claims
        Claims by the ids of their statements: one for each of `STATEMENTS`.
    """
    meanings: dict[Verdict, str] = {
        "reproduced": "as the paper says",
        "corrected": "holds once it is put right as stated",
        "refuted": "the evidence speaks against it",
        "open": "no computation with this model can tell, for the reason given",
    }
    verdicts = [claims[name].verdict for name in STATEMENTS]
    counts = "\n".join(
        f"| {WORDS[verdict]} | {meaning} | {verdicts.count(verdict)} |"
        for verdict, meaning in meanings.items()
    )
    total = f"| all | | {len(verdicts)} |"
    lines = [_INTRODUCTION.format(counts=counts, total=total)]
    for title, statements in GROUPS.items():
        lines += [
            f"## {title}",
            "",
            "| statement | place | computed | verdict | command |",
            "|---|---|---|---|---|",
            *(row(claims[statement.id]) for statement in statements),
            "",
        ]
    lines += ["## The evidence", ""]
    for name in STATEMENTS:
        if claims[name].evidence != claims[name].found:
            lines.append(f"- `{name}`: {_cell(claims[name].evidence)}.")
    return "\n".join(lines) + "\n"


def row(claim: Claim) -> str:
    """Return a claim's row of the table."""
    statement = STATEMENTS[claim.id]
    verdict = WORDS[claim.verdict]
    if statement.page and claim.verdict != "reproduced":
        verdict = f"[{verdict}]({statement.page})"
    if claim.theorem:
        verdict += ", [theorem](proofs.md)"
    cells = (
        statement.says,
        statement.place,
        claim.found,
        verdict,
        f"`{statement.command}`",
    )
    return f"| {' | '.join(map(_cell, cells))} |"


def _cell(text: str) -> str:
    """Return a text as a cell of a table shows it letter by letter; links and code stay."""
    marks = "|" if "](" in text or "`" in text else "|*<_"
    return "".join(f"\\{letter}" if letter in marks else letter for letter in text)


def text(claim: Claim) -> str:
    """Return a claim for the terminal."""
    statement = STATEMENTS[claim.id]
    lines = [
        f"statement  {claim.paper_says}",
        f"place      {claim.source}",
        f"computed   {claim.found}",
        f"verdict    {WORDS[claim.verdict]}",
        f"evidence   {claim.evidence}",
    ]
    if claim.command != f"vibroimpact claims {claim.id}":
        lines.append(f"by hand    {claim.command}")
    if statement.page:
        lines.append(f"explained  docs/{statement.page}")
    return "\n".join(lines)


def table(claims: Mapping[str, Claim]) -> str:
    """Return one line for each claim, and counts, for the terminal."""
    width = max(map(len, claims))
    verdict_width = max(map(len, WORDS.values()))
    lines = [
        f"{name.ljust(width)}  {WORDS[claim.verdict].ljust(verdict_width)}  {claim.found}"
        for name, claim in claims.items()
    ]
    verdicts = [claim.verdict for claim in claims.values()]
    counts = ", ".join(
        f"{verdicts.count(verdict)} {word}"
        for verdict, word in WORDS.items()
        if verdict in verdicts
    )
    return "\n".join([*lines, counts])
