//! Systems and the start of Han, Jin & Hu (2004), section 4, for the benchmarks.

use vibroimpact::{State, System, SystemBuilder};

/// The paper's system without damping, friction and force on the oscillator.
pub fn paper(drive_frequency: f64) -> SystemBuilder {
    System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(2.0)
        .restitution(0.8)
        .gap(0.5)
        .drive_frequency(drive_frequency)
        .moment_amplitude(1.0)
}

/// Drive frequencies of Fig. 4 at which the motion is chaotic: none repeats, so that every impact is
/// computed.
#[allow(dead_code)] // not every benchmark has chaotic motions
pub const CHAOTIC: [f64; 16] = [
    1.55, 1.575, 1.585, 1.875, 1.9, 1.925, 1.95, 1.975, 2.5, 2.525, 2.6, 2.61, 2.9, 2.925, 2.95,
    2.975,
];

/// The paper's initial state.
pub fn start() -> State {
    State::new(0.0, 0.5, 0.0, 0.0).unwrap()
}
