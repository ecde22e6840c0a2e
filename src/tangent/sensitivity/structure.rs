//! Derivatives of a run of a structure: its motion again, turn by turn, with its derivatives.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, RowDVector};

use super::error::SensitivityError;
use super::marks::{OneSided, OneSidedReason};
use super::structure_legs::{From, SensitiveLeg, StructureLegs, flight, tell};
use super::{Place, Sensitivity, check_names, without_first};
use crate::impact::strike;
use crate::model::state::Clock;
use crate::model::structure::{Coordinates, Structure, StructureState, Variation};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::StopReason;
use crate::simulate::run::{Run, StopImpactRecord};
use crate::simulate::structure::{StopImpactEvent, StructureEvent};
use crate::simulate::{Anchor, AnchorOf, ModelEvent, Observer, Simulation};
use crate::tangent::structure::{Linearised, Perturbed};
use crate::tangent::tolerances::SAME_TIME;

/// Sections of flights over fewer drive periods are reached from their start.
const SHORT_FLIGHT: i64 = 16;

/// The sections that a turn of a simulation has passed.
#[derive(Default)]
struct Passed(Vec<i64>);

impl Observer<StructureState> for Passed {
    const SECTIONS: bool = true;

    fn section(&mut self, k: i64, _: &StructureState) {
        self.0.push(k);
    }
}

/// Tables of derivatives, of the window and of what comes before it in the same drive period.
#[derive(Default)]
struct Rows {
    /// Drive period and time of the impacts.
    impacts: Vec<(i64, f64)>,
    times: Vec<f64>,
    before: Vec<f64>,
    after: Vec<f64>,
    stroboscopic: Vec<f64>,
    one_sided: Vec<OneSided>,
    events: i64,
    earlier: i64,
    /// Where the last chatter ended.
    chatter: Option<Clock>,
}

struct Follower<'a> {
    of: &'a Arc<Linearised>,
    window: Clock,
    end: Clock,
    section_offset: f64,
    /// Numbers of the sections that are recorded.
    sections: Range<i64>,
    derivatives: Perturbed,
    legs: Vec<SensitiveLeg>,
    rows: Rows,
}

impl Follower<'_> {
    fn other_motion(&self, clock: Clock) -> SensitivityError {
        SensitivityError::OtherMotion { time: self.of.drive().time(clock) }
    }

    /// To the end of the run: derivatives of the state there, or nothing if the caller has cancelled.
    fn follow(
        &mut self,
        mut simulation: Simulation<Structure>,
    ) -> Result<Option<DMatrix<f64>>, SensitivityError> {
        let mut passed = Passed::default();
        self.leg(&simulation);
        loop {
            let before = simulation.checkpoint().anchor.clone();
            let event = simulation.step(&mut passed).transpose()?;
            for k in std::mem::take(&mut passed.0) {
                if self.sections.contains(&k) {
                    let period = k - i64::from(self.section_offset > 0.0);
                    self.section(Clock::new(period, self.section_offset))?;
                }
            }
            let stop = event.as_ref().and_then(ModelEvent::as_stop);
            let clock = event.as_ref().map(ModelEvent::clock);
            if stop.is_some() || clock.is_some_and(|clock| clock > self.end) {
                if let Some(stop) = stop
                    && stop.clock < self.end
                {
                    let cancelled = stop.reason == StopReason::Interrupted;
                    return if cancelled { Ok(None) } else { Err(self.other_motion(stop.clock)) };
                }
                return Ok(Some(self.at_end()?));
            }
            self.derivatives.pass(&before, &simulation, event.as_ref())?;
            if let Some(event) = &event {
                self.take(event);
            }
            if before != simulation.checkpoint().anchor || simulation.checkpoint().skips() {
                self.leg(&simulation);
            }
        }
    }

    fn at_end(&self) -> Result<DMatrix<f64>, SensitivityError> {
        let Some(last) = self.legs.last() else { return Err(self.other_motion(self.end)) };
        last.at_fixed_time(&self.derivatives, self.end)
    }

    /// As [`Self::follow`], along the impacts that a run has kept, where there is nothing else.
    fn follow_kept(
        &mut self,
        run: &Run<Structure>,
        initial: StructureState,
        cancel: &CancelToken,
    ) -> Result<Option<DMatrix<f64>>, SensitivityError> {
        let mut sections = self.sections.clone();
        let mut pass_sections = |follower: &mut Self, until: Option<Clock>| {
            while let Some(k) = sections.clone().next() {
                let period = k - i64::from(follower.section_offset > 0.0);
                let clock = Clock::new(period, follower.section_offset);
                // One that falls on an event is left for the leg after it.
                if until.is_some_and(|until| clock >= until) {
                    break;
                }
                follower.section(clock)?;
                sections.next();
            }
            Ok::<(), SensitivityError>(())
        };
        let mut leg = Anchor::apart(Clock::START, initial);
        self.derivatives = self.derivatives.clone().without_chatter();
        self.fly_from(&leg);
        for row in &run.impacts {
            if cancel.is_cancelled() {
                return Ok(None);
            }
            let event = kept_event(&run.system, row).ok_or(self.other_motion(leg.clock))?;
            pass_sections(self, Some(event.clock))?;
            if self.rows.events == 0 && !self.leads_to(&leg, &event) {
                return Err(self.other_motion(event.clock));
            }
            let next = flight(event.clock, event.post.clone());
            let event = StructureEvent::Impact(event);
            self.derivatives.pass_to(&leg, &next, Some(&event))?;
            self.take(&event);
            self.derivatives.settle(&next);
            self.fly_from(&next);
            leg = next;
        }
        let end = run.final_state.clock;
        pass_sections(self, None)?;
        if run.impacts.is_empty() {
            let there = self.of.state_at(&leg, end);
            if !is_near(&there, &run.final_state.state) {
                return Err(self.other_motion(end));
            }
        }
        Ok(Some(self.at_end()?))
    }

    /// Takes note of the flight that begins.
    fn fly_from(&mut self, leg: &AnchorOf<Structure>) {
        let (clock, time) = (leg.clock, self.of.drive().time(leg.clock));
        let from = From::Flight(leg.state.clone(), self.derivatives.columns().clone());
        self.legs.push(SensitiveLeg { time, clock, from });
    }

    /// Whether the flight from the start leads to its first impact.
    fn leads_to(&self, leg: &AnchorOf<Structure>, event: &StopImpactEvent) -> bool {
        is_near(&self.of.state_at(leg, event.clock), &event.pre)
    }

    /// Takes note of the leg that begins, if the window needs it.
    fn leg(&mut self, simulation: &Simulation<Structure>) {
        let point = simulation.checkpoint();
        let (anchor, hops) = (point.anchor.clone(), point.skips());
        let clock = anchor.clock;
        if clock <= self.window {
            self.legs.clear();
        }
        let derivatives = &self.derivatives;
        let derivatives = if hops { derivatives.clone() } else { derivatives.kept() };
        let time = self.of.drive().time(clock);
        let from = From::Any(Box::new((anchor, derivatives)), hops);
        self.legs.push(SensitiveLeg { time, clock, from });
    }

    fn section(&mut self, clock: Clock) -> Result<(), SensitivityError> {
        let Some(leg) = self.legs.last() else { return Err(self.other_motion(clock)) };
        let there = leg.at(&self.derivatives, clock)?;
        if self.section_offset > 0.0 && self.of.turns() {
            // At a fixed phase: omega t = 2 pi k + the section's.
            let later = -self.section_offset / self.of.structure.drive_frequency();
            let faster = self.of.by.iter().map(|varied| varied.by.drive_frequency * later);
            let later = RowDVector::from_iterator(self.of.by.len(), faster);
            let from = self.of.leg_from(&leg.anchor());
            let state = self.of.state_at(&from, clock);
            let columns = there.columns() + self.of.rates(&from, clock, &state) * later;
            tell(&columns, &mut self.rows.stroboscopic);
        } else {
            tell(there.columns(), &mut self.rows.stroboscopic);
        }
        let periods = clock.period - leg.clock.period;
        let is_short = matches!(leg.from, From::Flight(..)) && periods < SHORT_FLIGHT;
        if !(is_short || leg.hops()) {
            // Longer flights go on from there.
            let time = self.of.drive().time(clock);
            let from = match leg.from {
                From::Flight(..) => {
                    let state = self.of.state_at(&leg.anchor(), clock);
                    From::Flight(state, there.into_matrix())
                }
                From::Any(..) => From::Any(Box::new((leg.anchor(), there.kept())), false),
            };
            self.legs.push(SensitiveLeg { time, clock, from });
        }
        Ok(())
    }

    fn take(&mut self, event: &StructureEvent) {
        if let Some(reason) = self.one_sided(event) {
            let time = self.of.drive().time(event.clock());
            self.rows.one_sided.push(OneSided { index: self.rows.events, time, reason });
        }
        self.rows.events += 1;
        self.rows.earlier += i64::from(event.clock() < self.window);
        if let StructureEvent::Chatter(chatter) = event {
            self.rows.chatter = Some(chatter.clock);
        }
        let StructureEvent::Impact(impact) = event else { return };
        let Some(([before, after], delay)) = self.derivatives.told() else { return };
        if impact.clock < self.window {
            return;
        }
        let rows = &mut self.rows;
        rows.impacts.push((impact.clock.period, impact.time));
        match self.of.later(impact.clock.period) {
            Some(later) => rows.times.extend((delay + later).iter()),
            None => rows.times.extend(delay.iter()),
        }
        tell(&before, &mut rows.before);
        tell(&after, &mut rows.after);
    }

    fn one_sided(&self, event: &StructureEvent) -> Option<OneSidedReason> {
        let at_start = self.rows.events == 0 && event.clock() == Clock::START;
        match event {
            StructureEvent::Graze(_) => Some(OneSidedReason::Graze),
            StructureEvent::Stop(_) => None,
            _ if at_start => Some(OneSidedReason::StartOnContact),
            StructureEvent::Impact(impact) if self.of.is_at_border(impact) => {
                Some(OneSidedReason::RegimeBorder)
            }
            StructureEvent::Impact(event) if self.of.is_at_knot(&event.impact) => {
                Some(OneSidedReason::RestitutionKnot)
            }
            StructureEvent::Closed(contact) => {
                let chattered = self.rows.chatter == Some(contact.clock);
                let at_border = self.of.is_at_border_of_contact(contact, chattered);
                let onset = at_border && chattered;
                let reason = onset.then_some(OneSidedReason::ChatterOnset);
                at_border.then(|| reason.unwrap_or(OneSidedReason::ContactBorder))
            }
            _ => None,
        }
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
        times: without_first(rows.times, k * more),
        before: without_first(rows.before, 2 * count * k * more),
        after: without_first(rows.after, 2 * count * k * more),
        stroboscopic: rows.stroboscopic,
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
