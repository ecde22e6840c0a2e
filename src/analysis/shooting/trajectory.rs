//! An orbit as a function of time, and the derivative of its return map.

use nalgebra::Matrix4;

use super::{NOWHERE, Orbit};
use crate::model::state::State;
use crate::numerics::cancel::CancelToken;
use crate::simulate::Horizon;
use crate::simulate::run::{RunOptions, run};
use crate::tangent::itinerary::Leg;

impl Orbit<'_> {
    /// Derivative of the return map of (x1, x1', x2', t) just after the first node, the product of
    /// those of the legs; of a circuit, of (x1, x1', x2', x2). NaN where a leg cannot be followed.
    #[must_use]
    pub fn return_map(&self) -> Matrix4<f64> {
        product(&self.transfer())
    }

    /// Times of the nodes, rising, the first in the first orbit.
    pub(super) fn node_times(&self) -> Vec<f64> {
        let period = self.system.drive_period();
        self.itinerary
            .clocks
            .iter()
            .zip(self.nodes)
            .map(|(&clock, node)| clock as f64 * period + node.time)
            .collect()
    }

    /// Length of an orbit in time.
    pub(super) fn length(&self) -> f64 {
        self.itinerary.periods as f64 * self.system.drive_period()
    }

    /// State at any time; the orbit repeats. It is that of the solution, whether or not this is a
    /// motion. Not finite where a leg, or chatter in it, cannot be followed.
    #[must_use]
    pub fn state_at(&self, time: f64) -> State {
        if self.is_circuit() {
            return self.state_in_leg(0, time.rem_euclid(self.length())).unwrap_or(NOWHERE);
        }
        let starts = self.node_times();
        let place = (time - starts[0]).rem_euclid(self.length());
        // A NaN is before all of them.
        let leg = starts.iter().take_while(|&start| start - starts[0] <= place).count().max(1) - 1;
        let ahead = place - (starts[leg] - starts[0]);
        let state = if self.itinerary.legs[leg] == Leg::Chatter && ahead > 0.0 {
            self.state_in_chatter(leg, ahead)
        } else {
            self.state_in_leg(leg, ahead)
        };
        state.unwrap_or(NOWHERE)
    }

    /// State after a time of chatter, by simulation.
    fn state_in_chatter(&self, leg: usize, time: f64) -> Option<State> {
        let State { x1, v1, x2, v2 } = self.state_in_leg(leg, 0.0)?;
        let start = State::new(x1, v1, x2, v2).ok()?;
        let ahead = self.system.drive_frequency() * self.nodes[leg].time;
        let shifted = self.system.with("phase", self.system.phase() + ahead).ok()?;
        let until = RunOptions::until(Horizon::Time(time));
        Some(run(&shifted, start, until, &CancelToken::never()).ok()?.final_state.state)
    }
}

/// The product of the derivatives of all legs, the first on the right.
pub(super) fn product(transfer: &[Matrix4<f64>]) -> Matrix4<f64> {
    transfer.iter().fold(Matrix4::identity(), |product, leg| leg * product)
}
