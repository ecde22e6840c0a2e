//! What a variation of a structure changes by itself: at an event, and in an impact.

use nalgebra::{DMatrix, DVector, RowDVector};

use smallvec::SmallVec;

use super::rates::{Linearised, OtherMasses, Varied, add_moved};
use crate::model::state::Clock;
use crate::model::structure::{StopVariation, Structure, StructureState};
use crate::simulate::{AnchorOf, Model};

impl Linearised {
    /// d(2 pi/omega)/d omega; 0 of a drive that stands still, of which no periods are counted.
    pub fn period_rate(&self) -> f64 {
        let drive = self.drive();
        if drive.has_period() { -drive.period.hi / drive.omega } else { 0.0 }
    }

    /// Whether the frequency of the drive varies.
    pub fn turns(&self) -> bool {
        self.by.iter().any(|by| by.by.drive_frequency != 0.0)
    }

    /// By how much an instant in another drive period comes later, of each column.
    pub fn later(&self, periods: i64) -> Option<RowDVector<f64>> {
        let moves = periods != 0 && self.turns();
        let by_one = self.period_rate() * periods as f64;
        moves.then(|| self.each(|by| by.by.drive_frequency * by_one))
    }

    fn each(&self, of: impl Fn(&Varied) -> f64) -> RowDVector<f64> {
        RowDVector::from_iterator(self.by.len(), self.by.iter().map(of))
    }

    /// What each column changes in the gap of a stop at a fixed instant in a fixed state, and in its
    /// rate; `None` where they change neither.
    pub fn by_number(&self, stop: usize, clock: Clock) -> Option<[RowDVector<f64>; 2]> {
        if !self.moved[stop] {
            return None;
        }
        let drive = self.stops[stop];
        let (trig, omega) = (drive.trig_at(clock), drive.omega);
        let amplitude = self.structure.stops()[stop].amplitude();
        let gap = self.each(|varied| {
            let own = varied.by.stop(stop);
            let turn = varied.turn_of(&own, clock.time_in_period);
            amplitude * trig.sin * turn - own.gap - own.amplitude * trig.cos
        });
        let rate = self.each(|varied| {
            let own = varied.by.stop(stop);
            let turn = varied.turn_of(&own, clock.time_in_period);
            let faster = varied.by.drive_frequency;
            trig.sin * (own.amplitude * omega + amplitude * faster)
                + amplitude * omega * trig.cos * turn
        });
        Some([gap, rate])
    }

    /// x . (dM in the modes) y of each column; `None` if no mass varies.
    pub fn by_mass(&self, x: &DVector<f64>, y: &DVector<f64>) -> Option<RowDVector<f64>> {
        self.varies_mass().then(|| {
            self.each(|varied| varied.modal.mass.as_ref().map_or(0.0, |mass| x.dot(&(mass * y))))
        })
    }

    pub fn varies_mass(&self) -> bool {
        self.by.iter().any(|varied| varied.modal.mass.is_some())
    }

    /// Derivatives of r of an impact on a stop at the approach velocity u, and of its friction, of each
    /// column; `None` where there are none.
    pub fn by_law(&self, stop: usize, u: f64) -> Option<[RowDVector<f64>; 2]> {
        if !self.other_laws[stop] {
            return None;
        }
        let coefficient = self.structure.stops()[stop].coefficient();
        let numbers = coefficient.curve.map_or(0, |curve| curve.names().len());
        let by_numbers: SmallVec<[f64; 4]> =
            (0..numbers).map(|place| coefficient.by_number(u, place)).collect();
        let of_curve = |own: &StopVariation| {
            let terms = by_numbers.iter().zip(&own.of_curve);
            terms.map(|(by, rate)| by * rate).sum::<f64>()
        };
        Some([
            self.each(|varied| {
                let own = varied.by.stop(stop);
                own.restitution + of_curve(&own)
            }),
            self.each(|varied| varied.by.stop(stop).friction),
        ])
    }

    /// What other masses change at a stop.
    pub fn other_masses(&self, stop: usize) -> OtherMasses {
        let [n, t] = self.modal_rows(stop);
        let changed = |x, y| -self.by_mass(x, y).unwrap_or_else(|| self.each(|_| 0.0));
        let modes = self.structure.modes();
        let count = modes.len();
        let shapes = DMatrix::from_fn(count, count, |k, i| modes[i].shape[k]);
        let by_impulse = [&n, &t].map(|row| {
            let mut all = DMatrix::zeros(count, self.by.len());
            for (mut column, varied) in all.column_iter_mut().zip(&self.by) {
                if let Some(mass) = &varied.modal.mass {
                    column.copy_from(&(&shapes * (mass * row)));
                }
            }
            all
        });
        OtherMasses { mobilities: [changed(&n, &n), changed(&n, &t), changed(&t, &t)], by_impulse }
    }

    /// What other masses change in the velocities after an impact by these impulses on a stop:
    /// -(M^-1 dM) (v+ - v-).
    pub fn by_inertia(&self, stop: usize, impulses: [f64; 2], events: &mut DMatrix<f64>) {
        let Some(masses) = self.masses.get(stop) else { return };
        let count = self.structure.coordinates();
        // v+ - v- = M^-1 (t Q - n P).
        for (impulse, by) in [impulses[0], -impulses[1]].into_iter().zip(&masses.by_impulse) {
            if impulse != 0.0 {
                let mut rates = events.rows_mut(count, count);
                rates.zip_apply(by, |x, by| *x += impulse * by);
            }
        }
    }

    /// n . phi and t . phi of a stop.
    pub fn modal_rows(&self, stop: usize) -> [DVector<f64>; 2] {
        let rows = self.structure.contact(stop);
        [&rows.modal_normal, &rows.modal_tangent]
            .map(|row| DVector::from_iterator(row.len(), row.iter().map(|x| x.value())))
    }

    /// Derivatives at a fixed time since the start from those at a fixed time in a fixed period.
    pub fn at_fixed_time(
        &self,
        leg: &AnchorOf<Structure>,
        clock: Clock,
        columns: &mut DMatrix<f64>,
    ) {
        if let Some(later) = self.later(-clock.period) {
            let state = self.state_at(leg, clock);
            add_moved(columns, &self.rates(leg, clock, &state), &later);
        }
    }

    /// The state of a leg at an instant.
    pub fn state_at(&self, leg: &AnchorOf<Structure>, clock: Clock) -> StructureState {
        let elapsed = self.drive().until(leg.clock, clock);
        if elapsed.hi <= 0.0 {
            return leg.state.clone();
        }
        let flight = self.motion.leg(leg, leg.clock, leg.state.clone());
        Structure::state_after(&self.motion, &flight, elapsed)
    }
}
