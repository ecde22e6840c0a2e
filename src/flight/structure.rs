//! Exact free motion of a linear structure, and the gaps of its stops (docs/structures.md): each mode
//! is a scalar oscillator, and a gap is a sum of their motions and of the stop's own.

mod stop_gap;

use std::sync::OnceLock;

use super::drive::{Drive, Trig, Turn};
use super::oscillator::{BodyFlight, FreeBody, Motion, Oscillator};
use super::table::Response;
use crate::flight::tolerances::CHUNK_TURNS;
use crate::model::state::Clock;
use crate::model::structure::Structure;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary;
use crate::numerics::lanes::LANES;
use crate::search::first_contact::{Found, Start, first_contact};
use crate::search::steps::{LEVELS, Weights, sextic_remainder};
use crate::search::tolerances::{SCAN_SPANS, SCAN_STEPS};
use stop_gap::StopGap;

/// What a structure's flights have in common, worked out once.
///
/// # Example
/// A mass on a spring meets a stop, and is thrown back:
/// ```
/// use vibroimpact::impact::strike;
/// use vibroimpact::{Clock, Stop, StopContact, Structure, StructureMotion};
///
/// let structure = Structure::builder(vec![vec![1.0]], vec![vec![1.0]])
///     .stop(Stop::new([1.0], 0.5, 0.8))
///     .build()?;
/// let motion = StructureMotion::new(&structure);
/// let flight = motion.flight(Clock::START, &[0.0], &[1.0]); // sin t
/// let StopContact::Met { stop, time, offset } = motion.next_contact(&flight, &[]) else {
///     unreachable!("sin t reaches 0.5")
/// };
/// assert!((time + offset - 0.5f64.asin()).abs() < 1e-15);
/// let (q, mut v) = motion.state_after(&flight, time, offset);
/// let (_, approach) = motion.gap(stop, motion.clock_after(&flight, time, offset), &q, &v);
/// strike(&structure, stop, approach, &mut v)?;
/// assert!((v[0] + 0.8 * 0.75f64.sqrt()).abs() < 1e-15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct StructureMotion {
    structure: Structure,
    drive: Drive,
    modes: Vec<ModeMotion>,
    stops: Vec<StopMotion>,
    span: f64,
    /// Longest local time at which a contact is met.
    reach: f64,
    /// Whether the bounds of derivatives hold for all times.
    steady: bool,
    remainder_factor: f64,
    tables: [OnceLock<Table>; LEVELS],
}

#[derive(Debug, Clone)]
struct ModeMotion {
    oscillator: Oscillator,
    /// The argument of its drive's complex amplitude.
    ahead: Trig,
}

#[derive(Debug, Clone)]
struct StopMotion {
    /// n . phi of the modes.
    row: Vec<f64>,
    gap: f64,
    amplitude: f64,
    drive: Drive,
}

/// Steps of one length of all modes.
#[derive(Debug, Clone)]
struct Table {
    responses: Vec<Response>,
    turns: [Turn; LANES],
    weights: Weights,
}

/// A flight between contacts: it starts at some instant, and is evaluated at local times.
#[derive(Debug, Clone)]
pub struct StructureFlight {
    clock: Clock,
    /// By mode; their phases at the start; and the phases of the stops.
    modes: Vec<BodyFlight>,
    phases: Vec<Trig>,
    stops: Vec<Trig>,
}

/// What a search for the first contact of a flight found.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum StopContact {
    /// A stop is met, at the local time `time + offset`.
    Met {
        /// Which.
        stop: usize,
        /// Local time to rounding,
        time: f64,
        /// and what that rounding left out.
        offset: f64,
    },
    /// The gap of a stop rises to zero within rounding, at this local time, and falls again.
    Grazed {
        /// Which.
        stop: usize,
        /// Local time.
        time: f64,
    },
    /// A stop is touched without separation.
    Resting {
        /// Which.
        stop: usize,
    },
    /// No stop is met up to this local time.
    Clear(f64),
    /// A number is not finite, or the search was given up.
    Failed {
        /// At which stop.
        stop: usize,
    },
}

impl StructureMotion {
    /// The free motion of a structure.
    #[must_use]
    pub fn new(structure: &Structure) -> Self {
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
        let stops = structure
            .stops()
            .iter()
            .enumerate()
            .map(|(index, stop)| StopMotion {
                row: structure.contact(index).modal_normal.clone(),
                gap: stop.gap(),
                amplitude: stop.amplitude(),
                drive: Drive::new(omega, stop.phase()),
            })
            .collect();
        let plain = modes.iter().all(|mode| mode.oscillator.swings_from().is_finite());
        Self {
            structure: structure.clone(),
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

    /// The structure.
    #[must_use]
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// Length of a local flight, up to which a contact is looked for at once.
    #[must_use]
    pub fn span(&self) -> f64 {
        self.span
    }

    /// The flight that starts at `clock` from coordinates q and velocities v, each (N,).
    ///
    /// # Panics
    /// If q or v has another length.
    #[must_use]
    pub fn flight(&self, clock: Clock, q: &[f64], v: &[f64]) -> StructureFlight {
        let count = self.structure.coordinates();
        assert!(q.len() == count && v.len() == count, "{count} coordinates and velocities");
        let start = self.drive.trig_at(clock);
        let phases: Vec<Trig> = self.modes.iter().map(|mode| start.turned_by(mode.ahead)).collect();
        let modes = self
            .structure
            .modes()
            .iter()
            .zip(&self.modes)
            .zip(&phases)
            .map(|((mode, motion), &phase)| {
                motion.oscillator.flight(dot(&mode.row, q), dot(&mode.row, v), phase)
            })
            .collect();
        let stops = self.stops.iter().map(|stop| stop.drive.trig_at(clock)).collect();
        StructureFlight { clock, modes, phases, stops }
    }

    /// The clock at a local time of a flight.
    #[must_use]
    pub fn clock_after(&self, flight: &StructureFlight, time: f64, offset: f64) -> Clock {
        self.drive.advance(flight.clock, DoubleDouble::sum(time, offset))
    }

    /// Coordinates and velocities at any local time, `time + offset`.
    #[must_use]
    pub fn state_after(
        &self,
        flight: &StructureFlight,
        time: f64,
        offset: f64,
    ) -> (Vec<f64>, Vec<f64>) {
        let elapsed = DoubleDouble::sum(time, offset);
        let angle = elapsed.scale(self.drive.omega).reduced_angle();
        let (cos_minus_1, sin) = elementary::turn(angle, 0.0);
        let count = self.structure.coordinates();
        let (mut q, mut v) = (vec![0.0; count], vec![0.0; count]);
        for (i, mode) in self.modes.iter().enumerate() {
            let body = &flight.modes[i];
            let turn = Turn::new(flight.phases[i], cos_minus_1, sin);
            let (place, rate) = mode.oscillator.after(body, body.x, elapsed, &turn);
            for (k, &shape) in self.structure.modes()[i].shape.iter().enumerate() {
                q[k] += shape * place;
                v[k] += shape * rate;
            }
        }
        (q, v)
    }

    /// Gap of a stop and its rate, u, at a clock, coordinates and velocities.
    #[must_use]
    pub fn gap(&self, stop: usize, clock: Clock, q: &[f64], v: &[f64]) -> (f64, f64) {
        let StopMotion { gap, amplitude, drive, .. } = &self.stops[stop];
        let normal = self.structure.stops()[stop].normal();
        let Trig { cos, sin } = drive.trig_at(clock);
        (dot(normal, q) - gap - amplitude * cos, dot(normal, v) + amplitude * drive.omega * sin)
    }

    /// The coordinates of a contact, whose gap is 0 to rounding, moved onto the stop so that rounding
    /// does not add up.
    #[must_use]
    pub fn on_stop(&self, stop: usize, gap: f64, q: &[f64]) -> Vec<f64> {
        let rows = self.structure.contact(stop);
        let part = gap / rows.mobilities[0];
        q.iter().zip(&rows.by_normal).map(|(q, m)| q - part * m).collect()
    }

    /// First contact of a flight within one span, among all stops. `starts`: how the flight starts at
    /// some of them, as on the one that has just been struck; it is apart from the others.
    #[must_use]
    pub fn next_contact(&self, flight: &StructureFlight, starts: &[(usize, Start)]) -> StopContact {
        let mut found = StopContact::Clear(self.span);
        let mut left = self.span;
        for stop in 0..self.stops.len() {
            let start = starts.iter().find(|(of, _)| *of == stop);
            let start = start.map_or(Start::Apart, |&(_, start)| start);
            let gap = StopGap { motion: self, flight, index: stop, stop: &self.stops[stop] };
            match first_contact(&gap, start, left).found {
                Found::Contact(touch) if touch.local_time() <= left => {
                    left = touch.local_time();
                    found = StopContact::Met { stop, time: touch.time, offset: touch.offset };
                }
                Found::Graze(touch) if touch.local_time() <= left => {
                    left = touch.local_time();
                    found = StopContact::Grazed { stop, time: touch.local_time() };
                }
                Found::Contact(_) | Found::Graze(_) | Found::Clear(_) => {}
                Found::Resting(_) => return StopContact::Resting { stop },
                Found::NotFinite | Found::Stalled => return StopContact::Failed { stop },
            }
        }
        found
    }

    /// Motion of mode `i` at a local time within the span.
    fn mode_at(&self, flight: &StructureFlight, i: usize, s: f64, (c1, sin): (f64, f64)) -> Motion {
        let turn = Turn::new(flight.phases[i], c1, sin);
        self.modes[i].oscillator.at(&flight.modes[i], s, &turn)
    }

    fn table(&self, level: usize) -> &Table {
        self.tables[level].get_or_init(|| {
            let step = self.step(level);
            let times = std::array::from_fn(|j| step * (j + 1) as f64);
            let turns = times.map(|s| self.drive.turned(Trig::ONE, s));
            let responses =
                self.modes.iter().map(|mode| Response::new(&mode.oscillator, &times, &turns));
            Table { responses: responses.collect(), turns, weights: Weights::new(step) }
        })
    }

    fn step(&self, level: usize) -> f64 {
        SCAN_STEPS * self.span / (LANES << level) as f64
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let terms = a.iter().zip(b);
    terms.fold(DoubleDouble::ZERO, |sum, (&a, &b)| sum + DoubleDouble::product(a, b)).value()
}
