//! All integration tests, in one binary: each binary would have to be linked with the library and
//! with all of what the tests use. `cargo test --test integration oracle` runs those of one file.

#![allow(clippy::unwrap_used)]

/// What several tests, examples and benchmarks share.
mod support {
    #[path = "audit.rs"]
    pub mod audit;
    pub mod contact_ode;
    pub mod impacts;
    pub mod random_structures;
    pub mod random_systems;

    use proptest::test_runner::{Config, RngSeed};

    /// How many random cases a test looks at: the first `usual` of those that it looks at under
    /// `make thorough`.
    pub fn draws(usual: usize, thorough: usize) -> usize {
        if std::env::var_os("VIBROIMPACT_THOROUGH").is_some() { thorough } else { usual }
    }

    /// So many cases, the same in every run. One that fails becomes a test with a name, not a file.
    pub fn random_cases(usual: usize, thorough: usize) -> Config {
        Config {
            cases: draws(usual, thorough) as u32,
            rng_seed: RngSeed::Fixed(2004),
            failure_persistence: None,
            ..Config::default()
        }
    }
}

mod audit_judge;
mod batch;
mod contact_audit;
mod contact_integrator;
mod contact_reference;
mod fast_search;
mod first_pass;
mod flights;
mod free_for_ever;
mod hard_cases;
mod impact_energy;
mod impact_incremental;
mod impact_law;
mod impact_properties;
mod impact_restitution;
mod lyapunov;
mod near_grazes;
mod oracle;
mod orbit;
mod random_systems;
mod robustness;
mod simulation;
mod structure_audit;
mod structure_batch;
mod structure_corners;
mod structure_orbits;
mod structure_runs;
mod structure_tangent;
mod structure_units;
mod structures;
mod sweep;
mod third_party;

/// A file that is no module would be tested by nobody.
#[test]
fn every_file_is_a_module() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        if path.extension().is_some_and(|end| end == "rs") && name != "integration" {
            assert!(include_str!("integration.rs").contains(&format!("\nmod {name};")), "{name}");
        }
    }
}
