//! The rates of a structure's legs, and the rows of its stops.

use nalgebra::{DMatrix, DVector};

use crate::flight::Drive;
use crate::model::state::Clock;
use crate::model::structure::{
    Coordinates, ModalVariation, StopVariation, Structure, StructureState, Variation,
};
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::model::{Follows, Model};
use crate::simulate::structure::Motion;
use crate::simulate::{Anchor, AnchorOf, Phase};

/// What the perturbations of the motions of a structure have in common.
#[derive(Debug)]
pub(crate) struct Linearised {
    pub structure: Structure,
    pub motion: Motion,
    /// Between events perturbations move as this does.
    pub homogeneous: Motion,
    /// Phi^T C Phi.
    pub(super) damping: DMatrix<f64>,
    /// Phases of the stops.
    pub(super) stops: Vec<Drive>,
    /// What the columns are derivatives by; none: they are perturbations.
    pub by: Vec<Varied>,
}

/// What a column is the derivative by.
#[derive(Debug, Clone)]
pub(crate) struct Varied {
    pub by: Variation,
    /// In the modes.
    pub modal: ModalVariation,
}

impl Varied {
    /// By how much the phase of the drive moves at a fixed time in its period,
    pub fn turn(&self, time_in_period: f64) -> f64 {
        self.by.phase + time_in_period * self.by.drive_frequency
    }

    /// and that of a stop.
    pub fn turn_of(&self, stop: &StopVariation, time_in_period: f64) -> f64 {
        stop.phase + time_in_period * self.by.drive_frequency
    }
}

impl Linearised {
    pub fn new(structure: &Structure) -> Self {
        let omega = structure.drive_frequency();
        Self {
            motion: structure.motion(),
            homogeneous: structure.homogeneous().motion(),
            damping: structure.modal_damping().rounded(),
            stops: structure.stops().iter().map(|stop| Drive::new(omega, stop.phase())).collect(),
            structure: structure.clone(),
            by: Vec::new(),
        }
    }

    /// Of columns that are derivatives along these variations.
    pub fn along(structure: &Structure, by: Vec<Variation>) -> Self {
        let varied = |by: Variation| Varied { modal: by.in_modes(structure), by };
        Self { by: by.into_iter().map(varied).collect(), ..Self::new(structure) }
    }

    pub fn drive(&self) -> &Drive {
        Structure::drive(&self.motion)
    }

    /// F = (q', q'') of a leg at an instant, in this state.
    pub fn rates(
        &self,
        leg: &AnchorOf<Structure>,
        clock: Clock,
        state: &StructureState,
    ) -> DVector<f64> {
        let mut acceleration = self.free_acceleration(clock, state);
        if let Phase::Contact(_) = leg.phase {
            let elapsed = self.drive().until(leg.clock, clock);
            let elapsed = if elapsed.hi < 0.0 { DoubleDouble::ZERO } else { elapsed };
            let held = self.motion.leg(leg, leg.clock, leg.state.clone());
            for force in Motion::forces(&held, elapsed) {
                let rows = self.structure.contact(force.stop);
                for (i, a) in acceleration.iter_mut().enumerate() {
                    *a += force.tangential * rows.by_tangent[i] - force.normal * rows.by_normal[i];
                }
            }
        }
        DVector::from_iterator(
            2 * state.q.len(),
            state.v.iter().copied().chain(acceleration.iter().copied()),
        )
    }

    /// q'' without forces of stops, by modes.
    fn free_acceleration(&self, clock: Clock, state: &StructureState) -> Coordinates {
        let trig = self.drive().trig_at(clock);
        let modes = self.structure.modes();
        let rates: Coordinates = modes.iter().map(|mode| mode.along(&state.v)).collect();
        let mut acceleration = Coordinates::from_elem(0.0, state.q.len());
        for (i, mode) in modes.iter().enumerate() {
            let square = mode.frequency.value().powi(2);
            let load = mode.load + mode.drive.re * trig.cos - mode.drive.im * trig.sin;
            let damped: f64 = (0..rates.len()).map(|j| self.damping[(i, j)] * rates[j]).sum();
            let own = load - square * mode.along(&state.q) - damped;
            for (a, shape) in acceleration.iter_mut().zip(&mode.shape) {
                *a += own * shape;
            }
        }
        acceleration
    }

    /// Partial derivatives by time of the gap of a stop and of its rate u.
    pub fn by_time(&self, stop: usize, clock: Clock) -> (f64, f64) {
        let Drive { omega, .. } = self.stops[stop];
        let trig = self.stops[stop].trig_at(clock);
        let amplitude = self.structure.stops()[stop].amplitude();
        (amplitude * omega * trig.sin, amplitude * omega * omega * trig.cos)
    }

    /// The leg that begins at this anchor, of bodies that no stop approaches any more.
    pub fn leg_from(&self, anchor: &AnchorOf<Structure>) -> AnchorOf<Structure> {
        if !matches!(anchor.phase, Phase::Landing | Phase::Strike) {
            return anchor.clone();
        }
        let landing = Anchor { phase: Phase::Landing, ..anchor.clone() };
        match self.motion.follows(&landing, None) {
            Follows::Leg(leg) => leg,
            Follows::Stops(_) => anchor.clone(),
        }
    }
}
