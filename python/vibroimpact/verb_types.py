"""Types in the signatures of methods that `verbs` provides; for type checkers only."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .orbits.branch import Branch as Branch
    from .orbits.curve_problem import CurveProblem as CurveProblem
    from .orbits.found import NotFound as NotFound
    from .orbits.motion import PeriodicMotion as PeriodicMotion
    from .plot.film import Animation as Animation
    from .run_in_si import RunInSI as RunInSI
    from .sensitivity import Sensitivity as Sensitivity
