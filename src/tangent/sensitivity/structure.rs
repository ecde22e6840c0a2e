//! Derivatives of a run of a structure: its motion again, turn by turn, with its derivatives.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::error::SensitivityError;
use super::structure_follower::{Follower, Rows, Turn};
use super::structure_kept::Kept;
use super::structure_legs::{StructureLegs, tell};
use super::structure_source::Source;
use super::table::SensitivityTable;
use super::{Place, Sensitivity, check_names, followed};
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState, Variation};
use crate::numerics::cancel::CancelToken;
use crate::simulate::Simulation;
use crate::simulate::run::{Run, StopImpactRecord};
use crate::tangent::structure::{Linearised, Perturbed};
use crate::tangent::tolerances::SAME_TIME;

impl Follower<'_> {
    /// To the end of the run: derivatives of the state there, or nothing if the caller has cancelled.
    fn follow(&mut self, mut source: Source) -> Result<Option<DMatrix<f64>>, SensitivityError> {
        self.leg(&mut source);
        let mut may_repeat = true;
        loop {
            let mut turn = self.turn(&mut source)?;
            if turn == Turn::Over
                && may_repeat
                && let Some(alike) = self.cycle_from(&source)
            {
                let repeated = self.repeat(&mut source, &alike);
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
    let (names, by): (Vec<String>, Vec<Variation>) = by.into_iter().unzip();
    check_names(&names)?;
    for (name, variation) in names.iter().zip(&by) {
        variation.check(name, structure)?;
    }
    let count = structure.coordinates();
    let mut columns = DMatrix::zeros(2 * count, by.len());
    for (mut column, variation) in columns.column_iter_mut().zip(&by) {
        if let Some(start) = &variation.start {
            column.rows_mut(0, count).copy_from_slice(&start.q);
            column.rows_mut(count, count).copy_from_slice(&start.v);
        }
    }
    let (impacts, sections) = followed(run);
    let width = 2 * count * by.len();
    let rows = Rows {
        times: SensitivityTable::with_capacity(by.len() * impacts),
        before: SensitivityTable::with_capacity(width * impacts),
        after: SensitivityTable::with_capacity(width * impacts),
        stroboscopic: SensitivityTable::with_capacity(width * sections),
        ..Rows::default()
    };
    let of = Arc::new(Linearised::along(structure, by));
    let options = &run.options;
    let end = run.final_state.clock;
    let phase = options.section_phase;
    let section_offset = if phase > 0.0 { phase / structure.drive_frequency() } else { 0.0 };
    let mut follower = Follower {
        of: &of,
        window: run.window,
        end,
        section_offset,
        sections: run.first_section..run.first_section + run.stroboscopic.len() as i64,
        derivatives: Perturbed::new(Arc::clone(&of), Clock::START, columns),
        legs: Vec::with_capacity(impacts + 1),
        rows,
    };
    let source = if let Some(kept) = Kept::new(run, &initial, section_offset, cancel)? {
        Source::Kept(Box::new(kept))
    } else {
        let simulation = Simulation::new(structure, initial)?
            .until(options.horizon)
            .max_events(options.max_events)
            .chatter_tolerance(options.chatter_tolerance)
            .section_phase(options.section_phase)
            .cancel_with(cancel);
        Source::found(simulation)
    };
    let last = follower.follow(source)?;
    let Follower { legs, rows, derivatives: blank, .. } = follower;
    let mut until = None;
    let final_state = match (last, legs.last()) {
        (Some(columns), _) => columns,
        (None, Some(leg)) => {
            let cycled = leg.cycled_at(of.drive(), f64::INFINITY);
            let leg = cycled.as_ref().unwrap_or(leg);
            until = Some(leg.time);
            leg.at_fixed_time(&blank, leg.clock)?
        }
        (None, None) => return Err(SensitivityError::OtherMotion { time: 0.0 }),
    };
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
