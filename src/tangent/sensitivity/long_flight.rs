//! Flights over many drive periods.

use std::borrow::Cow;

use super::by::By;
use super::columns::{Column, Columns, Differentiated, Here};
use super::error::SensitivityError;
use crate::model::state::{Clock, State};
use crate::tangent::long_flight::next_part;
use crate::tangent::strike::Departure;

impl Differentiated {
    /// Derivatives of the state at a fixed instant of the flight from here, and its rates there, where a
    /// column looks at them; `known`: the state there.
    pub fn at(
        &self,
        here: &Here,
        clock: Clock,
        known: Option<&State>,
    ) -> Result<(Columns, Column), SensitivityError> {
        self.at_once(&*self.nearer(here, clock)?, clock, known)
    }

    /// A point of the flight from here that is so near an instant that derivatives by the drive's frequency
    /// keep their digits up to it.
    pub fn nearer<'a>(
        &self,
        here: &'a Here,
        clock: Clock,
    ) -> Result<Cow<'a, Here>, SensitivityError> {
        let mut near = Cow::Borrowed(here);
        while let Some(next) = next_part(near.clock, clock)
            && self.by.contains(&By::DriveFrequency)
        {
            let state = self.state_at(here, next);
            let (columns, _) = self.at_once(&near, next, Some(&state))?;
            let departure = Departure::new(&self.model, &state, next, false);
            let trig = self.model.trig(next);
            near = Cow::Owned(Here { state, clock: next, trig, departure, columns });
        }
        Ok(near)
    }
}
