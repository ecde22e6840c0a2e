"""Which stops are closed, and the motion while they are.

On a closed stop g_j = g_j' = 0 and a force p_j >= 0 keeps g_j'' = 0. With the rows R of the g_i'
and the columns D of the forces, R (G z + D p) = 0 makes the forces rows times z,
p = -(R D)^-1 R G z, and the motion linear again: z' = (G - D (R D)^-1 R G) z. R D is rational, so
that a set without a solution is found exactly.

Without friction d_j = -M^-1 n_j. A stop that slides in the direction s has the force along t as
well, d = -M^-1 (n + s mu t); one that sticks has the condition t . q'' = 0 and a force +M^-1 t of
its own (theory page, section 5).

Which set: the linear complementarity problem p >= 0, g'' <= 0 on the stops with g = g' = 0, by
trial of all sets. A value that is 0 is judged by its first derivative that is not. A value enclosed
within half the digits of 0 counts as 0: a coincidence, such as that of a symmetric structure, is
beyond proof in balls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

from flint import arb, arb_mat, ctx, fmpq_mat

from ..contact import Undecided
from .flow import Generator
from .model import Structure

Kind = Literal["flight", "closed", "slide_positive", "slide_negative", "stick"]
#: Derivatives looked at before a row is taken to vanish for ever.
_DEEPEST = 4


@dataclass(frozen=True)
class Watch:
    """A row that is negative until an event: what it means and of which stop.

    `touching` derivatives of it, itself the first, vanish at the start by definition.
    """

    event: Literal["contact", "release", "stop", "slide_positive", "slide_negative"]
    stop: int
    row: arb_mat
    touching: int = 0


@dataclass(frozen=True)
class Mode:
    """The stops that are closed, and the motion with them."""

    kind: Kind
    closed: tuple[int, ...]
    generator: Generator
    watches: tuple[Watch, ...] = ()

    @property
    def direction(self) -> int:
        """Direction of slip."""
        return {"slide_positive": 1, "slide_negative": -1}.get(self.kind, 0)


@dataclass(frozen=True)
class Ended:
    """No mode: `painleve`, or `frictional_contacts`: several closed stops, with friction."""

    ending: Literal["painleve", "frictional_contacts"]


class Hold:
    """Modes of one structure at one precision."""

    def __init__(self, structure: Structure) -> None:
        self.structure = structure
        self.free = Generator(structure.free(), structure.size)
        stops = range(len(structure.stops))
        self.gaps = [structure.gap_row(j) for j in stops]
        self.rates = [structure.rate_row(j) for j in stops]
        self.rubs = [stop.tangent is not None for stop in structure.stops]
        self.flight = Mode("flight", (), self.free)
        self._sets: dict[tuple[int, ...], Mode | None] = {}
        self._slides: dict[tuple[int, int], Mode] = {}
        self._sticks: dict[int, tuple[Mode, arb_mat, arb_mat]] = {}

    def choose(self, held: Sequence[int], z: arb_mat, *, still: bool = False) -> Mode | Ended:
        """The mode that begins with g = g' = 0 on the stops `held`.

        `still`: the velocity of slip is 0 by definition.
        """
        plain = tuple(j for j in held if not self.rubs[j])
        rough = tuple(j for j in held if self.rubs[j])
        for count in range(len(plain), -1, -1):
            for chosen in combinations(plain, count):
                mode = self.closed(chosen)
                if mode is not None and self._fits(mode, held, z):
                    if rough and self._is_open(rough[0], z, still):
                        return Ended("painleve")
                    return mode
        if len(held) == 1 and rough:
            return self._rubbing(rough[0], z, still)
        if rough:
            # all others may leave while one slips or sticks
            ones = [self._rubbing(j, z, still or self._rests(j, z, rough)) for j in rough]
            fit = [one for one in ones if isinstance(one, Mode) and self._fits(one, held, z)]
            return fit[0] if len(fit) == 1 else Ended("frictional_contacts")
        raise Undecided("no set of closed stops fits")

    def pull(self, stops: Sequence[int]) -> fmpq_mat:
        """The matrix W of stops, n_i M^-1 n_j, exactly."""
        normals = [self.structure.stops[j].normal for j in stops]
        entries = [self.structure.coupling(a, b) for a in normals for b in normals]
        return fmpq_mat(len(stops), len(stops), entries)

    def closed(self, stops: tuple[int, ...]) -> Mode | None:
        """The mode with these stops closed and without friction; None if they are dependent."""
        if not stops:
            return self.flight
        if stops not in self._sets:
            pull = self.pull(stops)
            if pull.det() == 0:
                self._sets[stops] = None
            else:
                pushes = [self.structure.push(self.structure.stops[j].normal) for j in stops]
                generator, forces = self._led(
                    [self.rates[j] for j in stops], [-push for push in pushes], -pull
                )
                watches = tuple(
                    Watch("release", j, -force) for j, force in zip(stops, forces, strict=True)
                )
                self._sets[stops] = Mode("closed", stops, generator, watches)
        return self._sets[stops]

    def slide(self, j: int, direction: int) -> Mode | Ended:
        """A slide; no force fits where a + s mu b <= 0 (Painleve)."""
        if (j, direction) not in self._slides:
            structure, stop = self.structure, self.structure.stops[j]
            assert stop.tangent is not None
            along = stop.normal + stop.tangent * (direction * stop.friction)
            weight = structure.coupling(stop.normal, along)
            if not weight > 0:
                return Ended("painleve")
            generator, (force,) = self._led(
                [self.rates[j]], [-structure.push(along)], fmpq_mat(1, 1, [-weight])
            )
            slip = structure.slip_row(j)
            watches = (Watch("release", j, -force), Watch("stop", j, slip * -direction))
            kind: Kind = "slide_positive" if direction > 0 else "slide_negative"
            self._slides[j, direction] = Mode(kind, (j,), generator, watches)
        return self._slides[j, direction]

    def stick(self, j: int) -> tuple[Mode, arb_mat, arb_mat]:
        """A stick, and the rows of its normal and tangential force."""
        if j not in self._sticks:
            structure, stop = self.structure, self.structure.stops[j]
            assert stop.tangent is not None
            a, b, c = (
                structure.coupling(*rows)
                for rows in (
                    (stop.normal, stop.normal),
                    (stop.normal, stop.tangent),
                    (stop.tangent, stop.tangent),
                )
            )
            generator, (normal, tangential) = self._led(
                [self.rates[j], structure.slip_row(j)],
                [-structure.push(stop.normal), structure.push(stop.tangent)],
                fmpq_mat(2, 2, [-a, b, -b, c]),
            )
            grip = normal * arb(stop.friction)
            watches = (
                Watch("slide_negative", j, tangential - grip),
                Watch("slide_positive", j, -tangential - grip),
                Watch("release", j, -normal),
            )
            mode = Mode("stick", (j,), generator, watches)
            self._sticks[j] = mode, normal, tangential
        return self._sticks[j]

    def begun(self, mode: Mode, z: arb_mat, known: int = 0) -> list[Watch]:
        """The watches of a mode that begins at `z`, each with what vanishes there.

        `known` derivatives of the velocity of slip vanish by definition.
        """
        watches = []
        for watch in mode.watches:
            count = self.flat(watch.row, mode, z, known if watch.event == "stop" else 0)
            if count is not None:
                watches.append(replace(watch, touching=count))
        return watches

    def flat(self, row: arb_mat, mode: Mode, z: arb_mat, known: int = 0) -> int | None:
        """How many derivatives of a row vanish at `z`, itself the first; None if all do.

        `known` of them do so by definition.
        """
        for count in range(_DEEPEST + known):
            if count >= known and settled((row * z)[0, 0]):
                return count
            row = row * mode.generator.matrix
        return None

    def lead(self, row: arb_mat, generator: Generator, z: arb_mat) -> int:
        """Sign of the first derivative of a row along a motion that is not 0; 0 if all are."""
        for _ in range(_DEEPEST):
            found = settled((row * z)[0, 0])
            if found:
                return found
            row = row * generator.matrix
        return 0

    def _led(
        self, rates: list[arb_mat], columns: list[arb_mat], pull: fmpq_mat
    ) -> tuple[Generator, list[arb_mat]]:
        """The motion that keeps some rates constant by forces along columns, and the forces' rows.

        `pull` is the product of rates and columns, exactly.
        """
        count, width = len(rates), self.structure.width
        kept = arb_mat(count, width)
        for i, rate in enumerate(rates):
            change = rate * self.free.matrix
            for k in range(width):
                kept[i, k] = change[0, k]
        forces = arb_mat(-pull.inv()) * kept
        matrix = self.free.matrix
        rows = []
        for i, column in enumerate(columns):
            row = arb_mat(1, width, [forces[i, k] for k in range(width)])
            rows.append(row)
            matrix = matrix + column * row
        return Generator(matrix, self.structure.size), rows

    def _fits(self, mode: Mode, held: Sequence[int], z: arb_mat) -> bool:
        """Whether all forces of a set are >= 0, and the other stops of `held` do not close."""
        for watch in mode.watches:
            if self.lead(watch.row, mode.generator, z) > 0:
                return False
        for j in held:
            if j not in mode.closed:
                bend = self.rates[j] * mode.generator.matrix
                if self.lead(bend, mode.generator, z) > 0:
                    return False
        return True

    def _rubbing(self, j: int, z: arb_mat, still: bool) -> Mode | Ended:
        """The mode of one closed stop with friction that does not separate."""
        slip = (self.structure.slip_row(j) * z)[0, 0]
        if not still:
            return self.slide(j, certain(slip))
        if self._grips(j, z):
            return self.stick(j)[0]
        # slip begins against the friction that would be needed to hold it
        _, _, tangential = self.stick(j)
        return self.slide(j, -certain((tangential * z)[0, 0]))

    def _rests(self, j: int, z: arb_mat, rough: Sequence[int]) -> bool:
        """Whether one of several closed stops with friction does not slip."""
        return len(rough) > 1 and settled((self.structure.slip_row(j) * z)[0, 0]) == 0

    def _grips(self, j: int, z: arb_mat) -> bool:
        """Whether a stick fits: its normal force >= 0, within the cone of friction."""
        mode, _, _ = self.stick(j)
        return all(self.lead(watch.row, mode.generator, z) <= 0 for watch in mode.watches)

    def _is_open(self, j: int, z: arb_mat, still: bool) -> bool:
        """Whether a stop that is pulled open could also go on to slip or to stick."""
        if not self._tight(j):
            return False
        if still:
            return self._grips(j, z)
        slip = settled((self.structure.slip_row(j) * z)[0, 0])
        return slip != 0 and isinstance(self.slide(j, slip), Ended)

    def _tight(self, j: int) -> bool:
        """Whether friction in some direction could press a stop together."""
        return any(isinstance(self.slide(j, s), Ended) for s in (1, -1))


def settled(value: arb) -> int:
    """Certified sign, or 0 for a value enclosed within half the digits of 0."""
    if value > 0:
        return 1
    if value < 0:
        return -1
    if abs(value).upper() < arb(2) ** -(ctx.prec // 2):
        return 0
    raise Undecided("a sign at a stop")


def certain(value: arb) -> int:
    """Certified sign, +1 or -1."""
    if value > 0:
        return 1
    if value < 0:
        return -1
    raise Undecided("a direction of slip")
