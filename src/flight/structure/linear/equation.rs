//! The linear equation of a structure whose closed stops stay closed (docs/structures.md).
//!
//! In modal coordinates p (M-orthonormal) with the loads u = (1, tau, cos psi, sin psi), u' = J u:
//!
//! ```text
//! p'' = a - (force directions) lambda,     a = F u - W^2 p - D p',     R p = rho u
//! ```
//!
//! R has the normals of the closed stops, and in stick the tangent, whose place tau the flight
//! brings. With the columns of Z an orthonormal basis of what is orthogonal to R,
//!
//! ```text
//! p = Z y + X u,   X = R^T (R R^T)^-1 rho
//! lambda = G^-1 (R a - rho J^2 u),   G = R (force directions)
//! y'' = Z^T p'' = (from place) y + (from rate) y' + (from loads) u
//! ```
//!
//! so that no rounding leads off the stops. The force directions are the rows of R, but for a stop
//! that slides: n + mu s t. Time is in units of the span, a power of two: no digit is lost by that.

use super::Closed;
use crate::flight::drive::Drive;
use crate::flight::structure::StopMotion;
use crate::flight::tolerances::{GROWTH_IN_SCAN, LEG_ANGLE, SLOWEST_SCALES};
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::structure::Structure;
use crate::numerics::EPS;
use crate::numerics::dense::{Matrix, complement};
use crate::numerics::double_double::DoubleDouble;
use crate::search::tolerances::SCAN_SPANS;

/// Number of loads: 1, tau, cos psi, sin psi.
pub(super) const LOADS: usize = 4;

/// A row over (y, y', u), whose value along a leg is asked for.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub place: Vec<DoubleDouble>,
    pub rate: Vec<DoubleDouble>,
    pub loads: [DoubleDouble; LOADS],
}

#[derive(Debug, Clone)]
pub(super) struct Equation {
    /// Length of a local flight, the unit of time of what follows.
    pub span: f64,
    /// Whether anything moves by itself, so that its length is a time of the motion.
    pub turns: bool,
    /// Dimension of y.
    pub free: usize,
    pub from_place: Matrix,
    pub from_rate: Matrix,
    pub from_loads: Matrix,
    /// omega.
    pub turn: f64,
    /// y = to_free q; q = coordinates y + shift u; q' has `shift_rate`.
    pub to_free: Matrix,
    pub coordinates: Matrix,
    pub shift: Matrix,
    pub shift_rate: Matrix,
    /// p = basis y + offsets u.
    pub basis: Matrix,
    pub offsets: Matrix,
    /// lambda, by the rows of R.
    pub forces: Vec<Row>,
    /// Which closed stops the forces belong to, in stick before that of the tangent.
    pub pressed: Vec<usize>,
    /// The scales w of the norm |(w y, y')|, in which bounds are (gap.rs), and the largest rate at
    /// which it grows.
    pub scales: Vec<f64>,
    pub growth: f64,
    /// Spans for which the bounds are good.
    pub holds: f64,
}

/// The loads' row that has the rate of this one.
pub(super) fn rate_of(row: &[DoubleDouble], omega: f64) -> [DoubleDouble; LOADS] {
    [DoubleDouble::ZERO, DoubleDouble::ZERO, row[3].scale(omega), row[2].scale(-omega)]
}

fn rates_of(rows: &Matrix, omega: f64) -> Matrix {
    Matrix::from_fn(rows.rows, LOADS, |i, j| rate_of(rows.row(i), omega)[j])
}

fn largest_singular_value(of: &Matrix) -> f64 {
    if of.rows == 0 { 0.0 } else { of.rounded().singular_values().max() }
}

impl Equation {
    /// Whether the closed stops carry the coordinates along.
    pub fn moves(&self) -> bool {
        let rate = &self.shift_rate;
        (0..rate.rows).any(|i| rate.row(i).iter().any(|entry| entry.hi != 0.0))
    }

    /// `None` where no force keeps the stops closed, or more than one.
    pub fn new(
        structure: &Structure,
        stops: &[StopMotion],
        drive: &Drive,
        closed: &Closed,
    ) -> Option<Self> {
        let count = structure.coordinates();
        let (rho, rows, directions, pressed) = constraints(structure, stops, drive, closed)?;
        let modes = structure.modes();
        let squares: Vec<_> = modes.iter().map(|mode| mode.frequency * mode.frequency).collect();
        let stiffness = Matrix::diagonal(&squares);
        let damping = structure.modal_damping();
        let shapes = Matrix::from_fn(count, count, |k, i| DoubleDouble::new(modes[i].shape[k]));
        let to_modes = Matrix::from_fn(count, count, |i, k| modes[i].row[k]);
        let loads = Matrix::from_fn(count, LOADS, |i, j| {
            let of = [modes[i].load, 0.0, modes[i].drive.re, -modes[i].drive.im];
            DoubleDouble::new(of[j])
        });

        let (independent, any_basis) = complement(&rows, count);
        // With friction no other closed stop may see the one that rubs, so no row is to spare.
        if independent.len() < rows.len() && !matches!(closed, Closed::Frictionless(_)) {
            return None;
        }
        let keep = |of: &[Vec<DoubleDouble>], columns| {
            let kept: Vec<_> = independent.iter().map(|&i| of[i].clone()).collect();
            Matrix::from_rows(&kept, columns)
        };
        let (rho, rows, directions) =
            (keep(&rho, LOADS), keep(&rows, count), keep(&directions, count));
        let pressed = independent.iter().filter_map(|&i| pressed.get(i).copied()).collect();

        // In the modes of what is left free, so that bounds know the frequencies.
        let basis = if independent.is_empty() {
            any_basis
        } else {
            let left = any_basis.transposed().times(&stiffness.times(&any_basis));
            any_basis.times(&left.eigen().1)
        };
        let free = basis.columns;
        let omega = drive.omega;
        let gram = rows.times(&rows.transposed());
        let offsets = rows.transposed().times(&gram.solve(&rho)?);
        let offset_rates = rates_of(&offsets, omega);
        let [by_place, by_rate] =
            [&stiffness, &damping].map(|matrix| matrix.times(&basis).scaled(-1.0));
        let by_loads = loads.minus(&stiffness.times(&offsets)).minus(&damping.times(&offset_rates));
        let inertia = rows.times(&directions.transposed());
        let wanted = rates_of(&rates_of(&rho, omega), omega);
        let force_by_place = inertia.solve(&rows.times(&by_place))?;
        let force_by_rate = inertia.solve(&rows.times(&by_rate))?;
        let force_by_loads = inertia.solve(&rows.times(&by_loads).minus(&wanted))?;
        let onto = basis.transposed();
        let left = |by: &Matrix, force: &Matrix| {
            onto.times(&by.minus(&directions.transposed().times(force)))
        };
        let from_place = left(&by_place, &force_by_place);
        let from_rate = left(&by_rate, &force_by_rate);
        let from_loads = left(&by_loads, &force_by_loads);

        let rate = largest_singular_value(&from_place).sqrt() + largest_singular_value(&from_rate);
        let fastest = rate.max(omega);
        // Nothing moves: any length will do.
        let span = if fastest > 0.0 { (LEG_ANGLE / fastest).log2().floor().exp2() } else { 1.0 };
        let from_place = from_place.scaled(span * span);
        let from_rate = from_rate.scaled(span);
        let (scales, growth) = scales(&from_place, &from_rate);
        let forces = (0..rows.rows)
            .map(|i| Row {
                place: force_by_place.row(i).to_vec(),
                rate: force_by_rate.row(i).iter().map(|r| r.scale(1.0 / span)).collect(),
                loads: std::array::from_fn(|j| force_by_loads[(i, j)]),
            })
            .collect();
        Some(Self {
            span,
            turns: fastest > 0.0,
            free,
            from_place,
            from_rate,
            from_loads: from_loads.scaled(span * span),
            turn: omega * span,
            to_free: onto.times(&to_modes),
            coordinates: shapes.times(&basis),
            shift: shapes.times(&offsets),
            shift_rate: shapes.times(&offset_rates),
            basis,
            offsets,
            forces,
            pressed,
            scales,
            growth,
            holds: (GROWTH_IN_SCAN / growth).clamp(1.0, SCAN_SPANS),
        })
    }

    /// n p - rho of a stop.
    pub fn gap(&self, normal: &[DoubleDouble], rho: &[DoubleDouble; LOADS]) -> Row {
        let mut row = self.modal(normal);
        for (load, own) in row.loads.iter_mut().zip(rho) {
            *load = *load - *own;
        }
        row
    }

    /// (row) p.
    fn modal(&self, row: &[DoubleDouble]) -> Row {
        let row = Matrix::from_rows(&[row.to_vec()], row.len());
        let (place, loads) = (row.times(&self.basis), row.times(&self.offsets));
        Row {
            place: place.row(0).to_vec(),
            rate: vec![DoubleDouble::ZERO; self.free],
            loads: std::array::from_fn(|j| loads[(0, j)]),
        }
    }

    /// (row) p'.
    pub fn velocity(&self, row: &[DoubleDouble], omega: f64) -> Row {
        let Row { place, rate, loads } = self.modal(row);
        let per_time = place.iter().map(|part| part.scale(1.0 / self.span)).collect();
        Row { place: rate, rate: per_time, loads: rate_of(&loads, omega) }
    }
}

/// rho, rows and force directions of the constraints, and the stops that they belong to.
type Constraints =
    (Vec<Vec<DoubleDouble>>, Vec<Vec<DoubleDouble>>, Vec<Vec<DoubleDouble>>, Vec<usize>);

fn constraints(
    structure: &Structure,
    stops: &[StopMotion],
    drive: &Drive,
    closed: &Closed,
) -> Option<Constraints> {
    let places = closed.stops();
    let mut rho: Vec<Vec<_>> = places.iter().map(|&j| stops[j].place(drive).to_vec()).collect();
    let mut rows: Vec<Vec<_>> =
        places.iter().map(|&j| structure.contact(j).modal_normal.clone()).collect();
    let mut directions = rows.clone();
    match *closed {
        Closed::Frictionless(_) => {}
        Closed::Slide { stop, direction, .. } => {
            let (of, friction) = (structure.contact(stop), structure.stops()[stop].friction());
            let at = ContactCoordinates::new(0.0, 0.0, of.mobilities, friction);
            if at.slip_inertia(direction) == 0.0 {
                return None;
            }
            let own = places.iter().position(|&j| j == stop)?;
            for (n, t) in directions[own].iter_mut().zip(&of.modal_tangent) {
                *n = *n + t.scale(friction * direction);
            }
        }
        Closed::Stick { stop, .. } => {
            let tangent = structure.contact(stop).modal_tangent.clone();
            rows.push(tangent.clone());
            directions.push(tangent);
            rho.push([0.0, 1.0, 0.0, 0.0].map(DoubleDouble::new).to_vec());
        }
    }
    Some((rho, rows, directions, places))
}

/// Scales w such that |(w y, y')| grows at the lowest rate among those tried, and that rate: the
/// largest eigenvalue of the symmetric part of the matrix of (w y, y') (its logarithmic norm). A
/// mode that is slower than the span has the scale of one that is not.
fn scales(from_place: &Matrix, from_rate: &Matrix) -> (Vec<f64>, f64) {
    let free = from_place.rows;
    if free == 0 {
        return (Vec::new(), 0.0);
    }
    let tried = SLOWEST_SCALES.map(|least| {
        let scales: Vec<f64> =
            (0..free).map(|i| (-from_place[(i, i)].hi).max(least * least).sqrt()).collect();
        let matrix =
            nalgebra::DMatrix::from_fn(2 * free, 2 * free, |i, j| match (i < free, j < free) {
                (true, true) => 0.0,
                (true, false) => {
                    if i == j - free {
                        scales[i]
                    } else {
                        0.0
                    }
                }
                (false, true) => from_place[(i - free, j)].hi / scales[j],
                (false, false) => from_rate[(i - free, j - free)].hi,
            });
        let size = matrix.norm();
        let symmetric = 0.5 * (&matrix + matrix.transpose());
        let growth = symmetric.symmetric_eigenvalues().max();
        // With the rounding of the eigenvalues.
        (scales, growth.max(0.0) + 8.0 * EPS * (2 * free) as f64 * size)
    });
    let [first, rest @ ..] = tried;
    rest.into_iter().fold(first, |best, other| if other.1 < best.1 { other } else { best })
}
