//! Exact free motion of both bodies between contacts (docs/theory.md, section 2;
//! Han, Jin & Hu (2004), eqs. (22), (25), Appendix A, extended to every damping and to resonance).
//!
//! A [`Flight`] is local: it starts at some instant and is evaluated at times of at most
//! [`FreeMotion::span`] after it, as *increments* from the start, so that a short hop is as
//! exact, relatively, as a long one. Longer flights are evaluated from their start by
//! [`FreeMotion::state_after_periods`] with angles reduced in double-double, and go on as a new local flight.

mod drive;
mod oscillator;
mod resonance;
mod table;

pub(crate) use drive::{Drive, Trig};
pub(crate) use oscillator::{BodyFlight, Bounds, Motion, Oscillator};
pub(crate) use table::{LEVELS, Point, Table};

use crate::double_double::DoubleDouble;
use crate::lanes::LANES;
use crate::params::System;
use crate::state::{Clock, State};
use crate::tolerance::CHUNK_TURNS;

/// What a system's flights have in common, worked out once.
#[derive(Debug, Clone)]
pub struct FreeMotion {
    pub(crate) drive: Drive,
    pub(crate) pendulum: Oscillator,
    pub(crate) oscillator: Oscillator,
    /// Longest local flight.
    pub(crate) span: f64,
    tables: table::Tables,
}

impl FreeMotion {
    /// The free motion of both bodies of `system`.
    #[must_use]
    pub fn new(system: &System) -> Self {
        let omega = system.drive_frequency;
        let fastest = system.frequency_ratio.max(omega).max(1.0);
        let span = CHUNK_TURNS * std::f64::consts::TAU / fastest;
        let body =
            |natural, damping, amplitude| Oscillator::new(natural, damping, amplitude, omega, span);
        Self {
            drive: Drive::new(omega, system.phase),
            pendulum: body(
                system.frequency_ratio,
                system.pendulum_damping,
                system.moment_amplitude,
            ),
            oscillator: body(1.0, system.oscillator_damping, system.force_amplitude),
            span,
            tables: table::Tables::default(),
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
        let start = self.drive.trig_at(clock);
        Flight {
            clock,
            state,
            start,
            pendulum: self.pendulum.flight(state.x1, state.v1, start),
            oscillator: self.oscillator.flight(state.x2, state.v2, start),
        }
    }

    /// Length of the steps of a level of tables.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn step(&self, level: usize) -> f64 {
        self.span / (LANES << level) as f64
    }

    /// The table of a level.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn table(&self, level: usize) -> &Table {
        let make = || Table::new(self.step(level), &self.drive, &self.pendulum, &self.oscillator);
        self.tables.get(level, make)
    }

    /// Motion of pendulum and oscillator at time `s` after the start: increment of the
    /// displacement, rate, and their next two derivatives from the equation of motion.
    #[inline]
    pub(crate) fn at(&self, flight: &Flight, s: f64) -> (Motion, Motion) {
        let turn = if self.pendulum.is_forced() || self.oscillator.is_forced() {
            self.drive.turned(flight.start, s)
        } else {
            drive::Turn::STILL
        };
        (
            self.pendulum.at(&flight.pendulum, s, &turn),
            self.oscillator.at(&flight.oscillator, s, &turn),
        )
    }

    /// Like [`FreeMotion::at`], with the rounding of all angles made good: for the instant of a
    /// contact, once per flight.
    pub(crate) fn at_exactly(&self, flight: &Flight, s: f64) -> (Motion, Motion) {
        let turn = self.drive.turned_exactly(flight.start, s);
        (
            self.pendulum.at_exactly(&flight.pendulum, s, &turn),
            self.oscillator.at_exactly(&flight.oscillator, s, &turn),
        )
    }

    /// Bounds of the derivatives 1 to 4 of both displacements during the local flight.
    pub(crate) fn bounds(&self, flight: &Flight) -> (Bounds, Bounds) {
        (
            self.pendulum.bounds(&flight.pendulum, flight.start),
            self.oscillator.bounds(&flight.oscillator, flight.start),
        )
    }

    /// State at local time `s <= span`.
    #[must_use]
    pub fn state_at(&self, flight: &Flight, s: f64) -> State {
        let (p, o) = self.at(flight, s);
        State { x1: p.displacement(), v1: p.rate, x2: o.displacement(), v2: o.rate }
    }

    /// State at any local time: beyond the span with the angles reduced.
    pub(crate) fn state_within(&self, flight: &Flight, s: f64) -> State {
        if s <= self.span {
            self.state_at(flight, s)
        } else {
            self.state_after(flight, DoubleDouble::new(s))
        }
    }

    /// State a short time `h` after a motion of both bodies.
    pub(crate) fn state_later(&self, (p, o): &(Motion, Motion), h: f64) -> State {
        let (x1, v1) = self.pendulum.later(p, h);
        let (x2, v2) = self.oscillator.later(o, h);
        State { x1, v1, x2, v2 }
    }

    /// State after any time, however long, without loss of digits.
    pub(crate) fn state_after(&self, flight: &Flight, elapsed: DoubleDouble) -> State {
        let turn = self.drive.turned_far(flight.start, elapsed);
        let (x1, v1) = self.pendulum.after(&flight.pendulum, flight.state.x1, elapsed, &turn);
        let (x2, v2) = self.oscillator.after(&flight.oscillator, flight.state.x2, elapsed, &turn);
        State { x1, v1, x2, v2 }
    }

    /// State after `periods` drive periods and `time` more of a flight: exact for any number of
    /// periods. With a constant load `periods` is ignored.
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

/// Both bodies in free flight from a given state.
#[derive(Debug, Clone, Copy)]
pub struct Flight {
    pub(crate) clock: Clock,
    pub(crate) state: State,
    pub(crate) start: Trig,
    pub(crate) pendulum: BodyFlight,
    pub(crate) oscillator: BodyFlight,
}
