//! Derivatives of a run of a structure: its motion again, turn by turn, with its derivatives.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::error::SensitivityError;
use super::making::{Follows, Making};
use super::span::Span;
use super::structure_follower::{Follower, Rows, Turn};
use super::structure_kept::Kept;
use super::structure_legs::{SensitiveLeg, StructureLegs, tell};
use super::structure_source::Source;
use super::table::SensitivityTable;
use super::{Place, RunWith, Sensitivity, check_names, followed};
use crate::model::error::ParameterError;
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState, Variation};
use crate::numerics::cancel::CancelToken;
use crate::simulate::run::{Collection, Proceeds, Run, RunOptions, StopImpactRecord, run};
use crate::tangent::structure::{Linearised, Perturbed};
use crate::tangent::tolerances::SAME_TIME;

impl<'a> Follows for Follower<'a> {
    type Source = Source<'a>;
    type Last = DMatrix<f64>;
    type Told = Told;

    fn follow(&mut self, source: &mut Source) -> Result<Option<DMatrix<f64>>, SensitivityError> {
        if self.legs.is_empty() {
            self.leg(source);
        }
        let mut may_repeat = true;
        loop {
            let mut turn = self.turn(source)?;
            self.plain = self.plain.saturating_sub(1);
            if turn == Turn::Over
                && self.plain == 0
                && may_repeat
                && let Some(alike) = self.cycle_from(source)
            {
                let repeated = self.repeat(source, &alike);
                may_repeat = repeated.is_some();
                turn = repeated.unwrap_or(turn);
            }
            match turn {
                Turn::Over => {}
                Turn::Last => return Ok(Some(self.at_end()?)),
                Turn::Cancelled => return Ok(None),
            }
        }
    }

    fn told(self, last: Option<DMatrix<f64>>) -> Result<Told, SensitivityError> {
        let Self { of, legs, rows, derivatives: blank, given_up, .. } = self;
        let (last, until) = match (last, legs.last()) {
            (Some(columns), _) => (columns, None),
            (None, Some(leg)) => {
                let cycled = leg.cycled_at(of.drive(), f64::INFINITY);
                let leg = cycled.as_ref().unwrap_or(leg);
                let here = given_up.unwrap_or(leg.clock);
                let until = given_up.map_or(leg.time, |clock| of.drive().time(clock));
                (leg.at_fixed_time(&blank, here)?, Some(until))
            }
            (None, None) => return Err(SensitivityError::OtherMotion { time: 0.0 }),
        };
        Ok(Told { rows, legs, blank, last, until })
    }
}

/// Derivatives of a run of a structure from `initial` at t = 0 along variations of the structure and of
/// its start, each with its name.
///
/// # Errors
/// [`SensitivityError`]: a bad name or variation, another start than the run's, or a leg without
/// derivatives.
///
/// # Example
/// ```
/// use vibroimpact::tangent::structure_sensitivity;
/// use vibroimpact::{
///     CancelToken, Horizon, RunOptions, Stop, Structure, StructureState, Variation, run,
/// };
///
/// // A ball that is thrown at a wall a distance away: it is there after t = gap/v.
/// let ball = Structure::builder(vec![vec![1.0]], vec![vec![0.0]])
///     .stop(Stop::new([1.0], 1.0, 0.5))
///     .build()?;
/// let (start, never) = (StructureState::new(&[0.0], &[2.0]), CancelToken::never());
/// let thrown = run(&ball, start.clone(), RunOptions::until(Horizon::Time(1.0)), &never)?;
/// let by = ["gap", "v_0"].map(|name| Ok((name.to_owned(), Variation::named(name, &ball)?)));
/// let by: Vec<_> = by.into_iter().collect::<Result<_, vibroimpact::ParameterError>>()?;
/// let found = structure_sensitivity(&thrown, start, by, &never)?;
/// assert_eq!(found.times, [0.5, -0.25]);
/// // q at t = 1: gap - r v (1 - gap/v).
/// assert_eq!(found.final_state[..2], [1.5, -0.5]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn structure_sensitivity(
    run: &Run<Structure>,
    initial: StructureState,
    by: Vec<(String, Variation)>,
    cancel: &CancelToken,
) -> Result<Sensitivity<StructureLegs>, SensitivityError> {
    let structure = &run.system;
    let by = Along::new(structure, by)?;
    let (phase, rooms) = (run.options.section_phase, followed(run));
    let mut follower = by.follower(Span::of(run), phase, rooms);
    let mut source = if let Some(kept) = Kept::new(run, &initial, follower.section_offset, cancel)?
    {
        Source::Kept(Box::new(kept))
    } else {
        let mut again = Collection::told(structure, initial, run.options, run.kept())?;
        again.proceed_with(cancel);
        Source::made(again)
    };
    let last = follower.follow(&mut source)?;
    let told = follower.told(last)?;
    by.concluded(run, told)
}

/// Makes a run of a structure with [its derivatives](structure_sensitivity), as
/// [`run_with_sensitivity`](super::run_with_sensitivity) does one of a [`System`](crate::System).
///
/// # Errors
/// [`SensitivityError`]: a bad option, start, name or variation, or the run, or a leg of it without
/// derivatives.
pub fn structure_run_with_sensitivity(
    structure: &Structure,
    initial: StructureState,
    options: RunOptions,
    by: Vec<(String, Variation)>,
    cancel: &CancelToken,
) -> Result<(Run<Structure>, Sensitivity<StructureLegs>), SensitivityError> {
    if options.kept().0 == Clock::START {
        // It keeps what tells more than a motion in the making.
        Along::new(structure, by.clone())?;
        let run = run(structure, initial.clone(), options, cancel)?;
        let found = structure_sensitivity(&run, initial, by, cancel)?;
        return Ok((run, found));
    }
    let (run, found) = carried_out(structure, initial, options, by, |work| {
        work.proceed(cancel);
        Ok::<_, SensitivityError>(())
    })?;
    Ok((run, found?))
}

/// The same, with how the work is done. A run that was interrupted is there also where its derivatives are
/// refused.
pub(crate) fn carried_out<E: From<SensitivityError>>(
    structure: &Structure,
    initial: StructureState,
    options: RunOptions,
    by: Vec<(String, Variation)>,
    carry_out: impl FnOnce(&mut (dyn Proceeds + Send)) -> Result<(), E>,
) -> Result<RunWith<Structure, StructureLegs>, E> {
    let along = Along::new(structure, by).map_err(SensitivityError::from)?;
    options.check(structure).map_err(SensitivityError::from)?;
    let making = Collection::told(structure, initial, options, options.kept());
    let making = making.map_err(SensitivityError::from)?;
    let follower = along.follower(Span::of_made(&making), options.section_phase, (0, 0));
    let mut work = Making::new(follower, Source::made(making));
    carry_out(&mut work)?;
    let (run, told) = work.into_parts()?;
    let found = told.and_then(|told| along.concluded(&run, told));
    Ok((run, found))
}

/// What a run is differentiated along.
struct Along {
    names: Vec<String>,
    of: Arc<Linearised>,
    /// Coordinates of the structure.
    count: usize,
}

/// What is told of a motion.
pub(super) struct Told {
    rows: Rows,
    legs: Vec<SensitiveLeg>,
    /// None of the derivatives.
    blank: Perturbed,
    /// The derivatives of the state at the end, or
    last: DMatrix<f64>,
    /// where the caller has cancelled the rest, at this time.
    until: Option<f64>,
}

impl Along {
    fn new(structure: &Structure, by: Vec<(String, Variation)>) -> Result<Self, ParameterError> {
        let (names, by): (Vec<String>, Vec<Variation>) = by.into_iter().unzip();
        check_names(&names)?;
        for (name, variation) in names.iter().zip(&by) {
            variation.check(name, structure)?;
        }
        let (count, of) = (structure.coordinates(), Arc::new(Linearised::along(structure, by)));
        Ok(Self { names, of, count })
    }

    /// What follows a motion from its start, with room for so many impacts and sections.
    fn follower(
        &self,
        span: Span,
        section_phase: f64,
        (impacts, sections): (usize, usize),
    ) -> Follower<'_> {
        let Self { names, of, count } = self;
        let mut columns = DMatrix::zeros(2 * count, names.len());
        for (mut column, varied) in columns.column_iter_mut().zip(&of.by) {
            if let Some(start) = &varied.by.start {
                column.rows_mut(0, *count).copy_from_slice(&start.q);
                column.rows_mut(*count, *count).copy_from_slice(&start.v);
            }
        }
        let width = 2 * count * names.len();
        let rows = Rows {
            times: SensitivityTable::with_capacity(names.len() * impacts),
            before: SensitivityTable::with_capacity(width * impacts),
            after: SensitivityTable::with_capacity(width * impacts),
            stroboscopic: SensitivityTable::with_capacity(width * sections),
            ..Rows::default()
        };
        let frequency = of.structure.drive_frequency();
        Follower {
            of,
            span,
            section_offset: if section_phase > 0.0 { section_phase / frequency } else { 0.0 },
            derivatives: Perturbed::new(Arc::clone(of), Clock::START, columns),
            legs: Vec::with_capacity(impacts + 1),
            rows,
            given_up: None,
            plain: 0,
        }
    }

    /// The derivatives of a run, from what was told of its motion.
    fn concluded(
        self,
        run: &Run<Structure>,
        told: Told,
    ) -> Result<Sensitivity<StructureLegs>, SensitivityError> {
        let Self { names, count, .. } = self;
        let Told { rows, legs, blank, last: final_state, until } = told;
        let same = |&(period, time): &(i64, f64), row: &StopImpactRecord| {
            period == row.period && (time - row.time).abs() <= SAME_TIME * row.time.abs()
        };
        let place = Place { end: run.final_state.time, until, events: run.events.len() };
        let more = place.more(&rows.impacts, &run.impacts, same, |row| row.time)?;
        let k = names.len();
        place.check_sections(rows.stroboscopic.len(), 2 * count * k * run.stroboscopic.len())?;
        let mut last = Vec::with_capacity(final_state.len());
        tell(&final_state, &mut last);
        let found = Sensitivity {
            names,
            times: rows.times.without_first(k * more),
            before: rows.before.without_first(2 * count * k * more),
            after: rows.after.without_first(2 * count * k * more),
            stroboscopic: rows.stroboscopic,
            final_state: last,
            one_sided: place.marks(rows.one_sided, (rows.events, rows.earlier)),
            until,
            legs: StructureLegs {
                blank: blank.at(Clock::START, DMatrix::zeros(0, 0)),
                all: legs,
                span: (run.kept_from(), until.unwrap_or(run.final_state.time)),
            },
        };
        found.checked(run.impacts.iter().map(|row| row.time), run.final_state.time)
    }
}
