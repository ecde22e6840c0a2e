"""What no computation with this model can decide, with the reason; nothing is left out."""

from ..parameters import TRANSITIONS, Transition
from .diagrams import NO_IMPACTS, diagram, kinds
from .statement import STATEMENTS, Finding, Statement, stated


def _no_data(figure: int) -> str:
    """Say why the look of a figure is left open, and which statements on it are judged."""
    judged = [
        name for name, item in STATEMENTS.items() if item.figure == figure and not item.drawn_by
    ]
    return (
        "only the text of the paper was at hand, which gives neither data nor ranges of the axes, "
        "so that points cannot be compared; what it says of the figure in words is judged in "
        f"{', '.join(judged)}"
    )


def _undecided(id: str, place: str, says: str, why: str) -> Statement:
    return stated(id, place, says)(lambda: Finding(why, "open", why))


def _figure(figure: int, panels: str) -> Statement:
    @stated(
        f"fig{figure}-look",
        f"Fig. {figure}{panels}",
        "its points and curves, as drawn",
        figure=figure,
        drawn_by=f"vibroimpact reproduce --figures {figure} --out figures",
    )
    def judge() -> Finding:
        return Finding("drawn anew", "open", _no_data(figure))

    return judge


def _panel(transition: Transition) -> Statement:
    name = transition.id if transition.panel else f"{transition.id}ab"
    panel = f"({transition.panel})" if transition.panel else "(a), (b)"

    @stated(
        f"fig{name}-look",
        f"Fig. {transition.figure}{panel}",
        "both sections over omega, as drawn",
        figure=transition.figure,
        slow=True,
        drawn_by=f"vibroimpact reproduce --figures {transition.figure} --out figures",
    )
    def judge() -> Finding:
        found, made = kinds(transition.id), diagram(transition.id)
        impacts = found != NO_IMPACTS
        periodic = float(((made.m > 0) & impacts).mean())
        return Finding(
            f"drawn anew; periodic {periodic:.0%}, no impacts {1.0 - impacts.mean():.0%}",
            "open",
            f"of {len(found)} frequencies from {made.parameter[0]:g} to {made.parameter[-1]:g} "
            f"{periodic:.0%} are periodic with impacts, {(found == 'chaotic').mean():.0%} chaotic, "
            f"{1.0 - impacts.mean():.0%} have no impacts; {_no_data(transition.figure)}",
        )

    return judge


DURATION = _undecided(
    "impact-duration",
    "section 1",
    "a normal impact of metals takes 1e-5 to 1e-3 s",
    "impacts of rigid bodies have no duration: it is a statement on material",
)
EXPERIMENT = _undecided(
    "instantaneous-impact",
    "section 2, on ref. [30]",
    "oblique impacts are instantaneous unless they are very oblique or very slow",
    "a statement on deformable bodies, from an experiment; the model takes it as given",
)
VELOCITY = _undecided(
    "restitution-velocity",
    "section 2",
    "restitution falls from 1 to a constant as the approach velocity grows",
    "a statement on material; here, as in the paper's formulas, r is a given number",
)
VERIFIED = _undecided(
    "experiments",
    "section 2.2, on ref. [30]",
    "experiments confirm (14), (16), (18) and (19)",
    "the experiments are not in the paper; how far the formulas hold is judged above, one by one",
)
FIG2, FIG3 = _figure(2, ""), _figure(3, "")
FIG5, FIG6 = _figure(5, "(a) to (c)"), _figure(6, "(a) to (c)")
FIG9, FIG10 = _figure(9, "(1) to (4)"), _figure(10, "(a), (b)")
PANELS = {transition.id: _panel(transition) for transition in TRANSITIONS}
