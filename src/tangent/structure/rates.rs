//! The rates of a structure's legs, and the rows of its stops.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector, RowDVector};
use smallvec::SmallVec;

use crate::flight::{Drive, Trig};
use crate::model::state::Clock;
use crate::model::structure::{
    ModalVariation, StopVariation, Structure, StructureState, Variation,
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
    /// q'' without forces of stops by q, q', 1, cos psi and sin psi: N numbers each.
    free: Vec<f64>,
    /// Stops whose places vary in a column, and whose laws do.
    pub(super) moved: Vec<bool>,
    pub(super) other_laws: Vec<bool>,
    /// What other masses change at each stop; none where no mass varies.
    pub(super) masses: Vec<OtherMasses>,
    /// What the columns are derivatives by; none: they are perturbations.
    pub by: Vec<Varied>,
}

/// q' and q'': of up to eight coordinates without memory from the heap.
pub(crate) type Rates = SmallVec<[f64; 16]>;

/// What a column is the derivative by.
#[derive(Debug, Clone)]
pub(crate) struct Varied {
    pub by: Variation,
    /// In the modes.
    pub modal: ModalVariation,
}

/// What other masses change at a stop, in each column.
#[derive(Debug, Clone)]
pub(crate) struct OtherMasses {
    /// Of a, b and c.
    pub mobilities: [RowDVector<f64>; 3],
    /// (M^-1 dM) M^-1 n, and of t: (N, columns).
    pub by_impulse: [DMatrix<f64>; 2],
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

/// Adds to columns what moves at these rates for these times.
pub(crate) fn add_moved(columns: &mut DMatrix<f64>, rates: &Rates, times: &RowDVector<f64>) {
    let all = columns.as_mut_slice().chunks_exact_mut(rates.len());
    for (column, time) in all.zip(times.iter()) {
        column.iter_mut().zip(rates.iter()).for_each(|(x, rate)| *x += rate * time);
    }
}

impl Linearised {
    pub fn new(structure: &Structure) -> Self {
        let omega = structure.drive_frequency();
        Self {
            motion: structure.motion(),
            homogeneous: structure.homogeneous().motion(),
            free: free_acceleration(structure),
            damping: structure.modal_damping().rounded(),
            moved: vec![false; structure.stops().len()],
            other_laws: vec![false; structure.stops().len()],
            masses: Vec::new(),
            stops: structure.stops().iter().map(|stop| Drive::new(omega, stop.phase())).collect(),
            structure: structure.clone(),
            by: Vec::new(),
        }
    }

    /// Of columns that are derivatives along these variations.
    pub fn along(structure: &Structure, by: Vec<Variation>) -> Self {
        let varied = |by: Variation| Varied { modal: by.in_modes(structure), by };
        let mut of = Self { by: by.into_iter().map(varied).collect(), ..Self::new(structure) };
        for (place, stop) in structure.stops().iter().enumerate() {
            for varied in &of.by {
                let own = varied.by.stop(place);
                let turns = own.phase != 0.0 || varied.by.drive_frequency != 0.0;
                let moves = own.gap != 0.0 || own.amplitude != 0.0;
                of.moved[place] |= moves || (turns && stop.amplitude() != 0.0);
                let by_curve = own.of_curve.iter().any(|&rate| rate != 0.0);
                of.other_laws[place] |= own.restitution != 0.0 || own.friction != 0.0 || by_curve;
            }
        }
        if of.varies_mass() {
            of.masses = (0..structure.stops().len()).map(|stop| of.other_masses(stop)).collect();
        }
        of
    }

    pub fn drive(&self) -> &Drive {
        Structure::drive(&self.motion)
    }

    /// F = (q', q'') of a leg at an instant, in this state.
    pub fn rates(&self, leg: &AnchorOf<Structure>, clock: Clock, state: &StructureState) -> Rates {
        let count = state.q.len();
        let mut rates = Rates::from_slice(&state.v);
        rates.resize(2 * count, 0.0);
        let acceleration = &mut rates[count..];
        let Trig { cos, sin } = self.drive().trig_at(clock);
        let times = state.numbers().chain([1.0, cos, sin]);
        for (row, time) in self.free.chunks_exact(count).zip(times) {
            acceleration.iter_mut().zip(row).for_each(|(a, x)| *a += x * time);
        }
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
        rates
    }

    /// Partial derivatives by time of the gap of a stop and of its rate u.
    pub fn by_time(&self, stop: usize, clock: Clock) -> (f64, f64) {
        let amplitude = self.structure.stops()[stop].amplitude();
        if amplitude == 0.0 {
            return (0.0, 0.0);
        }
        let Drive { omega, .. } = self.stops[stop];
        let trig = self.stops[stop].trig_at(clock);
        (amplitude * omega * trig.sin, amplitude * omega * omega * trig.cos)
    }

    /// The leg that begins at this anchor, of bodies that no stop approaches any more.
    pub fn leg_from<'a>(&self, anchor: &'a AnchorOf<Structure>) -> Cow<'a, AnchorOf<Structure>> {
        if !matches!(anchor.phase, Phase::Landing | Phase::Strike) {
            return Cow::Borrowed(anchor);
        }
        let landing = Anchor { phase: Phase::Landing, ..anchor.clone() };
        match self.motion.follows(&landing, None) {
            Follows::Leg(leg) => Cow::Owned(leg),
            Follows::Stops(_) => Cow::Borrowed(anchor),
        }
    }
}

/// The coordinates of forced.rs.
impl Linearised {
    /// z of a state.
    pub(super) fn in_modes(&self, clock: Clock, state: &StructureState) -> DVector<f64> {
        let modes = self.structure.modes();
        let count = modes.len();
        let Trig { cos, sin } = self.drive().trig_at(clock);
        let on = |x: &[f64], i: usize| modes[i].along_exactly(x).value();
        DVector::from_fn(2 * count + 3, |i, _| match i {
            i if i < count => on(&state.q, i),
            i if i < 2 * count => on(&state.v, i - count),
            i => [1.0, cos, sin][i - 2 * count],
        })
    }

    /// dz of dq and dq', none of them for 0, and of what the drive turns by.
    pub(super) fn column_in_modes(&self, start: &[f64], [cos, sin]: [f64; 2]) -> DVector<f64> {
        let modes = self.structure.modes();
        let count = modes.len();
        let mut column = DVector::zeros(2 * count + 3);
        let (places, rates) = start.split_at(start.len() / 2);
        for (i, mode) in modes.iter().enumerate() {
            for ((row, place), rate) in mode.row.iter().zip(places).zip(rates) {
                column[i] += row.hi * place;
                column[count + i] += row.hi * rate;
            }
        }
        (column[2 * count + 1], column[2 * count + 2]) = (cos, sin);
        column
    }

    /// q and q' of z, or their derivatives of dz, added to these.
    pub(super) fn out_of_modes(&self, z: &DVector<f64>, to: &mut [f64]) {
        let modes = self.structure.modes();
        let count = modes.len();
        let (places, rates) = to.split_at_mut(count);
        for (i, mode) in modes.iter().enumerate() {
            for ((shape, place), rate) in mode.shape.iter().zip(&mut *places).zip(&mut *rates) {
                *place += shape * z[i];
                *rate += shape * z[count + i];
            }
        }
    }
}

/// q'' without forces of stops, -phi W^2 (M phi)^T q - phi C (M phi)^T q' and loads: N numbers by each of
/// q, q', 1, cos psi, sin psi.
fn free_acceleration(structure: &Structure) -> Vec<f64> {
    let (modes, damping) = (structure.modes(), structure.modal_damping().rounded());
    let count = modes.len();
    let into_modes = DMatrix::from_fn(count, count, |i, k| modes[i].row[k].hi);
    let shapes = DMatrix::from_fn(count, count, |k, i| modes[i].shape[k]);
    let squares = DMatrix::from_fn(count, count, |i, k| {
        modes[i].frequency.value().powi(2) * modes[i].row[k].hi
    });
    let loads = DMatrix::from_fn(count, 3, |i, k| {
        let mode = &modes[i];
        [mode.load, mode.drive.re, -mode.drive.im][k]
    });
    let parts = [-(&shapes * squares), -(&shapes * (damping * into_modes)), &shapes * loads];
    // By columns.
    parts.iter().flat_map(|part| part.as_slice().iter().copied()).collect()
}
