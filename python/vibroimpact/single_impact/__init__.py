"""All period n-1 motions without friction, by interval arithmetic (orbits page).

One impact in n drive periods leaves an algebraic problem in one angle. Its roots are isolated in
intervals with outward rounding, so that none is missed and none counted twice.
"""

from .motion_map import motion_map
from .motions import periodic_motions
from .results import MotionMap, PeriodicMotions, Undecided

__all__ = ["MotionMap", "PeriodicMotions", "Undecided", "motion_map", "periodic_motions"]
