"""What of the points of a branch is drawn: of a System, and of a structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from ..arguments import reject
from ..orbits import Bifurcation, Branch, Piece
from ..orbits.branch import AT_IMPACTS, AT_SECTIONS
from ..orbits.structure_piece import AT_STOP_SECTIONS, AT_STOPS, StructurePiece
from ..scales import Units, in_si
from ..structure import Structure
from .axis_names import SECTIONS, at_drive_phase
from .coordinates import Combination, in_section
from .given import chosen, usual_value
from .parameter_units import piece_axis, piece_factors, with_unit
from .structure_diagram import value_label
from .units import AxisUnits

Array = NDArray[np.float64]
Section = Literal["impact", "stroboscopic"]

# What has a number for each coordinate of a structure.
_WIDE = ("q", "v", "v_pre", "v_post")

# The columns of `PeriodicMotion.impacts` that hold the values just before an impact.
_COLUMNS = {"v1": "v1_pre", "v2": "v2_pre"}


@dataclass(frozen=True)
class SystemView:
    """What of a section is drawn, the factor of the parameter, and the names on the axes."""

    section: str
    value: str
    factor: float
    parameter_label: str
    value_label: str
    is_si: bool

    @classmethod
    def checked(
        cls,
        branches: Sequence[Branch],
        section: str,
        value: Any,
        coordinate: Any,
        units: Units | None,
    ) -> Self:
        """Check the arguments of ``vi.plot.branches``."""
        if coordinate != 0:
            reject("coordinate", coordinate, "0: only structures have several; give value")
        value = _value(branches, section, value)
        is_si = in_si(units)
        held: list[Any] = [piece.system for branch in branches for piece in branch.pieces]
        # Without a point there is nothing to scale.
        name = branches[0].parameter
        factor, text = piece_axis(name, held[0], is_si=is_si) if held else (1.0, name)
        label = SECTIONS[section][value]
        if section == "stroboscopic":
            phases = {system.phase for system in held}
            one = len(phases) == 1 and name != "phase"
            label = at_drive_phase(label, phases.pop() if one else None)
        return cls(section, value, factor, text, with_unit(label, value, is_si=is_si), is_si)

    @property
    def name(self) -> str:
        """What is drawn, as it is asked for."""
        return self.value

    def heights(self, piece: Piece) -> Array:
        """Return what is drawn of a piece, a column for each impact or section."""
        impacts = self.section == "impact"
        heights = piece.at_impacts(self.value) if impacts else piece.at_sections(self.value)
        return heights * piece_factors(piece, self.value)[:, None] if self.is_si else heights

    def heights_of(self, found: Bifurcation) -> Array:
        """Return what is drawn of a bifurcation."""
        motion = found.motion
        heights: Array = (
            motion.impacts[_COLUMNS.get(self.value, self.value)]
            if self.section == "impact"
            else motion.sections[:, AT_SECTIONS.index(self.value)]
        )
        return (
            heights * AxisUnits.of("SI", motion.system).factor(self.value)
            if self.is_si
            else heights
        )


@dataclass(frozen=True)
class StructureView:
    """As `SystemView`, of structures."""

    section: str
    value: str
    coordinate: Combination | None
    factor: float
    parameter_label: str
    value_label: str

    @classmethod
    def checked(
        cls,
        branches: Sequence[Branch],
        section: str,
        value: Any,
        coordinate: Any,
        units: Units | None,
    ) -> Self:
        """Check the arguments of ``vi.plot.branches``."""
        systems: list[Any] = [piece.system for branch in branches for piece in branch.pieces]
        if not all(isinstance(system, Structure) for system in systems):
            reject("branches", branches, "branches of structures, or of Systems")
        if units is not None:
            reject("units", units, "None: a structure has the units of its numbers")
        known = AT_STOPS if section == "impact" else AT_STOP_SECTIONS
        smallest = min(systems, key=lambda system: system.coordinates)
        wide = tuple(name for name in known if name in _WIDE)
        narrow = tuple(name for name in known if name not in wide)
        value, part = in_section(
            value, coordinate, smallest, wide=wide, narrow=narrow, usual=known[0]
        )
        factor, text = piece_axis(branches[0].parameter, systems[0], is_si=False)
        label = value_label(section, value, part)
        return cls(section, value, part, factor, text, label)

    def heights(self, piece: Piece) -> Array:
        """Return what is drawn of a piece, a column for each impact or section."""
        assert isinstance(piece, StructurePiece)
        of = piece.at_impacts if self.section == "impact" else piece.at_sections
        if self.coordinate is None:
            return of(self.value)
        terms = self.coordinate.terms
        columns = np.stack([of(self.value, place) for _, place in terms], axis=-1)
        return Combination(tuple((sign, k) for k, (sign, _) in enumerate(terms))).of(columns)

    @property
    def name(self) -> str:
        """What is drawn, as it is asked for."""
        return self.value if self.coordinate is None else self.coordinate.name(self.value)

    def heights_of(self, found: Bifurcation) -> Array:
        """Return what is drawn of a bifurcation."""
        motion = found.motion
        piece = StructurePiece(
            system=motion.system,
            parameter=found.parameter,
            itinerary=motion.itinerary,
            values=np.array([found.value]),
            nodes=motion.nodes[None],
            multipliers=motion.multipliers[None],
        )
        heights: Array = self.heights(piece)[0]
        return heights


View = SystemView | StructureView


def _value(branches: Sequence[Branch], section: str, value: Any) -> str:
    """Return what of a section is drawn: as asked for, or the usual."""
    if value is None:
        usual = {usual_value(section, branch) for branch in branches}
        return usual.pop() if len(usual) == 1 else "x1"
    return chosen("value", value, AT_IMPACTS if section == "impact" else AT_SECTIONS)
