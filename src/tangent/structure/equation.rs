//! The matrices of forced.rs: how z = (p, p', 1, cos psi, sin psi) of a leg moves, and what that changes
//! with a number.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use smallvec::SmallVec;

use super::rates::{Linearised, Varied};
use crate::flight::Trig;
use crate::flight::structure::Closed;
use crate::model::state::Clock;
use crate::model::structure::Structure;
use crate::numerics::dense::complement;
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::{AnchorOf, Phase};

/// The closed stops of a leg.
#[derive(Debug)]
pub(super) struct Held {
    /// R and D.
    rows: DMatrix<f64>,
    directions: DMatrix<f64>,
    /// (R D^T)^-1 and R^T (R R^T)^-1.
    inertia: DMatrix<f64>,
    onto: DMatrix<f64>,
    /// The stops of the rows; none of the tangent's, which is that of the stop that sticks.
    pub stops: Vec<Option<usize>>,
    pub sticks: Option<usize>,
    /// Row of a stop that slides, the direction of slip, and its tangent.
    slides: Option<(usize, f64, DVector<f64>)>,
}

/// A stop of a row: its amplitude, and by how much its phase is ahead of the drive's.
#[derive(Debug, Clone, Copy)]
struct Place {
    amplitude: f64,
    ahead: Trig,
}

/// z' = A z.
#[derive(Debug)]
pub(super) struct Equation {
    pub held: Option<Arc<Held>>,
    places: Vec<Place>,
    omega: f64,
    count: usize,
    /// A.
    pub generator: DMatrix<f64>,
    /// a and lambda, as rows over z.
    free: DMatrix<f64>,
    forces: DMatrix<f64>,
}

impl Held {
    pub fn new(structure: &Structure, leg: &AnchorOf<Structure>) -> Option<Self> {
        let Phase::Contact(mode) = leg.phase else { return None };
        let closed = mode.holds(structure, &leg.touching.closed());
        let places = closed.stops();
        let count = structure.coordinates();
        let rounded =
            |row: &[DoubleDouble]| DVector::from_iterator(count, row.iter().map(|x| x.value()));
        let mut exact: Vec<Vec<_>> =
            places.iter().map(|&j| structure.contact(j).modal_normal.clone()).collect();
        let mut stops: Vec<Option<usize>> = places.iter().copied().map(Some).collect();
        let (mut slides, mut sticks) = (None, None);
        match closed {
            Closed::Frictionless(_) => {}
            Closed::Slide { stop, direction, .. } => {
                let tangent = rounded(&structure.contact(stop).modal_tangent);
                slides =
                    places.iter().position(|&j| j == stop).map(|row| (row, direction, tangent));
            }
            Closed::Stick { stop, .. } => {
                exact.push(structure.contact(stop).modal_tangent.clone());
                stops.push(None);
                sticks = Some(stop);
            }
        }
        let (independent, _) = complement(&exact, count);
        let kept: Vec<_> = independent.iter().map(|&i| rounded(&exact[i]).transpose()).collect();
        if kept.is_empty() {
            return None;
        }
        let rows = DMatrix::from_rows(&kept);
        let mut directions = rows.clone();
        if let Some((row, direction, tangent)) = &slides {
            // No row is left out where one rubs.
            let friction = structure.stops()[places[*row]].friction();
            let mut own = directions.row_mut(*row);
            own += tangent.transpose() * (friction * *direction);
        }
        let stops = independent.iter().map(|&i| stops[i]).collect();
        let inertia = (&rows * directions.transpose()).try_inverse()?;
        let onto = rows.transpose() * (&rows * rows.transpose()).try_inverse()?;
        Some(Self { rows, directions, inertia, onto, stops, sticks, slides })
    }

    /// Impulses along the directions of the forces that take away what is left of u at the stops, and in
    /// stick of the velocity of slip: stop, normal and tangential impulse, and that by friction.
    pub fn impulses(&self, structure: &Structure, left: Vec<f64>) -> Vec<(usize, [f64; 2], f64)> {
        let all = &self.inertia * DVector::from_vec(left);
        let one = |(row, &impulse): (usize, &f64)| match self.stops[row] {
            Some(stop) => {
                let slides = self.slides.as_ref().filter(|(at, ..)| *at == row);
                let by_friction = slides.map_or(0.0, |(_, direction, _)| -direction * impulse);
                let tangential = structure.stops()[stop].friction() * by_friction;
                Some((stop, [impulse, tangential], by_friction))
            }
            None => self.sticks.map(|stop| (stop, [0.0, -impulse], 0.0)),
        };
        all.iter().enumerate().filter_map(one).collect()
    }

    /// What such impulses take from q' for each number that is left: (N, rows).
    pub fn taken(&self, structure: &Structure) -> DMatrix<f64> {
        let modes = structure.modes();
        let shapes = DMatrix::from_fn(modes.len(), modes.len(), |k, i| modes[i].shape[k]);
        shapes * self.directions.transpose() * &self.inertia
    }
}

impl Equation {
    pub fn new(of: &Linearised, held: Option<Held>) -> Self {
        let structure = &of.structure;
        let modes = structure.modes();
        let (count, omega) = (modes.len(), structure.drive_frequency());
        let start = of.drive().trig_at(Clock::START);
        let place = |stop: &Option<usize>| match *stop {
            None => Place { amplitude: 0.0, ahead: Trig::ONE },
            Some(stop) => {
                let own = of.stops[stop].trig_at(Clock::START);
                let back = Trig { cos: start.cos, sin: -start.sin };
                let amplitude = structure.stops()[stop].amplitude();
                Place { amplitude, ahead: own.turned_by(back) }
            }
        };
        let places = held.as_ref().map_or_else(Vec::new, |h| h.stops.iter().map(place).collect());
        let mut free = DMatrix::zeros(count, 2 * count + 3);
        for (i, mode) in modes.iter().enumerate() {
            free[(i, i)] = -mode.frequency.value().powi(2);
            for j in 0..count {
                free[(i, count + j)] = -of.damping[(i, j)];
            }
            free[(i, 2 * count)] = mode.load;
            free[(i, 2 * count + 1)] = mode.drive.re;
            free[(i, 2 * count + 2)] = -mode.drive.im;
        }
        let mut equation = Self {
            held: held.map(Arc::new),
            places,
            omega,
            count,
            generator: DMatrix::zeros(2 * count + 3, 2 * count + 3),
            forces: DMatrix::zeros(0, 2 * count + 3),
            free,
        };
        let mut wanted = DMatrix::zeros(equation.places.len(), 2 * count + 3);
        for (row, place) in equation.places.iter().enumerate() {
            let size = -place.amplitude * omega * omega;
            wanted[(row, 2 * count + 1)] = size * place.ahead.cos;
            wanted[(row, 2 * count + 2)] = -size * place.ahead.sin;
        }
        if let Some(held) = &equation.held {
            equation.forces = &held.inertia * (&held.rows * &equation.free - &wanted);
        }
        let second = equation.kept(equation.free.clone(), &wanted);
        let generator = &mut equation.generator;
        for i in 0..count {
            generator[(i, count + i)] = 1.0;
        }
        generator.rows_mut(count, count).copy_from(&second);
        generator[(2 * count + 1, 2 * count + 2)] = -omega;
        generator[(2 * count + 2, 2 * count + 1)] = omega;
        equation
    }

    pub fn is_closed(&self) -> bool {
        self.held.is_some()
    }

    /// Accelerations under forces that keep the stops closed, with the accelerations wanted there.
    fn kept(&self, free: DMatrix<f64>, wanted: &DMatrix<f64>) -> DMatrix<f64> {
        let Some(held) = &self.held else { return free };
        let forces = &held.inertia * (&held.rows * &free - wanted);
        free - held.directions.transpose() * forces
    }

    /// The fastest rate at which anything turns or decays.
    pub fn fastest(&self, of: &Linearised) -> f64 {
        let modes = of.structure.modes();
        let turn = modes.iter().map(|mode| mode.frequency.value()).fold(0.0, f64::max);
        let decay = if of.structure.couples_modes() {
            of.damping.norm()
        } else {
            (0..self.count).fold(0.0, |most: f64, i| most.max(of.damping[(i, i)]))
        };
        let factor = self.held.as_ref().map_or(1.0, |held| {
            let turned = held.directions.transpose() * &held.inertia * &held.rows;
            (DMatrix::identity(self.count, self.count) - turned).norm().max(1.0)
        });
        (turn * factor.sqrt()).max(decay * factor).max(self.omega)
    }

    /// Whether a leg adds to a column by itself.
    pub fn acts(&self, varied: &Varied) -> bool {
        let modal = &varied.modal;
        let matrix = modal.mass.is_some() || modal.damping.is_some() || modal.stiffness.is_some();
        let load = modal.load.is_some() || modal.drive.is_some();
        let turns = varied.by.drive_frequency != 0.0 || varied.by.phase != 0.0;
        let held = self.held.as_ref().is_some_and(|held| {
            let place = |stop: &Option<usize>| {
                stop.is_some_and(|stop| {
                    let own = varied.by.stop(stop);
                    own.gap != 0.0 || own.amplitude != 0.0 || own.phase != 0.0
                })
            };
            held.stops.iter().any(place) || self.rubs(varied).is_some()
        });
        matrix || load || turns || held
    }

    /// The change of friction at the stop that slides, with its row and tangent.
    fn rubs(&self, varied: &Varied) -> Option<(f64, usize, &DVector<f64>)> {
        let held = self.held.as_ref()?;
        let (row, direction, tangent) = held.slides.as_ref()?;
        let friction = varied.by.stop(held.stops[*row]?).friction;
        (friction != 0.0).then_some((friction * direction, *row, tangent))
    }

    /// B of a column.
    pub fn varied(&self, of: &Linearised, varied: &Varied) -> DMatrix<f64> {
        let (count, modal) = (self.count, &varied.modal);
        let size = 2 * count + 3;
        let mut free = DMatrix::zeros(count, size);
        let (place, rate) = ((0, 0), (0, count));
        if let Some(stiffness) = &modal.stiffness {
            let mut part = free.view_mut(place, (count, count));
            part -= stiffness;
        }
        if let Some(damping) = &modal.damping {
            let mut part = free.view_mut(rate, (count, count));
            part -= damping;
        }
        if let Some(mass) = &modal.mass {
            free -= mass * self.generator.rows(count, count);
        }
        for i in 0..count {
            if let Some(load) = &modal.load {
                free[(i, 2 * count)] += load[i];
            }
            if let Some(drive) = &modal.drive {
                free[(i, 2 * count + 1)] += drive[i].re;
                free[(i, 2 * count + 2)] -= drive[i].im;
            }
        }
        if let Some((friction, row, tangent)) = self.rubs(varied) {
            free -= tangent * self.forces.row(row) * friction;
        }
        // The second derivative of A cos, at the phase that dz tells.
        let (omega, faster) = (self.omega, varied.by.drive_frequency);
        let mut wanted = DMatrix::zeros(self.places.len(), size);
        for row in 0..self.places.len() {
            let Some(own) = self.own(varied, row) else { continue };
            let Place { amplitude, ahead } = self.places[row];
            let by_cos = -(own.amplitude * omega + 2.0 * amplitude * faster) * omega;
            let by_sin = amplitude * omega * omega * (own.phase - varied.by.phase);
            wanted[(row, 2 * count + 1)] = by_cos * ahead.cos + by_sin * ahead.sin;
            wanted[(row, 2 * count + 2)] = -by_cos * ahead.sin + by_sin * ahead.cos;
        }
        let mut all = DMatrix::zeros(size, size);
        all.rows_mut(count, count).copy_from(&self.kept(free, &wanted));
        all[(2 * count + 1, 2 * count + 2)] = -faster;
        all[(2 * count + 2, 2 * count + 1)] = faster;
        debug_assert_eq!(of.structure.coordinates(), count);
        all
    }

    fn own(&self, varied: &Varied, row: usize) -> Option<crate::model::structure::StopVariation> {
        let stop = self.held.as_ref()?.stops[row]?;
        Some(varied.by.stop(stop))
    }

    /// Moves the derivatives of a column onto the closed stops, whose places vary, too.
    pub fn keep(&self, varied: &Varied, motion: &DVector<f64>, column: &mut DVector<f64>) {
        let Some(held) = &self.held else { return };
        let (count, omega) = (self.count, self.omega);
        let phase = |of: &DVector<f64>| Trig { cos: of[2 * count + 1], sin: of[2 * count + 2] };
        let (now, turned) = (phase(motion), phase(&*column));
        // Along a tangent that sticks, places are what they are.
        let mut wanted: SmallVec<[[Option<f64>; 2]; 4]> =
            (0..held.stops.len()).map(|_| [None, Some(0.0)]).collect();
        for (row, wanted) in wanted.iter_mut().enumerate() {
            let Some(own) = self.own(varied, row) else { continue };
            let Place { amplitude, ahead } = self.places[row];
            let own_turn = own.phase - varied.by.phase;
            let Trig { cos, sin } = now.turned_by(ahead);
            let moved = turned.turned_by(ahead);
            let (by_cos, by_sin) = (moved.cos - sin * own_turn, moved.sin + cos * own_turn);
            let faster = own.amplitude * omega + amplitude * varied.by.drive_frequency;
            *wanted = [
                Some(own.gap + own.amplitude * cos + amplitude * by_cos),
                Some(-faster * sin - amplitude * omega * by_sin),
            ];
        }
        for k in 0..2 {
            let part = &mut column.as_mut_slice()[k * count..(k + 1) * count];
            let off: SmallVec<[f64; 4]> = wanted
                .iter()
                .zip(held.rows.row_iter())
                .map(|(wanted, row)| {
                    let is: f64 = row.iter().zip(&*part).map(|(n, x)| n * x).sum();
                    wanted[k].map_or(0.0, |wanted| wanted - is)
                })
                .collect();
            for (off, onto) in off.iter().zip(held.onto.column_iter()) {
                part.iter_mut().zip(onto.iter()).for_each(|(x, onto)| *x += off * onto);
            }
        }
    }
}
