//! Derivatives of a run of a structure: its motion again, turn by turn, with its derivatives.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, RowDVector};

use super::error::SensitivityError;
use super::marks::{OneSided, OneSidedReason};
use super::{Along, Place, Sensitivity, check_names};
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState, Variation};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::StopReason;
use crate::simulate::run::{Run, StopImpactRecord};
use crate::simulate::structure::{StopImpactEvent, StructureEvent};
use crate::simulate::{AnchorOf, ModelEvent, Observer, Simulation};
use crate::tangent::structure::{Linearised, Perturbed};
use crate::tangent::tolerances::SAME_TIME;

/// The sections that a turn of a simulation has passed.
#[derive(Default)]
struct Passed(Vec<i64>);

impl Observer<StructureState> for Passed {
    const SECTIONS: bool = true;

    fn section(&mut self, k: i64, _: &StructureState) {
        self.0.push(k);
    }
}

/// A leg of the motion with its derivatives at an instant of it.
struct SensitiveLeg {
    time: f64,
    clock: Clock,
    anchor: AnchorOf<Structure>,
    derivatives: Perturbed,
    /// Impacts are skipped.
    hops: bool,
}

impl SensitiveLeg {
    /// Derivatives of the state at an instant, at a fixed time in a fixed period.
    fn at(&self, clock: Clock) -> Result<Perturbed, SensitivityError> {
        if self.hops {
            return Ok(self.derivatives.hopped(&self.anchor, clock)?);
        }
        let mut there = self.derivatives.clone();
        there.carry_to(&self.anchor, clock)?;
        Ok(there)
    }

    /// The same at a fixed time since the start.
    fn at_fixed_time(
        &self,
        of: &Linearised,
        clock: Clock,
    ) -> Result<DMatrix<f64>, SensitivityError> {
        let mut columns = self.at(clock)?.into_matrix();
        of.at_fixed_time(&of.leg_from(&self.anchor), clock, &mut columns);
        Ok(columns)
    }
}

/// The legs of a run with the derivatives at their starts.
pub struct StructureLegs {
    of: Arc<Linearised>,
    all: Vec<SensitiveLeg>,
    span: (f64, f64),
}

impl Along for StructureLegs {
    fn trajectory(&self, times: &[f64]) -> Result<Option<Vec<f64>>, SensitivityError> {
        let Self { of, all: legs, span: (from, to) } = self;
        let drive = of.drive();
        let mut rows = Vec::new();
        for &time in times {
            if !(*from..=*to).contains(&time) {
                return Ok(None);
            }
            // The last leg that begins not later than this.
            let leg = &legs[legs.partition_point(|leg| leg.time <= time).max(1) - 1];
            let clock = drive.clock_at(time);
            let clock = if clock < leg.clock { leg.clock } else { clock };
            tell(&leg.at_fixed_time(of, clock)?, &mut rows);
        }
        Ok(Some(rows))
    }
}

/// Appends the rows of a matrix.
fn tell(columns: &DMatrix<f64>, rows: &mut Vec<f64>) {
    for row in columns.row_iter() {
        rows.extend(row.iter());
    }
}

/// Tables of derivatives, of the window and of what comes before it in the same drive period.
#[derive(Default)]
struct Rows {
    impacts: Vec<StopImpactEvent>,
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
                let Some(last) = self.legs.last() else { return Err(self.other_motion(self.end)) };
                return Ok(Some(last.at_fixed_time(self.of, self.end)?));
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
        self.legs.push(SensitiveLeg { time, clock, anchor, derivatives, hops });
    }

    fn section(&mut self, clock: Clock) -> Result<(), SensitivityError> {
        let Some(leg) = self.legs.last() else { return Err(self.other_motion(clock)) };
        let there = leg.at(clock)?;
        let mut columns = there.columns().clone();
        // At a fixed phase: omega t = 2 pi k + the section's.
        let later = -self.section_offset / self.of.structure.drive_frequency();
        let faster = self.of.by.iter().map(|varied| varied.by.drive_frequency * later);
        let later = RowDVector::from_iterator(self.of.by.len(), faster);
        if later.iter().any(|later| *later != 0.0) {
            let from = self.of.leg_from(&leg.anchor);
            let state = self.of.state_at(&from, clock);
            columns += self.of.rates(&from, clock, &state) * later;
        }
        tell(&columns, &mut self.rows.stroboscopic);
        if !leg.hops {
            // Longer flights go on from there.
            let (anchor, time) = (leg.anchor.clone(), self.of.drive().time(clock));
            let derivatives = there.kept();
            self.legs.push(SensitiveLeg { time, clock, anchor, derivatives, hops: false });
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
        rows.impacts.push(impact.clone());
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
            StructureEvent::Closed(contact) if self.of.is_at_border_of_contact(contact) => {
                let onset = self.rows.chatter == Some(contact.clock);
                let onset = onset.then_some(OneSidedReason::ChatterOnset);
                Some(onset.unwrap_or(OneSidedReason::ContactBorder))
            }
            _ => None,
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
    let of = Arc::new(Linearised::along(structure, by));
    let options = &run.options;
    let end = run.final_state.clock;
    let simulation = Simulation::new(structure, initial)?
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
    let last = follower.follow(simulation)?;
    let Follower { legs, rows, .. } = follower;
    let mut until = None;
    let final_state = match (last, legs.last()) {
        (Some(columns), _) => columns,
        (None, Some(leg)) => {
            until = Some(leg.time);
            leg.at_fixed_time(&of, leg.clock)?
        }
        (None, None) => return Err(SensitivityError::OtherMotion { time: 0.0 }),
    };
    let same = |event: &StopImpactEvent, row: &StopImpactRecord| {
        event.clock.period == row.period
            && (event.time - row.time).abs() <= SAME_TIME * row.time.abs()
    };
    let place = Place { end: run.final_state.time, until, events: run.events.len() };
    let more = place.more(&rows.impacts, &run.impacts, same, |row| row.time)?;
    let k = names.len();
    place.check_sections(rows.stroboscopic.len(), 2 * count * k * run.stroboscopic.len())?;
    let from = |table: Vec<f64>, rows: usize| table[rows * k..].to_vec();
    let mut last = Vec::with_capacity(final_state.len());
    tell(&final_state, &mut last);
    Ok(Sensitivity {
        names,
        times: from(rows.times, more),
        before: from(rows.before, 2 * count * more),
        after: from(rows.after, 2 * count * more),
        stroboscopic: rows.stroboscopic,
        final_state: last,
        one_sided: place.marks(rows.one_sided, (rows.events, rows.earlier)),
        until,
        legs: StructureLegs {
            of,
            all: legs,
            span: (run.kept_from(), until.unwrap_or(run.final_state.time)),
        },
    })
}
