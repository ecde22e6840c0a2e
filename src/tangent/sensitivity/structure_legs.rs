//! The legs of a motion of a structure with its derivatives, from which these follow at any time.

use std::borrow::Cow;
use std::sync::Arc;

use nalgebra::DMatrix;

use super::Along;
use super::error::SensitivityError;
use crate::flight::Drive;
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState};
use crate::numerics::cancel::CancelToken;
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

/// Cycles of the motion one after another.
pub(super) struct Cycles {
    /// The legs of one, with derivatives by its start and by the numbers; none of these.
    pub legs: Vec<SensitiveLeg>,
    pub unit: Perturbed,
    /// Drive periods of each.
    pub periods: i64,
    /// Derivatives at the start of each, of this shape.
    pub starts: Arc<Vec<f64>>,
    pub shape: (usize, usize),
}

/// A leg of one of them.
pub(super) struct Cycled {
    pub of: Arc<Cycles>,
    pub cycle: usize,
    pub place: usize,
}

impl Cycled {
    fn leg(&self) -> &SensitiveLeg {
        &self.of.legs[self.place]
    }

    /// Drive periods since that of the first.
    fn periods(&self) -> i64 {
        self.cycle as i64 * self.of.periods
    }

    fn clock(&self) -> Clock {
        let clock = self.leg().clock;
        Clock { period: clock.period + self.periods(), ..clock }
    }

    /// The one of all these at a time.
    fn at_time(&self, drive: &Drive, time: f64) -> Self {
        let of = |cycle: usize, place: usize| Self { of: Arc::clone(&self.of), cycle, place };
        let (count, by) = self.of.shape;
        let begins = |cycle: usize, place: usize| drive.time(of(cycle, place).clock()) <= time;
        let cycle = last(self.of.starts.len() / (count * by), |cycle| begins(cycle, 0));
        of(cycle, last(self.of.legs.len(), |place| begins(cycle, place)))
    }

    /// The derivatives where the leg begins.
    fn begin(&self, blank: &Perturbed) -> Perturbed {
        let leg = self.leg();
        let there = match &leg.from {
            From::Flight(_, columns) | From::Contact(_, columns) => {
                Cow::Owned(self.of.unit.at(leg.clock, columns.clone()))
            }
            From::Any(from, _) => Cow::Borrowed(&from.1),
            From::Cycled(of) => Cow::Owned(of.begin(&self.of.unit)),
        };
        let (count, by) = self.of.shape;
        let start = &self.of.starts[self.cycle * count * by..][..count * by];
        let mut all = DMatrix::zeros(count + by, by);
        all.rows_mut(0, count).copy_from_slice(start);
        all.rows_mut(count, by).fill_with_identity();
        there.combined(blank, &all, self.periods())
    }
}

/// The last of so many that has begun, or the first.
fn last(count: usize, begins: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, count);
    while high - low > 1 {
        let middle = usize::midpoint(low, high);
        if begins(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Where a leg is followed from.
pub(super) enum From {
    /// A flight from a state, with the derivatives of that.
    Flight(StructureState, DMatrix<f64>),
    /// Contact.
    Contact(Box<AnchorOf<Structure>>, DMatrix<f64>),
    /// Any leg; whether impacts are skipped.
    Any(Box<(AnchorOf<Structure>, Perturbed)>, bool),
    /// A leg of a cycle that comes again, and all that follow it there.
    Cycled(Cycled),
}

impl From {
    /// The leg that begins at this anchor, from which it lasts.
    pub fn leg(anchor: &AnchorOf<Structure>, columns: DMatrix<f64>) -> Self {
        match anchor.phase {
            Phase::Flight(_) => Self::Flight(anchor.state.clone(), columns),
            _ => Self::Contact(Box::new(anchor.clone()), columns),
        }
    }
}

impl SensitiveLeg {
    pub fn anchor(&self) -> AnchorOf<Structure> {
        match &self.from {
            From::Flight(state, _) => flight(self.clock, state.clone()),
            From::Contact(anchor, _) => (**anchor).clone(),
            From::Any(from, _) => from.0.clone(),
            From::Cycled(of) => {
                let mut anchor = of.leg().anchor();
                anchor.clock.period += of.periods();
                anchor
            }
        }
    }

    pub fn hops(&self) -> bool {
        match &self.from {
            From::Flight(..) | From::Contact(..) => false,
            From::Any(_, hops) => *hops,
            From::Cycled(of) => of.leg().hops(),
        }
    }

    /// The leg at a time of the cycles that begin with this one.
    pub fn cycled_at(&self, drive: &Drive, time: f64) -> Option<Self> {
        let From::Cycled(of) = &self.from else { return None };
        let there = of.at_time(drive, time);
        let clock = there.clock();
        Some(Self { time: drive.time(clock), clock, from: From::Cycled(there) })
    }

    /// Derivatives of the state at an instant, at a fixed time in a fixed period; `blank`: some of the same
    /// structure.
    pub fn at(&self, blank: &Perturbed, clock: Clock) -> Result<Perturbed, SensitivityError> {
        self.at_along(blank, &self.anchor(), clock)
    }

    /// The same of the leg from this anchor, its own.
    fn at_along(
        &self,
        blank: &Perturbed,
        anchor: &AnchorOf<Structure>,
        clock: Clock,
    ) -> Result<Perturbed, SensitivityError> {
        let mut there = match &self.from {
            From::Flight(_, columns) | From::Contact(_, columns) => {
                blank.at(self.clock, columns.clone())
            }
            From::Any(from, true) => return Ok(from.1.hopped(&from.0, clock)?),
            From::Any(from, false) => from.1.clone(),
            From::Cycled(of) if self.hops() => {
                return Ok(of.begin(blank).hopped(anchor, clock)?);
            }
            From::Cycled(of) => of.begin(blank),
        };
        there.carry_to(anchor, clock)?;
        Ok(there)
    }

    /// The same at a fixed time since the start.
    pub fn at_fixed_time(
        &self,
        blank: &Perturbed,
        clock: Clock,
    ) -> Result<DMatrix<f64>, SensitivityError> {
        let anchor = self.anchor();
        let there = self.at_along(blank, &anchor, clock)?;
        Ok(told_at_fixed_time(&there, &anchor, clock).into_owned())
    }
}

/// Derivatives at an instant of a leg, of the state at a fixed time since the start.
fn told_at_fixed_time<'a>(
    there: &'a Perturbed,
    anchor: &AnchorOf<Structure>,
    clock: Clock,
) -> Cow<'a, DMatrix<f64>> {
    let of = there.linearised();
    if !of.turns() {
        return Cow::Borrowed(there.columns());
    }
    let mut columns = there.columns().clone();
    of.at_fixed_time(&of.leg_from(anchor), clock, &mut columns);
    Cow::Owned(columns)
}

/// The flight from a state.
fn flight(clock: Clock, state: StructureState) -> AnchorOf<Structure> {
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
    fn trajectory(
        &self,
        times: &[f64],
        cancel: &CancelToken,
    ) -> Result<Option<Vec<f64>>, SensitivityError> {
        let Self { blank, all: legs, span: (from, to) } = self;
        let drive = blank.linearised().drive();
        let (columns, count) = (blank.linearised().by.len(), blank.structure().coordinates());
        let mut rows = Vec::with_capacity(2 * count * columns * times.len());
        let mut present: Option<Present> = None;
        for &time in times {
            if !(*from..=*to).contains(&time) {
                return Ok(None);
            }
            if cancel.is_cancelled() {
                break;
            }
            // The last leg that begins not later than this.
            let place = legs.partition_point(|leg| leg.time <= time).max(1) - 1;
            let cycled = legs[place].cycled_at(drive, time);
            let leg = cycled.as_ref().unwrap_or(&legs[place]);
            let place = (place, leg.clock);
            let clock = drive.clock_at(time);
            let clock = if clock < leg.clock { leg.clock } else { clock };
            let mut at = present.take().filter(|at| at.place == place).unwrap_or_else(|| {
                let anchor = leg.anchor();
                let goes_on = !leg.hops() && !blank.flies_at_once(&anchor);
                Present { place, anchor, goes_on, last: None }
            });
            let before = at.last.take().filter(|(there, gone)| {
                at.goes_on && *gone < MOST_GONE_ON && there.clock() <= clock
            });
            let (there, gone) = match before {
                Some((mut there, gone)) => {
                    there.carry_to(&at.anchor, clock)?;
                    (there, gone + 1)
                }
                None => (leg.at_along(blank, &at.anchor, clock)?, 0),
            };
            tell(&told_at_fixed_time(&there, &at.anchor, clock), &mut rows);
            at.last = Some((there, gone));
            present = Some(at);
        }
        Ok(Some(rows))
    }
}

/// The leg of the last time that was asked for.
struct Present {
    place: (usize, Clock),
    anchor: AnchorOf<Structure>,
    /// Whether derivatives go on from one time to the next.
    goes_on: bool,
    /// Derivatives there, and how often they have gone on.
    last: Option<(Perturbed, u32)>,
}

/// Appends the rows of a matrix.
pub(super) fn tell(columns: &DMatrix<f64>, rows: &mut impl Extend<f64>) {
    let (count, all) = (columns.nrows(), columns.as_slice());
    if columns.ncols() == 1 {
        rows.extend(all.iter().copied());
        return;
    }
    for i in 0..count {
        rows.extend(all.iter().skip(i).step_by(count).copied());
    }
}
