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

/// The paper's initial state.
pub fn start() -> State {
    State::new(0.0, 0.5, 0.0, 0.0).unwrap()
}
