//! A structure at one instant: the derivatives of its motion, and those of the gaps of its stops.

use crate::contact::sustained::{ClosedContact, ContactInstant};
use crate::contact::tolerances::CLOSED_NOISE;
use crate::flight::{Drive, Trig};
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::state::Clock;
use crate::model::structure::Structure;
use crate::numerics::EPS;
use crate::numerics::dense::{Matrix, length};
use crate::numerics::double_double::DoubleDouble;

/// Coordinates and velocities in the modes, and phases.
pub(super) struct Instant<'a> {
    pub structure: &'a Structure,
    place: Vec<f64>,
    rate: Vec<f64>,
    /// t . q' at each stop, and the sum of the sizes of its terms.
    slips: Vec<(f64, f64)>,
    drive: Trig,
    stops: Vec<Trig>,
    /// Phi^T C Phi, and a bound of its norm.
    damping: Matrix,
    damping_size: f64,
}

/// Derivatives of the modal coordinates, known up to some order and the next.
pub(super) struct Motion<'a> {
    instant: &'a Instant<'a>,
    order: usize,
    now: Vec<f64>,
    next: Vec<f64>,
    after: Vec<f64>,
    /// Rounding of `now` and `next`, as vectors.
    errors: [f64; 2],
    noise: f64,
}

/// A derivative of the free accelerations, and its rounding as a vector.
pub(super) struct Free {
    of: Vec<f64>,
    noise: f64,
}

fn size(of: &[f64]) -> f64 {
    of.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn along(row: &[DoubleDouble], of: &[f64]) -> f64 {
    row.iter().zip(of).fold(DoubleDouble::ZERO, |sum, (r, &x)| sum + r.scale(x)).value()
}

/// Derivative of this order of cos psi, and of sin psi, over omega to it.
fn turned(Trig { cos, sin }: Trig, order: usize) -> (f64, f64) {
    match order % 4 {
        0 => (cos, sin),
        1 => (-sin, cos),
        2 => (-cos, -sin),
        _ => (sin, -cos),
    }
}

impl<'a> Instant<'a> {
    pub fn new(structure: &'a Structure, clock: Clock, q: &[f64], v: &[f64]) -> Self {
        let omega = structure.drive_frequency();
        let on = |vector: &[f64]| {
            structure.modes().iter().map(|mode| mode.along_exactly(vector).value()).collect()
        };
        let slip = |stop: &crate::model::Stop| match stop.tangent() {
            Some(tangent) => tangent
                .iter()
                .zip(v)
                .fold((0.0, 0.0), |(sum, size), (t, v)| (sum + t * v, size + (t * v).abs())),
            None => (0.0, 0.0),
        };
        let damping = structure.modal_damping();
        Self {
            structure,
            place: on(q),
            rate: on(v),
            slips: structure.stops().iter().map(slip).collect(),
            drive: Drive::new(omega, structure.phase()).trig_at(clock),
            stops: structure
                .stops()
                .iter()
                .map(|stop| Drive::new(omega, stop.phase()).trig_at(clock))
                .collect(),
            damping_size: damping.rounded().norm(),
            damping,
        }
    }

    /// t . q', 0 where it is rounding.
    pub fn slip(&self, stop: usize) -> f64 {
        let (slip, size) = self.slips[stop];
        if slip.abs() <= CLOSED_NOISE * EPS * size { 0.0 } else { slip }
    }

    pub fn motion(&self) -> Motion<'_> {
        let (now, next) = (self.place.clone(), self.rate.clone());
        let errors = [EPS * size(&now), EPS * size(&next)];
        let after = vec![0.0; now.len()];
        Motion { instant: self, order: 0, now, next, after, errors, noise: 0.0 }
    }

    /// A stop with friction, closed, as contact/sustained.rs sees it.
    pub fn contact(&self, stop: usize, slip: f64, free: &Free) -> ContactInstant {
        let (rows, at) = (self.structure.contact(stop), &self.structure.stops()[stop]);
        let at = ContactCoordinates::new(0.0, slip, rows.mobilities, at.friction());
        let (gap_acceleration, gap_noise) = self.motion().gap_acceleration(free, stop);
        let slip_acceleration = along(&rows.modal_tangent, &free.of) / at.scale;
        ContactInstant {
            contact: ClosedContact {
                at,
                slip_acceleration,
                parting_acceleration: at.coupling * slip_acceleration - gap_acceleration,
                gap_acceleration,
            },
            gap_noise,
            slip_noise: CLOSED_NOISE * free.noise,
            scale_noise: 0.0,
            clock_noise: 0.0,
            scale_slope: 0.0,
            fastest: 0.0,
            turning: 0.0,
            wall_at_rest: false,
            constant_loads: false,
        }
    }
}

impl Motion<'_> {
    /// The derivative, of the order reached, of the accelerations without forces.
    pub fn free(&self) -> Free {
        let Instant { structure, drive, damping, damping_size, .. } = self.instant;
        let omega = structure.drive_frequency();
        let turning = omega.powi(self.order as i32);
        let (cos, sin) = turned(*drive, self.order);
        let (mut highest, mut terms) = (0.0f64, Vec::new());
        let of = structure
            .modes()
            .iter()
            .enumerate()
            .map(|(i, mode)| {
                let square = mode.frequency.value().powi(2);
                highest = highest.max(square);
                let load = if self.order == 0 { mode.load } else { 0.0 };
                let driven = turning * (mode.drive.re * cos - mode.drive.im * sin);
                let damped = along(damping.row(i), &self.next);
                let spring = square * self.now[i];
                terms.push(load.abs() + turning * mode.drive.norm() + spring.abs());
                load + driven - spring - damped
            })
            .collect();
        let noise = EPS * (size(&terms) + damping_size * size(&self.next))
            + highest * self.errors[0]
            + damping_size * self.errors[1];
        Free { of, noise }
    }

    /// The derivative of g'' of a stop by free accelerations, and its rounding.
    pub fn gap_acceleration(&self, free: &Free, stop: usize) -> (f64, f64) {
        self.gap_of(&free.of, free.noise, stop)
    }

    fn gap_of(&self, accelerations: &[f64], noise: f64, stop: usize) -> (f64, f64) {
        let structure = self.instant.structure;
        let normal = &structure.contact(stop).modal_normal;
        let own = structure.stops()[stop].amplitude()
            * structure.drive_frequency().powi(self.order as i32 + 2);
        let (cos, _) = turned(self.instant.stops[stop], self.order + 2);
        let noise = CLOSED_NOISE * (length(normal) * noise + EPS * own.abs());
        (along(normal, accelerations) - own * cos, noise)
    }

    /// One order further, under forces P against normals and Q along tangents.
    pub fn go_on(&mut self, free: &Free, forces: impl IntoIterator<Item = (usize, f64, f64)>) {
        let mut accelerations = free.of.clone();
        for (stop, normal, tangential) in forces {
            let rows = self.instant.structure.contact(stop);
            for (i, a) in accelerations.iter_mut().enumerate() {
                *a += tangential * rows.modal_tangent[i].value()
                    - normal * rows.modal_normal[i].value();
            }
        }
        self.noise = free.noise;
        self.errors = [self.errors[1], free.noise];
        self.now = std::mem::replace(&mut self.next, accelerations.clone());
        self.after = accelerations;
        self.order += 1;
    }

    /// g'' of a stop, of the order before the one reached, with the forces; and its rounding.
    pub fn gap_after(&self, stop: usize) -> (f64, f64) {
        let before = Motion {
            instant: self.instant,
            order: self.order - 1,
            now: Vec::new(),
            next: Vec::new(),
            after: Vec::new(),
            errors: self.errors,
            noise: self.noise,
        };
        before.gap_of(&self.after, self.noise, stop)
    }
}
