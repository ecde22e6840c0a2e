//! From a contact that begins at an event to another instant nearby, to second order in the time T between:
//! z + A z T + A^2 z T^2/2, value and derivatives, so that both may be extrapolated to T = 0 together. Where
//! the end moves against a fixed instant, an error of T^3 has a derivative of T^2, which has no slope there.

use nalgebra::{DMatrix, DVector, RowDVector};

use super::{Stepper, Steppers};
use crate::model::state::Clock;
use crate::model::structure::Structure;
use crate::simulate::AnchorOf;
use crate::tangent::structure::rates::Linearised;

/// Factors of A z and A^2 z in that sum, and in its derivative by T.
fn parts(time: f64) -> [[f64; 2]; 2] {
    [[time, 0.5 * time * time], [1.0, time]]
}

impl Stepper {
    /// A times this, and what the column adds by what B is multiplied with.
    fn change(&self, of: &DVector<f64>, (at, by): (usize, &DVector<f64>)) -> DVector<f64> {
        let mut change = DVector::zeros(of.len());
        self.rates(1.0, of, &mut change);
        if let Some(acts) = self.acts.iter().position(|&(other, _)| other == at) {
            self.seconds[acts].add(1.0, by, &mut change);
        }
        change
    }
}

impl Steppers {
    /// q and q' at an instant after a leg begins at an event that a column delays by so much, and their
    /// derivatives from those at the event.
    pub fn ahead(
        &self,
        of: &Linearised,
        leg: &AnchorOf<Structure>,
        (events, delay): (&DMatrix<f64>, &RowDVector<f64>),
        instant: Clock,
    ) -> (DVector<f64>, DMatrix<f64>) {
        let stepper = self.of(of, leg);
        let drive = of.drive();
        let later = of.later(instant.period - leg.clock.period);
        let [grown, by_time] = parts(drive.until(leg.clock, instant).value());
        let mut z = of.in_modes(leg.clock, &leg.state);
        let [mut first, mut second] = [z.clone(), z.clone()];
        stepper.rates(1.0, &z, &mut first);
        stepper.rates(1.0, &first, &mut second);
        let (cos, sin) = (z[z.len() - 2], z[z.len() - 1]);
        let mut columns = DMatrix::zeros(events.nrows(), events.ncols());
        for (at, column) in events.column_iter().enumerate() {
            let by = of.by.get(at).map_or(0.0, |varied| varied.turn(leg.clock.time_in_period));
            let turn = by + drive.omega * delay[at];
            let mut dz = of.column_in_modes(column.as_slice(), [-sin * turn, cos * turn]);
            let d_first = stepper.change(&dz, (at, &z));
            let d_second = stepper.change(&d_first, (at, &first));
            let d_time = later.as_ref().map_or(0.0, |later| later[at]) - delay[at];
            dz.axpy(grown[0], &d_first, 1.0);
            dz.axpy(grown[1], &d_second, 1.0);
            dz.axpy(by_time[0] * d_time, &first, 1.0);
            dz.axpy(by_time[1] * d_time, &second, 1.0);
            of.out_of_modes(&dz, columns.column_mut(at).as_mut_slice());
        }
        z.axpy(grown[0], &first, 1.0);
        z.axpy(grown[1], &second, 1.0);
        let mut state = DVector::zeros(events.nrows());
        of.out_of_modes(&z, state.as_mut_slice());
        (state, columns)
    }
}
