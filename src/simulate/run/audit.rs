//! Energy audit of a run: the works of all forces against the change of energy.
//!
//! E = x1'^2/2 + omega0^2 x1^2/2 + (x2'^2 + x2^2)/(2 mbar), in M1 l^2 omega_2^2; a wall (mbar = 0) has
//! no energy of its own, but does work. Between impacts the powers f1 cos psi x1',
//! -2 zeta1 omega0 x1'^2, f2 cos psi x2'/mbar, -2 zeta2 x2'^2/mbar and, in contact, T x1' sin x1
//! (friction) and -p x2' (a wall's) are integrated by Gauss-Legendre quadrature along the motion,
//! independently of the closed forms that gave it. Impacts skipped in chatter are resolved.

use super::Run;
use super::legs::{self, Kind};
use super::oblique::{Follower, Slide};
use crate::contact::sustained::ContactForce;
use crate::flight::FreeMotion;
use crate::impact::{Impact, PreImpact, resolve};
use crate::model::oblique::SecondBody;
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::cancel::CancelToken;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::quadrature::PANEL_ANGLE;
use crate::numerics::quadrature::{PANEL, POINTS};
use crate::simulate::event::{Event, ImpactEvent};
use crate::simulate::impacts_hop_by_hop;

/// Works of all forces on the system in the kept window of a run, in M1 l^2 omega_2^2: positive
/// what enters. All are NaN where one of them leaves the range of floats: velocities beyond 1e154
/// have energies beyond it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnergyAudit {
    /// Energy at the start of the window.
    pub energy_start: f64,
    /// Energy at its end.
    pub energy_end: f64,
    /// Work of the moment on the pendulum.
    pub moment: f64,
    /// Work of the force on the oscillator.
    pub force: f64,
    /// Work of both dampers, not positive.
    pub damping: f64,
    /// Work of the normal impulses, restitution's loss: negative as a rule; where friction drives
    /// the tip against the other body (x1' cos x1 < 0 before a stick) it can be positive.
    pub restitution: f64,
    /// Work of friction during impacts, not positive.
    pub impact_friction: f64,
    /// Work of friction in sustained contact, not positive.
    pub contact_friction: f64,
    /// Work of a wall (mbar = 0) on the pendulum, in impacts and in contact.
    pub wall: f64,
    /// Sum of all absolute works.
    pub total: f64,
}

impl EnergyAudit {
    /// Change of energy that no work explains: rounding, and the errors of completed chatter.
    #[must_use]
    pub fn residual(&self) -> f64 {
        let works = self.moment
            + self.force
            + self.damping
            + self.restitution
            + self.impact_friction
            + self.contact_friction
            + self.wall;
        (self.energy_end - self.energy_start) - works
    }

    fn whole_or_none(self) -> Self {
        // `total` is the size of all works.
        let sizes = [self.energy_start, self.energy_end, self.total, self.residual()];
        if sizes.iter().all(|size| size.is_finite()) {
            return self;
        }
        Self {
            energy_start: f64::NAN,
            energy_end: f64::NAN,
            moment: f64::NAN,
            force: f64::NAN,
            damping: f64::NAN,
            restitution: f64::NAN,
            impact_friction: f64::NAN,
            contact_friction: f64::NAN,
            wall: f64::NAN,
            total: f64::NAN,
        }
    }
}

type Leg = legs::Leg<System>;

/// The sums and what is needed to form them.
struct Auditor<'a> {
    system: &'a System,
    motion: &'a FreeMotion,
    nodes: [(f64, f64); POINTS],
    audit: EnergyAudit,
    cancel: &'a CancelToken,
}

impl Run {
    /// Works of all forces in the kept window, and the change of energy they should explain; `None`
    /// once `cancel` has ended it.
    #[must_use]
    pub fn energy_audit(&self, cancel: &CancelToken) -> Option<EnergyAudit> {
        let motion = FreeMotion::new(&self.system);
        let mut auditor = Auditor {
            system: &self.system,
            motion: &motion,
            nodes: *PANEL,
            audit: EnergyAudit::default(),
            cancel,
        };
        let legs = self.legs();
        let starts =
            if self.window < legs[0].anchor.clock { legs[0].anchor.clock } else { self.window };
        for (i, leg) in legs.iter().enumerate() {
            // The first leg may begin before the window.
            let from = if leg.anchor.clock < starts { starts } else { leg.anchor.clock };
            if i == 0 {
                let state = Follower::new(self, &motion, leg).at(self, &motion, leg, from).0;
                auditor.audit.energy_start = auditor.energy(&state);
            }
            auditor.leg(self, leg, from);
            if cancel.is_cancelled() {
                return None;
            }
        }
        for impact in &self.impacts {
            auditor.impact(
                &State { x1: impact.x1, v1: impact.v1_pre, x2: impact.x2, v2: impact.v2_pre },
                impact.energy_loss,
                impact.impulse_normal,
            );
        }
        // An impact at t = 0 comes before the first leg's state.
        if let Some(first) =
            self.impacts.first().filter(|i| i.period == 0 && i.time_in_period == 0.0)
        {
            let pre = State { x1: first.x1, v1: first.v1_pre, x2: first.x2, v2: first.v2_pre };
            auditor.audit.energy_start = auditor.energy(&pre);
        }
        auditor.audit.energy_end = auditor.energy(&self.final_state.state);
        Some(auditor.audit.whole_or_none())
    }
}

impl Auditor<'_> {
    fn energy(&self, state: &State) -> f64 {
        let State { x1, v1, x2, v2 } = *state;
        let w = self.system.frequency_ratio();
        let first = 0.5 * (v1 * v1 + w * w * x1 * x1);
        match self.system.second_body() {
            SecondBody::Free { mass_ratio } => first + 0.5 * (v2 * v2 + x2 * x2) / mass_ratio,
            SecondBody::Wall => first,
        }
    }

    fn leg(&mut self, run: &Run, leg: &Leg, from: Clock) {
        if let Kind::Hops(_) = leg.kind {
            return self.hops(leg, from);
        }
        let mut follower = Follower::new(run, self.motion, leg);
        if let Follower::Slide(slide) = &mut follower {
            // Step by step: the series of a step is smooth, the steps shrink where p grows.
            return self.slide(run, slide, leg, from);
        }
        self.integrate(from, leg.end, &mut |clock| follower.at(run, self.motion, leg, clock));
    }

    fn slide(&mut self, run: &Run, slide: &mut Slide, leg: &Leg, from: Clock) {
        let Kind::Contact(mode) = leg.kind else { return };
        let drive = &self.motion.drive;
        loop {
            let start = slide.clock;
            let end = drive.advance(start, DoubleDouble::new(slide.reach()));
            let end = if leg.end < end { leg.end } else { end };
            let begin = if start < from { from } else { start };
            let step = slide.step.clone();
            self.integrate(begin, end, &mut |clock| {
                let (x1, v1) = step.at(drive.until(start, clock).value());
                let state = run.system.on_contact(x1, v1);
                (state, run.system.contact_force(drive.trig_at(clock), &state, mode))
            });
            if end == leg.end
                || self.cancel.is_cancelled()
                || !slide.advance(run, self.motion, mode)
            {
                return;
            }
        }
    }

    /// Quadrature of all powers between two instants of one leg.
    fn integrate(
        &mut self,
        from: Clock,
        to: Clock,
        at: &mut dyn FnMut(Clock) -> (State, ContactForce),
    ) {
        let system = self.system;
        let drive = &self.motion.drive;
        let length = drive.until(from, to).value();
        if length <= 0.0 {
            return;
        }
        let (w, body) = (system.frequency_ratio(), system.second_body());
        let panels = (length * system.fastest_rate() / PANEL_ANGLE).ceil().max(1.0);
        let step = length / panels;
        for panel in 0..panels as i64 {
            if self.cancel.is_cancelled() {
                return;
            }
            let mut works = [0.0; 7];
            for (node, weight) in self.nodes {
                let elapsed = DoubleDouble::product(panel as f64 + node, step);
                let clock = drive.advance(from, elapsed);
                let (state, contact) = at(clock);
                let load = drive.trig_at(clock).cos;
                let State { x1, v1, v2, .. } = state;
                let part = |share: f64| match body {
                    SecondBody::Free { mass_ratio } => share / mass_ratio,
                    SecondBody::Wall => 0.0,
                };
                let powers = [
                    (system.moment_amplitude() * load + system.static_moment()) * v1,
                    part((system.force_amplitude() * load + system.static_force()) * v2),
                    -2.0 * system.pendulum_damping() * w * v1 * v1
                        - part(2.0 * system.oscillator_damping() * v2 * v2),
                    0.0,
                    0.0,
                    contact.tangential * v1 * x1.sin(),
                    if body == SecondBody::Wall { -contact.normal * v2 } else { 0.0 },
                ];
                for (work, power) in works.iter_mut().zip(powers) {
                    *work += weight * step * power;
                }
            }
            self.add(works);
        }
    }

    fn add(&mut self, works: [f64; 7]) {
        let a = &mut self.audit;
        let sums = [
            &mut a.moment,
            &mut a.force,
            &mut a.damping,
            &mut a.restitution,
            &mut a.impact_friction,
            &mut a.contact_friction,
            &mut a.wall,
        ];
        for (sum, work) in sums.into_iter().zip(works) {
            *sum += work;
        }
        a.total += works.iter().map(|work| work.abs()).sum::<f64>();
    }

    fn impact(&mut self, pre: &State, energy_loss: f64, impulse: f64) {
        let outcome = resolve(self.system, &PreImpact::new(self.system.contact(), pre));
        let friction = outcome.map_or(0.0, |impact: Impact| impact.friction_loss);
        let wall = if self.system.is_wall() { -pre.v2 * impulse } else { 0.0 };
        self.add([0.0, 0.0, 0.0, friction - energy_loss, -friction, 0.0, wall]);
    }

    /// The impacts that were skipped, one by one, and the flights between them.
    fn hops(&mut self, leg: &Leg, from: Clock) {
        let (mut clock, mut state) = (leg.anchor.clock, leg.anchor.state);
        let (system, motion) = (self.system, self.motion);
        let impacts =
            impacts_hop_by_hop(system, leg.anchor, leg.end).filter_map(Event::into_impact);
        let flight = |this: &mut Self, clock: Clock, state: State, to: Clock| {
            let flight = motion.flight(clock, state);
            let begin = if clock < from { from } else { clock };
            let at = &mut |now: Clock| {
                (
                    motion.state_after(&flight, motion.drive.until(clock, now)),
                    ContactForce::default(),
                )
            };
            this.integrate(begin, to, at);
        };
        for ImpactEvent { clock: next, pre, post, impact, .. } in impacts {
            flight(self, clock, state, next);
            if self.cancel.is_cancelled() {
                return;
            }
            if next > from {
                self.impact(&pre, impact.energy_loss, impact.impulse_normal);
            }
            (clock, state) = (next, post);
        }
        // What is left is shorter than rounding, or the run ends in flight.
        flight(self, clock, state, leg.end);
    }
}
