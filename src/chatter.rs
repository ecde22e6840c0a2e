//! Tells complete chatter (infinitely many impacts in finite time) from many impacts
//! (docs/theory.md, section 5).
//!
//! With the free gap acceleration g'' > 0 and impacts that shrink u by a ratio q < 1 the flights
//! shrink by q too, and the sequence ends after T = 2 u_post/(g''(1 - q)). In `slip` and
//! `frictionless` q = r to leading order; otherwise q is measured. Chatter is believed once
//! several impacts in a row have kept the ratio and the remaining time is so short that what
//! the leading order leaves out lies below the tolerance.

use serde::{Deserialize, Serialize};

use crate::impact::{Impact, RegimeKind};
use crate::tolerance::{CHATTER_IMPACTS, CHATTER_RATIO_RTOL};

/// Memory of the last impacts.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct ChatterMonitor {
    /// Approach velocity of the last impact, 0 before the first.
    last: f64,
    ratio: f64,
    kept: u32,
    /// Free gap acceleration after the last impact of a believed sequence, 0 before.
    second: f64,
}

impl ChatterMonitor {
    /// Takes an impact; returns the ratio once enough impacts have kept one.
    pub fn observe(&mut self, impact: &Impact, restitution: f64) -> Option<f64> {
        let slides = matches!(impact.regime.kind(), RegimeKind::Frictionless | RegimeKind::Slip);
        let measured =
            if self.last > 0.0 { impact.approach_velocity / self.last } else { f64::INFINITY };
        let predicted = if slides { restitution } else { self.ratio };
        let keeps = measured < 1.0
            && predicted < 1.0
            && (measured - predicted).abs() <= CHATTER_RATIO_RTOL * predicted;
        if !keeps {
            self.second = 0.0;
        }
        self.kept = if keeps { self.kept + 1 } else { 0 };
        self.ratio = if measured.is_finite() { measured } else { 0.0 };
        self.last = impact.approach_velocity;
        (self.kept >= CHATTER_IMPACTS).then_some(measured)
    }

    /// Whether g'' will keep its value over all hops to come: its change from hop to hop shrinks
    /// by the ratio too.
    pub fn is_steady(&mut self, second: f64, ratio: f64) -> bool {
        let change = (second - self.second).abs();
        self.second = second;
        change <= 1e-2 * (1.0 - ratio) * second
    }
}

/// Error of the leading-order time to the accumulation point, T = 2 u/(g'' (1 - q)), for a
/// separation velocity u, free gap acceleration g'' and its derivative just after an impact.
pub(crate) fn remaining_time_error(separation: f64, ratio: f64, second: f64, third: f64) -> f64 {
    let time = 2.0 * separation / (second * (1.0 - ratio));
    time * time * (third / second).abs()
}
