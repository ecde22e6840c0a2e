//! Derivatives of a run of a structure: its motion again, turn by turn, with its derivatives.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::error::SensitivityError;
use super::structure_cycles::RepeatedImpacts;
use super::structure_follower::{Follower, Rows, Turn};
use super::structure_legs::{StructureLegs, flight, tell};
use super::table::SensitivityTable;
use super::{Place, Sensitivity, check_names};
use crate::impact::strike;
use crate::model::state::Clock;
use crate::model::structure::{Coordinates, Structure, StructureState, Variation};
use crate::numerics::cancel::CancelToken;
use crate::simulate::run::{Run, StopImpactRecord};
use crate::simulate::structure::{StopImpactEvent, StructureEvent};
use crate::simulate::{Anchor, AnchorOf, Simulation};
use crate::tangent::structure::{Linearised, Perturbed};
use crate::tangent::tolerances::SAME_TIME;

impl Follower<'_> {
    /// To the end of the run: derivatives of the state there, or nothing if the caller has cancelled.
    fn follow(
        &mut self,
        mut simulation: Simulation<Structure>,
    ) -> Result<Option<DMatrix<f64>>, SensitivityError> {
        simulation.skips_repeats_until(Clock::START.period);
        self.leg(&simulation);
        let (mut cycle, mut may_repeat) = (None, true);
        loop {
            let mut turn = self.turn(&mut simulation)?;
            if let Some((found, _)) = simulation.repeats() {
                cycle = Some(found);
            }
            if turn == Turn::Over
                && may_repeat
                && let Some(found) = cycle
                && self.can_repeat(&simulation, &found)
            {
                cycle = None;
                let repeated = self.repeat(&mut simulation, &found);
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

    /// As [`Self::follow`], along the impacts that a run has kept, where there is nothing else.
    fn follow_kept(
        &mut self,
        run: &Run<Structure>,
        initial: StructureState,
        cancel: &CancelToken,
    ) -> Result<Option<DMatrix<f64>>, SensitivityError> {
        let mut leg = Anchor::apart(Clock::START, initial);
        self.derivatives = self.derivatives.clone().without_chatter();
        self.fly_from(&leg);
        let rows = &run.impacts;
        let repeated = RepeatedImpacts::of(run);
        let mut place = 0;
        while let Some(row) = rows.get(place) {
            if cancel.is_cancelled() {
                return Ok(None);
            }
            self.pass_row(run, row, &mut leg)?;
            if let Some(cycle) = repeated.filter(|cycle| cycle.first == place)
                && self.derivatives.begins_anew()
            {
                let unit = self.unit();
                let mut one = self.of_one_cycle(&unit, leg.clock);
                one.derivatives = one.derivatives.without_chatter();
                one.fly_from(&leg);
                for row in &rows[place + 1..=place + cycle.count] {
                    one.pass_row(run, row, &mut leg)?;
                }
                // The last leg is the first of the next cycle.
                one.legs.pop();
                self.legs.pop();
                let shift = cycle.left * cycle.periods;
                self.sections.start = one.sections.start + shift;
                self.take_cycles(one.into_cycle(), unit, (cycle.left, cycle.periods));
                leg.clock.period += shift;
                self.derivatives.begin_at(leg.clock);
                self.derivatives = self.derivatives.clone().without_chatter();
                self.fly_from(&leg);
                place += (cycle.left.unsigned_abs() as usize + 1) * cycle.count;
            }
            place += 1;
        }
        let end = run.final_state.clock;
        self.pass_sections(None)?;
        if run.impacts.is_empty() {
            let there = self.of.state_at(&leg, end);
            if !is_near(&there, &run.final_state.state) {
                return Err(self.other_motion(end));
            }
        }
        Ok(Some(self.at_end()?))
    }

    /// To the next of the impacts that a run has kept, and the flight after it.
    fn pass_row(
        &mut self,
        run: &Run<Structure>,
        row: &StopImpactRecord,
        leg: &mut AnchorOf<Structure>,
    ) -> Result<(), SensitivityError> {
        let event = kept_event(&run.system, row).ok_or(self.other_motion(leg.clock))?;
        self.pass_sections(Some(event.clock))?;
        if leg.clock == Clock::START && !self.leads_to(leg, &event) {
            return Err(self.other_motion(event.clock));
        }
        let next = flight(event.clock, event.post.clone());
        let event = StructureEvent::Impact(event);
        self.derivatives.pass_to(leg, &next, Some(&event))?;
        self.take(&event);
        self.derivatives.settle(&next);
        self.fly_from(&next);
        *leg = next;
        Ok(())
    }

    /// Tells the sections before an instant, or all.
    fn pass_sections(&mut self, until: Option<Clock>) -> Result<(), SensitivityError> {
        while let Some(k) = self.sections.clone().next() {
            let period = k - i64::from(self.section_offset > 0.0);
            let clock = Clock::new(period, self.section_offset);
            // One that falls on an event is left for the leg after it.
            if until.is_some_and(|until| clock >= until) {
                break;
            }
            self.section(clock)?;
            self.sections.next();
        }
        Ok(())
    }

    /// Whether the flight from the start leads to its first impact.
    fn leads_to(&self, leg: &AnchorOf<Structure>, event: &StopImpactEvent) -> bool {
        is_near(&self.of.state_at(leg, event.clock), &event.pre)
    }
}

/// Whether a run has kept all of its events, and these are impacts at instants of their own.
fn is_plain(run: &Run<Structure>) -> bool {
    let clock = |row: &StopImpactRecord| Clock::new(row.period, row.time_in_period);
    let apart = run.impacts.windows(2).all(|rows| clock(&rows[0]) < clock(&rows[1]));
    run.is_all_flights() && run.grazes.is_empty() && apart
}

/// A kept impact.
fn kept_event(structure: &Structure, row: &StopImpactRecord) -> Option<StopImpactEvent> {
    let state = |v: &Coordinates| StructureState { q: row.q.clone(), v: v.clone() };
    let mut velocities = row.v_pre.clone();
    let stop = usize::try_from(row.stop).ok()?;
    let impact = strike(structure, stop, row.approach_velocity, &mut velocities).ok()?;
    let (pre, post) = (state(&row.v_pre), state(&row.v_post));
    let clock = Clock::new(row.period, row.time_in_period);
    Some(StopImpactEvent { clock, time: row.time, phase: row.phase, pre, post, impact })
}

/// Whether two states are the same but for rounding.
fn is_near(a: &StructureState, b: &StructureState) -> bool {
    let pairs = a.q.iter().zip(&b.q).chain(a.v.iter().zip(&b.v));
    let size = b.q.iter().chain(&b.v).fold(1.0, |most: f64, x| most.max(x.abs()));
    pairs.into_iter().all(|(a, b)| (a - b).abs() <= SAME_TIME * size)
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
    let of = Arc::new(Linearised::along(structure, by));
    let options = &run.options;
    let end = run.final_state.clock;
    let simulation = Simulation::new(structure, initial.clone())?
        .until(options.horizon)
        .max_events(options.max_events)
        .chatter_tolerance(options.chatter_tolerance)
        .section_phase(options.section_phase)
        .cancel_with(cancel);
    let phase = options.section_phase;
    let mut follower = Follower {
        of: &of,
        window: run.window,
        end,
        section_offset: if phase > 0.0 { phase / structure.drive_frequency() } else { 0.0 },
        sections: run.first_section..run.first_section + run.stroboscopic.len() as i64,
        derivatives: Perturbed::new(Arc::clone(&of), Clock::START, columns),
        legs: Vec::new(),
        rows: Rows::default(),
    };
    let last = if is_plain(run) {
        follower.follow_kept(run, initial, cancel)?
    } else {
        follower.follow(simulation)?
    };
    let Follower { legs, rows, derivatives: blank, .. } = follower;
    let mut until = None;
    let final_state = match (last, legs.last()) {
        (Some(columns), _) => columns,
        (None, Some(leg)) => {
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
    Ok(Sensitivity {
        names,
        times: SensitivityTable::from(rows.times).without_first(k * more),
        before: SensitivityTable::from(rows.before).without_first(2 * count * k * more),
        after: SensitivityTable::from(rows.after).without_first(2 * count * k * more),
        stroboscopic: rows.stroboscopic.into(),
        final_state: last,
        one_sided: place.marks(rows.one_sided, (rows.events, rows.earlier)),
        until,
        legs: StructureLegs {
            blank: blank.at(Clock::START, DMatrix::zeros(0, 0)),
            all: legs,
            span: (run.kept_from(), until.unwrap_or(run.final_state.time)),
        },
    })
}
