"""Impacts on the stops of a structure, of one stop or of several at one instant.

One stop (structures page): with a = n M^-1 n, b = n M^-1 t, c = t M^-1 t the path of
reference/impact.py, and q'+ = q' - M^-1 n P + M^-1 t Q. Velocities are relative to the stop.

Stops that touch at the instant are those struck and those closed. Struck stops that do not see each
other are resolved one by one; a closed frictionless one that an impact pulls away opens. What is
left is simultaneous, and resolved by the structure's rule:
    stop       the run ends
    sequence   one after the other, lowest index first, until none approaches, with a cap
    together   u+ = u - W P, u+ + r max(u, 0) <= 0, P >= 0, complementary (no friction)
Here a velocity enclosed within half the digits of 0 counts as 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from flint import arb, arb_mat, fmpq

from ..contact import Undecided
from ..impact import Path, PlanarImpact
from .flow import column, vector
from .hold import Hold, settled
from .model import Structure

#: Impacts of one sequence.
SEQUENCE_CAP = 10_000
#: Impacts of one sequence that are enclosed.
_FEW = 30
#: A velocity that an endless sequence has shrunk by this is 0; the same at every precision, so that
#: all of them see the same impacts.
_SHRUNK = fmpq(1, 2**100)


@dataclass(frozen=True)
class StopImpact:
    """An impact on one stop: velocities (N,), normal velocities, regime, impulses, loss of energy.

    `approach_velocity` u > 0 before it (0 of a closed stop that others press) and
    `separation_velocity` <= 0 after it are relative to the stop; `slip_post` is the velocity of
    slip after it, 0 exactly where it sticks.
    """

    stop: int
    v_pre: tuple[arb, ...]
    v_post: tuple[arb, ...]
    approach_velocity: arb
    separation_velocity: arb
    regime: str
    impulse_normal: arb
    impulse_tangential: arb
    slip_post: arb
    energy_loss: arb


@dataclass(frozen=True)
class Struck:
    """The impacts of one instant, the state after them, and what has become of the stops.

    `rates`: the approach velocity afterwards of each stop that touches, 0 exactly where it stays.
    `ending`: simultaneous or sequence_cap, if the run ends there. `enclosed`: nothing was rounded.
    `together`: the impacts are one, else one follows the other.
    """

    impacts: list[StopImpact]
    z: arb_mat
    rates: dict[int, arb]
    ending: str | None = None
    enclosed: bool = True
    together: bool = False


def strike(hold: Hold, struck: Sequence[int], held: Sequence[int], z: arb_mat) -> Struck:
    """Resolve the impact on the stops `struck` while the stops `held` have g = g' = 0."""
    structure = hold.structure
    rates = {j: (hold.rates[j] * z)[0, 0] for j in struck} | {j: arb(0) for j in held}
    if not _simultaneous(structure, struck, held):
        impacts = []
        for j in sorted(struck):
            impacts.append(impact_on(hold, j, z, rates[j]))
            z = _moved(structure, z, impacts[-1].v_post)
            rates = _after(structure, impacts[-1], rates)
        return Struck(impacts, z, rates)
    if structure.simultaneous == "sequence":
        return _sequence(hold, rates, z)
    if structure.simultaneous == "together" and not any(hold.rubs[j] for j in rates):
        return _together(hold, rates, z)
    return Struck([], z, rates, "simultaneous")


def impact_on(hold: Hold, j: int, z: arb_mat, u: arb) -> StopImpact:
    """The impact on one stop with the approach velocity `u`."""
    structure, stop, n = hold.structure, hold.structure.stops[j], hold.structure.size
    path, tangential, u_post = planar(structure, j, u, slip_at(hold, j, z))
    push = structure.push(stop.normal) * -path.impulse
    if stop.tangent is not None:
        push = push + structure.push(stop.tangent) * tangential
    v_pre, v_post = vector(z, n, 2 * n), vector(z + push, n, 2 * n)
    own = (structure.stops[j].normal * column(v_pre))[0, 0] - u
    loss = _kinetic(structure, v_pre) - _kinetic(structure, v_post) - path.impulse * own
    return StopImpact(
        j, v_pre, v_post, u, u_post, path.regime, path.impulse, tangential, path.s, loss
    )


def slip_at(hold: Hold, j: int, z: arb_mat) -> arb:
    """The velocity of slip with which an impact begins; 0 without friction."""
    if hold.structure.stops[j].tangent is None:
        return arb(0)
    return _rounded((hold.structure.slip_row(j) * z)[0, 0])


def planar(structure: Structure, j: int, u: arb, s: arb) -> tuple[Path, arb, arb]:
    """The path of an impact with the velocities u and s, tangential impulse, u afterwards."""
    stop = structure.stops[j]
    a = arb(structure.coupling(stop.normal, stop.normal))
    b, c = arb(0), arb(1)
    if stop.tangent is not None:
        b = arb(structure.coupling(stop.normal, stop.tangent))
        c = arb(structure.coupling(stop.tangent, stop.tangent))
    r = stop.restitution_at(u)
    impact = PlanarImpact(r, arb(stop.friction), b, c, a - b**2 / c)
    path = impact.path(structure.law, s, u - b / c * s)
    tangential = arb(0) if stop.tangent is None else (path.s - s + b * path.impulse) / c
    # exactly -r u where nothing bends: a plastic impact leaves 0
    straight = path.regime in ("frictionless", "slip") or stop.restitution == 0
    return path, tangential, -r * u if straight else path.w + b / c * path.s


def _simultaneous(structure: Structure, struck: Sequence[int], held: Sequence[int]) -> bool:
    """Whether the outcome depends on a rule."""
    if any(structure.sees(i, j) for i, j in combinations(struck, 2)):
        return True
    for i in struck:
        for j in held:
            one, other = structure.stops[i], structure.stops[j]
            if structure.sees(i, j) and (one.tangent is not None or other.tangent is not None):
                return True
            if structure.coupling(one.normal, other.normal) < 0:
                return True
    return False


def _after(structure: Structure, done: StopImpact, rates: dict[int, arb]) -> dict[int, arb]:
    """Approach velocities after an impact: exactly as before where the stops do not see it."""
    stop, after = structure.stops[done.stop], {}
    for j, rate in rates.items():
        normal = structure.stops[j].normal
        change = -arb(structure.coupling(normal, stop.normal)) * done.impulse_normal
        if stop.tangent is not None:
            change += arb(structure.coupling(normal, stop.tangent)) * done.impulse_tangential
        after[j] = done.separation_velocity if j == done.stop else rate + change
    return after


def _sequence(hold: Hold, rates: dict[int, arb], z: arb_mat) -> Struck:
    """Impacts one after the other.

    Enclosures would not survive an endless sequence: after some impacts velocities are rounded, and
    one that is below 2^-100 of the largest before them is 0. So a sequence that shrinks to rest
    ends there.
    """
    impacts: list[StopImpact] = []
    least = max(abs(rate).upper() for rate in rates.values()) * arb(_SHRUNK)
    while True:
        rounded = len(impacts) > _FEW
        if rounded:
            rates = {j: rate.mid() if abs(rate) > least else arb(0) for j, rate in rates.items()}
            z = z.mid()
        coming = [j for j in sorted(rates) if settled(rates[j]) > 0]
        if not coming:
            rates = {j: _rounded(rate) for j, rate in rates.items()}
            return Struck(impacts, z, rates, enclosed=not rounded)
        if len(impacts) == SEQUENCE_CAP:
            return Struck(impacts, z, rates, "sequence_cap", enclosed=not rounded)
        impacts.append(impact_on(hold, coming[0], z, rates[coming[0]]))
        z = _moved(hold.structure, z, impacts[-1].v_post)
        rates = _after(hold.structure, impacts[-1], rates)


def _together(hold: Hold, rates: dict[int, arb], z: arb_mat) -> Struck:
    """One linear complementarity problem, by trial of all sets of stops with an impulse."""
    structure, stops = hold.structure, sorted(rates)
    speed = {j: rates[j] if settled(rates[j]) > 0 else arb(0) for j in stops}
    wanted = {j: -structure.stops[j].restitution_at(speed[j]) * speed[j] for j in stops}
    for count in range(len(stops), -1, -1):
        for chosen in combinations(stops, count):
            impulses = _impulses(hold, chosen, [rates[j] - wanted[j] for j in chosen])
            if impulses is None or any(settled(p) < 0 for p in impulses.values()):
                continue
            after = {j: _relieved(structure, j, rates[j], impulses) for j in stops}
            after |= {j: wanted[j] for j in chosen}
            if any(settled(after[j] - wanted[j]) > 0 for j in stops):
                continue
            push = arb_mat(structure.width, 1)
            for j, impulse in impulses.items():
                push = push - structure.push(structure.stops[j].normal) * impulse
            n = structure.size
            v_pre, v_post = vector(z, n, 2 * n), vector(z + push, n, 2 * n)
            # the losses P (u + u+)/2 add up to the whole
            impacts = [
                StopImpact(
                    j, v_pre, v_post, rates[j], after[j], "frictionless", impulses[j], arb(0),
                    arb(0), impulses[j] * (rates[j] + after[j]) / 2,
                )
                for j in chosen
            ]  # fmt: skip
            left = {j: _rounded(rate) for j, rate in after.items()}
            return Struck(impacts, z + push, left, together=True)
    raise Undecided("no set of impulses fits")


def _impulses(hold: Hold, chosen: Sequence[int], changes: Sequence[arb]) -> dict[int, arb] | None:
    """The impulses that change the approach velocities so; None if the stops are dependent."""
    if not chosen:
        return {}
    pull = hold.pull(chosen)
    if pull.det() == 0:
        return None
    found = arb_mat(pull.inv()) * column(changes)
    return dict(zip(chosen, found.entries(), strict=True))


def _relieved(structure: Structure, j: int, rate: arb, impulses: dict[int, arb]) -> arb:
    """An approach velocity after impulses."""
    normal = structure.stops[j].normal
    for i, impulse in impulses.items():
        rate = rate - arb(structure.coupling(normal, structure.stops[i].normal)) * impulse
    return rate


def _rounded(rate: arb) -> arb:
    """A rate that is 0 to half the digits as 0."""
    return rate if settled(rate) else arb(0)


def _moved(structure: Structure, z: arb_mat, v: Sequence[arb]) -> arb_mat:
    """A state with other velocities."""
    n, moved = structure.size, arb_mat(z)
    for i, value in enumerate(v):
        moved[n + i, 0] = value
    return moved


def _kinetic(structure: Structure, v: Sequence[arb]) -> arb:
    """Kinetic energy."""
    state = column(v)
    return (state.transpose() * arb_mat(structure.mass) * state)[0, 0] / 2
