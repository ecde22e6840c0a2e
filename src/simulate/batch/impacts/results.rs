//! What a lane has: its system, the contact, the impact there, and the flight after it.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets

use super::{Flights, ImpactLanes, Impacts, Systems};
use crate::flight::{BodyFlight, Equation, Touch, Trig};
use crate::impact::{Impact, PreImpact, Regime, RegimeKind};
use crate::model::angle::Angle;
use crate::model::state::{Clock, State};
use crate::numerics::lanes::Lanes;
use crate::search::steps::ScanStart;

impl ImpactLanes {
    /// The equations of motion of both bodies in lane `j`.
    #[inline(always)]
    pub fn equations(&self, j: usize) -> (Equation, Equation) {
        (self.systems.pendulums.get(j), self.systems.oscillators.get(j))
    }

    /// Changes of the amplitudes of both bodies' free motions after these times.
    #[inline(always)]
    pub fn amplitude_changes(&self, times: &Lanes) -> [Lanes; 2] {
        self.systems.amplitude_changes(times)
    }

    /// Whether both bodies of lane `j` turn by so little in this time that
    /// [`Equation::swung_transition`] holds.
    #[inline(always)]
    pub fn turns_within(&self, j: usize, time: f64) -> bool {
        let Systems { pendulums, oscillators, .. } = &self.systems;
        pendulums.get(j).turns_within(time) & oscillators.get(j).turns_within(time)
    }

    /// mbar, mu and r in lane `j`.
    #[inline(always)]
    pub fn contact_numbers(&self, j: usize) -> [f64; 3] {
        let Systems { mass_ratio, friction, restitution, .. } = &self.systems;
        [mass_ratio[j], friction[j], restitution[j]]
    }

    /// Time in lane `j` from an instant to the impact, as
    /// [`Drive::roughly_until`](crate::flight::Drive::roughly_until) has it; `ahead`: drive periods from
    /// that instant's to the one in which the present flight began.
    #[inline(always)]
    pub fn roughly_since(&self, j: usize, time_in_period: f64, residual: f64, ahead: f64) -> f64 {
        let Flights { time_in_period: time_after, residual: residual_after, .. } =
            &self.impacts.flights;
        let within = (time_after[j] - time_in_period) + (residual_after[j] - residual);
        let whole = ahead + self.impacts.periods[j];
        if whole == 0.0 { within } else { whole * self.systems.drives.period[j] + within }
    }

    /// Approach velocity in lane `j`.
    #[inline(always)]
    pub fn approach_velocity(&self, j: usize) -> f64 {
        self.impacts.approach[j]
    }

    /// The impact in lane `j`, if it is one of those that are resolved by themselves.
    #[inline(always)]
    pub fn switched(&self, j: usize) -> Option<&Impact> {
        self.impacts.switched[j].as_ref()
    }
    /// Evaluations of the gap in lane `j`.
    pub fn evaluations(&self, j: usize) -> u64 {
        self.evaluations[j] + 1
    }

    /// Whether the forced motions in lane `j` are steady, so that the start of the scan after an
    /// impact is known.
    #[inline(always)]
    pub fn is_steady(&self, j: usize) -> bool {
        self.systems.beats[0].which[j] | self.systems.beats[1].which[j] == 0
    }

    /// What the scan of the flight after the impact in lane `j` starts from, where forced motions
    /// are steady.
    #[inline(always)]
    pub fn scan_start(&self, j: usize) -> ScanStart {
        self.impacts.scan_starts.get(j)
    }

    /// Whether the contact in lane `j` is certain.
    #[inline(always)]
    pub fn is_certain(&self, j: usize) -> bool {
        self.contacts.certain[j] == 1
    }

    /// Local time of the contact in lane `j`, in two parts.
    #[inline(always)]
    pub fn contact_time(&self, j: usize) -> (f64, f64) {
        (self.near[j], self.contacts.offset[j])
    }

    /// The contact in lane `j`.
    #[inline(always)]
    pub fn contact(&self, j: usize) -> Touch {
        let contacts = &self.contacts;
        Touch {
            time: self.near[j],
            offset: contacts.offset[j],
            gap: contacts.gaps.get(j),
            state: State {
                x1: contacts.x1[j],
                v1: contacts.v1[j],
                x2: contacts.x2[j],
                v2: contacts.v2[j],
            },
        }
    }

    /// Whether the impact in lane `j` is resolved.
    #[inline(always)]
    pub fn is_resolved(&self, j: usize) -> bool {
        self.impacts.unswitched[j] == 1 || self.impacts.switched[j].is_some()
    }

    /// The state before the impact in lane `j`.
    #[inline(always)]
    pub fn state_before(&self, j: usize) -> State {
        let Self { contacts, impacts, .. } = self;
        let (x1, x2) = (impacts.pre_x1[j], impacts.pre_x2[j]);
        State { x1, v1: contacts.v1[j], x2, v2: contacts.v2[j] }
    }

    /// What the impact in lane `j` starts from.
    #[inline(always)]
    pub fn pre_impact(&self, j: usize) -> PreImpact {
        let Angle { sin, cos } = self.impacts.flights.angles.get(j);
        PreImpact { cos, sin, v1: self.contacts.v1[j], v2: self.contacts.v2[j] }
    }

    /// Regime of the impact in lane `j`.
    #[inline(always)]
    fn regime(&self, j: usize) -> Regime {
        match &self.impacts.switched[j] {
            Some(impact) => impact.regime,
            None if self.systems.friction[j] == 0.0 => Regime::Frictionless,
            None => Regime::Slip { direction: 1f64.copysign(self.contacts.v1[j]) },
        }
    }

    /// Kind of regime and approach velocity of the impact in lane `j`.
    #[inline(always)]
    pub fn approach(&self, j: usize) -> (RegimeKind, f64) {
        let unswitched = self.impacts.approach[j];
        let approach =
            self.impacts.switched[j].as_ref().map_or(unswitched, |i| i.approach_velocity);
        (self.regime(j).kind(), approach)
    }

    /// The impact in lane `j`.
    #[inline(always)]
    pub fn impact(&self, j: usize) -> Impact {
        let impacts = &self.impacts;
        impacts.switched[j].unwrap_or_else(|| Impact {
            regime: self.regime(j),
            v1_post: impacts.v1_post[j],
            v2_post: impacts.v2_post[j],
            approach_velocity: impacts.approach[j],
            separation_velocity: impacts.separation[j],
            impulse_approach: impacts.impulse_approach[j],
            impulse_normal: impacts.impulse_normal[j],
            impulse_tangential: impacts.impulse_tangential[j],
            energy_loss: impacts.energy_loss[j],
            friction_loss: impacts.friction_loss[j],
        })
    }

    /// Clock and state at the start of the flight after the impact in lane `j`; `period`: of the
    /// flight before.
    #[inline(always)]
    pub fn start_after(&self, j: usize, period: i64) -> (Clock, State) {
        let Impacts { flights: after, pre_x1, pre_x2, v1_post, v2_post, periods, .. } =
            &self.impacts;
        let clock = Clock {
            period: period + periods[j] as i64,
            time_in_period: after.time_in_period[j],
            residual: after.residual[j],
        };
        (clock, State { x1: pre_x1[j], v1: v1_post[j], x2: pre_x2[j], v2: v2_post[j] })
    }

    /// Angle and forcing phase there.
    #[inline(always)]
    pub fn angles_after(&self, j: usize) -> (Angle, Trig) {
        let Flights { angles, phases, .. } = &self.impacts.flights;
        (angles.get(j), phases.get(j))
    }

    /// Both bodies in the flight after the impact in lane `j`.
    #[inline(always)]
    pub fn bodies_after(&self, j: usize) -> (BodyFlight, BodyFlight) {
        let Flights { pendulums, oscillators, .. } = &self.impacts.flights;
        (pendulums.get(j), oscillators.get(j))
    }
}
