//! Where the events of a run come from: from its tables, where they have all of them and between them
//! the bodies fly, or from the motion once more.

use crate::impact::resolve;
use crate::model::contact_coordinates::PreImpact;
use crate::model::error::SimulationError;
use crate::model::state::{Clock, State};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{
    Event, EventKind, GrazeEvent, GrazeRecord, ImpactEvent, ImpactRecord, StopEvent, StopReason,
};
use crate::simulate::run::{Recorded, Run};
use crate::simulate::{Observer, Simulation};

/// The sections that have been passed since they were last asked for, and the states there.
#[derive(Default)]
pub(super) struct Passed(pub Vec<(i64, State)>);

impl Observer for Passed {
    const SECTIONS: bool = true;

    fn section(&mut self, k: i64, state: &State) {
        self.0.push((k, *state));
    }
}

/// The events of a run, one by one.
pub(super) enum Source<'a> {
    /// As a simulation finds them.
    Found(Box<Simulation>),
    /// As they are kept.
    Kept(Kept<'a>),
}

/// The events that a run keeps.
pub(super) struct Kept<'a> {
    run: &'a Run,
    cancel: &'a CancelToken,
    section_offset: f64,
    event: usize,
    section: usize,
    here: Clock,
}

impl<'a> Kept<'a> {
    pub fn new(run: &'a Run, section_offset: f64, cancel: &'a CancelToken) -> Self {
        Self { run, cancel, section_offset, event: 0, section: 0, here: Clock::START }
    }

    /// State just before the first event.
    pub fn first(&self) -> (Clock, State) {
        match self.next() {
            Some(Event::Impact(impact)) => (impact.clock, impact.pre),
            Some(Event::Graze(graze)) => (graze.clock, graze.state),
            _ => (self.run.final_state.clock, self.run.final_state.state),
        }
    }

    fn next(&self) -> Option<Event> {
        let run = self.run;
        let row = run.events.get(self.event)?;
        let index = usize::try_from(row.index).ok();
        let is = |kind: EventKind| row.kind == kind as i64;
        if is(EventKind::Impact) {
            let row = run.impacts.get(index?)?;
            let &ImpactRecord { time, period, time_in_period, x1, x2, phase, .. } = row;
            let pre = State { x1, v1: row.v1_pre, x2, v2: row.v2_pre };
            let post = State { x1, v1: row.v1_post, x2, v2: row.v2_post };
            let impact = resolve(&run.system, &PreImpact::new(run.system.contact, &pre)).ok()?;
            let clock = Clock::new(period, time_in_period);
            return Some(Event::Impact(ImpactEvent { clock, time, phase, pre, post, impact }));
        }
        if is(EventKind::Graze) {
            let row = run.grazes.get(index?)?;
            let &GrazeRecord { time, period, time_in_period, phase, gap_acceleration, .. } = row;
            let &GrazeRecord { x1, v1, x2, v2, .. } = row;
            let (clock, state) = (Clock::new(period, time_in_period), State { x1, v1, x2, v2 });
            return Some(Event::Graze(GrazeEvent { clock, time, phase, state, gap_acceleration }));
        }
        is(EventKind::Stop).then(|| {
            let end = &run.final_state;
            let (clock, time, state) = (end.clock, end.time, end.state);
            Event::Stop(StopEvent { clock, time, state, reason: run.stop_reason })
        })
    }

    fn advance(&mut self, passed: &mut Passed) -> Option<Event> {
        let end = &self.run.final_state;
        if self.cancel.is_cancelled() {
            let (clock, time, state) =
                (self.here, self.run.system.own_drive().time(self.here), end.state);
            let reason = StopReason::Interrupted;
            return Some(Event::Stop(StopEvent { clock, time, state, reason }));
        }
        let event = self.next()?;
        let over = matches!(event, Event::Stop(_));
        while let Some(&[x1, v1, x2, v2]) = self.run.stroboscopic.get(self.section) {
            let k = self.run.first_section + self.section as i64;
            let period = k - i64::from(self.section_offset > 0.0);
            // One that falls on an event is left for the leg after it.
            if !over && Clock::new(period, self.section_offset) >= event.clock() {
                break;
            }
            passed.section(k, &State { x1, v1, x2, v2 });
            self.section += 1;
        }
        self.event += 1;
        self.here = event.clock();
        Some(event)
    }
}

impl Source<'_> {
    pub fn advance(&mut self, passed: &mut Passed) -> Option<Result<Event, SimulationError>> {
        match self {
            Self::Found(simulation) => simulation.advance(passed),
            Self::Kept(kept) => kept.advance(passed).map(Ok),
        }
    }

    /// Whether this event, the last one so far, lies among skipped impacts.
    pub fn skips_at(&self, event: &Event) -> bool {
        matches!(self, Self::Found(simulation) if simulation.skips_at(event))
    }
}
