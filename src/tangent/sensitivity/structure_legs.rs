//! The legs of a motion of a structure with its derivatives, from which these follow at any time.

use std::borrow::Cow;

use nalgebra::DMatrix;

use super::Along;
use super::error::SensitivityError;
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState};
use crate::simulate::{Anchor, AnchorOf, FlightStart, Phase};
use crate::tangent::structure::Perturbed;

/// At so many times of a leg one after another derivatives go on from those before: at more, rounding
/// would add up.
const MOST_GONE_ON: u32 = 16;

/// A leg of the motion with its derivatives at an instant of it.
pub(super) struct SensitiveLeg {
    pub time: f64,
    pub clock: Clock,
    pub from: From,
}

/// Where a leg is followed from.
pub(super) enum From {
    /// A flight from a state, with the derivatives of that.
    Flight(StructureState, DMatrix<f64>),
    /// Any leg; whether impacts are skipped.
    Any(Box<(AnchorOf<Structure>, Perturbed)>, bool),
}

impl SensitiveLeg {
    pub fn anchor(&self) -> AnchorOf<Structure> {
        match &self.from {
            From::Flight(state, _) => flight(self.clock, state.clone()),
            From::Any(from, _) => from.0.clone(),
        }
    }

    pub fn hops(&self) -> bool {
        matches!(self.from, From::Any(_, true))
    }

    /// Derivatives of the state at an instant, at a fixed time in a fixed period; `blank`: some of the same
    /// structure.
    pub fn at(&self, blank: &Perturbed, clock: Clock) -> Result<Perturbed, SensitivityError> {
        let mut there = match &self.from {
            From::Flight(_, columns) => blank.at(self.clock, columns.clone()),
            From::Any(from, true) => return Ok(from.1.hopped(&from.0, clock)?),
            From::Any(from, false) => from.1.clone(),
        };
        there.carry_to(&self.anchor(), clock)?;
        Ok(there)
    }

    /// The same at a fixed time since the start.
    pub fn at_fixed_time(
        &self,
        blank: &Perturbed,
        clock: Clock,
    ) -> Result<DMatrix<f64>, SensitivityError> {
        Ok(self.told_at_fixed_time(&self.at(blank, clock)?, clock).into_owned())
    }

    /// The same of derivatives at this instant.
    fn told_at_fixed_time<'a>(&self, there: &'a Perturbed, clock: Clock) -> Cow<'a, DMatrix<f64>> {
        let of = there.linearised();
        if !of.turns() {
            return Cow::Borrowed(there.columns());
        }
        let mut columns = there.columns().clone();
        of.at_fixed_time(&of.leg_from(&self.anchor()), clock, &mut columns);
        Cow::Owned(columns)
    }
}

/// The flight from a state.
pub(super) fn flight(clock: Clock, state: StructureState) -> AnchorOf<Structure> {
    let phase = Phase::Flight(FlightStart::Touching);
    Anchor { phase, ..Anchor::apart(clock, state) }
}

/// The legs of a run with the derivatives at their starts.
pub struct StructureLegs {
    pub(super) blank: Perturbed,
    pub(super) all: Vec<SensitiveLeg>,
    pub(super) span: (f64, f64),
}

impl Along for StructureLegs {
    fn trajectory(&self, times: &[f64]) -> Result<Option<Vec<f64>>, SensitivityError> {
        let Self { blank, all: legs, span: (from, to) } = self;
        let drive = blank.linearised().drive();
        let mut rows = Vec::new();
        // Where the last time was, and how often it has been gone on from there.
        let mut last: Option<(usize, Perturbed, u32)> = None;
        for &time in times {
            if !(*from..=*to).contains(&time) {
                return Ok(None);
            }
            // The last leg that begins not later than this.
            let place = legs.partition_point(|leg| leg.time <= time).max(1) - 1;
            let leg = &legs[place];
            let clock = drive.clock_at(time);
            let clock = if clock < leg.clock { leg.clock } else { clock };
            let before = last.take().filter(|(at, there, gone)| {
                *at == place && *gone < MOST_GONE_ON && there.clock() <= clock && !leg.hops()
            });
            let (there, gone) = match before {
                Some((_, mut there, gone)) => {
                    there.carry_to(&leg.anchor(), clock)?;
                    (there, gone + 1)
                }
                None => (leg.at(blank, clock)?, 0),
            };
            tell(&leg.told_at_fixed_time(&there, clock), &mut rows);
            last = Some((place, there, gone));
        }
        Ok(Some(rows))
    }
}

/// Appends the rows of a matrix.
pub(super) fn tell(columns: &DMatrix<f64>, rows: &mut Vec<f64>) {
    for row in columns.row_iter() {
        rows.extend(row.iter());
    }
}
