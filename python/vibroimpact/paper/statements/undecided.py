"""What no computation with this model can decide, with the reason; nothing is left out."""

from ..parameters import TRANSITIONS, Transition
from .diagrams import NO_IMPACTS, diagram, kinds
from .statement import Finding, Statement, stated

NO_DATA = (
    "the paper gives neither data nor ranges of the axes, so that points cannot be compared; "
    "what it says of the figure in words is judged above"
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
        return Finding("drawn anew", "open", NO_DATA)

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
            f"{1.0 - impacts.mean():.0%} have no impacts; {NO_DATA}",
        )

    return judge


DURATION = _undecided(
    "impact-duration",
    "section 1",
    "a normal impact of metals takes 1e-5 to 1e-3 s",
    "impacts of rigid bodies have no duration: it is a statement on material",
)
SYNCHRONY = _undecided(
    "force-maxima",
    "section 1, on refs. [27] to [29]",
    "tangential and normal force reach their maxima together if slip keeps its direction",
    "observed in experiments of others; a rigid impact has impulses, no course of the forces",
)
MEASURED = _undecided(
    "instantaneous-friction",
    "section 1",
    "the coefficient of instantaneous friction is hard to define and to measure",
    "a judgement on measurements",
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
CLOSED_FORMS = _undecided(
    "no-closed-forms",
    "section 2",
    "for most oblique-impact systems no closed relation of the velocities can be found",
    "a statement on all other systems",
)
VERIFIED = _undecided(
    "experiments",
    "section 2.2, on ref. [30]",
    "experiments confirm (14), (16), (18) and (19)",
    "the experiments are not in the paper; how far the formulas hold is judged above, one by one",
)
NOT_ANALYTIC = _undecided(
    "no-analytic-solution",
    "sections 3.2.1 and 5",
    "(35) has no analytical solution; such solutions exist under special conditions only",
    "that no formula exists is no matter of computation; numerically all solutions are found, each "
    "proved by intervals, with damping and both forces as well",
)
DIFFICULT = _undecided(
    "difficult",
    "section 4.1",
    "period n-1 motions in the region of Figs. 2 and 3 are very difficult to realize",
    "how difficult is difficult is not said; what happens if parameters err is judged above",
)
FIG1 = _undecided(
    "fig1",
    "Fig. 1",
    "a sketch of the system",
    "it defines the model; there is nothing to compute",
)
FIG2, FIG3 = _figure(2, ""), _figure(3, "")
FIG5, FIG6 = _figure(5, "(a) to (c)"), _figure(6, "(a) to (c)")
FIG9, FIG10 = _figure(9, "(1) to (4)"), _figure(10, "(a), (b)")
PANELS = {transition.id: _panel(transition) for transition in TRANSITIONS}
