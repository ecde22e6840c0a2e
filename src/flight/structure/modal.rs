//! Free motion of a structure whose modes are oscillators of their own: the same closed forms as
//! the pendulum's, for every damping, at resonance, without a spring, and on a damper alone.

#![allow(clippy::inline_always)] // a flight is compiled for several instruction sets

mod shared;
mod stop_gap;

use std::sync::OnceLock;

use smallvec::SmallVec;

use self::shared::{SHARED_BY, Shared};
use self::stop_gap::StopGap;
use super::{StopContact, StopMotion, dot};
use crate::flight::drive::{Drive, Trig, Turn};
use crate::flight::oscillator::{BodyFlight, FreeBody, Motion, Oscillator};
use crate::flight::table::Response;
use crate::flight::tolerances::CHUNK_TURNS;
use crate::model::state::Clock;
use crate::model::structure::{Coordinates, Structure, StructureState};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary;
use crate::numerics::lanes::{self, LANES};
use crate::search::first_contact::{Found, Start, first_contact};
use crate::search::gap::{Gap, GapPoint};
use crate::search::steps::{LEVELS, Weights, sextic_remainder};
use crate::search::tolerances::{SCAN_SPANS, SCAN_STEPS};

/// What the flights have in common, worked out once.
#[derive(Debug, Clone)]
pub(super) struct ModalMotion {
    pub drive: Drive,
    pub modes: Vec<ModeMotion>,
    stops: Vec<StopMotion>,
    pub span: f64,
    /// Longest local time at which a contact is met.
    pub reach: f64,
    /// Whether the bounds of derivatives hold for all times.
    pub steady: bool,
    pub remainder_factor: f64,
    tables: [OnceLock<Table>; LEVELS],
}

#[derive(Debug, Clone)]
pub(super) struct ModeMotion {
    pub oscillator: Oscillator,
    /// The argument of its drive's complex amplitude.
    ahead: Trig,
}

/// Steps of one length of all modes.
#[derive(Debug, Clone)]
pub(super) struct Table {
    pub responses: Vec<Response>,
    pub turns: [Turn; LANES],
    pub weights: Weights,
}

/// A flight between contacts.
#[derive(Debug, Clone)]
pub(super) struct ModalFlight {
    /// By mode; their phases at the start; and the phases of the stops.
    pub modes: SmallVec<[BodyFlight; FEW]>,
    pub phases: SmallVec<[Trig; FEW]>,
    pub stops: SmallVec<[Trig; FEW]>,
}

/// Modes, and stops, of which a flight needs no memory of its own.
const FEW: usize = 4;

impl ModalMotion {
    /// The free motion of a structure.
    pub fn new(structure: &Structure, stops: Vec<StopMotion>) -> Self {
        let omega = structure.drive_frequency();
        let fastest =
            structure.modes().iter().map(|mode| mode.frequency.value()).fold(omega, f64::max);
        // Nothing turns: any length will do.
        let fastest = if fastest > 0.0 { fastest } else { 1.0 };
        let span = CHUNK_TURNS * std::f64::consts::TAU / fastest;
        let longest = SCAN_STEPS * span;
        let modes: Vec<ModeMotion> = structure
            .modes()
            .iter()
            .map(|mode| {
                let natural = mode.frequency.value();
                let free = if natural == 0.0 && mode.decay_rate > 0.0 {
                    FreeBody::on_damper(mode.decay_rate)
                } else if natural == 0.0 {
                    FreeBody::on_spring(DoubleDouble::ZERO, 0.0)
                } else {
                    FreeBody::on_spring(mode.frequency, mode.decay_rate / natural)
                };
                let size = mode.drive.norm();
                let ahead = if size > 0.0 {
                    Trig { cos: mode.drive.re / size, sin: mode.drive.im / size }
                } else {
                    Trig::ONE
                };
                // A load that stands still is real, whatever its phase.
                let forcing = if omega > 0.0 { size } else { mode.drive.re };
                let ahead = if omega > 0.0 { ahead } else { Trig::ONE };
                let oscillator = Oscillator::under(free, forcing, mode.load, omega, longest);
                ModeMotion { oscillator, ahead }
            })
            .collect();
        let plain = modes.iter().all(|mode| mode.oscillator.swings_from().is_finite());
        Self {
            drive: Drive::new(omega, structure.phase()),
            steady: modes.iter().all(|mode| mode.oscillator.is_steady()),
            modes,
            stops,
            span,
            reach: if plain { SCAN_SPANS * span } else { span },
            remainder_factor: sextic_remainder(longest / LANES as f64),
            tables: std::array::from_fn(|_| OnceLock::new()),
        }
    }

    /// The flight that starts at `clock` from q and q'.
    pub fn flight(&self, structure: &Structure, clock: Clock, q: &[f64], v: &[f64]) -> ModalFlight {
        lanes::narrow(|| self.flight_here(structure, clock, q, v))
    }

    #[inline(always)]
    fn flight_here(
        &self,
        structure: &Structure,
        clock: Clock,
        q: &[f64],
        v: &[f64],
    ) -> ModalFlight {
        let start = self.drive.trig_at(clock);
        let phases: SmallVec<[Trig; FEW]> =
            self.modes.iter().map(|mode| start.turned_by(mode.ahead)).collect();
        let modes = structure
            .modes()
            .iter()
            .zip(&self.modes)
            .zip(&phases)
            .map(|((mode, motion), &phase)| {
                motion.oscillator.flight(dot(&mode.row, q), dot(&mode.row, v), phase)
            })
            .collect();
        let stops = self.stops.iter().map(|stop| stop.trig_at(clock)).collect();
        ModalFlight { modes, phases, stops }
    }

    /// Coordinates and velocities at any local time.
    pub fn state_after(
        &self,
        structure: &Structure,
        flight: &ModalFlight,
        elapsed: DoubleDouble,
    ) -> StructureState {
        if elapsed.hi <= self.reach {
            return lanes::narrow(|| self.state_near(structure, flight, elapsed));
        }
        lanes::narrow(|| self.state_far(structure, flight, elapsed))
    }

    /// A short time after the start: angles need not be reduced.
    #[inline(always)]
    fn state_near(
        &self,
        structure: &Structure,
        flight: &ModalFlight,
        elapsed: DoubleDouble,
    ) -> StructureState {
        let turn = self.drive.turned(Trig::ONE, elapsed.hi);
        let turned = (turn.cos_minus_1, turn.sin);
        self.state_of(structure, |i| {
            let motion = self.mode_at(flight, i, elapsed.hi, turned);
            self.modes[i].oscillator.equation.later(&motion, elapsed.lo)
        })
    }

    /// From displacement and rate of each mode.
    #[inline(always)]
    fn state_of(
        &self,
        structure: &Structure,
        mode: impl Fn(usize) -> (f64, f64),
    ) -> StructureState {
        let none = Coordinates::from_elem(0.0, structure.coordinates());
        let mut state = StructureState { q: none.clone(), v: none };
        for i in 0..self.modes.len() {
            let (place, rate) = mode(i);
            let shape = &structure.modes()[i].shape;
            for ((q, v), &shape) in state.q.iter_mut().zip(&mut state.v).zip(shape) {
                *q += shape * place;
                *v += shape * rate;
            }
        }
        state
    }

    #[inline(always)]
    fn state_far(
        &self,
        structure: &Structure,
        flight: &ModalFlight,
        elapsed: DoubleDouble,
    ) -> StructureState {
        let angle = elapsed.scale(self.drive.omega).reduced_angle();
        let (cos_minus_1, sin) = elementary::turn(angle, 0.0);
        self.state_of(structure, |i| {
            let body = &flight.modes[i];
            let turn = Turn::new(flight.phases[i], cos_minus_1, sin);
            self.modes[i].oscillator.after(body, body.x, elapsed, &turn)
        })
    }

    /// First contact of a flight within one span, among all stops.
    pub fn next_contact(&self, flight: &ModalFlight, starts: &[(usize, Start)]) -> StopContact {
        lanes::narrow(|| self.next_contact_here(flight, starts))
    }

    #[inline(always)]
    fn next_contact_here(&self, flight: &ModalFlight, starts: &[(usize, Start)]) -> StopContact {
        let (mut found, mut clear, mut left) = (None, f64::INFINITY, self.span);
        let shared = (self.stops.len() >= SHARED_BY).then(Shared::default);
        for stop in 0..self.stops.len() {
            let start = starts.iter().find(|(of, _)| *of == stop);
            let start = start.map_or(Start::Apart, |&(_, start)| start);
            let own = &self.stops[stop];
            let shared = shared.as_ref();
            let gap = StopGap { motion: self, flight, index: stop, stop: own, shared };
            match first_contact(&gap, start, left).found {
                Found::Contact(touch) if is_first(found, touch.local_time(), left) => {
                    left = touch.local_time();
                    let (time, offset) = (touch.time, touch.offset);
                    found = Some(StopContact::Met { stop, time, offset });
                }
                Found::Graze(touch) if is_first(found, touch.local_time(), left) => {
                    left = touch.local_time();
                    found = Some(StopContact::Grazed { stop, time: left });
                }
                Found::Resting(touch) if is_first(found, touch.local_time(), left) => {
                    left = touch.local_time();
                    found = Some(StopContact::Resting { stop, time: left });
                }
                Found::Clear(time) => {
                    // Earlier than asked for only where the search goes on as a new flight.
                    clear = clear.min(time);
                    if time < left {
                        (left, found) = (time, None);
                    }
                }
                Found::Contact(_) | Found::Graze(_) | Found::Resting(_) => clear = clear.min(left),
                Found::NotFinite | Found::Stalled => return StopContact::Failed { stop },
            }
        }
        // Without a stop nothing is met: the caller looks in now and then.
        found.unwrap_or(StopContact::Clear(if clear.is_finite() { clear } else { self.span }))
    }

    /// The gap of a stop at the start of a flight, with its derivatives.
    pub fn gap_at_start(&self, flight: &ModalFlight, stop: usize) -> GapPoint {
        let own = &self.stops[stop];
        let gap = StopGap { motion: self, flight, index: stop, stop: own, shared: None };
        gap.change(0.0).0
    }

    /// Motion of mode `i` at a local time within the span.
    #[inline(always)]
    pub fn mode_at(&self, flight: &ModalFlight, i: usize, s: f64, (c1, sin): (f64, f64)) -> Motion {
        let turn = Turn::new(flight.phases[i], c1, sin);
        self.modes[i].oscillator.at(&flight.modes[i], s, &turn)
    }

    pub fn table(&self, level: usize) -> &Table {
        self.tables[level].get_or_init(|| {
            let step = self.step(level);
            let times = std::array::from_fn(|j| step * (j + 1) as f64);
            let turns = times.map(|s| self.drive.turned(Trig::ONE, s));
            let responses =
                self.modes.iter().map(|mode| Response::new(&mode.oscillator, &times, &turns));
            Table { responses: responses.collect(), turns, weights: Weights::new(step) }
        })
    }

    pub fn step(&self, level: usize) -> f64 {
        SCAN_STEPS * self.span / (LANES << level) as f64
    }
}

/// Whether this local time comes first; of equal ones the lowest number does.
fn is_first(found: Option<StopContact>, time: f64, left: f64) -> bool {
    if found.is_some() { time < left } else { time <= left }
}
