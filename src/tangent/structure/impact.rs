//! Derivatives of the impulses of an impact on a stop.

use nalgebra::{DMatrix, RowDVector};
use smallvec::SmallVec;

use super::equation::Held;
use super::rates::Linearised;
use super::samples::Formula;
use crate::impact::{PathEnd, Regime, RegimeKind, StopImpact};
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::parameters::ImpactLaw;
use crate::model::restitution::RestitutionAt;
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState};
use crate::numerics::dual::{Dual, Number};
use crate::simulate::structure::{StopContactEvent, StopImpactEvent, StructureMode};
use crate::tangent::border::{Border, BorderValue};
use crate::tangent::impact::{regime_borders, regime_path};
use crate::tangent::tolerances::{AT_BORDER, NEAR_ONSET};

/// By u, s, r and mu.
pub(crate) const FOUR: usize = 4;
/// And by a, b and c.
const SEVEN: usize = 7;

/// The impact on a stop in a regime that is held fixed, with derivatives by the first of u, s, r, mu, a,
/// b and c.
pub(crate) struct StopInRegime<const D: usize = FOUR> {
    contact: ContactCoordinates<Dual<D>>,
    restitution: Dual<D>,
    kind: RegimeKind,
    direction: f64,
    switch: Dual<D>,
    end: PathEnd<Dual<D>>,
    law: ImpactLaw,
    /// Whether the stop and its only body leave nothing but slip to move.
    one_body: bool,
}

impl<const D: usize> StopInRegime<D> {
    /// From u and s before; `direction` is that of slip there.
    pub fn new(
        structure: &Structure,
        stop: usize,
        (approach, slip): (f64, f64),
        (kind, direction): (RegimeKind, f64),
    ) -> Self {
        let (at, rows) = (&structure.stops()[stop], structure.contact(stop));
        let numbers = ContactCoordinates::new(approach, slip, rows.mobilities, at.friction());
        let number = |value, place| {
            if place < D { Dual::variable(value, place) } else { Dual::constant(value) }
        };
        let [a, b, c] = [0, 1, 2].map(|i| number(rows.mobilities[i], FOUR + i));
        let u = number(approach, 0);
        let none = Dual::constant(0.0);
        let (scale, coupling, w) = if numbers.scale > 0.0 {
            let scale = c.sqrt();
            (scale, b / scale, number(slip, 1) / scale)
        } else {
            (none, none, none)
        };
        let contact = ContactCoordinates {
            slip: w,
            parting: coupling * w - u,
            coupling,
            mobility: a - coupling * coupling,
            scale,
            side: numbers.side,
            friction: number(numbers.friction, 3),
        };
        let RestitutionAt { value, by_speed } = at.coefficient().with_slope(approach);
        let (mut restitution, law) = (number(value, 2), structure.law());
        if by_speed != 0.0 {
            restitution = Dual::chain(value, [(1.0, restitution), (by_speed, u)]);
        }
        let direction = if direction == 0.0 { 1.0 } else { direction };
        let (switch, end) = regime_path(&contact, (restitution, &law), kind, direction);
        let one_body = structure.coordinates() == 1 && at.amplitude() == 0.0;
        Self { contact, restitution, kind, direction, switch, end, law, one_body }
    }

    /// Normal and tangential impulse.
    pub fn impulses(&self) -> [Dual<D>; 2] {
        [self.end.impulse_normal, self.end.impulse_tangential]
    }

    /// What must be positive for this regime.
    pub fn borders(&self) -> SmallVec<[BorderValue; 4]> {
        let Self { contact, restitution, kind, direction, switch, end, law, one_body } = self;
        if *kind == RegimeKind::Frictionless || !law.is_coulomb() {
            return SmallVec::new();
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
    for (sum, column) in sum.iter_mut().zip(of.as_slice().chunks_exact(of.nrows())) {
        for (n, x) in row.iter().zip(&column[first..]) {
            if *n != 0.0 {
                *sum += x * n;
            }
        }
    }
    sum
}

/// Adds a row so many times.
fn add_times(to: &mut RowDVector<f64>, times: f64, row: &RowDVector<f64>) {
    to.iter_mut().zip(row.iter()).for_each(|(sum, x)| *sum += x * times);
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
    for (c, column) in events.as_mut_slice().chunks_exact_mut(2 * count).enumerate() {
        let rates = &mut column[count..];
        rates.iter_mut().zip(&rows.by_normal).for_each(|(x, n)| *x -= normal[c] * n);
        if let Some(tangential) = tangential {
            rates.iter_mut().zip(&rows.by_tangent).for_each(|(x, t)| *x += tangential[c] * t);
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
        let mut moved = along(normal, events, normal.len());
        let (_, by_time) = self.by_time(stop, clock);
        if by_time != 0.0 {
            moved += delay * by_time;
        }
        match self.by_number(stop, clock) {
            Some([_, rate]) => moved + rate,
            None => moved,
        }
    }

    /// dg at a stop, of perturbations at a fixed time.
    pub fn gap_change(&self, stop: usize, clock: Clock, columns: &DMatrix<f64>) -> RowDVector<f64> {
        let moved = along(self.structure.stops()[stop].normal(), columns, 0);
        match self.by_number(stop, clock) {
            Some([gap, _]) => moved + gap,
            None => moved,
        }
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
        let rubs = impact.regime.kind() != RegimeKind::Frictionless;
        let tangent = structure.stops()[impact.stop].tangent().filter(|_| rubs).unwrap_or(&[]);
        // Where masses stay as they are, a, b and c do.
        let masses = self.masses.get(impact.stop);
        let [by_normal, by_tangent] = if masses.is_some() {
            StopInRegime::<SEVEN>::new(structure, impact.stop, at, regime)
                .impulses()
                .map(|impulse| impulse.slope)
        } else {
            let of = StopInRegime::<FOUR>::new(structure, impact.stop, at, regime);
            of.impulses().map(|impulse| {
                let mut slope = [0.0; SEVEN];
                slope[..FOUR].copy_from_slice(&impulse.slope);
                slope
            })
        };
        let mut tangential = rubs.then(|| &du * by_tangent[0]);
        let mut normal = du * by_normal[0];
        let mut add = |place: usize, part: &RowDVector<f64>| {
            add_times(&mut normal, by_normal[place], part);
            if let Some(tangential) = &mut tangential {
                add_times(tangential, by_tangent[place], part);
            }
        };
        if rubs {
            add(1, &along(tangent, events, count));
        }
        if let Some([restitution, friction]) = self.by_law(impact.stop, impact.approach_velocity) {
            add(2, &restitution);
            add(3, &friction);
        }
        if let Some(masses) = masses {
            for (k, changed) in masses.mobilities.iter().enumerate() {
                add(FOUR + k, changed);
            }
        }
        push(structure, impact.stop, events, &normal, tangential.as_ref());
        let impulses = [impact.impulse_normal, impact.impulse_tangential];
        self.by_inertia(impact.stop, impulses, events);
    }

    /// As [`Linearised::strike`], of the impacts without friction of one instant: u+ = -r u at the
    /// stop that is met, and 0 at closed ones, which its impulse presses. Returns what there is after
    /// each of them.
    pub fn strike_together(
        &self,
        clock: Clock,
        impacts: &[StopImpact],
        met: usize,
        events: &mut DMatrix<f64>,
        delay: &RowDVector<f64>,
    ) -> Vec<DMatrix<f64>> {
        let structure = &self.structure;
        let stops: Vec<usize> = impacts.iter().map(|impact| impact.stop).collect();
        let wanted: Vec<RowDVector<f64>> = impacts
            .iter()
            .map(|impact| {
                let stop = impact.stop;
                let u = impact.approach_velocity;
                let RestitutionAt { value, by_speed } =
                    structure.stops()[stop].coefficient().with_slope(u);
                let mut change = self.rate_change(stop, clock, events, delay);
                if stop == met {
                    change *= 1.0 + value + by_speed * u;
                }
                if !self.by.is_empty() {
                    change -= self.by_other_mobility(stop, impacts);
                    if stop == met
                        && let Some([by_law, _]) = self.by_law(stop, u)
                    {
                        change += by_law * u;
                    }
                }
                change
            })
            .collect();
        let wanted = DMatrix::from_rows(&wanted);
        let count = stops.len();
        let gram = DMatrix::from_fn(count, count, |i, j| structure.mobility(stops[i], stops[j]));
        // Normals of stops with impulses at one instant are independent.
        let Some(impulses) = gram.lu().solve(&wanted) else {
            return vec![events.map(|_| f64::NAN)];
        };
        let mut after = Vec::with_capacity(count);
        for (i, impact) in impacts.iter().enumerate() {
            push(structure, impact.stop, events, &impulses.row(i).into_owned(), None);
            self.by_inertia(impact.stop, [impact.impulse_normal, 0.0], events);
            after.push(events.clone());
        }
        after
    }

    /// What other masses change in u+ at a stop, by the impulses of one instant: (d W) P.
    fn by_other_mobility(&self, stop: usize, impacts: &[StopImpact]) -> RowDVector<f64> {
        let mut sum = RowDVector::zeros(self.by.len());
        if self.varies_mass() {
            let [n, _] = self.modal_rows(stop);
            for impact in impacts {
                let [other, _] = self.modal_rows(impact.stop);
                sum -= self.by_mass(&n, &other).unwrap_or_default() * impact.impulse_normal;
            }
        }
        sum
    }

    /// Perturbations at an event after which stops stay closed, moved onto them. What is left of u is
    /// that of bounces yet to come: to leading order their impulses are those of one that closes the
    /// stops at once, along the directions of the forces which then hold them.
    pub(super) fn land_on(
        &self,
        held: &Held,
        clock: Clock,
        events: &mut DMatrix<f64>,
        delay: &RowDVector<f64>,
    ) {
        let (structure, count) = (&self.structure, self.structure.coordinates());
        for &stop in held.stops.iter().flatten() {
            let rows = structure.contact(stop);
            let (gap_by_time, _) = self.by_time(stop, clock);
            let gap = self.gap_change(stop, clock, events) + delay * gap_by_time;
            for (i, by_normal) in rows.by_normal.iter().enumerate() {
                let mut place = events.row_mut(i);
                place -= &gap * (by_normal / rows.mobilities[0]);
            }
        }
        let tangent = held.sticks.and_then(|stop| structure.stops()[stop].tangent()).unwrap_or(&[]);
        let left = held.stops.iter().map(|stop| match *stop {
            Some(stop) => self.rate_change(stop, clock, events, delay),
            None => along(tangent, events, count),
        });
        let left = DMatrix::from_rows(&left.collect::<Vec<_>>());
        let mut velocities = events.rows_mut(count, count);
        velocities -= held.taken(structure) * left;
    }

    /// The same, of a state that still moves on the stops, which it then does not.
    pub(super) fn close(
        &self,
        held: &Held,
        (clock, state): (Clock, &mut StructureState),
        events: &mut DMatrix<f64>,
        delay: &RowDVector<f64>,
    ) {
        let structure = &self.structure;
        let left = held.stops.iter().map(|stop| match *stop {
            Some(stop) => self.motion.gap(stop, clock, state).1,
            None => held.sticks.map_or(0.0, |stop| structure.slip(stop, &state.v)),
        });
        for (stop, impulses, by_friction) in held.impulses(structure, left.collect()) {
            let rows = structure.contact(stop);
            for ((v, n), t) in state.v.iter_mut().zip(&rows.by_normal).zip(&rows.by_tangent) {
                *v += impulses[1] * t - impulses[0] * n;
            }
            if let Some([_, friction]) = self.by_law(stop, 0.0) {
                let none = RowDVector::zeros(friction.len());
                push(structure, stop, events, &none, Some(&(friction * by_friction)));
            }
            self.by_inertia(stop, impulses, events);
        }
        self.land_on(held, clock, events, delay);
    }
}

impl Linearised {
    /// Whether an impact lies on the border of its regime, to rounding.
    pub fn is_at_border(&self, event: &StopImpactEvent) -> bool {
        let (structure, impact) = (&self.structure, &event.impact);
        let (stop, kind) = (impact.stop, impact.regime.kind());
        let at = &structure.stops()[stop];
        let Some(tangent) = at.tangent().filter(|_| at.friction() > 0.0) else { return false };
        let slip = structure.slip(stop, &event.pre.v);
        let regime = (kind, direction_of(impact.regime, slip));
        let approach = impact.approach_velocity;
        let met = StopInRegime::<FOUR>::new(structure, stop, (approach, slip), regime);
        let contact = &met.contact;
        let [scale, coupling] = [contact.scale, contact.coupling].map(|x| x.value);
        // What slip is a difference of.
        let terms = tangent.iter().zip(&event.pre.v).map(|(t, v)| (t * v).abs());
        let speed = terms.sum::<f64>() / scale;
        let size = |border: Border| match border {
            Border::StopAtEndOfImpact if kind != RegimeKind::Slip => impact.impulse_normal,
            Border::StopAtEndOfImpact => speed + scale * impact.impulse_tangential.abs(),
            Border::SlipBefore => speed,
            Border::StopAtEndOfApproach => approach + coupling.abs() * speed,
            _ => coupling.abs() + contact.grip().value,
        };
        met.borders().iter().any(|at| at.value.abs() <= AT_BORDER * size(at.border))
    }

    /// What impacts with one formula have in common. Slip is that before: after one in which it stops it
    /// is rounding.
    pub fn formula(&self, event: &StopImpactEvent) -> Formula {
        let impact = &event.impact;
        let slip = self.structure.slip(impact.stop, &event.pre.v);
        let coefficient = self.structure.stops()[impact.stop].coefficient();
        (impact.regime.kind(), slip > 0.0, coefficient.piece(impact.approach_velocity))
    }

    /// Whether an impact lies at a knot of the restitution curve, to rounding.
    pub fn is_at_knot(&self, impact: &StopImpact) -> bool {
        let stop = &self.structure.stops()[impact.stop];
        stop.coefficient().is_at_knot(impact.approach_velocity)
    }

    /// Whether a stop closes without force, or sticks at the limit of friction, to rounding.
    pub fn is_at_border_of_contact(&self, event: &StopContactEvent, chattered: bool) -> bool {
        let (stop, [normal, tangential]) = (event.stop, event.force);
        let closes = event.closed.contains(&u32::try_from(stop).unwrap_or(u32::MAX));
        if !closes {
            return false;
        }
        let (structure, clock) = (&self.structure, event.clock);
        let at = &structure.stops()[stop];
        // What the force is a difference of.
        let rows = structure.contact(stop);
        let terms = structure.modes().iter().zip(&rows.modal_normal).map(|(mode, n)| {
            let place = mode.frequency.value().powi(2) * mode.along(&event.state.q);
            let rate = 2.0 * mode.decay_rate * mode.along(&event.state.v);
            n.hi.abs() * (mode.load.abs() + mode.drive.norm() + place.abs() + rate.abs())
        });
        let (_, by_time) = self.by_time(stop, clock);
        let size = (terms.sum::<f64>() + by_time.abs()) / rows.mobilities[0];
        let sticks = event.mode == Some(StructureMode::Stick) && at.friction() > 0.0;
        let grip = at.friction() * normal - tangential.abs();
        let least = if chattered { NEAR_ONSET } else { AT_BORDER };
        normal <= least * size || (sticks && grip <= AT_BORDER * (1.0 + at.friction()) * size)
    }
}
