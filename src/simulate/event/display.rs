//! An event in one line, for people: what happens, when, and with which velocities.

use std::fmt;

use super::{ContactEvent, Event, StopReason};

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// ```
/// use vibroimpact::{Simulation, State, System};
///
/// let system = System::builder()
///     .mass_ratio(0.6)
///     .frequency_ratio(2.0)
///     .restitution(0.8)
///     .gap(0.5)
///     .drive_frequency(1.8)
///     .moment_amplitude(1.0)
///     .build()?;
/// let mut events = Simulation::new(&system, State::new(0.0, 0.5, 0.0, 0.0)?)?.periods(20);
/// let first = events.next().expect("a run ends with an event")?;
/// assert!(first.to_string().starts_with("impact (frictionless) at t = "), "{first}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let contact = |f: &mut fmt::Formatter<'_>, what: &str, event: &ContactEvent| {
            write!(f, "{what} at t = {:.6}", event.time)
        };
        match self {
            Self::Impact(e) => write!(
                f,
                "impact ({}) at t = {:.6}, approach velocity {:.6}",
                e.impact.regime.kind().name(),
                e.time,
                e.impact.approach_velocity
            ),
            Self::Graze(e) => write!(f, "graze at t = {:.6}", e.time),
            Self::Chatter(e) => write!(f, "chatter ends at t = {:.6}", e.time),
            Self::SlidePositive(e) => contact(f, "slide (x1' > 0)", e),
            Self::SlideNegative(e) => contact(f, "slide (x1' < 0)", e),
            Self::Stick(e) => contact(f, "stick", e),
            Self::Release(e) => contact(f, "release", e),
            Self::Stop(e) => write!(f, "stop ({}) at t = {:.6}", e.reason, e.time),
        }
    }
}
