//! How far a run goes and what is kept of it.

use serde::{Deserialize, Serialize};

use super::recorded::Recorded;
use crate::model::error::ParameterError;
use crate::model::state::Clock;
use crate::simulate::Horizon;
use crate::simulate::tolerances::{DEFAULT_MAX_EVENTS, DEFAULT_TOLERANCE, MOST_COUNTED};

/// How a run is made and what is kept of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RunOptions {
    /// How far the run goes, from t = 0.
    pub horizon: Horizon,
    /// Keep only the last so many drive periods before the horizon; everything if `None`. A run
    /// that stops before they begin keeps nothing.
    pub keep: Option<i64>,
    /// Cap on the number of events.
    pub max_events: u64,
    /// Tolerance in time and state where something is approximated (the completion of chatter):
    /// absolute for a [`System`](crate::System), of a structure a part of the scales of its motion.
    pub chatter_tolerance: f64,
    /// The stroboscopic section lies at omega t = this (mod 2 pi), in [0, 2 pi).
    pub section_phase: f64,
}

impl RunOptions {
    /// So many drive periods, everything kept.
    #[must_use]
    pub fn periods(periods: i64) -> Self {
        Self::until(Horizon::Periods(periods))
    }

    /// Up to a horizon, everything kept.
    #[must_use]
    pub fn until(horizon: Horizon) -> Self {
        Self {
            horizon,
            keep: None,
            max_events: DEFAULT_MAX_EVENTS,
            chatter_tolerance: DEFAULT_TOLERANCE,
            section_phase: 0.0,
        }
    }

    /// Keeps the last so many periods only.
    #[must_use]
    pub fn keep(mut self, periods: i64) -> Self {
        self.keep = Some(periods);
        self
    }

    /// Refuses what makes no sense for `system`, before any work.
    ///
    /// # Errors
    /// [`ParameterError`] names the option, its value and the allowed range.
    pub fn check<M: Recorded>(&self, system: &M) -> Result<(), ParameterError> {
        let omega = system.own_drive().omega;
        let period = std::f64::consts::TAU / omega;
        let error = |name, value: String, allowed: &str| {
            Err(ParameterError::new(name, value, allowed.to_string()))
        };
        match self.horizon {
            Horizon::Periods(periods) if omega == 0.0 => {
                return error("periods", periods.to_string(), "time instead: drive_frequency is 0");
            }
            Horizon::Periods(periods) if periods < 0 => {
                return error("periods", periods.to_string(), "a whole number >= 0");
            }
            Horizon::Time(time) | Horizon::Impacts { max_time: time, .. }
                if !(time.is_finite() && time >= 0.0) =>
            {
                return error("time", time.to_string(), "a finite number >= 0");
            }
            _ => {}
        }
        let turns = match self.horizon {
            Horizon::Periods(periods) => periods as f64,
            Horizon::Time(time) | Horizon::Impacts { max_time: time, .. } => time / period,
        };
        if turns > MOST_COUNTED {
            return error("time", turns.to_string(), "at most 2^53 drive periods");
        }
        // A drive so slow that its period is beyond all numbers is refused even for none of them.
        let length = turns * period;
        if let Horizon::Periods(periods) = self.horizon
            && (length.is_nan() || length > MOST_COUNTED)
        {
            return error("periods", periods.to_string(), "at most 2^53 units of time");
        }
        match (self.keep, self.horizon) {
            (Some(keep), Horizon::Periods(periods)) if !(0..=periods).contains(&keep) => {
                return error("keep", keep.to_string(), "a whole number in [0, periods]");
            }
            (Some(keep), Horizon::Time(_) | Horizon::Impacts { .. }) => {
                return error("keep", keep.to_string(), "only together with periods");
            }
            _ => {}
        }
        if !(self.chatter_tolerance.is_finite() && self.chatter_tolerance > 0.0) {
            return error(
                "chatter_tolerance",
                self.chatter_tolerance.to_string(),
                "a finite number > 0",
            );
        }
        if !(0.0..std::f64::consts::TAU).contains(&self.section_phase) {
            return error("section_phase", self.section_phase.to_string(), "in [0, 2 pi)");
        }
        Ok(())
    }

    /// Where the window begins, and its first section.
    pub(crate) fn kept(&self) -> (Clock, i64) {
        (Clock::new(self.window(), 0.0), self.window() + 1)
    }

    /// First drive period of which anything is kept.
    pub(super) fn window(&self) -> i64 {
        match (self.keep, self.horizon) {
            (Some(keep), Horizon::Periods(periods)) => periods - keep,
            _ => 0,
        }
    }
}
