//! Derivatives through complete chatter, whose impacts are followed hop by hop.
//!
//! As in the legs of itineraries (tangent/chatter.rs), time and state after the impacts are smooth
//! functions of the separation velocity u; the limit at u = 0 is extrapolated for numbers that carry
//! derivatives, some columns at a time.

use super::columns::{Columns, Differentiated, Here};
use super::error::SensitivityError;
use crate::contact::tolerances::CHATTER_SPACING;
use crate::impact::RegimeKind;
use crate::model::parameters::Contact;
use crate::model::state::{Clock, State};
use crate::numerics::EPS;
use crate::numerics::dual::Dual;
use crate::numerics::extrapolation::at_zero;
use crate::simulate::event::Event;
use crate::simulate::{Anchor, impacts_hop_by_hop};
use crate::tangent::tolerances::{CONVERGED, LOWEST_REVERSING, MOST_EXTRAPOLATED};

/// Columns that are extrapolated together.
const AT_ONCE: usize = 4;

/// A state after an impact, with u there and the time since the start.
struct Sample {
    u: f64,
    time: f64,
    here: Here,
}

impl Sample {
    fn values(&self) -> [f64; 3] {
        [self.time, self.here.state.x1, self.here.state.v1]
    }
}

impl Differentiated {
    /// Derivatives of x1, x1', x2' and the time where the chatter that begins after an impact ends, at this
    /// clock in this state; `None` where its impacts are no smooth functions of u.
    pub fn accumulated(
        &self,
        start: &Here,
        clock: Clock,
        state: &State,
    ) -> Result<Option<Columns>, SensitivityError> {
        let drive = &self.model.motion.drive;
        let mut samples: Vec<Sample> = Vec::new();
        let (mut here, mut regime) = (start.clone(), None);
        // The least difference of two orders, and up to which sample.
        let mut best: Option<(f64, usize)> = None;
        let anchor = Anchor::after_impact(start.clock, start.state);
        for event in impacts_hop_by_hop(&self.system, anchor, clock) {
            let Event::Impact(impact) = event else { continue };
            self.strike(&mut here, &impact, impact.clock)?;
            let kind = impact.impact.regime.kind();
            if matches!(kind, RegimeKind::ReversalInApproach | RegimeKind::ReversalInRestitution) {
                return Ok(None);
            }
            let direction = impact.pre.v1.is_sign_negative();
            let approach = impact.impact.approach_velocity;
            let piece = self.system.coefficient().piece(approach);
            let formula = (kind, direction, piece);
            if regime.replace(formula) != Some(formula) {
                // Only impacts in one regime, with one formula for r, are smooth functions of u.
                samples.clear();
                best = None;
            }
            let u = -impact.impact.separation_velocity;
            if samples.last().is_some_and(|last| u > CHATTER_SPACING * last.u) || u <= 0.0 {
                continue;
            }
            let time = drive.until(start.clock, here.clock).value();
            samples.push(Sample { u, time, here: here.clone() });
            if samples.len() < 4 {
                continue;
            }
            let newest = newest(&samples);
            let nodes: Vec<f64> = newest.iter().rev().map(|sample| sample.u).collect();
            let through = |count: usize| {
                let values: Vec<[f64; 3]> = newest.iter().rev().map(Sample::values).collect();
                at_zero(&nodes[..count], values)
            };
            let (limit, lower) = (through(nodes.len()), through(nodes.len() - 1));
            let off = limit.iter().zip(&lower).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if best.is_none_or(|(least, _)| off < least) {
                best = Some((off, samples.len()));
            }
            if off <= EPS || u <= LOWEST_REVERSING * LOWEST_REVERSING {
                break;
            }
        }
        let Some((_, count)) = best.filter(|(off, _)| *off <= CONVERGED) else { return Ok(None) };
        let stops = regime.is_some_and(|(kind, _, _)| kind.sticks());
        Ok(Some(self.limit(newest(&samples[..count]), (start, clock), state, stops)))
    }

    /// The derivatives of the limit through these samples.
    fn limit(
        &self,
        samples: &[Sample],
        (start, clock): (&Here, Clock),
        state: &State,
        stops: bool,
    ) -> Columns {
        let contact = self.system.contact;
        let oblique = contact == Contact::Oblique;
        let mut columns = Columns::with_capacity(self.by.len());
        for first in (0..self.by.len()).step_by(AT_ONCE) {
            let count = AT_ONCE.min(self.by.len() - first);
            let dual = |value: f64, slope: &dyn Fn(usize) -> f64| Dual::<AT_ONCE> {
                value,
                slope: std::array::from_fn(|j| if j < count { slope(first + j) } else { 0.0 }),
            };
            let (mut nodes, mut values) = (Vec::new(), Vec::new());
            for sample in samples.iter().rev() {
                let Here { state, clock, columns, .. } = &sample.here;
                let angle = contact.angle(state.x1);
                let turned = if oblique { angle.sin * state.v1 } else { 0.0 };
                nodes.push(dual(sample.u, &|i| {
                    let [x1, v1, v2, _] = columns[i];
                    v2 - angle.cos * v1 + turned * x1
                }));
                let [time, x1, v1] = sample.values();
                let since = |i: usize| columns[i][3] + self.later(self.by[i], start.clock, *clock);
                values.push([
                    dual(time, &since),
                    dual(x1, &|i| columns[i][0]),
                    dual(v1, &|i| columns[i][1]),
                ]);
            }
            let [time, x1, v1] = at_zero(&nodes, values);
            let angle = contact.angle(state.x1);
            let turned = if oblique { angle.sin * state.v1 } else { 0.0 };
            columns.extend((0..count).map(|j| {
                // A tip that stops in each impact is at rest in the limit.
                let v1 = if stops { 0.0 } else { v1.slope[j] };
                let x1 = x1.slope[j];
                let delay = time.slope[j] - self.later(self.by[first + j], start.clock, clock);
                [x1, v1, angle.cos * v1 - turned * x1, delay]
            }));
        }
        columns
    }
}

/// Those that are extrapolated.
fn newest(samples: &[Sample]) -> &[Sample] {
    &samples[samples.len().saturating_sub(MOST_EXTRAPOLATED)..]
}
