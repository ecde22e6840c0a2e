//! Derivatives of the conditions of periodicity by a parameter, at fixed nodes.
//!
//! With the response to the drive h = D^-1 f, D = K - w^2 M + i w C in the modes, a flight is
//!
//! ```text
//! x(t) = X(psi) + y(t),    X = Re(h exp(i psi), i w h exp(i psi)),    y' = A y + constant load
//! ```
//!
//! so that a parameter of the drive changes it by dX at its end, by -Phi dX from its start, and by
//! the rate of y times the change of its duration: periods that it passes become longer or shorter.
//! dh/dw = -D^-1 (-2 w M + i C) h.

use nalgebra::{Complex, DMatrix, DVector};

use super::{Flown, StructureCycle};
use crate::model::state::Clock;
use crate::model::structure::StructureParameter;
use crate::tangent::structure::Linearised;

/// h and dh/dw of the modes, and their shapes.
#[derive(Debug)]
pub(super) struct Response {
    amplitude: DVector<Complex<f64>>,
    by_frequency: DVector<Complex<f64>>,
    shapes: DMatrix<f64>,
}

/// X by the phase and by w, at one instant.
struct Driven {
    by_phase: DVector<f64>,
    by_frequency: DVector<f64>,
}

impl Response {
    /// None at resonance without damping.
    pub fn new(of: &Linearised) -> Option<Self> {
        let structure = &of.structure;
        let (modes, omega) = (structure.modes(), structure.drive_frequency());
        let count = modes.len();
        let damping = structure.modal_damping().rounded();
        let square = |i: usize| modes[i].frequency.value().powi(2);
        let matrix = DMatrix::from_fn(count, count, |i, j| {
            let own = if i == j { square(i) - omega * omega } else { 0.0 };
            Complex::new(own, omega * damping[(i, j)])
        });
        let solver = matrix.lu();
        let force = DVector::from_fn(count, |i, _| modes[i].drive);
        let amplitude = solver.solve(&force)?;
        let slope = DVector::from_fn(count, |i, _| {
            let damped: Complex<f64> =
                (0..count).map(|j| Complex::new(0.0, damping[(i, j)]) * amplitude[j]).sum();
            amplitude[i] * (2.0 * omega) - damped
        });
        let by_frequency = solver.solve(&slope)?;
        let finite =
            |x: &DVector<Complex<f64>>| x.iter().all(|x| x.re.is_finite() && x.im.is_finite());
        let shapes = DMatrix::from_fn(structure.coordinates(), count, |k, i| modes[i].shape[k]);
        (finite(&amplitude) && finite(&by_frequency)).then_some(Self {
            amplitude,
            by_frequency,
            shapes,
        })
    }

    /// At a phase psi of the drive, `time` after the start of its period.
    fn at(&self, psi: f64, time: f64, omega: f64) -> Driven {
        let turn = Complex::from_polar(1.0, psi);
        let i = Complex::<f64>::i();
        let real = |of: &dyn Fn(usize) -> Complex<f64>| {
            let modes = DVector::from_fn(self.amplitude.len(), |k, _| (of(k) * turn).re);
            &self.shapes * modes
        };
        let (h, dh) = (&self.amplitude, &self.by_frequency);
        let stacked = |q: DVector<f64>, v: DVector<f64>| {
            DVector::from_iterator(2 * q.len(), q.iter().chain(v.iter()).copied())
        };
        Driven {
            by_phase: stacked(real(&|k| i * h[k]), real(&|k| -h[k] * omega)),
            by_frequency: stacked(
                real(&|k| dh[k] + i * h[k] * time),
                real(&|k| i * h[k] + i * dh[k] * omega - h[k] * (omega * time)),
            ),
        }
    }
}

impl StructureCycle<'_> {
    /// Derivative of the equations of a leg by a parameter at fixed nodes, (2N + 1): of the state at
    /// its end, and of the gap there.
    pub(super) fn by_parameter(
        &self,
        flown: &Flown,
        leg: usize,
        parameter: StructureParameter,
    ) -> DVector<f64> {
        let size = 2 * self.structure().coordinates();
        let is_of = |stop: Option<usize>| {
            flown.strike.as_ref().is_some_and(|strike| stop.is_none_or(|stop| stop == strike.stop))
        };
        let mut by = DVector::zeros(size + 1);
        match (parameter, &flown.strike) {
            (StructureParameter::DriveFrequency | StructureParameter::Phase, _) => {
                return self.by_drive(flown, leg, parameter == StructureParameter::DriveFrequency);
            }
            (StructureParameter::Gap(stop), _) if is_of(stop) => by[size] = -1.0,
            (StructureParameter::Restitution(stop), Some(strike)) if is_of(stop) => {
                by.rows_mut(0, size).copy_from(&strike.by_law[0]);
            }
            (StructureParameter::OfCurve(name, stop), Some(strike)) if is_of(stop) => {
                let coefficient = self.structure().stops()[strike.stop].coefficient();
                if let Some(place) = coefficient.place_of(name) {
                    let by_number = coefficient.by_number(strike.approach_velocity, place);
                    by.rows_mut(0, size).copy_from(&(&strike.by_law[0] * by_number));
                }
            }
            (StructureParameter::Friction(stop), Some(strike)) if is_of(stop) => {
                by.rows_mut(0, size).copy_from(&strike.by_law[1]);
            }
            _ => {}
        }
        by
    }

    fn by_drive(&self, flown: &Flown, leg: usize, by_frequency: bool) -> DVector<f64> {
        let (structure, linearised) = (self.structure(), &self.of.linearised);
        let size = 2 * structure.coordinates();
        let omega = structure.drive_frequency();
        let response = self.of.response.get_or_init(|| Response::new(linearised));
        let Some(response) = response else { return DVector::from_element(size + 1, f64::NAN) };
        // Times in the periods of the nodes, whichever periods they lie in.
        let time = |leg: usize| if self.is_circuit() { 0.0 } else { self.nodes[leg][size] };
        let (next, turns) = self.next(leg);
        let (start, end) = (time(leg), time(next));
        let driven = |clock, time| response.at(phase_at(linearised, clock), time, omega);
        let (first, last) = (driven(flown.from, start), driven(flown.to, end));
        let mut state = if by_frequency {
            let passed = self.itinerary.clocks[next] + turns * self.itinerary.periods
                - self.itinerary.clocks[leg];
            let longer = -(passed as f64) * linearised.drive().period.value() / omega;
            let other = &flown.rates[1] - &last.by_phase * omega;
            &last.by_frequency - &flown.flow * &first.by_frequency + other * longer
        } else {
            &last.by_phase - &flown.flow * &first.by_phase
        };
        let mut gap = 0.0;
        if let Some(strike) = &flown.strike {
            gap = strike.normal.dot(&state);
            state = &strike.through * state;
            if by_frequency {
                // The stop moves too: a cos(w t + phase), at a fixed time.
                let (gap_by_time, rate_by_time) = strike.by_time;
                gap += gap_by_time * end / omega;
                state += &strike.by_rate * ((gap_by_time + end * rate_by_time) / omega);
            }
        }
        DVector::from_iterator(size + 1, state.iter().copied().chain([gap]))
    }
}

fn phase_at(of: &Linearised, clock: Clock) -> f64 {
    let trig = of.drive().trig_at(clock);
    trig.sin.atan2(trig.cos)
}
