//! Random single impacts under the laws that walk along the impulse.
//!
//! Ranges: all angles, |v1| <= 2, u in [1e-3, 2], mbar 0 or in [0.01, 100], mu in [0, 5], r in
//! [0, 1]; every eighth mass ratio is 0, half of these walls are at rest; every tenth contact is
//! direct.

use crate::support::random_cases;
use std::f64::consts::PI;

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use vibroimpact::impact::{Impact, ImpactFailure, PreImpact, resolve};
use vibroimpact::{Contact, ImpactLaw, System, SystemBuilder};

pub const LAWS: [ImpactLaw; 3] = [ImpactLaw::Poisson, ImpactLaw::Newton, ImpactLaw::Energetic];

/// Of an impact only mass ratio, restitution and friction count.
fn striking(mass_ratio: f64, restitution: f64, friction: f64) -> SystemBuilder {
    System::builder()
        .mass_ratio(mass_ratio)
        .frequency_ratio(1.0)
        .restitution(restitution)
        .gap(0.0)
        .drive_frequency(1.0)
        .friction(friction)
}

/// A system that strikes obliquely, under Poisson's law.
pub fn system(mass_ratio: f64, restitution: f64, friction: f64) -> System {
    striking(mass_ratio, restitution, friction).build().unwrap()
}

/// One random impact, under any law.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    pub contact: Contact,
    pub mass_ratio: f64,
    pub restitution: f64,
    pub friction: f64,
    pub pre: PreImpact,
}

impl Case {
    pub fn system(&self, law: ImpactLaw) -> System {
        striking(self.mass_ratio, self.restitution, self.friction)
            .contact(self.contact)
            .law(law)
            .build()
            .unwrap()
    }

    pub fn resolve(&self, law: ImpactLaw) -> Result<Impact, ImpactFailure> {
        resolve(&self.system(law), &self.pre)
    }
}

pub fn cases() -> impl Strategy<Value = Case> {
    let mass_ratio = prop_oneof![7 => (-2.0..2.0).prop_map(|m| 10f64.powf(m)), 1 => Just(0.0)];
    let restitution = prop_oneof![8 => 0.0..1.0, 1 => Just(0.0), 1 => Just(1.0)];
    let friction = prop_oneof![9 => 0.0..5.0, 1 => Just(0.0)];
    let v1 = prop_oneof![9 => -2.0..2.0, 1 => Just(0.0)];
    let geometry = prop_oneof![9 => Just(Contact::Oblique), 1 => Just(Contact::Direct)];
    let state = (-PI..PI, v1, 1e-3..2.0, any::<bool>());
    (mass_ratio, restitution, friction, geometry, state).prop_map(
        |(mass_ratio, restitution, friction, contact, (x1, v1, u, at_rest))| {
            let (sin, cos): (f64, f64) =
                if contact == Contact::Direct { (0.0, 1.0) } else { x1.sin_cos() };
            let friction = if contact == Contact::Direct { 0.0 } else { friction };
            let wall_at_rest = mass_ratio == 0.0 && at_rest && v1 * cos > 1e-3;
            let v2 = if wall_at_rest { 0.0 } else { v1 * cos - u };
            let pre = PreImpact { cos, sin, v1, v2 };
            Case { contact, mass_ratio, restitution, friction, pre }
        },
    )
}

pub fn config() -> ProptestConfig {
    random_cases(2_000, 20_000)
}

/// The first `count` cases that [`config`] draws.
pub fn sample(count: usize) -> Vec<Case> {
    let mut runner = TestRunner::new(config());
    (0..count).map(|_| cases().new_tree(&mut runner).unwrap().current()).collect()
}
