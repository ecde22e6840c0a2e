//! Energy audit of a run of a structure: the works of all forces against the change of energy.
//!
//! E = (q' M q' + q K q)/2. Between impacts the powers of the loads, of the dampers, of moving stops in
//! contact (-P times the stop's velocity) and of friction there (Q s) are integrated by Gauss-Legendre
//! quadrature along the motion, independently of the closed forms that gave it. Impacts take their loss
//! and get the work of a moving stop; those skipped in chatter are resolved. Bounces that are lower than
//! any digit have no rows: their impulses follow from what they do to the velocities.

use nalgebra::{DMatrix, DVector};

use super::Run;
use super::legs::{Kind, Leg, begins_leg};
use crate::impact::StopImpact;
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState};
use crate::numerics::cancel::CancelToken;
use crate::numerics::dense::DEPENDENT;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::quadrature::{PANEL, PANEL_ANGLE};
use crate::simulate::event::EventKind;
use crate::simulate::model::Follows;
use crate::simulate::structure::{Motion, StructureEvent, StructureLeg};
use crate::simulate::{AnchorOf, Model, hops, impacts_hop_by_hop};

/// Works of all forces on a structure in the kept window of a run, in its own units: positive what
/// enters.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StructureAudit {
    /// Energy at the start of the window.
    pub energy_start: f64,
    /// Energy at its end.
    pub energy_end: f64,
    /// Work of the drive and the constant load.
    pub loads: f64,
    /// Work of the dampers, not positive.
    pub damping: f64,
    /// Work taken by impacts, restitution and friction.
    pub impacts: f64,
    /// Work of friction in lasting contact, not positive.
    pub contact_friction: f64,
    /// Work of moving stops, in impacts and in contact.
    pub stops: f64,
    /// Sum of all absolute works.
    pub total: f64,
}

impl StructureAudit {
    /// Change of energy that no work explains: rounding, and the errors of completed chatter.
    #[must_use]
    pub fn residual(&self) -> f64 {
        let works = self.loads + self.damping + self.impacts + self.contact_friction + self.stops;
        (self.energy_end - self.energy_start) - works
    }

    fn add(&mut self, [loads, damping, impacts, contact_friction, stops]: [f64; 5]) {
        self.loads += loads;
        self.damping += damping;
        self.impacts += impacts;
        self.contact_friction += contact_friction;
        self.stops += stops;
        self.total +=
            [loads, damping, impacts, contact_friction, stops].iter().map(|w| w.abs()).sum::<f64>();
    }
}

impl Run<Structure> {
    /// Works of all forces in the kept window, and the change of energy they should explain; `None`
    /// once `cancel` has ended it.
    #[must_use]
    pub fn energy_audit(&self, cancel: &CancelToken) -> Option<StructureAudit> {
        let motion = self.system.motion();
        let (structure, damping) = (&self.system, self.system.damping());
        let auditor = Auditor { structure, damping, motion: &motion, cancel };
        let mut audit = StructureAudit::default();
        let legs = self.legs();
        let mut begins = self.events.iter().filter(|event| begins_leg(event));
        for (i, leg) in legs.iter().enumerate() {
            // The first leg may begin before the window.
            let from = if leg.anchor.clock < self.window { self.window } else { leg.anchor.clock };
            if i == 0 {
                let flight = auditor.flight(&leg.anchor);
                let elapsed = Structure::drive(&motion).until(leg.anchor.clock, from);
                audit.energy_start = auditor.energy(&motion.state_after(&flight, elapsed));
            }
            let end = auditor.leg(leg, from, &mut audit);
            if cancel.is_cancelled() {
                return None;
            }
            if let (Some(event), Some(next)) = (begins.next(), legs.get(i + 1)) {
                let row = usize::try_from(event.index).ok().and_then(|at| self.impacts.get(at));
                let then = match row.filter(|_| event.kind == EventKind::Impact as i64) {
                    Some(row) => StructureState { q: row.q.clone(), v: row.v_pre.clone() },
                    None => motion.state_after(&auditor.flight(&next.anchor), DoubleDouble::ZERO),
                };
                auditor.low_bounces(leg.end, &end, &then, &mut audit);
            }
        }
        for row in &self.impacts {
            let clock = Clock::new(row.period, row.time_in_period);
            let stop = usize::try_from(row.stop).unwrap_or_default();
            auditor.impact(clock, stop, row.impulse_normal, row.energy_loss, &mut audit);
        }
        // Impacts at t = 0 come before the first leg's state.
        if let Some(first) = self.impacts.first()
            && first.period == 0
            && first.time_in_period == 0.0
        {
            let pre = StructureState { q: first.q.clone(), v: first.v_pre.clone() };
            audit.energy_start = auditor.energy(&pre);
        }
        audit.energy_end = auditor.energy(&self.final_state.state);
        Some(audit)
    }
}

struct Auditor<'a> {
    structure: &'a Structure,
    /// C.
    damping: Vec<Vec<f64>>,
    motion: &'a Motion,
    cancel: &'a CancelToken,
}

fn form(matrix: &[Vec<f64>], x: &[f64]) -> f64 {
    let row = |row: &Vec<f64>| row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
    matrix.iter().zip(x).map(|(of, x)| x * row(of)).sum()
}

impl Auditor<'_> {
    fn energy(&self, state: &StructureState) -> f64 {
        let kinetic = form(self.structure.mass(), &state.v);
        0.5 * (kinetic + form(self.structure.stiffness(), &state.q))
    }

    fn flight(&self, anchor: &AnchorOf<Structure>) -> StructureLeg {
        self.motion.leg(anchor, anchor.clock, anchor.state.clone())
    }

    /// A leg; returns the state at its end.
    fn leg(&self, leg: &Leg<Structure>, from: Clock, audit: &mut StructureAudit) -> StructureState {
        let mut anchor = leg.anchor.clone();
        let mut last = None;
        if let Kind::Hops(_) = leg.kind {
            for event in impacts_hop_by_hop(self.structure, leg.anchor.clone(), leg.end) {
                let StructureEvent::Impact(event) = event else { continue };
                let begin = if anchor.clock < from { from } else { anchor.clock };
                self.integrate(&self.flight(&anchor), anchor.clock, (begin, event.clock), audit);
                if self.cancel.is_cancelled() {
                    return event.post;
                }
                if event.clock > from {
                    let StopImpact { stop, impulse_normal, energy_loss, .. } = event.impact;
                    self.impact(event.clock, stop, impulse_normal, energy_loss, audit);
                }
                last = Some((event.impact.stop, event.impact.regime.kind().sticks()));
                (anchor.clock, anchor.state) = (event.clock, event.post);
            }
        }
        if let Some((stop, stuck)) = last
            && hops(self.structure, anchor.clone(), leg.end).0.is_none()
        {
            self.come_to_rest(&mut anchor, stop, stuck, audit);
        }
        let begin = if anchor.clock < from { from } else { anchor.clock };
        let flight = self.flight(&anchor);
        self.integrate(&flight, anchor.clock, (begin, leg.end), audit);
        let whole = Structure::drive(self.motion).until(anchor.clock, leg.end);
        // Of several impacts at one instant each goes on from the last one.
        if whole.value() > 0.0 { self.motion.state_after(&flight, whole) } else { anchor.state }
    }

    /// From here on all bounces at this stop are lower than any digit: they do what a lasting force
    /// would.
    fn come_to_rest(
        &self,
        anchor: &mut AnchorOf<Structure>,
        stop: usize,
        stuck: bool,
        audit: &mut StructureAudit,
    ) {
        let clock = anchor.clock;
        let state = self.motion.on_stop_at_rest(clock, anchor.state.clone(), stop, stuck);
        self.low_bounces(clock, &anchor.state, &state, audit);
        *anchor = self.structure.landing(anchor, clock, state, stop as u32, stuck);
        if let Follows::Leg(next) = self.motion.follows(anchor, None) {
            *anchor = next;
        }
    }

    /// What the impulses of bounces without rows do between two states of one instant. One that is no
    /// low bounce is left out, and shows in the residual.
    fn low_bounces(
        &self,
        clock: Clock,
        before: &StructureState,
        after: &StructureState,
        audit: &mut StructureAudit,
    ) {
        let jump: Vec<f64> = after.v.iter().zip(&before.v).map(|(b, a)| b - a).collect();
        if jump.iter().all(|x| *x == 0.0) {
            return;
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let rate = |stop: usize, state: &StructureState| self.motion.gap(stop, clock, state).1;
        let low = |stop: usize| self.motion.is_low(stop, &after.q, rate(stop, before));
        let near = self.motion.near(clock, after, 0.0);
        let near = near.iter().map(|at| at.stop as usize).filter(|&stop| low(stop));
        // Impulses along normals and tangents, and the velocities that they give.
        let mut pushes = Vec::new();
        for stop in near {
            let (at, rows) = (&self.structure.stops()[stop], self.structure.contact(stop));
            let rates = rate(stop, before) + rate(stop, after);
            pushes.push((at.normal(), &rows.by_normal, rates, self.stop_velocity(clock, stop)));
            if let Some(tangent) = at.tangent().filter(|_| self.structure.rubs(stop as u32)) {
                let slips = [before, after].map(|state| self.structure.slip(stop, &state.v));
                pushes.push((tangent, &rows.by_tangent, slips[0] + slips[1], 0.0));
            }
        }
        if pushes.is_empty() {
            return;
        }
        let count = pushes.len();
        let act = DMatrix::from_fn(count, count, |i, j| dot(pushes[i].0, pushes[j].1));
        let wanted = DVector::from_fn(count, |i, _| dot(pushes[i].0, &jump));
        let least = DEPENDENT * act.amax();
        let Ok(inverse) = act.pseudo_inverse(least) else { return };
        for (push, &(.., rates, own)) in (inverse * wanted).iter().zip(&pushes) {
            audit.add([0.0, 0.0, 0.5 * push * rates, 0.0, push * own]);
        }
    }

    /// Velocity of a stop.
    fn stop_velocity(&self, clock: Clock, stop: usize) -> f64 {
        // u = n . q' minus it.
        let at = &self.structure.stops()[stop];
        let phase = self.structure.drive_frequency() * clock.time_in_period + at.phase();
        -at.amplitude() * self.structure.drive_frequency() * phase.sin()
    }

    fn impact(
        &self,
        clock: Clock,
        stop: usize,
        impulse: f64,
        energy_loss: f64,
        audit: &mut StructureAudit,
    ) {
        let pushed = -impulse * self.stop_velocity(clock, stop);
        audit.add([0.0, 0.0, -energy_loss, 0.0, pushed]);
    }

    /// Quadrature of all powers between two instants of one leg, which begins at `start`.
    fn integrate(
        &self,
        flight: &StructureLeg,
        start: Clock,
        (from, to): (Clock, Clock),
        audit: &mut StructureAudit,
    ) {
        let structure = self.structure;
        let drive = Structure::drive(self.motion);
        let length = drive.until(from, to).value();
        if length <= 0.0 {
            return;
        }
        let panels = (length * self.fastest() / PANEL_ANGLE).ceil().max(1.0);
        let step = length / panels;
        for panel in 0..panels as i64 {
            if self.cancel.is_cancelled() {
                return;
            }
            let mut works = [0.0; 5];
            for (node, weight) in *PANEL {
                let elapsed = DoubleDouble::product(panel as f64 + node, step);
                let clock = drive.advance(from, elapsed);
                let since = drive.until(start, clock);
                let state = self.motion.state_after(flight, since);
                let phase = drive.trig_at(clock);
                let loads: f64 = structure
                    .modes()
                    .iter()
                    .map(|mode| {
                        let force = mode.drive.re * phase.cos - mode.drive.im * phase.sin;
                        (mode.load + force) * mode.along(&state.v)
                    })
                    .sum();
                let (mut rubbed, mut pushed) = (0.0, 0.0);
                for force in Motion::forces(flight, since) {
                    rubbed += force.tangential * structure.slip(force.stop, &state.v);
                    pushed -= force.normal * self.stop_velocity(clock, force.stop);
                }
                let damped = -form(&self.damping, &state.v);
                for (work, power) in works.iter_mut().zip([loads, damped, 0.0, rubbed, pushed]) {
                    *work += weight * step * power;
                }
            }
            audit.add(works);
        }
    }

    /// A bound of the rates at which the motion turns or decays.
    fn fastest(&self) -> f64 {
        let of = self.structure.modes().iter();
        let rates = of.map(|mode| mode.frequency.value().max(2.0 * mode.decay_rate));
        rates.fold(self.structure.drive_frequency(), f64::max)
    }
}
