//! Perturbations of a motion of a structure, along the turns of its simulation.

use std::sync::Arc;

use nalgebra::{DMatrix, RowDVector};
use smallvec::SmallVec;

use super::StructureTangentError;
use super::forced::Steppers;
use super::rates::{Linearised, Rates, add_moved};
use super::samples::{Sample, Samples};
use crate::impact::StopImpact;
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState};
use crate::simulate::event::StopReason;
use crate::simulate::model::ModelEvent;
use crate::simulate::structure::{ClosedStops, StopImpactEvent, StructureEvent};
use crate::simulate::{AnchorOf, Model, Phase, Simulation};
use crate::tangent::long_flight::Parts;
use crate::tangent::tolerances::{SHORT_BOUNCE, SLOW_BOUNCE};

/// Perturbations, in columns.
#[derive(Debug, Clone)]
pub(crate) struct Perturbed {
    pub(super) of: Arc<Linearised>,
    /// What legs add to derivatives by numbers.
    pub(super) steppers: Arc<Steppers>,
    /// Of the state at this time; or, with a delay, of that at the event of this time.
    pub(super) columns: DMatrix<f64>,
    pub(super) clock: Clock,
    pub(super) delay: Option<RowDVector<f64>>,
    rank: usize,
    /// Stops struck at this instant, or closed before it, from this state on.
    struck: Vec<usize>,
    held: ClosedStops,
    before: StructureState,
    /// Impacts of what may become chatter, unless none does.
    pub(super) samples: Samples,
    samples_impacts: bool,
    /// A stop with bounces so low that rounding has spoilt the perturbations, and when.
    pub(super) low: Option<(usize, f64)>,
    /// Derivatives before and after the impacts of this instant that are still to be told, each at its
    /// own time; after the last of them they are the columns.
    told: SmallVec<[Told; 1]>,
}

/// Derivatives before an impact, and after it.
type Told = (DMatrix<f64>, Option<DMatrix<f64>>);

impl Perturbed {
    pub fn new(of: Arc<Linearised>, clock: Clock, columns: DMatrix<f64>) -> Self {
        let rank = columns.nrows();
        Self {
            of,
            steppers: Arc::default(),
            columns,
            clock,
            delay: None,
            rank,
            struck: Vec::new(),
            held: ClosedStops::default(),
            before: StructureState::default(),
            samples: Samples::default(),
            samples_impacts: true,
            low: None,
            told: SmallVec::new(),
        }
    }

    /// Whether the next impacts may lead into contact.
    pub fn expect_rest(&mut self, may_land: bool) {
        self.samples_impacts = may_land;
    }

    /// Of the state at an instant of a flight, with what is worked out once.
    pub fn at(&self, clock: Clock, columns: DMatrix<f64>) -> Self {
        Self {
            steppers: Arc::clone(&self.steppers),
            ..Self::new(Arc::clone(&self.of), clock, columns)
        }
    }

    /// Dimension of the states that nearby motions reach.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// The perturbations of the state.
    pub fn into_matrix(self) -> DMatrix<f64> {
        self.columns
    }

    /// One turn of the simulation, and its event, if there is one. At the end the perturbations are
    /// those of the state there, unless impacts are skipped.
    pub fn advance(
        &mut self,
        simulation: &mut Simulation<Structure>,
    ) -> Result<Option<StructureEvent>, StructureTangentError> {
        let before = simulation.checkpoint().anchor.clone();
        let event = simulation.step(&mut ()).transpose()?;
        self.pass(&before, simulation, event.as_ref())?;
        Ok(event)
    }

    /// What such a turn does, from the leg before.
    pub fn pass(
        &mut self,
        before: &AnchorOf<Structure>,
        simulation: &Simulation<Structure>,
        event: Option<&StructureEvent>,
    ) -> Result<(), StructureTangentError> {
        let point = simulation.checkpoint();
        if let Some(stop) = event.and_then(ModelEvent::as_stop) {
            // Hops have no horizon but a time.
            let over =
                stop.reason == StopReason::TimeCap && stop.clock == simulation.horizon_clock();
            if !(stop.reason.reached_the_end() || over) {
                return Err(StructureTangentError::Stopped(stop.reason));
            }
            if !point.skips() {
                self.carry_to(before, stop.clock)?;
            }
            return Ok(());
        }
        self.pass_to(before, &point.anchor, event)
    }

    /// The same up to what is no stop, to the leg after.
    pub fn pass_to(
        &mut self,
        before: &AnchorOf<Structure>,
        after: &AnchorOf<Structure>,
        event: Option<&StructureEvent>,
    ) -> Result<(), StructureTangentError> {
        match event {
            Some(StructureEvent::Impact(impact)) => self.strike(before, after, impact),
            Some(StructureEvent::Chatter(chatter)) => self.accumulate((before, after), chatter),
            Some(StructureEvent::Graze(_)) => Ok(()),
            _ if before != after => self.change(before, after),
            _ => Ok(()),
        }
    }

    /// To perturbations at an instant of a leg.
    pub fn carry_to(
        &mut self,
        leg: &AnchorOf<Structure>,
        clock: Clock,
    ) -> Result<(), StructureTangentError> {
        let leg = self.of.leg_from(leg);
        self.fly(&leg, clock)?;
        self.settle(&leg);
        Ok(())
    }

    /// Whether this leg is carried along as well at once as in parts.
    pub fn flies_at_once(&self, leg: &AnchorOf<Structure>) -> bool {
        self.steppers.flies_at_once(&self.of, leg)
    }

    /// The perturbations at the end of a simulation that skips the impacts there.
    pub fn within_chatter(
        &self,
        simulation: &Simulation<Structure>,
    ) -> Result<Self, StructureTangentError> {
        self.hopped(&simulation.checkpoint().anchor, simulation.horizon_clock())
    }

    /// The perturbations at an instant after this leg begins, in which impacts are skipped.
    pub fn hopped(
        &self,
        anchor: &AnchorOf<Structure>,
        end: Clock,
    ) -> Result<Self, StructureTangentError> {
        self.steppers.hop(&self.of, (anchor, end), |hopping| {
            let mut there = self.clone();
            loop {
                if let Some(StructureEvent::Stop(_)) = there.advance(hopping)? {
                    return Ok(there);
                }
            }
        })
    }

    /// These perturbations combined otherwise, of columns as those of `blank`, so many drive periods later.
    pub fn combined(&self, blank: &Self, by: &DMatrix<f64>, periods: i64) -> Self {
        let mut samples = self.samples.clone();
        samples.combine(by);
        samples.later_by(periods);
        Self {
            of: Arc::clone(&blank.of),
            steppers: Arc::clone(&blank.steppers),
            columns: &self.columns * by,
            clock: Clock { period: self.clock.period + periods, ..self.clock },
            delay: self.delay.as_ref().map(|delay| delay * by),
            samples,
            ..self.kept()
        }
    }

    /// Whether nothing of what has been before counts for what comes, but the columns.
    pub fn begins_anew(&self) -> bool {
        self.samples.are_few() && self.low.is_none() && self.told.is_empty()
    }

    /// The columns, at another instant, as if there had been nothing before.
    pub fn begin_at(&mut self, clock: Clock) {
        let columns = std::mem::take(&mut self.columns);
        *self = self.at(clock, columns);
    }

    pub fn columns_mut(&mut self) -> &mut DMatrix<f64> {
        &mut self.columns
    }

    /// What perturbations of its motions have in common, for others of them.
    pub fn shared(&self) -> &Arc<Linearised> {
        &self.of
    }

    /// The same perturbations combined otherwise: these are `columns`, which are the present ones
    /// times `by` but for rounding.
    pub fn recombine(&mut self, columns: DMatrix<f64>, by: &DMatrix<f64>) {
        self.columns = columns;
        self.delay = self.delay.take().map(|delay| delay * by);
        self.samples.combine(by);
    }

    /// What perturbations of its motions have in common.
    pub fn linearised(&self) -> &Linearised {
        &self.of
    }

    /// What moves.
    pub fn structure(&self) -> &Structure {
        &self.of.structure
    }

    /// The time of which they are.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    pub fn columns(&self) -> &DMatrix<f64> {
        &self.columns
    }

    /// From an event on: perturbations of the state at its time, in the leg that begins there.
    pub fn settle(&mut self, leg: &AnchorOf<Structure>) {
        if let Some(delay) = self.delay.take() {
            let rates = self.steppers.rates(&self.of, leg, (leg.clock, &leg.state));
            add_moved(&mut self.columns, &rates, &(-delay));
            self.struck.clear();
            self.reduce(self.of.motion.dimension(leg));
        }
    }

    pub(super) fn reduce(&mut self, most: usize) {
        self.rank = self.rank.min(most);
    }

    /// Along a leg up to an instant.
    pub(super) fn fly(
        &mut self,
        leg: &AnchorOf<Structure>,
        clock: Clock,
    ) -> Result<(), StructureTangentError> {
        let elapsed = self.of.drive().until(self.clock, clock);
        if elapsed.hi <= 0.0 {
            return Ok(());
        }
        if let Some((stop, time)) = self.low
            && !self.is_short(elapsed.hi)
        {
            return Err(StructureTangentError::Chatter(stop, time, self.columns.amax()));
        }
        self.settle(leg);
        self.struck.clear();
        let longest = self.steppers.longest_part(&self.of, leg);
        let parts = Parts::new(self.of.drive(), longest, self.of.turns());
        while let Some(part) = parts.first(self.of.drive(), self.clock, clock) {
            self.fly_on(leg, part.end)?;
        }
        self.fly_on(leg, clock)
    }

    /// The same of one part.
    fn fly_on(
        &mut self,
        leg: &AnchorOf<Structure>,
        clock: Clock,
    ) -> Result<(), StructureTangentError> {
        let over = ([self.clock, clock], self.of.drive().until(self.clock, clock));
        let carried = self.steppers.carry(&self.of, leg, over, &mut self.columns);
        carried.map_err(StructureTangentError::Damping)?;
        if let Some(later) = self.of.later(clock.period - self.clock.period) {
            let state = self.of.state_at(leg, clock);
            let rates = self.steppers.rates(&self.of, leg, (clock, &state));
            add_moved(&mut self.columns, &rates, &later);
        }
        self.clock = clock;
        Ok(())
    }

    /// Tells derivatives just before an impact that has been passed, and just after it, at its own time, and
    /// the delay of that: of each impact once, in their order, before what comes next.
    pub fn tell<R>(
        &mut self,
        of: impl FnOnce([&DMatrix<f64>; 2], &RowDVector<f64>) -> R,
    ) -> Option<R> {
        let (before, after) = if self.told.is_empty() { None } else { Some(self.told.remove(0)) }?;
        let delay = self.delay.as_ref()?;
        Some(of([&before, after.as_ref().unwrap_or(&self.columns)], delay))
    }

    /// The same for legs that are looked at later, without what belongs to chatter.
    pub fn kept(&self) -> Self {
        Self {
            of: Arc::clone(&self.of),
            steppers: Arc::clone(&self.steppers),
            columns: self.columns.clone(),
            clock: self.clock,
            delay: self.delay.clone(),
            rank: self.rank,
            struck: self.struck.clone(),
            held: self.held.clone(),
            before: self.before.clone(),
            samples: Samples::default(),
            samples_impacts: self.samples_impacts,
            low: self.low,
            told: SmallVec::new(),
        }
    }

    /// Whether a flight lasts no longer than low bounces do.
    fn is_short(&self, time: f64) -> bool {
        time < SHORT_BOUNCE * Structure::span(&self.of.motion)
    }

    /// To perturbations at an event that happens dt later.
    pub(super) fn delayed(&mut self, rates: &Rates, delay: RowDVector<f64>) {
        add_moved(&mut self.columns, rates, &delay);
        self.delay = Some(delay);
    }

    fn strike(
        &mut self,
        before: &AnchorOf<Structure>,
        after: &AnchorOf<Structure>,
        event: &StopImpactEvent,
    ) -> Result<(), StructureTangentError> {
        let at_once = before.phase == Phase::Strike;
        if at_once && !before.touching.pending.is_empty() {
            // Told with the first of the instant.
            return Ok(());
        }
        let leg = self.of.leg_from(before);
        let time = self.of.drive().until(self.clock, event.clock).value();
        let bounces = at_once || self.is_short(time);
        self.fly(&leg, event.clock)?;
        if self.struck.is_empty() {
            self.before.clone_from(&event.pre);
            self.held = before.touching.closed();
        }
        let pending = &after.touching.pending;
        let met = self.met(event, pending)?;
        self.checked_order(met.stop, event)?;
        // What is closed or has been struck meets its stop when the first one is met, in nearby
        // motions too.
        let stop = met.stop;
        let meets = at_once && (self.struck.contains(&stop) || self.held.contains(&(stop as u32)));
        let delay = match self.delay.take_if(|_| meets) {
            Some(delay) => delay,
            None => self.meet(&leg, event, &met, bounces),
        };
        self.struck.push(stop);
        self.struck.extend(pending.iter().map(|other| other.stop));
        let before = if self.of.by.is_empty() { None } else { Some(self.columns.clone()) };
        if pending.is_empty() {
            self.of.strike(event, &mut self.columns, &delay);
            self.sample(event, &delay);
            self.told = before.map(|before| (before, None)).into_iter().collect();
        } else {
            let all: Vec<StopImpact> =
                std::iter::once(event.impact).chain(pending.iter().copied()).collect();
            let columns = &mut self.columns;
            let after = self.of.strike_together(event.clock, &all, stop, columns, &delay);
            let before_each = before.into_iter().chain(after.iter().cloned());
            self.told = before_each.zip(after.iter().cloned().map(Some)).collect();
            self.samples = Samples::default();
        }
        self.delay = Some(delay);
        if event.impact.regime.kind().sticks() || event.impact.separation_velocity == 0.0 {
            self.reduce(self.columns.nrows() - 1);
        }
        Ok(())
    }

    /// Of the impacts of one event, that of the stop which is met there: the others are closed.
    fn met(
        &self,
        event: &StopImpactEvent,
        pending: &[StopImpact],
    ) -> Result<StopImpact, StructureTangentError> {
        if pending.is_empty() {
            return Ok(event.impact);
        }
        let near = self.of.motion.near(event.clock, &event.pre, 0.0);
        let approaches = |of: &&StopImpact| {
            near.iter().any(|at| at.stop as usize == of.stop && at.moves && at.rate > 0.0)
        };
        let mut met = std::iter::once(&event.impact).chain(pending).filter(approaches);
        match (met.next(), met.next()) {
            (Some(one), Some(other)) => {
                Err(StructureTangentError::Simultaneous(one.stop, other.stop, event.time))
            }
            (one, _) => Ok(*one.unwrap_or(&event.impact)),
        }
    }

    /// To perturbations at the time of an impact; the delay of that.
    fn meet(
        &mut self,
        leg: &AnchorOf<Structure>,
        event: &StopImpactEvent,
        met: &StopImpact,
        bounces: bool,
    ) -> RowDVector<f64> {
        let speed = event.pre.v.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        if bounces && met.approach_velocity < SLOW_BOUNCE * speed {
            self.low = Some((met.stop, event.time));
        }
        let struck = std::mem::take(&mut self.struck);
        self.settle(leg);
        self.struck = struck;
        let rates = self.steppers.rates(&self.of, leg, (event.clock, &event.pre));
        let gap = self.of.gap_change(met.stop, event.clock, &self.columns);
        let delay = gap * (-1.0 / met.approach_velocity);
        add_moved(&mut self.columns, &rates, &delay);
        delay
    }

    /// Takes note of an impact that may belong to chatter.
    fn sample(&mut self, event: &StopImpactEvent, delay: &RowDVector<f64>) {
        if !self.samples_impacts {
            return;
        }
        let stop = event.impact.stop;
        let new = Sample {
            stop,
            formula: self.of.formula(event),
            approach: event.impact.approach_velocity,
            separation: -event.impact.separation_velocity,
            change: -self.of.rate_change(stop, event.clock, &self.columns, delay),
            clock: event.clock,
            delay: delay.clone(),
            state: event.post.clone(),
            events: self.columns.clone(),
            closed: None,
        };
        self.samples.take(new, self.low.is_some());
    }

    /// Refuses an impact whose order among those of its instant rounding has chosen.
    fn checked_order(
        &self,
        stop: usize,
        event: &StopImpactEvent,
    ) -> Result<(), StructureTangentError> {
        let seen = self.struck.iter().find(|&&other| self.of.structure.sees(other, stop));
        let Some(&other) = seen else { return Ok(()) };
        let near = self.of.motion.near(event.clock, &self.before, 0.0);
        let approached = |at: &crate::simulate::structure::Near| {
            at.stop as usize == stop && at.moves && at.rate > 0.0
        };
        if !self.struck.contains(&stop) && near.iter().any(approached) {
            return Err(StructureTangentError::Simultaneous(other, stop, event.time));
        }
        Ok(())
    }
}
