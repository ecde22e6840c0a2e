//! Exact free motion of a linear structure, and the gaps of its stops (docs/structures.md): each mode
//! is a scalar oscillator, and a gap is a sum of their motions and of the stop's own.

use std::sync::OnceLock;

use super::drive::{Drive, Trig, Turn};
use super::oscillator::{BodyFlight, FreeBody, Motion, Oscillator};
use super::table::{Loads, Response};
use crate::flight::tolerances::CHUNK_TURNS;
use crate::model::state::Clock;
use crate::model::structure::Structure;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary;
use crate::numerics::lanes::LANES;
use crate::search::first_contact::{Found, Start, first_contact};
use crate::search::gap::{Gap, GapBounds, GapPoint, Higher};
use crate::search::steps::{Jet, Jets, LEVELS, ScanStart, SteppedGap, Weights, sextic_remainder};
use crate::search::tolerances::{BOUND_MARGIN, SCAN_SPANS, SCAN_STEPS};

/// What a structure's flights have in common, worked out once.
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

/// The gap of one stop along a flight.
struct StopGap<'a> {
    motion: &'a StructureMotion,
    flight: &'a StructureFlight,
    index: usize,
    stop: &'a StopMotion,
}

impl StopGap<'_> {
    /// The modes that move it, with their part n . phi.
    fn parts(&self) -> impl Iterator<Item = (usize, f64)> {
        self.stop.row.iter().copied().enumerate().filter(|&(_, part)| part != 0.0)
    }

    fn sum(&self, of: impl Fn(usize) -> f64) -> f64 {
        self.parts().map(|(i, part)| part.abs() * of(i)).sum()
    }

    /// |A| omega^n.
    fn stop_bound(&self, order: i32) -> f64 {
        self.stop.amplitude.abs() * self.stop.drive.omega.powi(order)
    }

    /// Derivatives 0 to 5 of the stop's motion A cos at a phase, its value as the increment from the
    /// start.
    fn stop_motion(&self, (c1, sin): (f64, f64)) -> [f64; 6] {
        let StopMotion { amplitude, drive, .. } = self.stop;
        if *amplitude == 0.0 {
            return [0.0; 6];
        }
        let start = self.flight.stops[self.index];
        let Trig { cos, sin: sin_psi } = Turn::new(start, c1, sin).phase;
        let (w, a) = (drive.omega, *amplitude);
        let increment = a * (start.cos * c1 - start.sin * sin);
        let (even, odd) = (a * w * w * cos, a * w * sin_psi);
        [increment, -odd, -even, odd * w * w, even * w * w, -odd * w.powi(4)]
    }

    fn turned(&self, s: f64) -> (f64, f64) {
        let turn = self.motion.drive.turned(Trig::ONE, s);
        (turn.cos_minus_1, turn.sin)
    }
}

impl Gap for StopGap<'_> {
    /// The jet, and the next two derivatives.
    type Instant = (GapPoint, Higher);
    type State = ();

    fn start(&self) -> (f64, f64) {
        let StopMotion { gap, amplitude, .. } = self.stop;
        let own = gap + amplitude * self.flight.stops[self.index].cos;
        let (mut value, mut size) = (-own, gap.abs() + amplitude.abs());
        for (i, part) in self.parts() {
            let term = part * self.flight.modes[i].x;
            (value, size) = (value + term, size + term.abs());
        }
        (value, size)
    }

    fn bounds(&self) -> GapBounds {
        let bound = |order: usize| {
            self.sum(|i| {
                let body = &self.flight.modes[i];
                self.motion.modes[i].oscillator.bounds(body, self.flight.phases[i]).0[order]
            })
        };
        GapBounds {
            slope_noise: 0.0,
            rate: bound(0) + self.stop_bound(1),
            fourth: (bound(3) + self.stop_bound(4)) * BOUND_MARGIN,
            fifth: f64::INFINITY,
            sixth: f64::INFINITY,
        }
    }

    fn change(&self, s: f64) -> (GapPoint, Self::Instant) {
        let turned = self.turned(s);
        let mut sums = self.stop_motion(turned).map(|own| -own);
        for (i, part) in self.parts() {
            let motion = self.motion.mode_at(self.flight, i, s, turned);
            let [fourth, fifth, _] = self.motion.modes[i].oscillator.equation.higher(&motion);
            let Motion { increment, rate, acceleration, jerk, .. } = motion;
            for (sum, term) in
                sums.iter_mut().zip([increment, rate, acceleration, jerk, fourth, fifth])
            {
                *sum += part * term;
            }
        }
        let [value, rate, second, third, fourth, fifth] = sums;
        let point = GapPoint { value, rate, second, third };
        (point, (point, Higher { fourth, fifth }))
    }

    fn higher(&self, (_, higher): &Self::Instant) -> Higher {
        *higher
    }

    fn state(&self, _: &Self::Instant, _: f64) {}
}

impl SteppedGap for StopGap<'_> {
    /// Local time where a scan stands.
    type Place = f64;
    /// Local time of the last place, and the step.
    type Places = (f64, f64);

    fn scan_start(&self) -> ScanStart {
        let (point, _) = self.change(0.0);
        let (value, _) = self.start();
        let mut bounds = [0.0; 6];
        for (i, part) in self.parts() {
            let own = self.motion.modes[i].oscillator.derivative_bounds(&self.flight.modes[i]);
            for (bound, term) in bounds.iter_mut().zip(own) {
                *bound += part.abs() * term;
            }
        }
        let bound = |order: i32| bounds[order as usize - 1] + self.stop_bound(order);
        ScanStart {
            start: Jet { value, rate: point.rate, second: point.second },
            bounds: GapBounds {
                slope_noise: 0.0,
                rate: bound(1),
                fourth: bound(4) * BOUND_MARGIN,
                fifth: bound(5),
                sixth: bound(6),
            },
        }
    }

    fn bounds_hold(&self) -> f64 {
        if self.motion.steady { SCAN_SPANS * self.motion.span } else { self.motion.span }
    }

    fn reach(&self) -> f64 {
        self.motion.reach
    }

    fn extent(&self) -> f64 {
        self.start().1
    }

    fn steps_hold(&self, _: f64) -> bool {
        true
    }

    /// By the amplitudes of all modes about their equilibria, and of the stop.
    fn never_meets(&self, slack: f64) -> bool {
        let (mut nearest, mut size) = (self.stop.amplitude.abs(), 0.0);
        for (i, part) in self.parts() {
            let oscillator = &self.motion.modes[i].oscillator;
            let (free, steady) = oscillator.amplitudes(&self.flight.modes[i]);
            let rest = part * oscillator.equation.equilibrium;
            nearest += part.abs() * (free + steady) + rest;
            size += rest.abs();
        }
        nearest * BOUND_MARGIN + (BOUND_MARGIN - 1.0) * size < self.stop.gap - slack
    }

    fn higher_at_start(&self) -> (f64, f64) {
        let (point, (_, higher)) = self.change(0.0);
        (point.third, higher.fourth)
    }

    fn remainder_factor(&self) -> f64 {
        self.motion.remainder_factor
    }

    fn place(&self) -> f64 {
        0.0
    }

    fn step(&self, level: usize) -> f64 {
        self.motion.step(level)
    }

    fn weights(&self, level: usize) -> &Weights {
        &self.motion.table(level).weights
    }

    fn eight_steps(&self, level: usize, from: &f64) -> ((f64, f64), Jets) {
        let table = self.motion.table(level);
        let turned = self.turned(*from);
        let mut jets = Jets::default();
        for j in 0..LANES {
            // The stop's own motion goes on from the start of the flight.
            let Turn { cos_minus_1, sin, .. } = table.turns[j];
            let c1 = turned.0 + cos_minus_1 + (turned.0 * cos_minus_1 - turned.1 * sin);
            let s1 = turned.1 + sin + (turned.1 * cos_minus_1 + turned.0 * sin);
            let own = self.stop_motion((c1, s1));
            jets.value[j] = self.own_place() - own[0];
            (jets.rate[j], jets.second[j]) = (-own[1], -own[2]);
        }
        for (i, part) in self.parts() {
            let mode = &self.motion.modes[i].oscillator;
            let body = &self.flight.modes[i];
            let (x, v, phase) = if *from == 0.0 {
                (body.x, body.v, self.flight.phases[i])
            } else {
                let motion = self.motion.mode_at(self.flight, i, *from, turned);
                let phase = Turn::new(self.flight.phases[i], turned.0, turned.1).phase;
                (motion.displacement(), motion.rate, phase)
            };
            let (xs, vs) = table.responses[i].motion(x, v, phase, Loads::of(mode));
            for j in 0..LANES {
                let Trig { cos, sin } = table.turns[j].phase;
                let cos_psi = phase.cos * cos - phase.sin * sin;
                jets.value[j] += part * xs[j];
                jets.rate[j] += part * vs[j];
                jets.second[j] += part * mode.equation.acceleration(xs[j], vs[j], cos_psi);
            }
        }
        ((*from, self.motion.step(level)), jets)
    }

    fn place_after((from, step): &(f64, f64), j: usize) -> f64 {
        from + step * (j + 1) as f64
    }
}

impl StopGap<'_> {
    /// What the stop and its gap take from the gap at the start of the flight.
    fn own_place(&self) -> f64 {
        let StopMotion { gap, amplitude, .. } = self.stop;
        -gap - amplitude * self.flight.stops[self.index].cos
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let terms = a.iter().zip(b);
    terms.fold(DoubleDouble::ZERO, |sum, (&a, &b)| sum + DoubleDouble::product(a, b)).value()
}
