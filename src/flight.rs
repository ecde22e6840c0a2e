//! Exact free motion of both bodies between contacts (docs/theory.md, section 2;
//! Han, Jin & Hu (2004), eqs. (22), (25), Appendix A, extended to every damping and to resonance).
//!
//! A [`Flight`] is local: it starts at some instant and is evaluated at times of at most
//! [`FreeMotion::span`] after it, as *increments* from the start, so that a short hop is as exact,
//! relatively, as a long one. Longer flights are evaluated from their start by
//! [`FreeMotion::state_after_periods`] with angles reduced in double-double, and go on as a new
//! local flight.

mod drive;
pub(crate) mod gap;
mod oscillator;
mod resonance;
pub(crate) mod structure;
mod table;
pub(crate) mod tolerances;

pub(crate) use drive::{Drive, Drives, Trig, Trigs, Turn, turn_within};
pub(crate) use gap::{Apart, stays_apart};
pub use gap::{ContactReport, Found, Touch, next_contact};
pub(crate) use oscillator::{
    BodyFlight, BodyFlights, Bounds, Equation, Equations, Motion, MotionLanes, Oscillator,
    SeriesLanes,
};
pub(crate) use resonance::{Beat, Beats};
pub use structure::{StopContact, StructureFlight, StructureMotion};
pub(crate) use table::{Point, States, Table};

use crate::flight::tolerances::CHUNK_TURNS;
use crate::model::angle::Angle;
use crate::model::oblique::Body;
use crate::model::parameters::{Contact, System};
use crate::model::state::{Clock, State};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary;
use crate::numerics::lanes::{self, LANES, Lanes};
use crate::search::steps::sextic_remainder;
use crate::search::tolerances::{BOUND_MARGIN, FREE_SPANS, SCAN_SPANS, SCAN_STEPS};

/// What a system's flights have in common, worked out once.
#[derive(Debug, Clone)]
pub struct FreeMotion {
    pub(crate) drive: Drive,
    pub(crate) pendulum: Oscillator,
    pub(crate) oscillator: Oscillator,
    /// Longest local flight.
    pub(crate) span: f64,
    /// Remainder of an interpolant on the longest steps, per unit sixth derivative.
    remainder_factor: f64,
    pub(crate) contact: Contact,
    pub(crate) gap: f64,
    /// Equilibrium of the pendulum under its constant load.
    pub(crate) equilibrium: f64,
    /// The gap from the equilibrium of body 2, less what the equilibria take from the margin of a
    /// bound.
    pub(crate) gap_at_rest: f64,
    /// Longest time after its start at which a contact of a local flight is met.
    pub(crate) reach: f64,
    /// Longest time after its start for which a local flight is evaluated without reducing angles.
    pub(crate) far: f64,
    /// Local time from which on `plain_at` holds: infinite where a body creeps or is near
    /// resonance.
    plain_from: f64,
    tables: table::Tables,
}

impl FreeMotion {
    /// The free motion of both bodies of `system`.
    #[must_use]
    pub fn new(system: &System) -> Self {
        let omega = system.drive_frequency;
        let span = CHUNK_TURNS * std::f64::consts::TAU / system.highest_frequency();
        // The first pass looks a little further.
        let longest = SCAN_STEPS * span;
        let body = |body: Body<f64>| Oscillator::new(&body, omega, longest);
        let (pendulum, oscillator) = (body(system.pendulum()), body(system.oscillator()));
        let plain_from = pendulum.swings_from().max(oscillator.swings_from());
        let tables = table::Tables::new(span);
        let (first, second) = (pendulum.equation.equilibrium, oscillator.equation.equilibrium);
        Self {
            drive: Drive::of(system),
            pendulum,
            oscillator,
            plain_from,
            span,
            reach: if plain_from.is_finite() { SCAN_SPANS * span } else { span },
            far: if plain_from.is_finite() { FREE_SPANS * span } else { span },
            remainder_factor: sextic_remainder(tables.steps[0]),
            contact: system.contact,
            gap: system.gap,
            equilibrium: first,
            gap_at_rest: system.gap + second - (BOUND_MARGIN - 1.0) * (first.abs() + second.abs()),
            tables,
        }
    }

    /// Longest time for which a local flight may be evaluated.
    #[must_use]
    pub fn span(&self) -> f64 {
        self.span
    }

    /// The local flight that starts at `clock` in `state`.
    #[must_use]
    pub fn flight(&self, clock: Clock, state: State) -> Flight {
        self.flight_at(clock, state, self.contact.angle(state.x1))
    }

    /// As [`FreeMotion::flight`], from a known sine and cosine of x1.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn flight_at(&self, clock: Clock, state: State, angle: Angle) -> Flight {
        let start = self.drive.trig_at(clock);
        Flight {
            clock,
            state,
            angle,
            start,
            pendulum: self.pendulum.flight(state.x1, state.v1, start),
            oscillator: self.oscillator.flight(state.x2, state.v2, start),
        }
    }

    /// Length of the steps of a level of tables.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn step(&self, level: usize) -> f64 {
        self.tables.steps[level]
    }

    /// The table of a level.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn table(&self, level: usize) -> &Table {
        let make = || Table::new(self.step(level), &self.drive, &self.pendulum, &self.oscillator);
        self.tables.get(level, make)
    }

    /// Motion of both bodies at the start.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn at_start(&self, flight: &Flight) -> (Motion, Motion) {
        let State { x1, v1, x2, v2 } = flight.state;
        let turn = Turn { cos_minus_1: 0.0, sin: 0.0, phase: flight.start, start: flight.start };
        (
            self.pendulum.equation.motion_from(0.0, v1, [x1, 0.0], &turn),
            self.oscillator.equation.motion_from(0.0, v2, [x2, 0.0], &turn),
        )
    }

    /// Motion of pendulum and oscillator at time `s` after the start: increment of the
    /// displacement, rate, and their next two derivatives from the equation of motion.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn at(&self, flight: &Flight, s: f64) -> (Motion, Motion) {
        if s > self.plain_from { self.plain_at(flight, s) } else { self.any_at(flight, s) }
    }

    /// All sines at once, for two bodies that swing and answer the drive with the steady response.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn plain_at(&self, flight: &Flight, s: f64) -> (Motion, Motion) {
        let drive = DoubleDouble::new(self.drive.omega);
        let (first, second) = (self.pendulum.equation.damped, self.oscillator.equation.damped);
        let rates = [first, second, drive, DoubleDouble::ZERO];
        let angles = rates.map(|w| DoubleDouble::product(w.hi, s));
        let tails = std::array::from_fn(|j| angles[j].lo + rates[j].lo * s);
        let [first, second, (cos_minus_1, sin), _] = elementary::turns(angles.map(|a| a.hi), tails);
        let turn = Turn::new(flight.start, cos_minus_1, sin);
        (
            self.pendulum.swung::<true>(&flight.pendulum, s, first, &turn),
            self.oscillator.swung::<true>(&flight.oscillator, s, second, &turn),
        )
    }

    #[inline(never)]
    fn any_at(&self, flight: &Flight, s: f64) -> (Motion, Motion) {
        let turn = if self.pendulum.is_forced() || self.oscillator.is_forced() {
            self.drive.turned(flight.start, s)
        } else {
            Turn::STILL
        };
        (
            self.pendulum.at(&flight.pendulum, s, &turn),
            self.oscillator.at(&flight.oscillator, s, &turn),
        )
    }

    /// Bounds of the derivatives 1 to 4 of both displacements during the local flight.
    pub(crate) fn bounds(&self, flight: &Flight) -> (Bounds, Bounds) {
        (
            self.pendulum.bounds(&flight.pendulum, flight.start),
            self.oscillator.bounds(&flight.oscillator, flight.start),
        )
    }

    /// Whether a free motion has decayed by local time `s` so far that its start would cancel.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn decays_by(&self, s: f64) -> bool {
        self.pendulum.equation.decayed(s) || self.oscillator.equation.decayed(s)
    }

    /// Whether both bodies swing, and answer the drive with the steady response or a beat.
    pub(crate) fn swings_or_beats(&self) -> bool {
        self.pendulum.swings_or_beats() && self.oscillator.swings_or_beats()
    }

    /// State at local time `s <= span`.
    #[must_use]
    pub fn state_at(&self, flight: &Flight, s: f64) -> State {
        let (p, o) = self.at(flight, s);
        State { x1: p.displacement(), v1: p.rate, x2: o.displacement(), v2: o.rate }
    }

    /// State at any local time: far from the start with the angles reduced.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn state_within(&self, flight: &Flight, s: DoubleDouble) -> State {
        if s.hi <= self.far {
            state_past(&self.at(flight, s.hi), s.lo)
        } else {
            self.state_after(flight, s)
        }
    }

    /// States at several local times.
    pub(crate) fn states_within(&self, flight: &Flight, times: &[DoubleDouble]) -> [State; LANES] {
        let (mut s, mut rests) = ([self.far; LANES], [0.0; LANES]);
        for (j, time) in times.iter().enumerate() {
            (s[j], rests[j]) = (time.hi, time.lo);
        }
        if s.iter().all(|&s| s > self.plain_from && s <= self.far) {
            return lanes::wide(Several { motion: self, flight, s, rests });
        }
        let mut states = [flight.state; LANES];
        for (state, &time) in states.iter_mut().zip(times) {
            *state = self.state_within(flight, time);
        }
        states
    }

    /// State a short time `h` after a motion of both bodies.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn state_later(&self, (p, o): &(Motion, Motion), h: f64) -> State {
        let (x1, v1) = self.pendulum.equation.later(p, h);
        let (x2, v2) = self.oscillator.equation.later(o, h);
        State { x1, v1, x2, v2 }
    }

    /// State after any time, however long, without loss of digits.
    pub(crate) fn state_after(&self, flight: &Flight, elapsed: DoubleDouble) -> State {
        lanes::narrow(After { motion: self, flight, elapsed })
    }

    /// Derivatives of (x, x') of pendulum and oscillator after any time by (x, x') before. With fused
    /// operations: for what is compiled where these are instructions.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn transitions(&self, elapsed: DoubleDouble) -> [[[f64; 2]; 2]; 2] {
        let time = elapsed.hi;
        let (pendulum, oscillator) = (&self.pendulum.equation, &self.oscillator.equation);
        let within = pendulum.turns_within(time) && oscillator.turns_within(time);
        // Whoever tells more digits of the time needs them.
        if within && elapsed.lo == 0.0 && self.swings_or_beats() {
            return [
                pendulum.swung_transition(time, pendulum.amplitude_change(time)),
                oscillator.swung_transition(time, oscillator.amplitude_change(time)),
            ];
        }
        [self.pendulum.transition(elapsed), self.oscillator.transition(elapsed)]
    }

    /// State after `periods` drive periods and `time` more of a flight: exact for any number of
    /// periods up to 2^53 units of time, as long as a run may be. Without a drive period `periods` is
    /// ignored.
    #[must_use]
    pub fn state_after_periods(&self, flight: &Flight, periods: i64, time: f64) -> State {
        let elapsed = if self.drive.has_period() {
            self.drive.period.scale(periods as f64) + DoubleDouble::new(time)
        } else {
            DoubleDouble::new(time)
        };
        self.state_after(flight, elapsed)
    }
}

/// A state after any time, compiled for fused multiplications where there are any.
struct After<'a> {
    motion: &'a FreeMotion,
    flight: &'a Flight,
    elapsed: DoubleDouble,
}

impl pulp::NullaryFnOnce for After<'_> {
    type Output = State;

    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn call(self) -> State {
        let Self { motion: FreeMotion { drive, pendulum, oscillator, .. }, flight, elapsed } = self;
        let turn = drive.turned_far(flight.start, elapsed);
        let (x1, v1) = pendulum.after(&flight.pendulum, flight.state.x1, elapsed, &turn);
        let (x2, v2) = oscillator.after(&flight.oscillator, flight.state.x2, elapsed, &turn);
        State { x1, v1, x2, v2 }
    }
}

/// States at several times of a flight of bodies that swing and answer the drive with the steady
/// response, each as by itself.
struct Several<'a> {
    motion: &'a FreeMotion,
    flight: &'a Flight,
    s: Lanes,
    rests: Lanes,
}

impl pulp::NullaryFnOnce for Several<'_> {
    type Output = [State; LANES];

    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn call(self) -> [State; LANES] {
        let FreeMotion { pendulum, oscillator, .. } = self.motion;
        if pendulum.equation.decay_rate + oscillator.equation.decay_rate > 0.0 {
            self.states::<true>()
        } else {
            self.states::<false>()
        }
    }
}

impl Several<'_> {
    #[inline(always)]
    #[allow(clippy::inline_always)]
    #[allow(clippy::needless_range_loop)] // loops over lanes read best with their index
    fn states<const DAMPED: bool>(self) -> [State; LANES] {
        let Self { motion: FreeMotion { drive, pendulum, oscillator, .. }, flight, s, rests } =
            self;
        let omega = DoubleDouble::new(drive.omega);
        let (mut x1, mut v1, mut x2, mut v2) =
            ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for j in 0..LANES {
            let first = turn_within(pendulum.equation.damped, s[j]);
            let second = turn_within(oscillator.equation.damped, s[j]);
            let (cos_minus_1, sin) = turn_within(omega, s[j]);
            let turn = Turn::new(flight.start, cos_minus_1, sin);
            let motions = (
                pendulum.swung::<DAMPED>(&flight.pendulum, s[j], first, &turn),
                oscillator.swung::<DAMPED>(&flight.oscillator, s[j], second, &turn),
            );
            let state = state_past(&motions, rests[j]);
            (x1[j], v1[j], x2[j], v2[j]) = (state.x1, state.v1, state.x2, state.v2);
        }
        std::array::from_fn(|j| State { x1: x1[j], v1: v1[j], x2: x2[j], v2: v2[j] })
    }
}

/// State so short a time after a motion of both bodies as rounding leaves.
#[inline(always)]
#[allow(clippy::inline_always)]
pub(crate) fn state_past((p, o): &(Motion, Motion), rest: f64) -> State {
    let past = |m: &Motion| (m.displacement() + m.rate * rest, m.rate + m.acceleration * rest);
    let ((x1, v1), (x2, v2)) = (past(p), past(o));
    State { x1, v1, x2, v2 }
}

/// Both bodies in free flight from a given state.
#[derive(Debug, Clone, Copy)]
pub struct Flight {
    pub(crate) clock: Clock,
    pub(crate) state: State,
    /// Of x1 at the start.
    pub(crate) angle: Angle,
    pub(crate) start: Trig,
    pub(crate) pendulum: BodyFlight,
    pub(crate) oscillator: BodyFlight,
}
