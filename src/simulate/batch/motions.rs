//! Motions of both bodies of several systems at once, one system in each lane (src/flight.rs).

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

use crate::flight::{
    Beat, Beats, BodyFlight, BodyFlights, Drives, Equation, Equations, FreeMotion, Motion,
    MotionLanes, SeriesLanes, Trigs, Turn, turn_within,
};
use crate::model::angle::Angles;
use crate::model::parameters::System;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::{LANES, Lanes};

/// What does not change along a run.
#[derive(Debug, Clone, Default)]
#[repr(C, align(64))]
pub(super) struct Systems {
    pub drives: Drives,
    pub pendulums: Equations,
    pub oscillators: Equations,
    /// Of pendulums and oscillators.
    pub beats: [Beating; 2],
    pub gap: Lanes,
    pub mass_ratio: Lanes,
    /// r; NaN where it depends on the approach velocity: such impacts are resolved by themselves.
    pub restitution: Lanes,
    pub friction: Lanes,
    /// Whether any body is damped.
    damped: bool,
}

impl Systems {
    /// A system in lane `j`.
    pub fn set(&mut self, j: usize, system: &System, motion: &FreeMotion) {
        self.drives.set(j, &motion.drive);
        self.pendulums.set(j, &motion.pendulum.equation);
        self.oscillators.set(j, &motion.oscillator.equation);
        for (beats, body) in self.beats.iter_mut().zip([&motion.pendulum, &motion.oscillator]) {
            beats.set(j, body.beat());
        }
        self.gap[j] = system.gap;
        self.mass_ratio[j] = system.mass_ratio;
        let changes = system.restitution_curve.is_some();
        self.restitution[j] = if changes { f64::NAN } else { system.restitution };
        self.friction[j] = system.friction;
        let mut decay_rates = self.pendulums.decay_rate.iter().chain(&self.oscillators.decay_rate);
        self.damped = decay_rates.any(|&rate| rate > 0.0);
    }

    /// Changes of the amplitudes of both bodies' free motions after these times. Exponentials are dear,
    /// and most systems are undamped: without any damping none is computed.
    #[inline(always)]
    pub fn amplitude_changes(&self, times: &Lanes) -> [Lanes; 2] {
        if self.damped {
            [self.pendulums.amplitude_changes(times), self.oscillators.amplitude_changes(times)]
        } else {
            [[0.0; LANES]; 2]
        }
    }
}

/// Bodies near resonance.
#[derive(Debug, Clone, Default)]
pub(super) struct Beating {
    beats: Beats,
    /// 1 for a body that beats.
    pub which: [u64; LANES],
}

impl Beating {
    fn set(&mut self, j: usize, beat: Option<&Beat>) {
        self.which[j] = u64::from(beat.is_some());
        if let Some(beat) = beat {
            self.beats.set(j, beat);
        }
    }

    /// Whether any body beats.
    #[inline(always)]
    fn any(&self) -> bool {
        self.which.iter().sum::<u64>() > 0
    }

    /// Increments and rates of the bodies that beat.
    #[inline(always)]
    fn motions(
        &self,
        equations: &Equations,
        flights: &BodyFlights,
        times: &Lanes,
        changes: &Lanes,
        (cos_minus_1, sin): (&Lanes, &Lanes),
    ) -> [Lanes; 2] {
        let mut motions = [[0.0; LANES]; 2];
        if self.any() {
            for j in 0..LANES {
                let (equation, f, s) = (equations.get(j), flights.get(j), times[j]);
                let basis = equation.swinging_basis(changes[j], (cos_minus_1[j], sin[j]));
                let free = Equation::free(&f, basis);
                let forced = self.beats.get(j).near((f.p, f.q), s, basis);
                (motions[0][j], motions[1][j]) = (free.0 + forced.0, free.1 + forced.1);
            }
        }
        motions
    }

    /// Flights of the bodies that beat, in place of those with a steady response.
    #[inline(always)]
    pub fn start(
        &self,
        equations: &Equations,
        x: &Lanes,
        v: &Lanes,
        starts: &Trigs,
        flights: &mut BodyFlights,
    ) {
        if self.any() {
            for j in 0..LANES {
                let (equation, beat) = (equations.get(j), self.beats.get(j));
                let beating = equation.beating_flight(&beat, x[j], v[j], starts.get(j));
                let steady = flights.get(j);
                flights.set(j, if self.which[j] == 1 { &beating } else { &steady });
            }
        }
    }
}

/// Flights, each from its start.
#[derive(Debug, Clone, Default)]
#[repr(C, align(64))]
pub(super) struct Flights {
    pub time_in_period: Lanes,
    pub residual: Lanes,
    pub angles: Angles,
    pub phases: Trigs,
    pub pendulums: BodyFlights,
    pub oscillators: BodyFlights,
}

/// Motions of both bodies at a local time of each flight.
#[derive(Debug, Clone, Default)]
#[repr(C, align(64))]
pub(super) struct Motions {
    series: [SeriesLanes; 2],
    pendulums: MotionLanes,
    oscillators: MotionLanes,
}

impl Motions {
    /// The motions at these times, at which no free motion has decayed.
    #[inline(always)]
    pub fn evaluate(&mut self, systems: &Systems, flights: &Flights, times: &Lanes) {
        let Self { series, pendulums, oscillators } = self;
        let mut cos_minus_1 = [[0.0; LANES]; 3];
        let mut sin = [[0.0; LANES]; 3];
        for j in 0..LANES {
            let turns = [
                turn_within(systems.pendulums.get(j).damped, times[j]),
                turn_within(systems.oscillators.get(j).damped, times[j]),
                turn_within(DoubleDouble::new(systems.drives.omega[j]), times[j]),
            ];
            for body in 0..3 {
                (cos_minus_1[body][j], sin[body][j]) = turns[body];
            }
        }
        let changes = systems.amplitude_changes(times);
        let beating = [
            systems.beats[0].motions(
                &systems.pendulums,
                &flights.pendulums,
                times,
                &changes[0],
                (&cos_minus_1[0], &sin[0]),
            ),
            systems.beats[1].motions(
                &systems.oscillators,
                &flights.oscillators,
                times,
                &changes[1],
                (&cos_minus_1[1], &sin[1]),
            ),
        ];
        series[0].sum(&systems.pendulums, &flights.pendulums, &flights.phases, times);
        series[1].sum(&systems.oscillators, &flights.oscillators, &flights.phases, times);
        for j in 0..LANES {
            let turn = Turn::new(flights.phases.get(j), cos_minus_1[2][j], sin[2][j]);
            let near_by = |body: usize| Near {
                s: times[j],
                change: changes[body][j],
                turned: (cos_minus_1[body][j], sin[body][j]),
                summed: (series[body].increment[j], series[body].rate[j]),
                beats: systems.beats[body].which[j] == 1,
                beating: (beating[body][0][j], beating[body][1][j]),
                turn,
            };
            let (first, second) = (near_by(0), near_by(1));
            let (pendulum, oscillator) = (systems.pendulums.get(j), systems.oscillators.get(j));
            pendulums.set(j, &first.motion(&pendulum, &flights.pendulums.get(j)));
            oscillators.set(j, &second.motion(&oscillator, &flights.oscillators.get(j)));
        }
    }

    /// The motions of both bodies in lane `j`.
    #[inline(always)]
    pub fn get(&self, j: usize, flights: &Flights) -> (Motion, Motion) {
        let (mut p, mut o) = (self.pendulums.get(j), self.oscillators.get(j));
        p.place_after(flights.pendulums.x[j]);
        o.place_after(flights.oscillators.x[j]);
        (p, o)
    }
}

/// How far one body has come by local time `s`.
struct Near {
    s: f64,
    /// Of the amplitude of its free motion.
    change: f64,
    /// (cos wd s - 1, sin wd s).
    turned: (f64, f64),
    /// Increment and rate by the Taylor series, for a short time.
    summed: (f64, f64),
    /// Whether the body beats, and its increment and rate by the formulas for that.
    beats: bool,
    beating: (f64, f64),
    turn: Turn,
}

impl Near {
    #[inline(always)]
    fn motion(&self, equation: &Equation, flight: &BodyFlight) -> Motion {
        let swung = equation.swung(flight, self.change, self.turned, &self.turn);
        let swung = if self.beats { self.beating } else { swung };
        let (increment, rate) = if self.s <= equation.short { self.summed } else { swung };
        equation.motion_from(increment, rate, [flight.x, increment], &self.turn)
    }
}
