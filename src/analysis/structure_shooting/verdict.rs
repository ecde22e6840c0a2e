//! Is a solution of the conditions of periodicity a motion of its structure? First every condition
//! of its legs, then a simulation over one orbit, which must pass the same impacts and come back.

use std::fmt;

use super::{StopConditionValue, StructureCycle, StructureItinerary, numbers};
use crate::analysis::shooting::{Digits, is_same_cycle, is_violated, largest};
use crate::analysis::tolerances::{CLOSES, NEAR_EVENT};
use crate::model::error::StateError;
use crate::model::structure::StructureState;
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::StopReason;
use crate::simulate::{Horizon, Simulation};
use crate::tangent::border::{Border, BorderKind};
use crate::tangent::itinerary::ItineraryError;

/// Why a solution is no motion of its structure.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum StructureRejection {
    /// A leg cannot be followed: its derivative is not finite.
    NotFollowed,
    /// A condition of a leg that does not hold.
    Violated(StopConditionValue),
    /// A simulation of it has no sequence of impacts.
    Simulation(ItineraryError),
    /// A simulation of it passes other events.
    OtherEvents,
    /// A simulation of it ends at this distance from its start.
    NotClosed(f64),
}

impl fmt::Display for StructureRejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFollowed => write!(f, "a leg cannot be followed"),
            Self::Violated(StopConditionValue { condition, value, .. }) => {
                let (stop, leg) = (condition.stop, condition.leg);
                match condition.border {
                    Border::ApproachVelocity => {
                        write!(
                            f,
                            "separating before the impact on stop {stop} (u = {})",
                            Digits(*value)
                        )
                    }
                    Border::Flight => {
                        write!(f, "stop {stop} is penetrated in flight (gap {})", Digits(-value))
                    }
                    border => {
                        let kind = border.kind().name().replace('_', " ");
                        write!(f, "{kind}: {} ({}, leg {leg})", border.text(), Digits(*value))
                    }
                }
            }
            Self::Simulation(why) => write!(f, "a simulation of it: {why}"),
            Self::OtherEvents => write!(f, "a simulation of it passes other events"),
            Self::NotClosed(off) => {
                write!(f, "a simulation of it does not come back (by {})", Digits(*off))
            }
        }
    }
}

impl StructureCycle<'_> {
    /// Why the solution is no motion; None if it is one. A simulation is given up after so many
    /// events.
    ///
    /// # Errors
    /// [`ItineraryError`] if `cancel` ends it.
    pub fn rejection(
        &self,
        max_events: u64,
        cancel: &CancelToken,
    ) -> Result<Option<StructureRejection>, ItineraryError> {
        let return_map = self.return_map();
        if return_map.iter().any(|entry| !entry.is_finite()) {
            return Ok(Some(StructureRejection::NotFollowed));
        }
        if let Some(violated) = self.violated() {
            return Ok(Some(StructureRejection::Violated(violated)));
        }
        let growth = largest(return_map.iter());
        self.simulated_otherwise(growth, max_events, cancel)
    }

    /// The first condition that does not hold, those of grazing before the others.
    fn violated(&self) -> Option<StopConditionValue> {
        let mut tests = self.tests();
        tests.sort_by_key(|test| test.condition.border.kind() != BorderKind::Grazing);
        tests.into_iter().find(|test| is_violated(test.condition.border, test.value))
    }

    fn simulated_otherwise(
        &self,
        growth: f64,
        max_events: u64,
        cancel: &CancelToken,
    ) -> Result<Option<StructureRejection>, ItineraryError> {
        let moment = self.clear_of_impacts();
        let start = self.state_at(moment);
        let turned;
        let structure = if moment == 0.0 {
            self.structure()
        } else {
            let drive = self.of.linearised.drive();
            let angle = drive.omega * (moment % drive.period.value());
            turned = self.structure().turned(angle);
            &turned
        };
        let periods = self.itinerary.periods;
        let followed = StructureItinerary::follow(structure, &start, periods, max_events, cancel);
        let passed = match followed {
            Ok((itinerary, _)) => itinerary.legs,
            Err(error) => return refused_or(error),
        };
        if !is_same_cycle(&passed, &self.itinerary.legs) {
            return Ok(Some(StructureRejection::OtherEvents));
        }
        let mut simulation = match Simulation::new(structure, start.clone()) {
            Ok(simulation) => simulation.until(Horizon::Periods(periods)).cancel_with(cancel),
            Err(error) => return refused_or(StateError::into(error)),
        };
        let end = loop {
            match simulation.advance(&mut ()) {
                Some(Ok(event)) => {
                    if let crate::simulate::structure::StructureEvent::Stop(stop) = event {
                        break stop.state;
                    }
                }
                Some(Err(error)) => return refused_or(error.into()),
                None => break start.clone(),
            }
        };
        if cancel.is_cancelled() {
            return Err(ItineraryError::Stopped(StopReason::Interrupted));
        }
        let (from, to) = (numbers(&start), numbers(&end));
        let off = (to - &from).amax();
        let scale = largest(from.iter());
        Ok((off > CLOSES * scale * growth).then_some(StructureRejection::NotClosed(off)))
    }

    /// Time from which to simulate an orbit: 0 unless an impact is within rounding of it, which a
    /// simulation might count twice, or not at all.
    fn clear_of_impacts(&self) -> f64 {
        if self.is_circuit() {
            return 0.0;
        }
        let drive = self.of.linearised.drive();
        let period = drive.period.value();
        let time = |leg: usize| drive.time(self.clock(leg, 0));
        let to_section =
            |time: f64| ((time + 0.5 * period).rem_euclid(period) - 0.5 * period).abs();
        let count = self.nodes.len();
        if (0..count).all(|leg| to_section(time(leg)) > NEAR_EVENT * period) {
            return 0.0;
        }
        let length = |leg: usize| {
            let (next, turns) = self.next(leg);
            drive.until(self.clock(leg, 0), self.clock(next, turns)).value()
        };
        let longest = (0..count).max_by(|&a, &b| length(a).total_cmp(&length(b))).unwrap_or(0);
        time(longest) + 0.5 * length(longest)
    }

    /// States at the starts of the drive periods.
    #[must_use]
    pub fn sections(&self) -> Vec<StructureState> {
        if self.is_circuit() && self.itinerary.periods == 1 {
            return vec![StructureState::of_numbers(&self.nodes[0])];
        }
        let period = self.of.linearised.drive().period.value();
        (0..self.itinerary.periods).map(|k| self.state_at(k as f64 * period)).collect()
    }
}

/// A wish to end is no verdict.
fn refused_or(error: ItineraryError) -> Result<Option<StructureRejection>, ItineraryError> {
    match error {
        ItineraryError::Stopped(StopReason::Interrupted) => Err(error),
        why => Ok(Some(StructureRejection::Simulation(why))),
    }
}
