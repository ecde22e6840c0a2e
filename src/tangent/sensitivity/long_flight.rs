//! Flights over many drive periods.

use super::columns::{Column, Columns, Differentiated, Here};
use super::error::SensitivityError;
use super::impact::FollowedImpact;
use crate::model::state::{Clock, State};
use crate::tangent::long_flight::Part;
use crate::tangent::strike::Departure;

/// Points of one flight, each on the way from the one before, and the parts that end there: for instants in
/// their order a long flight is carried on but once.
#[derive(Debug, Clone, Default)]
pub(super) struct Waypoints(Vec<(Part, Here)>);

impl Waypoints {
    /// They are of another flight.
    pub fn forget(&mut self) {
        self.0.clear();
    }
}

impl Differentiated {
    /// Derivatives of the state at a fixed instant of the flight from here, and its rates there, where a
    /// column looks at them; `known`: the state there. What it returns does not depend on the points that
    /// are `passed` already.
    pub fn at(
        &self,
        here: &Here,
        passed: &mut Waypoints,
        (clock, known): (Clock, Option<&State>),
    ) -> Result<(Columns, Column), SensitivityError> {
        let near = self.nearer(here, passed, clock)?.unwrap_or(here);
        self.at_once(near, clock, known)
    }

    /// From an event to the impact at this clock that ends the flight from there; the derivatives just
    /// before it, at its own time, and u after it.
    pub fn strike(
        &self,
        here: &mut Here,
        impact: &FollowedImpact,
        clock: Clock,
    ) -> Result<(Columns, f64), SensitivityError> {
        if let Some(nearer) = self.nearer(here, &mut Waypoints::default(), clock)? {
            *here = nearer.clone();
        }
        self.strike_at_once(here, impact, clock)
    }

    /// The last point of the flight from here from which derivatives are carried to an instant at once, if it
    /// is another one.
    fn nearer<'a>(
        &self,
        here: &Here,
        Waypoints(passed): &'a mut Waypoints,
        clock: Clock,
    ) -> Result<Option<&'a Here>, SensitivityError> {
        let others = passed.iter().position(|(part, _)| !part.leads_to.contains(&clock));
        passed.truncate(others.unwrap_or(passed.len()));
        loop {
            let near = passed.last().map_or(here, |(_, near)| near);
            let Some(part) = self.parts.first(&self.model.motion.drive, near.clock, clock) else {
                break;
            };
            let state = self.state_at(here, part.end);
            let (columns, _) = self.at_once(near, part.end, Some(&state))?;
            let departure = Departure::new(&self.model, &state, part.end, false);
            let trig = self.model.trig(part.end);
            let next = Here { state, clock: part.end, trig, departure, columns };
            // The longest parts are those of all instants beyond them.
            if part.leads_to.end.period == i64::MAX {
                passed.clear();
            }
            passed.push((part, next));
        }
        Ok(passed.last().map(|(_, near)| near))
    }
}
