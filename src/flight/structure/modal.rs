//! Free motion of a structure whose modes are oscillators of their own: the same closed forms as
//! the pendulum's, for every damping, at resonance, without a spring, and on a damper alone.

#![allow(clippy::inline_always)] // a flight is compiled for several instruction sets

mod begins;
mod carry;
mod few_steps;
mod flight_lanes;
mod fours;
mod search;
mod shared;
mod stop_gap;

pub(crate) use carry::Transitions;
pub(crate) use flight_lanes::{FlightLanes, Looked, Met, Shape};

use std::sync::OnceLock;

use smallvec::SmallVec;

use self::begins::StopGroup;
use self::carry::Carried;
use self::few_steps::ModeSteps;
use self::fours::{FOUR, Four};
use self::search::ContactSearch;
use super::{StopContact, StopMotion};
use crate::flight::drive::{Drive, Trig, Turn};
use crate::flight::oscillator::{BodyFlight, FreeBody, Oscillator};
use crate::flight::table::Response;
use crate::flight::tolerances::CHUNK_TURNS;
use crate::model::state::Clock;
use crate::model::structure::{Coordinates, Structure, StructureState};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary;
use crate::numerics::lanes::{self, LANES};
use crate::search::first_contact::Start;
use crate::search::gap::GapPoint;
use crate::search::steps::{LEVELS, Weights, sextic_remainder};
use crate::search::tolerances::{SCAN_SPANS, SCAN_STEPS};

/// What the flights have in common, worked out once.
#[derive(Debug, Clone)]
pub(super) struct ModalMotion {
    pub drive: Drive,
    pub modes: Vec<ModeMotion>,
    fours: Vec<Four>,
    stops: Vec<StopMotion>,
    groups: Vec<StopGroup>,
    pub span: f64,
    /// Time after which velocities have turned; infinite where nothing turns.
    pub longest: f64,
    /// Longest local time at which a contact is met.
    pub reach: f64,
    /// Whether the bounds of derivatives hold for all times.
    pub steady: bool,
    /// Whether all of the modes move by free motion and loads, the rounding of which grows with time.
    pub grows: bool,
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
    /// Of few modes.
    few: Vec<ModeSteps>,
    pub turns: [Turn; LANES],
    pub weights: Weights,
}

/// A flight between contacts.
#[derive(Debug, Clone)]
pub(super) struct ModalFlight {
    /// Time of its start.
    pub since: f64,
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
        let turns = fastest > 0.0;
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
            fours: Four::all(structure, &modes),
            grows: modes.iter().all(|mode| mode.oscillator.grows()),
            modes,
            groups: StopGroup::all(&stops),
            stops,
            span,
            longest: if turns { span } else { f64::INFINITY },
            reach: if plain { SCAN_SPANS * span } else { span },
            remainder_factor: sextic_remainder(longest / LANES as f64),
            tables: std::array::from_fn(|_| OnceLock::new()),
        }
    }

    /// The flight that starts at `clock` from q and q'.
    pub fn flight(&self, clock: Clock, q: &[f64], v: &[f64]) -> ModalFlight {
        lanes::narrow(StartOfFlight { motion: self, clock, q, v })
    }

    /// Coordinates and velocities at any local time.
    pub fn state_after(
        &self,
        structure: &Structure,
        flight: &ModalFlight,
        elapsed: DoubleDouble,
    ) -> StructureState {
        lanes::narrow(StateOfFlight { motion: self, structure, flight, elapsed })
    }

    /// Carries many states q, v, one after another, from t = 0 on, without loads and drive.
    pub fn carry(&self, structure: &Structure, elapsed: DoubleDouble, states: &mut [f64]) {
        lanes::narrow(Carried { motion: self, structure, elapsed, states });
    }

    /// Displacement and rate of each mode: a short time after the start, where angles need not be
    /// reduced,
    #[inline(always)]
    fn near(&self, flight: &ModalFlight, elapsed: DoubleDouble) -> SmallVec<[(f64, f64); FEW]> {
        let (motions, _) = self.modes_at(flight, elapsed.hi);
        let mut places = SmallVec::with_capacity(self.modes.len());
        for (motion, mode) in motions.iter().zip(&self.modes) {
            places.push(mode.oscillator.equation.later(motion, elapsed.lo));
        }
        places
    }

    /// and any time after it.
    #[inline(always)]
    fn far(&self, flight: &ModalFlight, elapsed: DoubleDouble) -> SmallVec<[(f64, f64); FEW]> {
        let angle = elapsed.scale(self.drive.omega).reduced_angle();
        let (cos_minus_1, sin) = elementary::turn(angle, 0.0);
        let mut places = SmallVec::with_capacity(self.modes.len());
        for i in 0..self.modes.len() {
            let body = &flight.modes[i];
            let turn = Turn::new(flight.phases[i], cos_minus_1, sin);
            places.push(self.modes[i].oscillator.after(body, body.x, elapsed, &turn));
        }
        places
    }

    /// First contact of a flight within one span, among all stops.
    pub fn next_contact(&self, flight: &ModalFlight, starts: &[(usize, Start)]) -> StopContact {
        lanes::narrow(ContactSearch { motion: self, flight, starts })
    }

    /// The gap of a stop at the start of a flight, with its derivatives.
    pub fn gap_at_start(&self, flight: &ModalFlight, stop: usize) -> GapPoint {
        let modes = self.mode_begins(flight);
        self.begins(flight, &modes, stop / LANES).get(stop % LANES).point
    }

    pub fn table(&self, level: usize) -> &Table {
        self.tables[level].get_or_init(|| {
            let step = self.step(level);
            let times = std::array::from_fn(|j| step * (j + 1) as f64);
            let turns = times.map(|s| self.drive.turned(Trig::ONE, s));
            let response = |mode: &ModeMotion| Response::new(&mode.oscillator, &times, &turns);
            let responses: Vec<_> = self.modes.iter().map(response).collect();
            let few = if self.modes.len() <= FEW {
                let modes = self.modes.iter().zip(&responses);
                modes.map(|(mode, of)| ModeSteps::new(&mode.oscillator, of, &turns)).collect()
            } else {
                Vec::new()
            };
            Table { responses, few, turns, weights: Weights::new(step) }
        })
    }

    pub fn step(&self, level: usize) -> f64 {
        SCAN_STEPS * self.span / (LANES << level) as f64
    }
}

/// The start of a flight, compiled for each set of vector instructions.
struct StartOfFlight<'a> {
    motion: &'a ModalMotion,
    clock: Clock,
    q: &'a [f64],
    v: &'a [f64],
}

impl pulp::NullaryFnOnce for StartOfFlight<'_> {
    type Output = ModalFlight;

    #[inline(always)]
    fn call(self) -> ModalFlight {
        let Self { motion, clock, q, v } = self;
        let start = motion.drive.trig_at(clock);
        let mut flight = ModalFlight {
            since: motion.drive.time(clock),
            modes: SmallVec::with_capacity(motion.modes.len()),
            phases: SmallVec::with_capacity(motion.modes.len()),
            stops: SmallVec::with_capacity(motion.stops.len()),
        };
        for (four, modes) in motion.fours.iter().zip(motion.modes.chunks(FOUR)) {
            let (x, v) = (four.coordinates(q), four.coordinates(v));
            for (j, mode) in modes.iter().enumerate() {
                let phase = start.turned_by(mode.ahead);
                flight.phases.push(phase);
                flight.modes.push(mode.oscillator.flight(x[j], v[j], phase));
            }
        }
        for stop in &motion.stops {
            flight.stops.push(stop.trig_at(clock));
        }
        flight
    }
}

/// A state of a flight, compiled for each set of vector instructions.
struct StateOfFlight<'a> {
    motion: &'a ModalMotion,
    structure: &'a Structure,
    flight: &'a ModalFlight,
    elapsed: DoubleDouble,
}

impl pulp::NullaryFnOnce for StateOfFlight<'_> {
    type Output = StructureState;

    #[inline(always)]
    fn call(self) -> StructureState {
        let Self { motion, structure, flight, elapsed } = self;
        let near = elapsed.hi <= motion.reach;
        let modes = if near { motion.near(flight, elapsed) } else { motion.far(flight, elapsed) };
        let count = structure.coordinates();
        let (mut q, mut v) =
            (Coordinates::from_elem(0.0, count), Coordinates::from_elem(0.0, count));
        for (&(place, rate), mode) in modes.iter().zip(structure.modes()) {
            for ((q, v), &shape) in q.iter_mut().zip(&mut v).zip(&mode.shape) {
                *q += shape * place;
                *v += shape * rate;
            }
        }
        StructureState { q, v }
    }
}
