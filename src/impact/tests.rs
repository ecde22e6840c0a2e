//! The impulse path of any contact, under the laws of the library and one that stands here alone.

use super::incremental::integrate;
use super::laws::{Approach, Law, Restitution};
use super::{Impact, follow, resolve_in_contact};
use crate::impact::RegimeKind;
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::parameters::ImpactLaw;
use crate::numerics::dual::{Dual, Number};

/// The bodies part at r times the mean velocity of approach along the impulse, doubled: Newton's
/// law where the path is straight. All there is to a law.
struct MeanVelocity;

impl Law for MeanVelocity {
    fn restitution<T: Number>(&self, approach: &Approach<T>) -> Restitution<T> {
        let mean = approach.work / approach.impulse;
        Restitution::Velocity(approach.restitution * 2.0 * mean / approach.velocity)
    }

    fn may_gain_energy(&self) -> bool {
        true
    }
}

/// Contacts that show every regime: u, s, (a, b, c), mu.
const CONTACTS: [(f64, f64, [f64; 3], f64); 8] = [
    (1.0, 0.4, [1.3, 0.2, 0.5], 0.0),
    (1.0, -0.7, [1.3, 0.2, 0.5], 0.3),
    (1.0, 0.1, [1.3, 0.6, 0.5], 0.2),
    (1.0, 0.6, [1.3, 0.6, 0.5], 0.2),
    (0.4, 0.05, [2.1, 0.3, 0.8], 0.7),
    (0.4, -0.05, [2.1, 0.3, 0.8], 0.7),
    (1.0, 0.6, [1.3, 0.2, 0.5], 0.9),
    (1.0, 0.5, [1.0, 0.6, 0.5], 2.0),
];

const RESTITUTION: f64 = 0.7;

fn contacts() -> impl Iterator<Item = ContactCoordinates<f64>> {
    CONTACTS
        .into_iter()
        .map(|(u, s, numbers, friction)| ContactCoordinates::new(u, s, numbers, friction))
}

fn resolved(contact: &ContactCoordinates<f64>, law: &impl Law) -> Impact {
    resolve_in_contact(contact, RESTITUTION, law).unwrap()
}

fn stepped_agrees(law: &impl Law) {
    for contact in contacts() {
        let exact = resolved(&contact, law);
        let stepped = integrate(&contact, (RESTITUTION, law), 200_000).unwrap();
        assert_eq!(exact.regime.kind(), stepped.regime.kind(), "{contact:?}");
        for (closed, open) in [
            (exact.v1_post, stepped.v1_post),
            (exact.v2_post, stepped.v2_post),
            (exact.impulse_normal, stepped.impulse_normal),
            (exact.impulse_tangential, stepped.impulse_tangential),
            (exact.energy_loss, stepped.energy_loss),
        ] {
            assert!((closed - open).abs() < 1e-4, "{contact:?}: {closed} {open}");
        }
    }
}

fn slopes_agree(law: &impl Law) {
    let velocities = |contact: &ContactCoordinates<f64>, restitution: f64| {
        let impact = resolve_in_contact(contact, restitution, law).unwrap();
        [impact.v1_post, impact.v2_post]
    };
    for contact in contacts() {
        let regime = resolved(&contact, law).regime;
        let (direction, _) = regime.start(contact.slip);
        let variable = Dual::<7>::variable;
        let dual = ContactCoordinates {
            slip: variable(contact.slip, 0),
            parting: variable(contact.parting, 1),
            coupling: variable(contact.coupling, 2),
            mobility: variable(contact.mobility, 3),
            scale: variable(contact.scale, 4),
            side: contact.side,
            friction: variable(contact.friction, 5),
        };
        let switch = dual.slip / dual.slip_rate(direction);
        let ratio = variable(RESTITUTION, 6);
        let end = follow(&dual, (ratio, law), regime.kind(), direction, switch);
        let moved = |i: usize, h: f64| {
            let mut contact = contact;
            let mut restitution = RESTITUTION;
            *[
                &mut contact.slip,
                &mut contact.parting,
                &mut contact.coupling,
                &mut contact.mobility,
                &mut contact.scale,
                &mut contact.friction,
                &mut restitution,
            ][i] += h;
            velocities(&contact, restitution)
        };
        // Without friction mu = 0 is a border.
        let smooth = regime.kind() == RegimeKind::Frictionless;
        for i in (0..7).filter(|&i| !(smooth && i == 5)) {
            let h = 1e-6;
            let (up, down) = (moved(i, h), moved(i, -h));
            for (c, value) in [end.slip, end.parting].into_iter().enumerate() {
                let difference = (up[c] - down[c]) / (2.0 * h);
                let slope = value.slope[i];
                assert!((slope - difference).abs() < 1e-7, "{contact:?} {i}: {slope} {difference}");
            }
        }
    }
}

#[test]
fn every_regime_is_met() {
    let mut kinds: Vec<_> =
        contacts().map(|c| resolved(&c, &ImpactLaw::Poisson).regime.kind()).collect();
    kinds.sort();
    kinds.dedup();
    assert_eq!(kinds.len(), 6, "{kinds:?}");
}

#[test]
fn a_law_is_one_function_for_impact_derivative_and_increments() {
    stepped_agrees(&MeanVelocity);
    slopes_agree(&MeanVelocity);
    let differs = contacts().any(|contact| {
        let newton = resolved(&contact, &ImpactLaw::Newton).v2_post;
        (resolved(&contact, &MeanVelocity).v2_post - newton).abs() > 1e-3
    });
    assert!(differs, "the law is one of the library's");
}

#[test]
fn the_laws_of_the_library_have_derivatives_and_increments() {
    for law in [ImpactLaw::Poisson, ImpactLaw::Newton, ImpactLaw::Energetic] {
        stepped_agrees(&law);
        slopes_agree(&law);
    }
}

/// du = -a dP + b dQ, ds = -b dP + c dQ from the impulses alone.
#[test]
fn velocities_of_contact_change_by_its_numbers_and_impulses() {
    for (u, s, numbers, friction) in CONTACTS {
        let contact = ContactCoordinates::new(u, s, numbers, friction);
        let impact = resolved(&contact, &ImpactLaw::Poisson);
        let ([a, b, c], p, q) = (numbers, impact.impulse_normal, impact.impulse_tangential);
        let slip = contact.scale * impact.v1_post;
        assert!((impact.separation_velocity - (u - a * p + b * q)).abs() < 1e-14);
        assert!((slip - (s - b * p + c * q)).abs() < 1e-14);
        assert!(q.abs() <= friction * p + 1e-15);
    }
}
