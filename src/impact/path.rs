//! The impulse path in closed form, in contact coordinates: at most three straight segments. With
//! numbers that carry derivatives it gives those of the impact in a regime that is held fixed.

#![allow(clippy::inline_always)] // a flight with its impact is compiled for several instruction sets

use super::laws::{Approach, Law, Switch};
use super::regime::RegimeKind;
use crate::model::contact_coordinates::ContactCoordinates;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::dual::Number;

/// Where the impulse path ends, and what was summed along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PathEnd<T> {
    /// w after.
    pub slip: T,
    /// v after.
    pub parting: T,
    /// u before.
    pub approach_velocity: T,
    /// u after.
    pub separation_velocity: T,
    /// P_I.
    pub impulse_approach: T,
    /// P.
    pub impulse_normal: T,
    /// Q, along +t.
    pub impulse_tangential: T,
    /// Energy taken by restitution and friction.
    pub energy_loss: f64,
    /// The part of it that is friction's work.
    pub friction_loss: f64,
}

impl PathEnd<f64> {
    /// Whether velocities, impulse and energy are numbers: energies are squares, and the first to
    /// leave the range of floats.
    #[inline(always)]
    pub(crate) fn is_finite(&self) -> bool {
        (self.slip + self.parting + self.impulse_normal + self.energy_loss).is_finite()
    }
}

/// A sum or product, and its rounding error: without that, the velocities would have the rounding
/// error of the impulse. The error is too small for its derivatives to matter.
#[derive(Clone, Copy)]
struct Exact<T> {
    rounded: T,
    rest: f64,
}

impl<T: Number> Exact<T> {
    #[inline(always)]
    fn of(formula: T, exact: DoubleDouble) -> Self {
        Self { rounded: formula.with_value(exact.hi), rest: exact.lo }
    }

    #[inline(always)]
    fn product_sum(a: T, b: T, c: T) -> Self {
        Self::of(a * b + c, DoubleDouble::product_sum(a.value(), b.value(), c.value()))
    }

    #[inline(always)]
    fn exact(self) -> DoubleDouble {
        DoubleDouble { hi: self.rounded.value(), lo: self.rest }
    }

    #[inline(always)]
    fn over(self, other: Self) -> Self {
        let rounded = self.rounded / other.rounded;
        let (quotient, divisor) = (rounded.value(), other.rounded.value());
        let rest = (-quotient).mul_add(divisor, self.rounded.value())
            + (self.rest - quotient * other.rest);
        Self { rounded, rest: rest / divisor }
    }

    /// a x + b for this x, rounded once: rounding twice is a bias.
    #[inline(always)]
    fn multiply_add(self, a: T, b: T) -> T {
        let sum = Self::product_sum(a, self.rounded, b);
        sum.rounded.with_value(sum.rounded.value() + a.value().mul_add(self.rest, sum.rest))
    }
}

/// a b + c rounded once.
#[inline(always)]
fn fused<T: Number>(a: T, b: T, c: T) -> T {
    (a * b + c).with_value(a.value().mul_add(b.value(), c.value()))
}

/// One law of motion along the impulse: dw = -k dP, dQ = t dP, work of friction mu |h| |w| dP.
pub(crate) struct Segment<T> {
    k: T,
    tangential: T,
    grip: f64,
}

impl<T: Number> Segment<T> {
    /// Without friction.
    #[inline(always)]
    pub fn smooth(contact: &ContactCoordinates<T>) -> Self {
        Self { k: contact.coupling, tangential: T::constant(0.0), grip: 0.0 }
    }

    #[inline(always)]
    pub fn slip(contact: &ContactCoordinates<T>, direction: f64) -> Self {
        Self {
            k: contact.slip_rate(direction),
            tangential: contact.friction * (-direction * contact.side),
            grip: contact.grip().value(),
        }
    }

    #[inline(always)]
    fn stick(contact: &ContactCoordinates<T>) -> Self {
        let tangential = contact.coupling / contact.scale;
        Self { k: T::constant(0.0), tangential, grip: 0.0 }
    }

    /// -du/dP.
    #[inline(always)]
    fn slows(&self, contact: &ContactCoordinates<T>) -> T {
        fused(self.k, contact.coupling, contact.mobility)
    }
}

impl<T: Number> PathEnd<T> {
    /// The start of the path.
    #[inline(always)]
    fn start(contact: &ContactCoordinates<T>) -> Self {
        let (u, zero) = (contact.approach_velocity(), T::constant(0.0));
        Self {
            slip: contact.slip,
            parting: contact.parting,
            approach_velocity: u,
            separation_velocity: u,
            impulse_approach: zero,
            impulse_normal: zero,
            impulse_tangential: zero,
            energy_loss: 0.0,
            friction_loss: 0.0,
        }
    }

    /// Follows a segment for this impulse, which ends at w = 0.
    #[inline(always)]
    fn stop(&mut self, contact: &ContactCoordinates<T>, segment: &Segment<T>, impulse: T) {
        let parting = fused(contact.mobility, impulse, self.parting);
        self.reach(contact, segment, impulse, (T::constant(0.0), parting));
    }

    /// Follows a segment for this impulse.
    #[inline(always)]
    fn step(&mut self, contact: &ContactCoordinates<T>, segment: &Segment<T>, impulse: T) {
        let slip = fused(-segment.k, impulse, self.slip);
        let parting = fused(contact.mobility, impulse, self.parting);
        self.reach(contact, segment, impulse, (slip, parting));
    }

    /// Ends a segment at these velocities, w and v.
    #[inline(always)]
    fn reach(
        &mut self,
        contact: &ContactCoordinates<T>,
        segment: &Segment<T>,
        impulse: T,
        (slip, parting): (T, T),
    ) {
        let u = slip * contact.coupling - parting;
        // Straight segments: the trapezoidal rule is exact. u dP is what restitution takes in
        // approach and gives back after, mu |h| |w| dP the work of friction.
        let friction = segment.grip * (self.slip.value().abs() + slip.value().abs());
        let half = 0.5 * impulse.value();
        self.energy_loss += half * ((self.separation_velocity.value() + u.value()) + friction);
        self.friction_loss += half * friction;
        self.impulse_tangential = self.impulse_tangential + segment.tangential * impulse;
        self.impulse_normal = self.impulse_normal + impulse;
        (self.slip, self.parting, self.separation_velocity) = (slip, parting, u);
    }
}

/// The path of an impact whose slip keeps its direction, or that has no friction: all laws agree
/// there, and none gains energy.
#[inline(always)]
pub(crate) fn without_switch<T: Number>(
    contact: &ContactCoordinates<T>,
    restitution: T,
    segment: &Segment<T>,
) -> PathEnd<T> {
    // 1 + r and mobility + k b/h with what rounding leaves out of them: constant where the contact
    // does not turn, it would drain energy from every impact alike.
    let slowing = Exact::product_sum(segment.k, contact.coupling, contact.mobility);
    let approach = Exact::product_sum(contact.slip, contact.coupling, -contact.parting);
    let whole = Exact::of(
        (T::constant(1.0) + restitution) * approach.rounded,
        DoubleDouble::sum(1.0, restitution.value()) * approach.exact(),
    );
    let impulse = whole.over(slowing);
    let mut path = PathEnd::start(contact);
    let slip = impulse.multiply_add(-segment.k, contact.slip);
    let parting = impulse.multiply_add(contact.mobility, contact.parting);
    path.reach(contact, segment, impulse.rounded, (slip, parting));
    path.energy_loss = path.energy_loss.max(0.0);
    // -r u is exact; the difference of the velocities has rounding.
    path.separation_velocity = -(restitution * path.approach_velocity);
    path.impulse_approach = approach.rounded / slowing.rounded;
    path
}

/// As [`without_switch`], in slip in this direction, whether there is friction or not.
#[inline(always)]
pub(crate) fn slipping_path<T: Number>(
    contact: &ContactCoordinates<T>,
    restitution: T,
    direction: f64,
) -> PathEnd<T> {
    without_switch(contact, restitution, &Segment::slip(contact, direction))
}

/// The path of an impact whose slip ends at the impulse `switch`: approach to u = 0 at P_I,
/// restitution to where the law ends it.
#[inline(always)]
fn with_switch<T: Number>(
    contact: &ContactCoordinates<T>,
    (restitution, law): (T, &impl Law),
    kind: RegimeKind,
    direction: f64,
    switch: T,
) -> PathEnd<T> {
    let (sticks, in_approach) = (kind.sticks(), kind.switches_in_approach());
    let first = Segment::slip(contact, direction);
    let second = if sticks { Segment::stick(contact) } else { Segment::slip(contact, -direction) };
    let (slows_before, slows_after) = (first.slows(contact), second.slows(contact));
    let mut path = PathEnd::start(contact);
    let u = path.approach_velocity;
    path.stop(contact, &first, switch);
    let mobile = contact.mobility.value() > 0.0;
    let velocity = path.separation_velocity;
    let impulse_approach = match (in_approach, sticks) {
        (false, _) => u / slows_before,
        (true, false) => switch - (contact.parting + contact.mobility * switch) / slows_after,
        // The approach ends at v = 0. A resting wall is there at once.
        (true, true) if mobile => (-contact.parting / contact.mobility).at_least(switch),
        (true, true) => switch,
    };
    let work = if in_approach {
        switch * (u + velocity) + velocity * (impulse_approach - switch)
    } else {
        u * impulse_approach
    };
    let approach =
        Approach { restitution, velocity: u, impulse: impulse_approach, work: work * 0.5 };
    let end = law.restitution(&approach).end(&Switch {
        impulse: switch,
        velocity,
        approach_velocity: u,
        impulse_approach,
        parting: contact.parting,
        slows_before,
        slows_after,
        in_approach,
        sticks_mobile: sticks && mobile,
    });
    if sticks {
        path.stop(contact, &second, end.impulse);
        if let Some(separation) = end.separation {
            // u = -v in stick: exact too, also where r = 0 ends in rest.
            path.parting = -separation;
        }
    } else {
        path.step(contact, &second, end.impulse);
    }
    path.separation_velocity = match end.separation {
        Some(separation) => separation,
        None if kind == RegimeKind::StickInApproach => -path.parting,
        None if path.separation_velocity.value() < 0.0 => path.separation_velocity,
        None => T::constant(0.0),
    };
    path.impulse_approach = impulse_approach;
    if !law.may_gain_energy() {
        // Below zero by rounding only.
        path.energy_loss = path.energy_loss.max(0.0);
    }
    path
}

/// The path in a given regime, with slip in this direction at first; `switch` is P*, if the regime
/// has one.
#[inline(always)]
pub(crate) fn follow<T: Number>(
    contact: &ContactCoordinates<T>,
    (restitution, law): (T, &impl Law),
    kind: RegimeKind,
    direction: f64,
    switch: T,
) -> PathEnd<T> {
    match kind {
        RegimeKind::Frictionless => without_switch(contact, restitution, &Segment::smooth(contact)),
        RegimeKind::Slip => slipping_path(contact, restitution, direction),
        _ => with_switch(contact, (restitution, law), kind, direction, switch),
    }
}
