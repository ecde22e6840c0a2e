//! Derivatives of the impulses of an impact on a stop.

use nalgebra::{DMatrix, RowDVector};

use super::rates::Linearised;
use crate::impact::{PathEnd, Regime, RegimeKind, StopImpact};
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::parameters::ImpactLaw;
use crate::model::state::Clock;
use crate::model::structure::Structure;
use crate::numerics::dual::{Dual, Number};
use crate::simulate::structure::StopImpactEvent;
use crate::tangent::border::BorderValue;
use crate::tangent::impact::{regime_borders, regime_path};

/// With derivatives by u, s, r and mu.
pub(crate) type Four = Dual<4>;

/// The impact on a stop in a regime that is held fixed.
pub(crate) struct StopInRegime {
    contact: ContactCoordinates<Four>,
    restitution: Four,
    kind: RegimeKind,
    direction: f64,
    switch: Four,
    end: PathEnd<Four>,
    law: ImpactLaw,
    /// Whether the stop and its only body leave nothing but slip to move.
    one_body: bool,
}

impl StopInRegime {
    /// From u and s before; `direction` is that of slip there.
    pub fn new(
        structure: &Structure,
        stop: usize,
        (approach, slip): (f64, f64),
        (kind, direction): (RegimeKind, f64),
    ) -> Self {
        let (at, rows) = (&structure.stops()[stop], structure.contact(stop));
        let numbers = ContactCoordinates::new(approach, slip, rows.mobilities, at.friction());
        let constant = Four::constant;
        let u = Four::variable(approach, 0);
        let w = if numbers.scale > 0.0 {
            Four::variable(slip, 1) / constant(numbers.scale)
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
            friction: Four::variable(numbers.friction, 3),
        };
        let (restitution, law) = (Four::variable(at.restitution(), 2), structure.law());
        let direction = if direction == 0.0 { 1.0 } else { direction };
        let (switch, end) = regime_path(&contact, (restitution, &law), kind, direction);
        let one_body = structure.coordinates() == 1 && at.amplitude() == 0.0;
        Self { contact, restitution, kind, direction, switch, end, law, one_body }
    }

    /// Normal and tangential impulse.
    pub fn impulses(&self) -> [Four; 2] {
        [self.end.impulse_normal, self.end.impulse_tangential]
    }

    /// What must be positive for this regime.
    pub fn borders(&self) -> Vec<BorderValue> {
        let Self { contact, restitution, kind, direction, switch, end, law, one_body } = self;
        if *kind == RegimeKind::Frictionless || !law.is_coulomb() {
            return Vec::new();
        }
        regime_borders(contact, *restitution, (*kind, *direction), (*switch, end), *one_body)
    }
}

/// The direction of slip that an impact knows, from the slip before; 0 without friction.
pub(crate) fn direction_of(regime: Regime, slip: f64) -> f64 {
    match regime {
        Regime::Frictionless => 0.0,
        Regime::Slip { direction } => direction,
        _ => 1f64.copysign(slip),
    }
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
        let regime = (impact.regime.kind(), direction_of(impact.regime, slip));
        let at = (impact.approach_velocity, slip);
        let [normal, tangential] =
            StopInRegime::new(structure, impact.stop, at, regime).impulses().map(|p| p.slope);
        if impact.regime.kind() == RegimeKind::Frictionless {
            push(structure, impact.stop, events, &(du * normal[0]), None);
            return;
        }
        let tangent = structure.stops()[impact.stop].tangent().unwrap_or(&[]);
        let ds = along(tangent, events, count);
        let of = |by: [f64; 4]| &du * by[0] + &ds * by[1];
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
