//! Derivatives through complete chatter.
//!
//! As in the legs of itineraries (tangent/chatter.rs), what bounces tell of the end of their sequence is
//! extrapolated, some columns at a time. They are those of the run; of those that the run has skipped, hop
//! by hop, only as many follow as it takes until derivatives have converged.

use std::sync::OnceLock;

use smallvec::SmallVec;

use super::by::By;
use super::columns::{Column, Columns, Differentiated, Here};
use super::contact::start;
use super::error::SensitivityError;
use super::impact::FollowedImpact;
use super::models::{FEW, ONE, models};
use crate::contact::tolerances::CHATTER_SPACING;
use crate::impact::RegimeKind;
use crate::model::parameters::Contact;
use crate::model::state::{Clock, State};
use crate::numerics::dual::{Dual, Number};
use crate::simulate::event::Event;
use crate::simulate::{Anchor, impacts_hop_by_hop};
use crate::tangent::Model;
use crate::tangent::chatter::{End, Formula, Limit, end_ahead, reverses, slips};
use crate::tangent::itinerary::Signs;
use crate::tangent::tolerances::{LOWEST_BOUNCE, MOST_EXTRAPOLATED};

/// A number of each column.
type Slopes = SmallVec<[f64; 4]>;
/// What the bounces tell that are extrapolated, the newest first.
type Newest<'a> = SmallVec<[&'a Told; MOST_EXTRAPOLATED]>;

/// A bounce: what it leads to, u after it, and by what ratio that shrinks, with its derivatives.
struct Bounce {
    here: Here,
    u: f64,
    ratio: (f64, Slopes),
    /// Once it has been asked.
    told: Option<Told>,
}

/// What a bounce tells: u after it, the time from the start to the end of the sequence, x1 and x1' there.
struct Told {
    values: [f64; 4],
    slopes: Columns,
}

/// Low impacts that may lead into chatter.
pub(super) struct Bounces {
    /// Before the first of them, with u there.
    start: (Here, f64),
    all: Vec<Bounce>,
    formula: Option<Formula>,
}

impl Bounces {
    /// From the last impact before them, with u after it.
    pub fn new(start: &Here, u: f64) -> Self {
        Self { start: (start.clone(), u), all: Vec::new(), formula: None }
    }

    /// Takes the next impact, with the columns before it and u after it, which leads here; whether it tells
    /// more than the last one.
    pub fn take(
        &mut self,
        of: &Differentiated,
        impact: &FollowedImpact,
        (before, u): (&Columns, f64),
        here: &Here,
    ) -> bool {
        let (kind, signs) = of.regime(impact);
        let formula = (kind, signs, of.system.coefficient().piece(impact.approach_velocity));
        let known = self.formula.replace(formula);
        if known != Some(formula) || reverses(formula) {
            self.all.clear();
        }
        let close = self.all.last().is_some_and(|last| u > CHATTER_SPACING * last.u);
        if close || u <= 0.0 {
            return false;
        }
        let (approached, parts) = (of.approach(&impact.pre), of.approach(&here.state));
        let ratio = u / impact.approach_velocity;
        let slopes = before.iter().zip(&here.columns).map(|(before, after)| {
            -(parts(after) + ratio * approached(before)) / impact.approach_velocity
        });
        let ratio = (ratio, slopes.collect::<Slopes>());
        if known.is_none() && !reverses(formula) {
            // The state before has led to the same bounces.
            let (here, u) = self.start.clone();
            self.add(&here, u, ratio.clone());
        }
        self.add(here, u, ratio);
        true
    }

    fn add(&mut self, here: &Here, u: f64, ratio: (f64, Slopes)) {
        if u > 0.0 {
            self.all.push(Bounce { here: here.clone(), u, ratio, told: None });
        }
    }

    /// A sequence of which no impact has been followed: the tip goes on slipping, or rests.
    fn begin(&mut self, of: &Differentiated) {
        let (here, u) = self.start.clone();
        if self.formula.is_some() || here.departure.slope.is_none() {
            return;
        }
        let State { x1, v1, .. } = here.state;
        let rests = if v1 == 0.0 { RegimeKind::StickInApproach } else { RegimeKind::Slip };
        let sin = of.system.contact.angle(x1).sin;
        self.formula = Some((rests, Signs::of(rests, v1, sin), 0));
        self.add(&here, u, of.restitution_at_rest());
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

    /// r of the lowest impacts, and its derivatives.
    fn restitution_at_rest(&self) -> (f64, Slopes) {
        let coefficient = self.system.coefficient();
        let by = |&by: &By| match by {
            By::Restitution => 1.0,
            By::OfCurve(place) => coefficient.by_number(0.0, place),
            _ => 0.0,
        };
        (coefficient.with_slope(0.0).value, self.by.iter().map(by).collect())
    }

    /// Derivatives of x1, x1', x2' and the time where chatter ends, at this clock in this state, the last
    /// of whose impacts in the run leads here.
    pub fn chatter(
        &self,
        mut bounces: Bounces,
        here: &Here,
        (clock, state): (Clock, &State),
    ) -> Result<Columns, SensitivityError> {
        bounces.begin(self);
        let mut best = self.limit(&mut bounces, None, (clock, state));
        let mut here = here.clone();
        let anchor = Anchor::after_impact(here.clock, here.state);
        // Those that the run has skipped, as far as they are needed.
        let mut skipped = impacts_hop_by_hop(&self.system, anchor, clock);
        while !best.as_ref().is_some_and(|best| best.has_converged() && best.has_slopes()) {
            let Some(Event::Impact(impact)) = skipped.next() else { break };
            let impact = FollowedImpact::found(&self.system, &impact);
            let (before, u) = self.strike(&mut here, &impact, impact.clock)?;
            let formula = bounces.formula;
            let sampled = bounces.take(self, &impact, (&before, -u), &here);
            if bounces.formula != formula {
                best = None;
            }
            if sampled {
                best = self.limit(&mut bounces, best, (clock, state));
            }
            if -u <= LOWEST_BOUNCE {
                break;
            }
        }
        let found = best.filter(Limit::has_converged);
        found.map(|limit| limit.end).ok_or_else(|| self.no_derivative(&bounces.start.0, clock))
    }

    /// The end that the last bounces tell, unless this one is better; `None`: there is none.
    fn limit(
        &self,
        bounces: &mut Bounces,
        best: Option<Limit<Columns>>,
        at: (Clock, &State),
    ) -> Option<Limit<Columns>> {
        let (slips, since) = (bounces.formula.and_then(slips), bounces.start.0.clock);
        let mut told = Newest::new();
        for bounce in bounces.all.iter_mut().rev().take(MOST_EXTRAPOLATED) {
            if bounce.told.is_none() {
                bounce.told = self.told(bounce, since, slips);
            }
            let Some(each) = &bounce.told else { break };
            told.push(each);
        }
        if told.is_empty() {
            return best;
        }
        let end = Columns::with_capacity(self.by.len());
        let mut limit = Limit { end, off: 0.0, slopes_off: 0.0 };
        if self.by.len() == 1 {
            self.extrapolate::<ONE>((&told, since), at, &mut limit);
        } else {
            self.extrapolate::<FEW>((&told, since), at, &mut limit);
        }
        Some(limit.better(best))
    }

    /// The same of some columns at a time.
    fn extrapolate<const N: usize>(
        &self,
        (told, since): (&Newest, Clock),
        (clock, state): (Clock, &State),
        limit: &mut Limit<Columns>,
    ) {
        let approach = self.approach(state);
        for first in (0..self.by.len()).step_by(N) {
            let count = N.min(self.by.len() - first);
            let zero = Dual::<N>::constant(0.0);
            let mut nodes = [zero; MOST_EXTRAPOLATED];
            let mut ends: [End<N>; MOST_EXTRAPOLATED] = [[zero; 3]; MOST_EXTRAPOLATED];
            for ((node, end), told) in nodes.iter_mut().zip(&mut ends).zip(told) {
                let row =
                    |row: usize| self.number(told.values[row], first, |i| told.slopes[i][row]);
                *node = row(0);
                *end = [row(1), row(2), row(3)];
            }
            let found = Limit::new(&nodes[..told.len()], &ends[..told.len()], 0.0);
            limit.off = limit.off.max(found.off);
            limit.slopes_off = limit.slopes_off.max(found.slopes_off);
            let [time, x1, v1] = found.end;
            limit.end.extend((0..count).map(|j| {
                let (x1, v1) = (x1.slope[j], v1.slope[j]);
                let delay = time.slope[j] - self.later(self.by[first + j], since, clock);
                // In the end the bodies stay together.
                [x1, v1, approach(&[x1, v1, 0.0, delay]), delay]
            }));
        }
    }

    /// What a bounce tells of the end, by the time since then.
    fn told(&self, bounce: &Bounce, since: Clock, slips: Option<Signs>) -> Option<Told> {
        if self.by.len() == 1 {
            self.told_along(&self.contact.one, bounce, since, slips)
        } else {
            self.told_along(&self.contact.few, bounce, since, slips)
        }
    }

    fn told_along<const N: usize>(
        &self,
        made: &OnceLock<Vec<Model<N>>>,
        Bounce { here, u, ratio: (ratio, slopes), .. }: &Bounce,
        since: Clock,
        slips: Option<Signs>,
    ) -> Option<Told> {
        let approach = self.approach(&here.state);
        let passed = self.model.motion.drive.until(since, here.clock).value();
        let mut told = Told { values: [*u; 4], slopes: Columns::with_capacity(self.by.len()) };
        for (model, first) in models(made, &self.system, &self.names) {
            let (state, moment) = start(model, here, None, first);
            let u: Dual<N> = self.number(*u, first, |i| -approach(&here.columns[i]));
            let ratio = self.number(*ratio, first, |i| slopes[i]);
            let [left, x1, v1] = end_ahead(model, (&state, &moment), (u, ratio), slips)?;
            told.values = [u.value, passed + left.value, x1.value, v1.value];
            let columns = here.columns.iter().zip(&self.by).skip(first).take(N).enumerate();
            told.slopes.extend(columns.map(|(j, (column, &by))| {
                let time = column[3] + self.later(by, since, here.clock) + left.slope[j];
                [u.slope[j], time, x1.slope[j], v1.slope[j]]
            }));
        }
        Some(told)
    }

    /// A number with its derivatives along some columns, from this one on.
    fn number<const N: usize>(
        &self,
        value: f64,
        first: usize,
        slope: impl Fn(usize) -> f64,
    ) -> Dual<N> {
        let of = |j: usize| if first + j < self.by.len() { slope(first + j) } else { 0.0 };
        Dual { value, slope: std::array::from_fn(of) }
    }
}
