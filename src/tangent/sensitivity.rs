//! Derivatives of a run by the parameters of its system and by its start (docs/sensitivity.md).
//!
//! The motion is followed once more, along its events where the run has kept them, or once, while the run is
//! made. Flights and impacts carry the derivatives by all numbers at once,
//! as they carry perturbations (strike.rs), and add what each number changes by itself. Chatter and
//! contact phases do so by the derivatives of their legs. Nothing is approximated but the limit of
//! chatter, whose error is stated with its event.

mod by;
mod chatter;
mod columns;
mod contact;
mod error;
mod follow;
mod impact;
mod legs;
mod long_flight;
mod making;
mod marks;
mod models;
mod repeats;
mod source;
mod span;
mod structure;
mod structure_cycles;
mod structure_follower;
mod structure_kept;
mod structure_legs;
mod structure_source;
mod table;

pub use error::SensitivityError;
pub use marks::{OneSided, OneSidedReason};
#[cfg(feature = "python")]
pub(crate) use structure::carried_out as structure_carried_out;
pub use structure::{structure_run_with_sensitivity, structure_sensitivity};
pub use structure_legs::StructureLegs;
pub use table::SensitivityTable;

use by::By;
use columns::Differentiated;
use follow::{Follower, Told, append};
use legs::{KeptLegs, SensitiveLeg};
use making::{Follows as _, Making};
use source::{Kept, Source};
use span::Span;

use crate::model::error::ParameterError;
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::ImpactRecord;
use crate::simulate::run::{self, Collection, Proceeds, Recorded, Run, RunOptions};
use crate::tangent::tolerances::SAME_TIME;

/// What tells derivatives at any time.
pub trait Along: Send + Sync {
    /// Derivatives of the states at these fixed times, of the first ones where the caller cancels; `None` for
    /// a time outside of the kept window.
    ///
    /// # Errors
    /// [`SensitivityError`] within a leg that has none.
    fn trajectory(
        &self,
        times: &[f64],
        cancel: &CancelToken,
    ) -> Result<Option<Vec<f64>>, SensitivityError>;
}

/// Derivatives of a run by some numbers, `names.len()` in each row; states are x1, x1', x2, x2', or q
/// and then q' of a structure, a row for each of these. `L` is what follows the motion at other times.
#[derive(Debug, Clone)]
pub struct Sensitivity<L = Legs> {
    /// What the run is differentiated by.
    pub names: Vec<String>,
    /// Derivatives of the times of the impacts that the run keeps,
    pub times: SensitivityTable,
    /// of the states just before them, each at its own time,
    pub before: SensitivityTable,
    /// and just after them.
    pub after: SensitivityTable,
    /// Derivatives of the stroboscopic sections, at the fixed phase of the drive where they lie.
    pub stroboscopic: SensitivityTable,
    /// Derivatives of the final state, at its fixed time.
    pub final_state: Vec<f64>,
    /// Events from which on derivatives are one-sided.
    pub one_sided: Vec<OneSided>,
    /// Up to when they are known, where the caller has cancelled the rest; `final_state` is then that of
    /// this time, and the tables have the first rows of the run's.
    pub until: Option<f64>,
    legs: L,
}

/// The legs of a run with the derivatives at their starts.
pub struct Legs {
    of: Differentiated,
    all: KeptLegs,
    span: (f64, f64),
}

impl<L> Sensitivity<L> {
    /// Refuses derivatives that have grown beyond the range of numbers, of a run with impacts at these times
    /// that ends then.
    fn checked(
        self,
        mut impacts: impl Iterator<Item = f64>,
        end: f64,
    ) -> Result<Self, SensitivityError> {
        let are_finite = |row: &[f64]| row.iter().all(|number| number.is_finite());
        // They stay beyond it once they are.
        if are_finite(&self.final_state) {
            return Ok(self);
        }
        let lost = self.times.chunks(self.names.len()).position(|row| !are_finite(row));
        let time = lost.and_then(|place| impacts.nth(place)).unwrap_or(end);
        Err(SensitivityError::Overflow { time })
    }
}

impl<L: Along> Sensitivity<L> {
    /// Derivatives of the states at these fixed times, of the first ones where the caller cancels; `None` for
    /// a time outside of the kept window. Times in their order cost least.
    ///
    /// # Errors
    /// [`SensitivityError`] within a contact phase that has none.
    pub fn trajectory(
        &self,
        times: &[f64],
        cancel: &CancelToken,
    ) -> Result<Option<Vec<f64>>, SensitivityError> {
        self.legs.trajectory(times, cancel)
    }

    /// The same, whatever was differentiated.
    #[cfg(feature = "python")]
    pub(crate) fn of_any(self) -> Sensitivity<Box<dyn Along>>
    where
        L: 'static,
    {
        let Self { names, times, before, after, stroboscopic, final_state, .. } = self;
        let Self { one_sided, until, legs, .. } = self;
        let legs: Box<dyn Along> = Box::new(legs);
        Sensitivity {
            names,
            times,
            before,
            after,
            stroboscopic,
            final_state,
            one_sided,
            until,
            legs,
        }
    }
}

impl Along for Box<dyn Along> {
    fn trajectory(
        &self,
        times: &[f64],
        cancel: &CancelToken,
    ) -> Result<Option<Vec<f64>>, SensitivityError> {
        (**self).trajectory(times, cancel)
    }
}

/// Refuses no names, and one that is given twice.
fn check_names(names: &[String]) -> Result<(), ParameterError> {
    if names.is_empty() {
        return Err(ParameterError::new("names", "none", "at least one name"));
    }
    for (i, name) in names.iter().enumerate() {
        if names[..i].contains(name) {
            return Err(ParameterError::new("names", name.clone(), "each name once"));
        }
    }
    Ok(())
}

impl Along for Legs {
    fn trajectory(
        &self,
        times: &[f64],
        cancel: &CancelToken,
    ) -> Result<Option<Vec<f64>>, SensitivityError> {
        let Self { of, all: legs, span: (from, to) } = self;
        let drive = &of.model.motion.drive;
        let mut rows = Vec::with_capacity(4 * of.by.len() * times.len());
        let mut present: Option<SensitiveLeg> = None;
        for &time in times {
            if !(*from..=*to).contains(&time) {
                return Ok(None);
            }
            if cancel.is_cancelled() {
                break;
            }
            let mut leg = legs.at(time, of);
            if let Some(same) = present.take_if(|other| other.here.clock == leg.here.clock) {
                leg = same;
            }
            let clock = drive.clock_at(time);
            let clock = if clock < leg.here.clock { leg.here.clock } else { clock };
            let (columns, rates) = leg.at(of, clock, None)?;
            append(&of.at_fixed_time(columns, &rates, clock), &mut rows);
            present = Some(leg);
        }
        Ok(Some(rows))
    }
}

/// Derivatives of a run from `initial` at t = 0 by parameters of its system (`"restitution"`, ...) and by
/// the components of its start (`"x1"`, `"v1"`, `"x2"`, `"v2"`).
///
/// # Errors
/// [`SensitivityError`]: a bad name, another start than the run's, or a leg without derivatives.
///
/// # Example
/// ```
/// use vibroimpact::tangent::sensitivity;
/// use vibroimpact::{CancelToken, Contact, RunOptions, State, System, run, Horizon};
///
/// // A ball that is thrown at a wall a distance away: it is there after t = gap/v.
/// let system = System::builder()
///     .mass_ratio(0.0).frequency_ratio(0.0).restitution(0.5).gap(1.0).drive_frequency(0.0)
///     .contact(Contact::Direct)
///     .build()?;
/// let (start, never) = (State::new(0.0, 2.0, 0.0, 0.0)?, CancelToken::never());
/// let thrown = run(&system, start, RunOptions::until(Horizon::Time(1.0)), &never)?;
/// let found = sensitivity(&thrown, start, &["gap".into(), "v1".into()], &never)?;
/// assert_eq!(found.times, [0.5, -0.25]);
/// // x1 at t = 1: gap - r v (1 - gap/v).
/// assert_eq!(found.final_state[..2], [1.5, -0.5]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn sensitivity(
    run: &Run,
    initial: State,
    names: &[String],
    cancel: &CancelToken,
) -> Result<Sensitivity, SensitivityError> {
    let of = differentiated(&run.system, names)?;
    let phase = run.options.section_phase;
    let mut follower = Follower::new(&of, initial, Span::of(run), phase, followed(run));
    let mut source = if run.is_whole() && run.is_traced() {
        let kept = Kept::new(run, follower.section_offset, cancel);
        let (clock, state) = kept.first();
        if !follower.leads_to(clock, &state) {
            return Err(SensitivityError::OtherMotion { time: of.model.motion.drive.time(clock) });
        }
        Source::Kept(kept)
    } else {
        let mut again = Collection::told(&run.system, initial, run.options, run.kept())?;
        again.proceed_with(cancel);
        Source::made(again)
    };
    let last = follower.follow(&mut source)?;
    let told = follower.told(last)?;
    concluded(run, of, told)
}

/// Makes a run with [its derivatives](sensitivity), which `cancel` ends with what is done. Where it keeps its
/// last drive periods only, these cost less than afterwards: the motion before them is followed once.
///
/// # Errors
/// [`SensitivityError`]: a bad option, start or name, or the run, or a leg of it without derivatives.
///
/// # Example
/// ```
/// use vibroimpact::tangent::{run_with_sensitivity, sensitivity};
/// use vibroimpact::{CancelToken, RunOptions, State, System};
///
/// let system = System::builder()
///     .mass_ratio(0.6).frequency_ratio(2.0).restitution(0.8).gap(0.5)
///     .drive_frequency(1.8).moment_amplitude(1.0)
///     .build()?;
/// let (start, never) = (State::new(0.0, 0.5, 0.0, 0.0)?, CancelToken::never());
/// let (options, names) = (RunOptions::periods(600).keep(10), ["gap".into()]);
/// let (run, found) = run_with_sensitivity(&system, start, options, &names, &never)?;
/// assert_eq!(found.times.to_vec(), sensitivity(&run, start, &names, &never)?.times.to_vec());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn run_with_sensitivity(
    system: &System,
    initial: State,
    options: RunOptions,
    names: &[String],
    cancel: &CancelToken,
) -> Result<(Run, Sensitivity), SensitivityError> {
    if options.kept().0 == Clock::START {
        // It keeps what tells more than a motion in the making.
        differentiated(system, names)?;
        let run = run::run(system, initial, options, cancel)?;
        let found = sensitivity(&run, initial, names, cancel)?;
        return Ok((run, found));
    }
    let (run, found) = carried_out(system, initial, options, names, |work| {
        work.proceed(cancel);
        Ok::<_, SensitivityError>(())
    })?;
    Ok((run, found?))
}

/// The same, with how the work is done. A run that was interrupted is there also where its derivatives are
/// refused.
pub(crate) fn carried_out<E: From<SensitivityError>>(
    system: &System,
    initial: State,
    options: RunOptions,
    names: &[String],
    carry_out: impl FnOnce(&mut (dyn Proceeds + Send)) -> Result<(), E>,
) -> Result<RunWith<System, Legs>, E> {
    let of = differentiated(system, names)?;
    options.check(system).map_err(SensitivityError::from)?;
    let making = Collection::told(system, initial, options, options.kept());
    let making = making.map_err(SensitivityError::from)?;
    let span = Span::of_made(&making);
    let follower = Follower::new(&of, initial, span, options.section_phase, (0, 0));
    let mut work = Making::new(follower, Source::made(making));
    carry_out(&mut work)?;
    let (run, told) = work.into_parts()?;
    let found = told.and_then(|told| concluded(&run, of, told));
    Ok((run, found))
}

/// A run, with its derivatives or why it has none.
pub(crate) type RunWith<M, L> = (Run<M>, Result<Sensitivity<L>, SensitivityError>);

/// A system, with what it is differentiated by.
fn differentiated(system: &System, names: &[String]) -> Result<Differentiated, SensitivityError> {
    check_names(names)?;
    let by = By::all(names, system)?;
    Ok(Differentiated::new(system, by, names.to_vec()))
}

/// The derivatives of a run, from what was told of its motion.
fn concluded(run: &Run, of: Differentiated, told: Told) -> Result<Sensitivity, SensitivityError> {
    let Told { rows, looks, last: final_state, until } = told;
    let same = |&(period, time): &(i64, f64), row: &ImpactRecord| {
        period == row.period && (time - row.time).abs() <= SAME_TIME * row.time.abs()
    };
    let place = Place { end: run.final_state.time, until, events: run.events.len() };
    let k = of.by.len();
    // Impacts that were followed along the run's are these.
    let more =
        if looks { place.more(&rows.impacts, &run.impacts, same, |row| row.time)? } else { 0 };
    place.check_sections(rows.stroboscopic.len(), 4 * k * run.stroboscopic.len())?;
    let mut last = Vec::with_capacity(4 * k);
    append(&final_state, &mut last);
    let found = Sensitivity {
        names: of.names.clone(),
        times: rows.times.without_first(k * more),
        before: rows.before.without_first(4 * k * more),
        after: rows.after.without_first(4 * k * more),
        stroboscopic: rows.stroboscopic,
        final_state: last,
        one_sided: place.marks(rows.one_sided, (rows.events, rows.earlier)),
        until,
        legs: Legs {
            of,
            all: rows.legs,
            span: (run.kept_from(), until.unwrap_or(run.final_state.time)),
        },
    };
    found.checked(run.impacts.iter().map(|row| row.time), run.final_state.time)
}

/// Impacts and sections that are followed: not copied.
fn followed<M: Recorded>(run: &Run<M>) -> (usize, usize) {
    let copies = &run.trace.copies;
    let [mut impacts, mut sections] = [run.impacts.len(), run.stroboscopic.len()];
    let events: usize = copies.iter().map(|all| all.times * all.events).sum();
    let periods: i64 = copies.iter().map(|all| all.times as i64 * all.periods).sum();
    impacts = impacts.min(run.events.len().saturating_sub(events));
    sections = sections.saturating_sub(usize::try_from(periods).unwrap_or_default());
    (impacts, sections)
}

/// Which rows found are those of the run.
struct Place {
    end: f64,
    until: Option<f64>,
    /// The run's events.
    events: usize,
}

impl Place {
    /// How many impacts come before the first that the run keeps: of the window's first drive period it
    /// may keep a part only.
    fn more<E, R>(
        &self,
        found: &[E],
        kept: &[R],
        same: impl Fn(&E, &R) -> bool,
        time: impl Fn(&R) -> f64,
    ) -> Result<usize, SensitivityError> {
        let other = |time: f64| SensitivityError::OtherMotion { time };
        let more = if self.until.is_some() {
            let first = kept.first().and_then(|row| found.iter().position(|e| same(e, row)));
            first.unwrap_or(found.len())
        } else {
            found.len().checked_sub(kept.len()).ok_or(other(self.end))?
        };
        match found[more..].iter().zip(kept).find(|(event, row)| !same(event, row)) {
            Some((_, row)) => Err(other(time(row))),
            None => Ok(more),
        }
    }

    /// All sections must have been found.
    fn check_sections(&self, found: usize, kept: usize) -> Result<(), SensitivityError> {
        let all = self.until.is_some() || found == kept;
        all.then_some(()).ok_or(SensitivityError::OtherMotion { time: self.end })
    }

    /// Events by their rows in the run, of so many events found, some before the window.
    fn marks(&self, found: Vec<OneSided>, (all, earlier): (i64, i64)) -> Vec<OneSided> {
        // The stop is an event of the run.
        let before = if self.until.is_some() { earlier } else { all + 1 - self.events as i64 };
        let at = |at: OneSided| OneSided { index: (at.index - before).max(-1), ..at };
        found.into_iter().map(at).collect()
    }
}
