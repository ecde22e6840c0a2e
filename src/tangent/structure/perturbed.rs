//! Perturbations of a motion of a structure, along the turns of its simulation.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, RowDVector};

use super::StructureTangentError;
use super::forced::Steppers;
use super::impact::along;
use super::rates::Linearised;
use super::samples::{Sample, Samples};
use crate::impact::StopImpact;
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState};
use crate::simulate::event::StopReason;
use crate::simulate::model::ModelEvent;
use crate::simulate::structure::{
    ClosedStops, StopImpactEvent, StopStart, StructureEvent, StructureMode,
};
use crate::simulate::{AnchorOf, Model, Phase, Simulation};
use crate::tangent::tolerances::{SHORT_BOUNCE, SLOW_BOUNCE, STILL_FLIGHT};

/// Perturbations, in columns.
#[derive(Debug, Clone)]
pub(crate) struct Perturbed {
    pub(super) of: Arc<Linearised>,
    /// What legs add to derivatives by numbers.
    steppers: Arc<Steppers>,
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
    /// own time, and the delay of that.
    told: Vec<[DMatrix<f64>; 2]>,
}

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
            told: Vec::new(),
        }
    }

    /// Of a motion of which no chatter is followed.
    pub fn without_chatter(self) -> Self {
        Self { samples_impacts: false, ..self }
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
            Some(StructureEvent::Chatter(chatter)) => self.accumulate(before, chatter),
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
        let mut hopping = Simulation::hopping(&self.of.structure, anchor.clone(), end);
        let mut there = self.clone();
        loop {
            if let Some(StructureEvent::Stop(_)) = there.advance(&mut hopping)? {
                return Ok(there);
            }
        }
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
            let rates = self.of.rates(leg, leg.clock, &leg.state);
            self.columns.ger(-1.0, &rates, &delay.transpose(), 1.0);
            self.struck.clear();
            self.reduce(self.of.motion.dimension(leg));
        }
    }

    fn reduce(&mut self, most: usize) {
        self.rank = self.rank.min(most);
    }

    /// Along a leg up to an instant.
    fn fly(
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
            return Err(StructureTangentError::Chatter(stop, time));
        }
        self.settle(leg);
        self.struck.clear();
        let forced = self.steppers.forced(&self.of, leg, (self.clock, elapsed.hi));
        let forced = forced.map_err(StructureTangentError::Damping)?;
        if let Some(start) = forced.as_ref().and_then(|forced| forced.start.as_ref()) {
            self.columns -= start;
        }
        self.of.homogeneous.carry(leg, elapsed, self.columns.as_mut_slice());
        if let Some(forced) = &forced {
            self.columns += &forced.end;
        }
        if let Some(later) = self.of.later(clock.period - self.clock.period) {
            let state = self.of.state_at(leg, clock);
            self.columns += self.of.rates(leg, clock, &state) * later;
        }
        self.clock = clock;
        Ok(())
    }

    /// Derivatives just before an impact that has been passed, and just after it, at its own time, and the
    /// delay of that: of each impact once, in their order.
    pub fn told(&mut self) -> Option<([DMatrix<f64>; 2], RowDVector<f64>)> {
        let told = if self.told.is_empty() { None } else { Some(self.told.remove(0)) };
        told.zip(self.delay.clone())
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
            told: Vec::new(),
        }
    }

    /// Whether a flight lasts no longer than low bounces do.
    fn is_short(&self, time: f64) -> bool {
        time < SHORT_BOUNCE * Structure::span(&self.of.motion)
    }

    /// To perturbations at an event that happens dt later.
    fn delayed(&mut self, rates: &DVector<f64>, delay: RowDVector<f64>) {
        self.columns += rates * &delay;
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
        let delay = match self.delay.clone().filter(|_| meets) {
            Some(delay) => delay,
            None => self.meet(&leg, event, &met, bounces),
        };
        self.struck.push(stop);
        self.struck.extend(pending.iter().map(|other| other.stop));
        let before = if self.of.by.is_empty() { None } else { Some(self.columns.clone()) };
        if pending.is_empty() {
            self.of.strike(event, &mut self.columns, &delay);
            self.sample(event, &delay);
            self.told = before.map(|before| [before, self.columns.clone()]).into_iter().collect();
        } else {
            let all: Vec<StopImpact> =
                std::iter::once(event.impact).chain(pending.iter().copied()).collect();
            let columns = &mut self.columns;
            let after = self.of.strike_together(event.clock, &all, stop, columns, &delay);
            let before_each = before.into_iter().chain(after.iter().cloned());
            self.told = before_each.zip(after.clone()).map(|(a, b)| [a, b]).collect();
            self.samples = Samples::default();
        }
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

    /// To perturbations at the time of an impact; that time's.
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
        let rates = self.of.rates(leg, event.clock, &event.pre);
        let gap = self.of.gap_change(met.stop, event.clock, &self.columns);
        let delay = gap * (-1.0 / met.approach_velocity);
        self.delayed(&rates, delay.clone());
        delay
    }

    /// Takes note of an impact that may belong to chatter.
    fn sample(&mut self, event: &StopImpactEvent, delay: &RowDVector<f64>) {
        if !self.samples_impacts {
            return;
        }
        let (stop, kind) = (event.impact.stop, event.impact.regime.kind());
        let slip = self.of.structure.slip(stop, &event.post.v);
        let coefficient = self.of.structure.stops()[stop].coefficient();
        let piece = coefficient.piece(event.impact.approach_velocity);
        self.samples.take(Sample {
            contact: (stop, kind, slip > 0.0, piece),
            separation: -event.impact.separation_velocity,
            change: -self.of.rate_change(stop, event.clock, &self.columns, delay),
            clock: event.clock,
            delay: delay.clone(),
            state: event.post.clone(),
            events: self.columns.clone(),
            low: self.low.is_some(),
        });
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

    /// A leg has changed without an impact.
    fn change(
        &mut self,
        before: &AnchorOf<Structure>,
        after: &AnchorOf<Structure>,
    ) -> Result<(), StructureTangentError> {
        match before.phase {
            Phase::Contact(mode) => {
                self.fly(before, after.clock)?;
                self.settle(before);
                if self.slip_ends(mode, before, after) {
                    self.stop_slip(before, after);
                } else {
                    // The force has fallen to 0, or to the limit of friction: no rate jumps.
                    self.reduce(self.of.motion.dimension(before));
                }
                Ok(())
            }
            Phase::Flight(_) => {
                let time = self.of.drive().until(self.clock, after.clock).value();
                if time > STILL_FLIGHT * Structure::span(&self.of.motion) {
                    let time = self.of.drive().time(after.clock);
                    return Err(StructureTangentError::Landing(time));
                }
                self.land_all(after);
                Ok(())
            }
            Phase::Landing => {
                self.land_all(after);
                Ok(())
            }
            Phase::Strike => Ok(()),
        }
    }

    /// Starts on stops without an event before stand for those that land there.
    fn land_all(&mut self, after: &AnchorOf<Structure>) {
        let still = RowDVector::zeros(self.columns.ncols());
        if self.delay.is_none() {
            self.delay = Some(still);
        }
        let Some(delay) = self.delay.clone() else { return };
        for &(stop, start) in &after.touching.at {
            if start == StopStart::Closed {
                self.of.land_on(stop as usize, after.clock, &mut self.columns, &delay);
            }
        }
    }

    fn slip_ends(
        &self,
        mode: StructureMode,
        before: &AnchorOf<Structure>,
        after: &AnchorOf<Structure>,
    ) -> bool {
        let slid = matches!(mode, StructureMode::SlidePositive | StructureMode::SlideNegative);
        let rubs = |stop: &u32| self.of.structure.rubs(*stop);
        let stays = |stop: &u32| after.touching.of(*stop) == Some(StopStart::Closed);
        slid && after.phase != before.phase
            && before.touching.closed().iter().any(|stop| rubs(stop) && stays(stop))
    }

    /// t . q' = 0 at a closed stop.
    fn stop_slip(&mut self, before: &AnchorOf<Structure>, after: &AnchorOf<Structure>) {
        let structure = &self.of.structure;
        let count = structure.coordinates();
        let closed = before.touching.closed();
        let Some(stop) = closed.into_iter().find(|&stop| structure.rubs(stop)) else { return };
        let tangent = structure.stops()[stop as usize].tangent().unwrap_or(&[]);
        let rates = self.of.rates(before, after.clock, &after.state);
        let change: f64 = tangent.iter().zip(rates.iter().skip(count)).map(|(t, a)| t * a).sum();
        let delay = along(tangent, &self.columns, count) * (-1.0 / change);
        self.delayed(&rates, delay);
    }
}
