"""The page beside the figures that says what each of them shows."""

from collections.abc import Sequence
from pathlib import Path

NAME = "index.md"
REGIMES = "-regimes"
SHOWN = {
    "fig2": "which period 1-1 motions exist and are stable: left as the paper says, right as it is",
    "fig3": "the same for period 2-1 motions",
    "fig4": "angle over drive frequency, without friction and damping",
    "fig4-enlarged": "the windows of periodic motions in Fig. 4",
    "fig5": "the 1-1 and 2-1 motions: time histories and phase portraits",
    "fig6": "the 1-2, 2-4 and 8-6 motions: time histories and phase portraits",
    "fig7": "angle over drive frequency, with damping and two drives",
    "fig7c-enlarged": "low frequencies of Fig. 7(c): chatter, and the time in sustained contact",
    "fig8": "angle over drive frequency, with friction",
    "fig8a-enlarged": "a part of Fig. 8(a) and its windows of periodic motions",
    "fig9": "four motions and what coexists with them; what tells the last two apart",
    "fig10": "sporadic impacts: gap and displacements, and how the impacts go on",
    "impact-regimes": "what an impact does over angle and velocity ratio",
    "impact-incremental": "impacts in closed form against many small steps of the impulse",
    "orbits-coexistence": "the 4-5 and the 6-7 motion of Fig. 9(3) over drive frequency, and which "
    "of them random starts reach",
    "orbits-multipliers": "Floquet multipliers along both branches",
    "orbits-portraits": "both motions side by side",
    "islands": "borders of the islands of stability over drive frequency and moment amplitude",
}
"""What a page shows, by the name of its file."""


def contents(files: Sequence[Path]) -> str:
    """Return the page: a line for every figure, and where its claims are.

    A page whose points have the colours of the impact regimes is named beside the one in black.
    """
    formats = sorted({path.suffix for path in files})
    stems = list(dict.fromkeys(path.stem for path in files))
    lines = ["# Figures", "", "What is judged by them is in [claims.md](claims.md).", ""]
    lines += ["| figure | by impact regime | what it shows |", "|---|---|---|"]
    for stem in stems:
        if stem.endswith(REGIMES) and stem not in SHOWN:
            continue
        colored = f"{stem}{REGIMES}"
        beside = _links(colored, formats) if colored in stems else ""
        lines.append(f"| {_links(stem, formats)} | {beside} | {SHOWN[stem]} |")
    return "\n".join(lines) + "\n"


def _links(stem: str, formats: Sequence[str]) -> str:
    first, *others = formats
    more = "".join(f" [{suffix[1:]}]({stem}{suffix})" for suffix in others)
    return f"[{stem}]({stem}{first}){more}"
