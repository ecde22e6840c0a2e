//! Derivatives of the impulses of an impact on a stop.

use nalgebra::{DMatrix, RowDVector};

use super::rates::Linearised;
use crate::impact::{Regime, RegimeKind, StopImpact};
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::state::Clock;
use crate::model::structure::Structure;
use crate::numerics::dual::{Dual, Number};
use crate::simulate::structure::StopImpactEvent;
use crate::tangent::impact::regime_path;

/// u and s.
type Pair = Dual<2>;

/// Derivatives of the normal and the tangential impulse by u and s.
fn impulses(structure: &Structure, impact: &StopImpact, slip: f64) -> [[f64; 2]; 2] {
    let (at, rows) = (&structure.stops()[impact.stop], structure.contact(impact.stop));
    let numbers =
        ContactCoordinates::new(impact.approach_velocity, slip, rows.mobilities, at.friction());
    let constant = Pair::constant;
    let u = Pair::variable(impact.approach_velocity, 0);
    let w = if numbers.scale > 0.0 {
        Pair::variable(slip, 1) / constant(numbers.scale)
    } else {
        constant(0.0)
    };
    let coupling = constant(numbers.coupling);
    let contact = ContactCoordinates {
        slip: w,
        parting: coupling * w - u,
        coupling,
        mobility: constant(numbers.mobility),
        scale: constant(numbers.scale),
        side: numbers.side,
        friction: constant(numbers.friction),
    };
    let direction = match impact.regime {
        Regime::Frictionless => 1.0,
        Regime::Slip { direction } => direction,
        _ => 1f64.copysign(slip),
    };
    let law = (constant(at.restitution()), &structure.law());
    let (_, end) = regime_path(&contact, law, impact.regime.kind(), direction);
    [end.impulse_normal.slope, end.impulse_tangential.slope]
}

/// n . (rows of q'), row of a matrix of perturbations.
pub(super) fn along(row: &[f64], of: &DMatrix<f64>, first: usize) -> RowDVector<f64> {
    let mut sum = RowDVector::zeros(of.ncols());
    for (i, &n) in row.iter().enumerate() {
        if n != 0.0 {
            sum += of.row(first + i) * n;
        }
    }
    sum
}

/// Adds -(M^-1 n) x normal + (M^-1 t) x tangential to the rows of q'.
fn push(
    structure: &Structure,
    stop: usize,
    events: &mut DMatrix<f64>,
    normal: &RowDVector<f64>,
    tangential: Option<&RowDVector<f64>>,
) {
    let (count, rows) = (structure.coordinates(), structure.contact(stop));
    for i in 0..count {
        let mut row = events.row_mut(count + i);
        row -= normal * rows.by_normal[i];
        if let Some(tangential) = tangential {
            row += tangential * rows.by_tangent[i];
        }
    }
}

impl Linearised {
    /// du at a stop, of perturbations at an event whose time is perturbed by `delay`.
    pub fn rate_change(
        &self,
        stop: usize,
        clock: Clock,
        events: &DMatrix<f64>,
        delay: &RowDVector<f64>,
    ) -> RowDVector<f64> {
        let normal = self.structure.stops()[stop].normal();
        along(normal, events, normal.len()) + delay * self.by_time(stop, clock).1
    }

    /// Perturbations at an impact, through it.
    pub fn strike(
        &self,
        event: &StopImpactEvent,
        events: &mut DMatrix<f64>,
        delay: &RowDVector<f64>,
    ) {
        let (structure, impact) = (&self.structure, &event.impact);
        let count = structure.coordinates();
        let du = self.rate_change(impact.stop, event.clock, events, delay);
        let slip = structure.slip(impact.stop, &event.pre.v);
        let [normal, tangential] = impulses(structure, impact, slip);
        if impact.regime.kind() == RegimeKind::Frictionless {
            push(structure, impact.stop, events, &(du * normal[0]), None);
            return;
        }
        let tangent = structure.stops()[impact.stop].tangent().unwrap_or(&[]);
        let ds = along(tangent, events, count);
        let of = |by: [f64; 2]| &du * by[0] + &ds * by[1];
        push(structure, impact.stop, events, &of(normal), Some(&of(tangential)));
    }

    /// As [`Linearised::strike`], of the impacts without friction of one instant: u+ = -r u at the
    /// stop that is met, and 0 at closed ones, which its impulse presses.
    pub fn strike_together(
        &self,
        clock: Clock,
        impacts: &[StopImpact],
        met: usize,
        events: &mut DMatrix<f64>,
        delay: &RowDVector<f64>,
    ) {
        let structure = &self.structure;
        let stops: Vec<usize> = impacts.iter().map(|impact| impact.stop).collect();
        let wanted: Vec<RowDVector<f64>> = stops
            .iter()
            .map(|&stop| {
                let restitution = structure.stops()[stop].restitution();
                let factor = if stop == met { 1.0 + restitution } else { 1.0 };
                self.rate_change(stop, clock, events, delay) * factor
            })
            .collect();
        let wanted = DMatrix::from_rows(&wanted);
        let count = stops.len();
        let gram = DMatrix::from_fn(count, count, |i, j| structure.mobility(stops[i], stops[j]));
        // Normals of stops with impulses at one instant are independent.
        let Some(impulses) = gram.lu().solve(&wanted) else { return events.fill(f64::NAN) };
        for (i, &stop) in stops.iter().enumerate() {
            push(structure, stop, events, &impulses.row(i).into_owned(), None);
        }
    }

    /// Perturbations at an event at which a stop is reached with g = g' = 0, moved onto it.
    pub fn land_on(
        &self,
        stop: usize,
        clock: Clock,
        events: &mut DMatrix<f64>,
        delay: &RowDVector<f64>,
    ) {
        let (count, rows) = (self.structure.coordinates(), self.structure.contact(stop));
        let normal = self.structure.stops()[stop].normal();
        let (gap_by_time, _) = self.by_time(stop, clock);
        let gap = along(normal, events, 0) + delay * gap_by_time;
        let rate = self.rate_change(stop, clock, events, delay);
        for i in 0..count {
            let part = rows.by_normal[i] / rows.mobilities[0];
            let mut place = events.row_mut(i);
            place -= &gap * part;
            let mut velocity = events.row_mut(count + i);
            velocity -= &rate * part;
        }
    }
}
