"""Branches of periodic motions over a parameter, stable and unstable, with their bifurcations.

A branch is followed by pseudo-arclength continuation with its sequence of legs held fixed, so that
every condition of the motion is smooth (orbits page). Where a condition that makes it a motion
reaches zero the branch meets a border: a flight grazes, an impact changes its regime, chatter
becomes incomplete, a contact phase ends another way. The border is located, and where the orbit
goes on it goes on with another sequence of legs: both sequences have the border's orbit in common.
"""

from collections.abc import Callable, Sequence
from typing import Any, Unpack, overload

from ..arguments import reject
from ..interruption import interruptible
from ..keyword_types import Ranges, completing
from ..made import made_from, value_of
from ..scales import Units
from ..structure_motion import StructureOrbit
from .bifurcation import Bifurcation
from .branch import Branch
from .call_types import FollowCall, SwitchCall
from .following import Settings, check_ways, followed
from .friction import need_friction, with_friction
from .kinds import BifurcationKind
from .motion import PeriodicMotion
from .ranges import MOTIONS, begin, one_range
from .resegment import Crossing
from .structure import need_impacts
from .switching import crossing_start, doubled_start


@overload
def follow_motion(
    motion: PeriodicMotion, *, system: None = ..., **keywords: Unpack[FollowCall]
) -> Branch: ...


@overload
def follow_motion(motion: StructureOrbit, *, system: None = ..., **keywords: Any) -> Branch: ...


@overload
def follow_motion(motion: PeriodicMotion, *, units: Units, **keywords: Any) -> Branch: ...


@overload
def follow_motion(
    motion: PeriodicMotion | StructureOrbit, *, system: Callable[..., Any], **keywords: Any
) -> Branch: ...


@interruptible
@completing(Ranges)
def follow_motion(
    motion: PeriodicMotion | StructureOrbit,
    *,
    system: Callable[..., Any] | None = None,
    units: Units | None = None,
    both: bool = True,
    direction: int = 1,
    step: float | None = None,
    max_step: float = 0.05,
    max_points: int = 2000,
    stop_at: str | Sequence[str] = (),
    virtual: bool = False,
    **parameter: tuple[float, ...],
) -> Branch:
    """Follow a periodic motion over a parameter, stable or not, with its bifurcations.

    Parameters
    ----------
    motion
        Where to start: a PeriodicMotion of a System, or a StructureOrbit whose only events are
        impacts; ``run.refine()`` gives both.
    system
        A function that makes the system or structure from the number that varies, such as a
        stiffness: ``lambda stiffness: vi.System.from_physical(..., stiffness=stiffness)``, or
        ``lambda stiffness: structure.replace(stiffness=[[stiffness]])``. Derivatives of a System by
        that number are those by its own parameters times differences of the function; of a
        structure they are differences of the equations.
    units
        ``"SI"``: what varies is a quantity of ``System.from_physical`` in its unit, such as
        ``drive_frequency`` in rad/s, with a range (low, high); the system needs ``scales``.
    both
        Follow it both ways.
    direction
        If not ``both``, the way on which the parameter first grows (1) or falls (-1).
    step
        First step, as part of the range and of the motion's size; 0.01 or ``max_step``, if that is
        smaller.
    max_step
        Largest step, in the same measure, at most 1000.
    max_points
        Cap on the points of each direction.
    stop_at
        Kinds of bifurcations at which it ends, the first that comes: ``"branch_point"``, or
        ``["branch_point", "grazing"]``.
    virtual
        Go on with the same legs beyond borders, where the solution is no motion any more.
    **parameter
        What varies, with its range: one numeric parameter of the System,
        ``drive_frequency=(1.5, 1.6)``; of a structure ``drive_frequency``, ``phase``, or ``gap``,
        ``restitution``, ``friction`` of all stops or of one, ``gap_0=(0.2, 0.4)``. With ``system``
        the argument of the function, with the value at which it makes the motion's system between
        the ends: ``stiffness=(30, 40, 50)``. Where values are not allowed the branch ends as
        ``outside domain``.

    Returns
    -------
    Branch
        Pieces, bifurcations and ends. Bifurcations are located until rounding stops it, as a rule
        to 1e-12 in the parameter. A branch of motions without symmetry ends at a pitchfork, since
        the mirror images of its motions would follow.

    Raises
    ------
    ParameterError
        For bad input.
    Interrupted
        After Ctrl-C; ``.result`` is the branch so far.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> branch = vi.follow_motion(motion, drive_frequency=(1.7, 1.9))
    >>> [str(found.kind) for found in branch.bifurcations]
    ['neimark_sacker']
    """
    if not isinstance(motion, MOTIONS):
        reject("motion", motion, "a PeriodicMotion or a StructureOrbit, as run.refine() gives it")
    motion, ranges = begin(motion, system, parameter, units)
    name, bounds = one_range(motion.system, ranges)
    settings = Settings.checked(name, bounds, step, max_step, max_points, virtual, stop_at)
    check_ways(both, direction)
    if isinstance(motion, StructureOrbit):
        need_impacts(motion, name)
    value = value_of(motion.system, name)
    itinerary: Any = motion.itinerary
    nodes = motion.nodes
    if isinstance(motion, PeriodicMotion):
        need_friction(motion.system, [name])
        if name == "friction" and made_from(motion.system, [name]) is None:
            itinerary, nodes, value = with_friction(motion.system, itinerary, nodes)
    start = Crossing(itinerary=itinerary, u=nodes.ravel().copy(), p=value, tangent=None)
    return followed(motion.system, start, (-1, 1) if both else (direction,), settings)


@overload
def switch_branch(
    bifurcation: Bifurcation, *, system: None = ..., **keywords: Unpack[SwitchCall]
) -> Branch: ...


@overload
def switch_branch(bifurcation: Bifurcation, *, units: Units, **keywords: Any) -> Branch: ...


@overload
def switch_branch(
    bifurcation: Bifurcation, *, system: Callable[..., Any], **keywords: Any
) -> Branch: ...


@interruptible
@completing(Ranges)
def switch_branch(
    bifurcation: Bifurcation,
    *,
    system: Callable[..., Any] | None = None,
    units: Units | None = None,
    both: bool = True,
    direction: int = 1,
    step: float | None = None,
    max_step: float = 0.05,
    max_points: int = 2000,
    stop_at: str | Sequence[str] = (),
    **parameter: tuple[float, ...],
) -> Branch:
    """Follow the other branch that meets a branch at a period doubling or at a branch point.

    At a period doubling it is the branch of doubled motions, which begins there. At a branch point
    it is the one that crosses: of a pitchfork the two sides on which a symmetry is lost, of which
    one is the mirror image of the other.

    Parameters
    ----------
    bifurcation
        A ``period_doubling`` or a ``branch_point`` of a branch.
    system
        A function that makes the system, as in ``follow_motion``.
    units
        ``"SI"``: ranges are in SI, as in ``follow_motion``.
    both
        From a branch point follow the other branch both ways. From a period doubling there is one
        way: the other one has the same motions, with exchanged halves.
    direction
        If not ``both``, the way: 1 or -1.
    step
        First step, as in ``follow_motion``.
    max_step
        Largest step, as in ``follow_motion``.
    max_points
        Cap on the points of the branch.
    stop_at
        Kinds of bifurcations at which it ends, as in ``follow_motion``.
    **parameter
        What varies, with its range, as in ``follow_motion``; it may be another one than that of the
        bifurcation.

    Returns
    -------
    Branch
        Its first point is the bifurcation. A branch point is among its bifurcations if the branch
        goes both ways, or closes. At another pitchfork it ends: the mirror images follow there.

    Raises
    ------
    ParameterError
        For bad input, if the bifurcation is of another kind, and for a branch point where not
        exactly two branches over the parameter cross.
    Interrupted
        After Ctrl-C; ``.result`` is the branch so far.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> branch = vi.follow_motion(motion, drive_frequency=(1.5, 1.9))
    >>> doubling = branch.of_kind("period_doubling")[0]
    >>> doubled = vi.switch_branch(doubling, drive_frequency=(1.45, 1.6))
    >>> {motion.m for motion in doubled.motions}
    {1, 2}
    """
    wanted = (BifurcationKind.PERIOD_DOUBLING, BifurcationKind.BRANCH_POINT)
    if not isinstance(bifurcation, Bifurcation) or bifurcation.kind not in wanted:
        reject("bifurcation", bifurcation, f"a Bifurcation of the kind {' or '.join(wanted)}")
    bifurcation, ranges = begin(bifurcation, system, parameter, units)
    varies = bifurcation.motion.system
    name, bounds = one_range(varies, ranges)
    settings = Settings.checked(name, bounds, step, max_step, max_points, stop_at=stop_at)
    check_ways(both, direction)
    if bifurcation.kind is BifurcationKind.PERIOD_DOUBLING:
        return followed(varies, doubled_start(bifurcation, name), (direction,), settings)
    start, here = crossing_start(bifurcation, name, settings.size)
    return followed(varies, start, (-1, 1) if both else (direction,), settings, here)
