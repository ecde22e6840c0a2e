"""The whole motion of a structure with stops: flights, impacts, chatter, closed stops, release.

Every piece of motion is a linear flow (flow.py), every event the first rise of a row through 0,
found with proof by the search of reference/contact.py. States are carried as balls from one piece
to the next, so that a run encloses the exact motion, up to its first chatter. From there on a
state that has lost three eighths of its digits is rounded to the midpoint of its ball, since
enclosures would not survive the limit of a chatter (reference/chatter.py), and the run is repeated
with finer settings: the difference of both is the stated error and the radius of every value.

What the balls do not decide, such as a graze, raises Undecided; the run is then repeated with twice
the digits, up to a cap. Coincidences are judged, not proved: two contacts whose times overlap when
each is known to a quarter of the digits are one instant.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import arb, arb_mat, ctx, fmpq, fmpq_mat

from ..chatter import ANALYTIC, Accumulation, Bounce, Tail
from ..contact import Contact, Undecided, first_contact, isolate
from ..flight import Number, exact, rational
from ..samples import Samples, no_state
from .carried import Carried
from .flow import Flow, Watched, column, vector
from .hold import Ended, Hold, Mode, Watch, certain
from .impulses import StopImpact, Struck, strike
from .model import Structure
from .result import Change, Impact, State, StructureRun, merged

#: Precision of the search, which a root is refined from.
_ROUGH = 128
#: First length of a search, times the motion's rate; odd, so that its end hits no event.
_AHEAD = fmpq(8 * 1021, 1024)
#: Impacts in a row with falling approach velocity that make a chatter likely.
_LIKELY = 4
#: Share of the digits by which the second run is finer.
_FINER = fmpq(3, 8)


def simulate_structure(
    structure: Structure,
    initial: Sequence[Sequence[Number]],
    *,
    periods: int | None = None,
    times: Sequence[Number] | None = None,
    precision: int = 400,
    cap: int = 1600,
    max_events: int = 20_000,
) -> StructureRun:
    """Follow the motion from `initial` = (q, q').

    Parameters
    ----------
    structure : Structure
    initial : exact numbers, (2, N), with g <= 0 at every stop
    periods : whole drive periods, with the state after each; or else
    times : ascending times of states
    precision, cap : first and last precision tried, in bits

    Raises
    ------
    ValueError : an inadmissible start; neither or both of `periods` and `times`; no drive period
    Undecided : an event, a regime or a mode is not decided at the last precision, such as a graze

    Examples
    --------
    >>> ball = {"mass": [[1]], "stiffness": [[0]], "static_load": ["1"],
    ...         "stops": [{"normal": [1], "gap": 0, "restitution": "0.5"}]}
    >>> run = simulate_structure(Structure.parse(ball), [[-2], [0]], times=[7])
    >>> [entry.kind for entry in run.story[-2:]]
    ['chatter', 'closed']
    >>> run.story[-2].time.str(10, radius=False)  # 2 + 4 (1/2 + 1/4 + ...) = 6
    '6.000000000'
    """
    if (periods is None) == (times is None):
        raise ValueError("periods or times, not both")
    if periods is not None and structure.omega == 0:
        raise ValueError("without a drive frequency there is no period")
    start = [[exact(value) for value in part] for part in initial]
    if [len(part) for part in start] != [structure.size] * 2:
        raise ValueError(f"a start of {structure.size} coordinates and as many velocities")

    def run(bits: int) -> StructureRun:
        with ctx.workprec(bits):
            if times is None:
                period = 2 * arb.pi() / arb(structure.omega)
                wanted = [period * (k + 1) for k in range(periods or 0)]
            else:
                wanted = [arb(exact(time)) for time in times]
            return Motion(structure, start, Samples(wanted), max_events).run()

    while True:
        try:
            plain = run(precision)
            if plain.proved == len(plain.story) and plain.proved_states == len(plain.states):
                return plain
            return merged(plain, run(precision + int((precision * _FINER).floor())))
        except Undecided:
            if 2 * precision > cap:
                raise
        precision *= 2


class Motion:
    """One run at the present precision: its start exact, `samples` to fill, most entries.

    Without `enclose` states are rounded from the start on.
    """

    def __init__(
        self,
        structure: Structure,
        start: Sequence[Sequence[fmpq]],
        samples: Samples[State],
        most: int,
        *,
        enclose: bool = True,
    ) -> None:
        self.structure, self.start, self.samples, self.most = structure, start, samples, most
        self.size = structure.size
        self.hold = Hold(structure)
        self.end = samples.times[-1] if samples.times else arb(0)
        self.tail = Tail(arb(2) ** -(ctx.prec * 3 // 8))
        self.story: list[Impact | Change] = []
        self.now = arb(0)
        balls = [arb(value) for part in start for value in part]
        self.z = column([*balls, arb(1), arb(1), arb(0)])
        self.mode, self.watches = self.hold.flight, list[Watch]()
        #: Stops with g = g' = 0, closed or not; of open ones, derivatives of g that vanish.
        self.held: tuple[int, ...] = ()
        self.touching: dict[int, int] = {}
        self.still = False
        self.enclose = enclose
        self.proved: tuple[int, int] | None = None if enclose else (0, 0)
        self.rounded = False
        self.carried = Carried(structure, self.now, self.z) if enclose else None

    def run(self) -> StructureRun:
        """To the end."""
        ending = self._begin()
        while ending is None:
            ending = self._piece()
        limits = any(isinstance(entry, Change) and entry.kind == "chatter" for entry in self.story)
        if self.rounded and not limits and self.tail.falling < _LIKELY:
            raise Undecided("a state that lost its digits, in what was no chatter")
        return self.so_far(ending)

    def width(self) -> float:
        """The largest radius of time and state."""
        return max(float(value.rad()) for value in (self.now, *self.z.entries()))

    def so_far(self, ending: str) -> StructureRun:
        """What is known by now."""
        proved = self.proved or (len(self.story), len(self.samples.states))
        return StructureRun(self.story, self.samples.states, ending, ctx.prec, *proved)

    def _begin(self) -> str | None:
        """The stops that touch at the start."""
        q, v = self.start
        struck = []
        for j in range(len(self.structure.stops)):
            gap = self.structure.exact_gap(j, q)
            sign = certain((self.hold.gaps[j] * self.z)[0, 0]) if gap is None else gap
            if sign > 0:
                raise ValueError(f"g > 0 at stop {j}")
            if sign < 0:
                continue
            rate = self.structure.exact_rate(j, v)
            if rate > 0:
                struck.append(j)
            elif rate < 0:
                self.touching[j] = 1
            else:
                self.held = (*self.held, j)
        if self.held:
            slips = [self.structure.slips(j, v) for j in self.held if self.hold.rubs[j]]
            self.still = slips == [0]
        return self._impact(struck) if struck else self._settle(())

    def _piece(self) -> str | None:
        """One flow to its first event."""
        if len(self.story) >= self.most:
            return "event_cap"
        flow = Flow(self.mode.generator, self.z)
        left = rational((self.end - self.now).upper())
        found, watches = self._first(flow, left)
        then = self.end if found is None else self.now + found
        began = self.now

        def state(t: arb) -> State:
            return self._state(flow.state(t - began))

        self.samples.take(then, state)
        if found is None or self.samples.full():
            return "completed"
        self.now, self.z = then, flow.state(found)
        if self.carried:
            self.carried.fly(flow, began, watches[0].row, found, self.now, self.z)
            self.now, self.z = self.carried.narrowed(self.now, self.z)
        struck = [watch.stop for watch in watches if watch.event == "contact"]
        self._keep()
        self.touching = {}
        if len(struck) == len(watches):
            return self._impact(struck)
        released = [watch.stop for watch in watches if watch.event == "release"]
        # without a force along t the cone of a stick shrinks to 0 with its normal force
        if released and (self.mode.kind == "stick" or len(released) == len(watches)):
            return self._release(released)
        if len(watches) > 1:
            raise Undecided("two events of closed stops at one instant")
        return self._turn(watches[0])

    def _first(self, flow: Flow, left: fmpq) -> tuple[arb | None, list[Watch]]:
        """The time of the first event, and all that happen then.

        Searched for within longer and longer times, so that no row is followed far beyond it.
        """
        gaps = [
            Watch("contact", j, row, self.touching.get(j, 0))
            for j, row in enumerate(self.hold.gaps)
            if j not in self.held
        ]
        ahead = _AHEAD / fmpq(round(1024 * flow.generator.rate()), 1024)
        while True:
            end = min(ahead, left)
            found, events = _earliest(flow, (*self.watches, *gaps), end)
            if found is not None or end == left:
                return found, events
            ahead *= 4

    def _release(self, stops: Sequence[int]) -> str | None:
        """Closed stops open: their forces have fallen to 0."""
        self.tail.forget()
        if len(stops) > 1 and self.mode.kind == "closed":
            # one of them may go on to press another
            return self._settle(self.mode.closed)
        for j in stops:
            self._tell("release", j)
        mode = self.hold.closed(tuple(j for j in self.mode.closed if j not in stops))
        assert mode is not None
        return self._enter(mode, released=stops)

    def _turn(self, watch: Watch) -> str | None:
        """What follows the end of a slide or a stick that stays closed."""
        self.tail.forget()
        if watch.event == "stop":
            self.still = True
            return self._settle(self.held, known=1)
        # a stick ends: slip and its rate are 0
        slide = self.hold.slide(watch.stop, 1 if watch.event == "slide_positive" else -1)
        if isinstance(slide, Mode):
            self._tell(slide.kind, watch.stop)
        return self._enter(slide, known=2)

    def _impact(self, struck: Sequence[int]) -> str | None:
        """Impacts, and the modes they lead to."""
        before = self.z
        done = strike(self.hold, struck, self.held, before)
        limit = self._tail(struck, done)
        if limit is not None:
            return self._limit(struck[0], limit)
        if not done.enclosed:
            self._unprove()
        q = vector(before, 0, self.size)
        passed = len(self.samples.states)
        for impact in done.impacts:
            self.story.append(Impact(**vars(impact), period=passed, time=self.now, q=q))
        self.z = done.z
        if self.carried:
            self.carried.strike(self.hold, struck, self.held, before, done, self.now)
            _, self.z = self.carried.narrowed(self.now, self.z)
        if done.ending is not None:
            return done.ending
        closed = self.mode.closed
        self.held = tuple(sorted(j for j, rate in done.rates.items() if rate.is_zero()))
        for j, rate in done.rates.items():
            if not rate.is_zero():
                self.touching[j] = 1
                if not rate < 0:
                    raise Undecided("the velocity after an impact")
                if j in closed:
                    self._tell("release", j)
        self.still = self._still(done.impacts)
        return self._settle(tuple(j for j in closed if j in self.held))

    def _still(self, impacts: Sequence[StopImpact]) -> bool:
        """Whether the one held stop with friction sticks by definition."""
        rough = [j for j in self.held if self.hold.rubs[j]]
        if len(rough) != 1:
            return False
        still = self.mode.kind == "stick" and rough == list(self.mode.closed)
        for impact in impacts:
            if impact.stop == rough[0]:
                still = bool(impact.slip_post.is_zero())
            elif self._moves_slip(impact.stop, rough[0]):
                still = False
        return still

    def _moves_slip(self, struck: int, stop: int) -> bool:
        """Whether an impact on one stop changes the velocity of slip at another."""
        tangent, hit = self.structure.stops[stop].tangent, self.structure.stops[struck]
        rows = [row for row in (hit.normal, hit.tangent) if row is not None]
        return tangent is not None and any(self.structure.coupling(row, tangent) for row in rows)

    def _tail(self, struck: Sequence[int], done: Struck) -> Accumulation | None:
        """The limit of a chatter at one stop, when it is known well enough.

        Stops that are held must stay so through every impact of it.
        """
        stays = all(done.rates[k].is_zero() for k in self.held)
        if len(struck) > 1 or done.ending is not None or not stays:
            self.tail.forget()
            return None
        (j,) = struck
        u = (self.hold.rates[j] * self.z)[0, 0]
        slip = self._slip(j)
        signs = (
            j,
            0 if slip.contains(0) else certain(slip),
            *self.mode.closed,
            *(impact.stop for impact in done.impacts),
        )
        values = (self.now, *vector(self.z, 0, 2 * self.size))
        middle = tuple(value.mid() for value in values)
        if not done.impacts:
            raise Undecided("an impact without an approach velocity")
        regimes = [impact.regime for impact in done.impacts]
        regime = next((name for name in regimes if name not in ANALYTIC), regimes[0])
        limit = self.tail.observe(Bounce(middle, u.mid(), regime, signs))
        return limit if limit and self._is_alone(j, limit.values[0] - self.now) else None

    def _is_alone(self, j: int, time: arb) -> bool:
        """Whether no open stop but one that chatters for so long can be met.

        |n . q'| <= sqrt(2 E n M^-1 n), and the root of 2 E grows by no more than the loads and the
        force that would hold the stop; twice that, for friction and for stops that move.
        """
        structure, n = self.structure, self.size
        q, v = column(vector(self.z, 0, n)), column(vector(self.z, n, 2 * n))
        energy = v.transpose() * arb_mat(structure.mass) * v
        energy = energy + q.transpose() * arb_mat(structure.stiffness) * q
        parts = [list(structure.load), *map(list, zip(*structure.drive, strict=True))]
        rows = [fmpq_mat(1, n, part) for part in parts]
        loads = sum((arb(structure.coupling(row, row)).sqrt() for row in rows), arb(0))
        normals = [stop.normal for stop in structure.stops]
        weights = [arb(structure.coupling(row, row)).sqrt() for row in normals]
        bend = abs((self.hold.rates[j] * self.hold.free.matrix * self.z)[0, 0])
        most = 2 * (abs(energy[0, 0]).sqrt() + time * (loads + bend / weights[j]))
        for other, stop in enumerate(structure.stops):
            if other == j or other in self.mode.closed:
                continue
            own = abs(arb(stop.amplitude) * arb(structure.omega))
            gap = (self.hold.gaps[other] * self.z)[0, 0]
            if not gap < -time * (weights[other] * most + own):
                return False
        return True

    def _slip(self, j: int) -> arb:
        """Velocity of slip at a stop; 0 without friction."""
        return (self.structure.slip_row(j) * self.z)[0, 0] if self.hold.rubs[j] else arb(0)

    def _limit(self, j: int, limit: Accumulation) -> str | None:
        """A chatter is completed."""
        self.samples.take(limit.values[0], no_state)
        self.now = limit.values[0]
        self.z = column([*limit.values[1:], arb(1), arb(1), arb(0)])
        self._round()
        self.held, self.touching = tuple(sorted((*self.held, j))), {}
        # other impacts than slip reverse or stop it, so that it is of the order of u
        self.still = self.hold.rubs[j] and limit.regime not in ANALYTIC
        if self.hold.rubs[j] and not self.still and not abs(self._slip(j)) > 10 * limit.error():
            raise Undecided("the direction of slip at the end of a chatter")
        self.tail.forget()
        self._tell("chatter", j)
        ending = self._settle(self.mode.closed)
        if ending is None and j not in self.mode.closed:
            raise Undecided("a chatter whose limit is no contact")
        return ending

    def _keep(self) -> None:
        """Round a state that enclosures would not survive, in a chatter and from then on."""
        if self.proved is None:
            lost = self.width() > 2.0 ** -(ctx.prec * 5 // 8)
            if self.tail.falling < _LIKELY or not lost:
                return
            self.rounded = True
        self._round()

    def _unprove(self) -> None:
        """From here on nothing encloses the exact motion."""
        if self.proved is None:
            self.proved = len(self.story), len(self.samples.states)
        self.carried = None

    def _round(self) -> None:
        """Time and state as midpoints, from here on without enclosure."""
        self._unprove()
        self.now = self.now.mid()
        turn = arb(self.structure.omega) * self.now
        middle = [value.mid() for value in vector(self.z, 0, 2 * self.size)]
        self.z = column([*middle, arb(1), turn.cos(), turn.sin()])

    def _settle(self, closed: tuple[int, ...], known: int = 0) -> str | None:
        """The mode on the stops that are held; `closed` were so before."""
        if not self.held:
            return self._enter(self.hold.flight)
        mode = self.hold.choose(self.held, self.z, still=self.still)
        if isinstance(mode, Ended):
            return mode.ending
        kind = self.mode.kind
        for j in closed:
            if j not in mode.closed:
                self._tell("release", j)
        for j in mode.closed:
            if j not in closed or mode.kind != kind:
                self._tell(mode.kind, j)
        return self._enter(mode, known=known or int(self.still))

    def _enter(
        self, mode: Mode | Ended, known: int = 0, released: Sequence[int] = ()
    ) -> str | None:
        """A mode begins; `known` derivatives of the velocity of slip vanish.

        Stops that are held without a force leave: g'' is the first derivative of g that does not
        vanish, or a later one, as at those `released`. If all vanish they stay where they are.
        """
        if isinstance(mode, Ended):
            return mode.ending
        for j in self.held:
            if j not in mode.closed:
                bend = self.hold.rates[j] * mode.generator.matrix
                count = self.hold.flat(bend, mode, self.z, int(j in released))
                if count is not None:
                    self.touching[j] = 2 + count
        self.held = tuple(j for j in self.held if j not in self.touching)
        self.mode = mode
        self.still = mode.kind == "stick"
        self.watches = self.hold.begun(mode, self.z, known)
        return None

    def _tell(self, kind: str, stop: int) -> None:
        """An event at the present state."""
        self.story.append(Change(kind, self.now, stop, self._state(self.z)))

    def _state(self, z: arb_mat) -> State:
        """Coordinates and velocities."""
        return vector(z, 0, self.size), vector(z, self.size, 2 * self.size)


def _earliest(flow: Flow, watches: Sequence[Watch], end: fmpq) -> tuple[arb | None, list[Watch]]:
    """The time of the first event up to `end`, and all that happen then.

    A row that is undecided is looked at again once the others have shortened the search.
    """
    best: arb | None = None
    first: list[Watch] = []
    tie, last = arb(2) ** -(ctx.prec // 4), end
    pending = [(watch, True) for watch in watches]
    while pending:
        watch, again = pending.pop(0)
        try:
            time = _search(Watched(flow, watch.row), last, watch.touching)
        except Undecided:
            if not again:
                raise
            pending.append((watch, False))
            continue
        if time is None:
            continue
        if best is None or time < best:
            best, first = time, [watch]
            last = min(end, rational((time + tie).upper()))
        elif not time > best:
            if not (time.rad() < tie and best.rad() < tie):
                raise Undecided("the order of two events")
            best, first = best.union(time), [*first, watch]
    return best, first


def _search(watched: Watched, end: fmpq, touching: int) -> arb | None:
    """The first rise of a row through 0: searched at low precision, refined at the present one."""
    bits = ctx.prec
    found: Contact = first_contact(watched, end, touching=touching, precision=_ROUGH, cap=bits)
    if found.kind not in ("none", "contact"):
        found = first_contact(watched, end, touching=touching, precision=bits, cap=bits)
    if found.kind == "none":
        return None
    if found.kind != "contact" or found.time is None:
        raise Undecided(f"{found.kind} event")
    if found.precision == bits:
        return found.time
    return isolate(watched, rational(found.time.lower()), rational(found.time.upper()))
