//! Derivatives through complete chatter.
//!
//! As in the legs of itineraries (tangent/chatter.rs), time and state after the impacts are smooth
//! functions of the separation velocity u; the limit at u = 0 is extrapolated for numbers that carry
//! derivatives, some columns at a time. Its impacts are those of the run; of those that the run has
//! skipped, hop by hop, only as many follow as it takes until derivatives have converged.

use super::columns::{Column, Columns, Differentiated, Here};
use super::error::SensitivityError;
use super::impact::FollowedImpact;
use crate::contact::tolerances::CHATTER_SPACING;
use crate::impact::RegimeKind;
use crate::model::parameters::Contact;
use crate::model::state::{Clock, State};
use crate::numerics::dual::{Dual, Number};
use crate::numerics::extrapolation::at_zero;
use crate::simulate::event::Event;
use crate::simulate::{Anchor, impacts_hop_by_hop};
use crate::tangent::itinerary::Leg;
use crate::tangent::tolerances::{CONVERGED, LOWEST_REVERSING, MOST_EXTRAPOLATED, SAME_SLOPES};

/// Columns that are extrapolated together.
const AT_ONCE: usize = 4;

/// A state after an impact, with u there and the time since the start.
#[derive(Clone)]
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

/// What impacts of one chatter are alike in: regime, direction of slip, formula for r.
type Formula = (RegimeKind, bool, usize);

/// Low impacts that may lead into chatter.
pub(super) struct Bounces {
    /// Before the first of them.
    pub start: Here,
    samples: Vec<Sample>,
    formula: Option<Formula>,
    /// Whether slip has reversed in one of them.
    reverses: bool,
}

/// An extrapolation: the limit of the columns, and how much it and that of time and state differ from
/// those of one order less.
struct Limit {
    columns: Columns,
    off: f64,
    values_off: f64,
}

impl Bounces {
    /// From the last impact before them.
    pub fn new(start: &Here) -> Self {
        Self { start: start.clone(), samples: Vec::new(), formula: None, reverses: false }
    }

    /// Takes the next impact, with u after it, which leads here; whether it is a sample.
    pub fn take(
        &mut self,
        of: &Differentiated,
        (impact, separation): (&FollowedImpact, f64),
        here: &Here,
    ) -> bool {
        let (kind, _) = impact.regime;
        self.reverses |=
            matches!(kind, RegimeKind::ReversalInApproach | RegimeKind::ReversalInRestitution);
        let direction = impact.pre.v1.is_sign_negative();
        let piece = of.system.coefficient().piece(impact.approach_velocity);
        let formula = (kind, direction, piece);
        if self.formula.replace(formula) != Some(formula) {
            // Only impacts in one regime, with one formula for r, are smooth functions of u.
            self.samples.clear();
        }
        let u = -separation;
        let close = self.samples.last().is_some_and(|last| u > CHATTER_SPACING * last.u);
        if close || u <= 0.0 {
            return false;
        }
        let time = of.model.motion.drive.until(self.start.clock, here.clock).value();
        self.samples.push(Sample { u, time, here: here.clone() });
        true
    }
}

impl Differentiated {
    /// How fast the bodies approach at a contact in this state, u, by what these columns are.
    pub fn approach(&self, state: &State) -> impl Fn(&Column) -> f64 + use<> {
        let contact = self.system.contact;
        let angle = contact.angle(state.x1);
        let turned = if contact == Contact::Oblique { angle.sin * state.v1 } else { 0.0 };
        move |&[x1, v1, v2, _]| angle.cos * v1 - turned * x1 - v2
    }

    /// Derivatives of x1, x1', x2' and the time where chatter ends, at this clock in this state, the last
    /// of whose impacts in the run leads here.
    pub fn chatter(
        &self,
        bounces: Bounces,
        here: &Here,
        (clock, state): (Clock, &State),
    ) -> Result<Columns, SensitivityError> {
        let start = bounces.start.clone();
        if let Some(columns) = self.accumulated(bounces, here, (clock, state))? {
            return Ok(columns);
        }
        Ok(self.passed(&start, (Leg::Chatter, None), (clock, state))?.0)
    }

    /// Derivatives of x1, x1', x2' and the time where chatter ends, at this clock in this state, from its
    /// impacts, the last of which leads here; `None` where they are no smooth functions of u.
    fn accumulated(
        &self,
        mut bounces: Bounces,
        here: &Here,
        (clock, state): (Clock, &State),
    ) -> Result<Option<Columns>, SensitivityError> {
        let mut best = self.limit(&bounces, clock, state);
        let mut here = here.clone();
        let anchor = Anchor::after_impact(here.clock, here.state);
        // Those that the run has skipped, as far as they are needed.
        let converged =
            |best: &Option<Limit>| best.as_ref().is_some_and(|best| best.off <= SAME_SLOPES);
        let mut skipped = impacts_hop_by_hop(&self.system, anchor, clock);
        while !bounces.reverses && !converged(&best) {
            let Some(Event::Impact(impact)) = skipped.next() else { break };
            let impact = FollowedImpact::found(&self.system, &impact);
            let (_, separation) = self.strike(&mut here, &impact, impact.clock)?;
            let (formula, sampled) =
                (bounces.formula, bounces.take(self, (&impact, separation), &here));
            if bounces.formula != formula {
                best = None;
            }
            if !sampled {
                continue;
            }
            if let Some(limit) = self.limit(&bounces, clock, state)
                && best.as_ref().is_none_or(|best| limit.off < best.off)
            {
                best = Some(limit);
            }
            if -separation <= LOWEST_REVERSING * LOWEST_REVERSING {
                break;
            }
        }
        let found = best.filter(|best| !bounces.reverses && best.values_off <= CONVERGED);
        Ok(found.map(|limit| limit.columns))
    }

    /// The limit through the last samples; `None` while there are too few.
    fn limit(&self, bounces: &Bounces, clock: Clock, state: &State) -> Option<Limit> {
        let samples = newest(&bounces.samples);
        if samples.len() < 4 {
            return None;
        }
        let columns = Columns::with_capacity(self.by.len());
        let mut limit = Limit { columns, off: 0.0, values_off: 0.0 };
        for first in (0..self.by.len()).step_by(AT_ONCE) {
            if self.by.len() == 1 {
                self.extrapolate::<1>((bounces, samples), first, (clock, state), &mut limit);
            } else {
                self.extrapolate::<AT_ONCE>((bounces, samples), first, (clock, state), &mut limit);
            }
        }
        Some(limit)
    }

    /// The same of N columns from this one on.
    fn extrapolate<const N: usize>(
        &self,
        (bounces, samples): (&Bounces, &[Sample]),
        first: usize,
        (clock, state): (Clock, &State),
        limit: &mut Limit,
    ) {
        let start = bounces.start.clock;
        let count = N.min(self.by.len() - first);
        let dual = |value: f64, slope: &dyn Fn(usize) -> f64| Dual::<N> {
            value,
            slope: std::array::from_fn(|j| if j < count { slope(first + j) } else { 0.0 }),
        };
        let mut nodes = [Dual::<N>::constant(0.0); MOST_EXTRAPOLATED];
        let mut values = [[Dual::<N>::constant(0.0); 3]; MOST_EXTRAPOLATED];
        for ((node, values), sample) in nodes.iter_mut().zip(&mut values).zip(samples.iter().rev())
        {
            let Here { state, clock, columns, .. } = &sample.here;
            let approach = self.approach(state);
            *node = dual(sample.u, &|i| -approach(&columns[i]));
            let [time, x1, v1] = sample.values();
            let since = |i: usize| columns[i][3] + self.later(self.by[i], start, *clock);
            *values =
                [dual(time, &since), dual(x1, &|i| columns[i][0]), dual(v1, &|i| columns[i][1])];
        }
        let nodes = &nodes[..samples.len()];
        let lower = at_zero(&nodes[..nodes.len() - 1], values);
        let all = at_zero(nodes, values);
        for (a, b) in all.iter().zip(&lower) {
            limit.values_off = limit.values_off.max((a.value - b.value).abs());
            for (a, b) in a.slope.iter().zip(&b.slope) {
                limit.off = limit.off.max((a - b).abs() / (1.0 + a.abs()));
            }
        }
        let [time, x1, v1] = all;
        let stops = bounces.formula.is_some_and(|(kind, ..)| kind.sticks());
        let approach = self.approach(state);
        limit.columns.extend((0..count).map(|j| {
            // A tip that stops in each impact is at rest in the limit.
            let v1 = if stops { 0.0 } else { v1.slope[j] };
            let x1 = x1.slope[j];
            let delay = time.slope[j] - self.later(self.by[first + j], start, clock);
            // In the limit the bodies stay together.
            [x1, v1, approach(&[x1, v1, 0.0, delay]), delay]
        }));
    }
}

/// Those that are extrapolated.
fn newest(samples: &[Sample]) -> &[Sample] {
    &samples[samples.len().saturating_sub(MOST_EXTRAPOLATED)..]
}
