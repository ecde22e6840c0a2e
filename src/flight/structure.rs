//! Exact free motion of a linear structure, and the gaps of its stops (docs/structures.md). Where
//! damping does not couple the modes each is a scalar oscillator (modal.rs), else all of them
//! together are one linear equation (linear.rs).

mod linear;
mod modal;

use smallvec::SmallVec;

use super::drive::{Drive, Trig};
use crate::model::state::Clock;
use crate::model::structure::{Coordinates, Structure, StructureState};
use crate::numerics::double_double::DoubleDouble;
use crate::search::first_contact::{Found, Start};
use crate::search::gap::GapPoint;
#[cfg(test)]
pub(crate) use linear::draws;
#[allow(unused_imports)] // sustained contact comes with the event loop
pub(crate) use linear::{Closed, LegEvent, LinearFlight, LinearMotion, StopForce};
pub(crate) use modal::{FlightLanes, Looked, Met, Shape, Transitions};
use modal::{ModalFlight, ModalMotion};

/// What a structure's flights have in common, worked out once.
///
/// # Example
/// A mass on a spring meets a stop, and is thrown back:
/// ```
/// use vibroimpact::impact::strike;
/// use vibroimpact::{Clock, Stop, StopContact, Structure, StructureMotion};
///
/// let structure = Structure::builder(vec![vec![1.0]], vec![vec![1.0]])
///     .stop(Stop::new([1.0], 0.5, 0.8))
///     .build()?;
/// let motion = StructureMotion::new(&structure);
/// let flight = motion.flight(Clock::START, &[0.0], &[1.0]); // sin t
/// let StopContact::Met { stop, time, offset } = motion.next_contact(&flight, &[]) else {
///     unreachable!("sin t reaches 0.5")
/// };
/// assert!((time + offset - 0.5f64.asin()).abs() < 1e-15);
/// let (q, mut v) = motion.state_after(&flight, time, offset);
/// let (_, approach) = motion.gap(stop, motion.clock_after(&flight, time, offset), &q, &v);
/// strike(&structure, stop, approach, &mut v)?;
/// assert!((v[0] + 0.8 * 0.75f64.sqrt()).abs() < 1e-15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct StructureMotion {
    structure: Structure,
    drive: Drive,
    stops: Vec<StopMotion>,
    motion: Motions,
}

/// By modes, or together.
#[derive(Debug, Clone)]
enum Motions {
    Modal(Box<ModalMotion>),
    Linear(Box<LinearMotion>),
}

/// A stop's own part in its gap.
#[derive(Debug, Clone)]
struct StopMotion {
    /// The entries of its normal that are not 0, with their places.
    normal: SmallVec<[(usize, f64); 2]>,
    /// Sum of their sizes.
    normal_size: f64,
    /// n . phi of the modes.
    row: Vec<f64>,
    gap: f64,
    amplitude: f64,
    drive: Drive,
}

/// A flight between contacts: it starts at some instant, and is evaluated at local times.
#[derive(Debug, Clone)]
pub struct StructureFlight {
    clock: Clock,
    flight: Flights,
}

#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "flights by modes are usual, and take no memory")]
enum Flights {
    Modal(ModalFlight),
    Linear(Box<LinearFlight>),
}

/// What a search for the first contact of a flight found.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum StopContact {
    /// A stop is met, at the local time `time + offset`.
    Met {
        /// Which.
        stop: usize,
        /// Local time to rounding,
        time: f64,
        /// and what that rounding left out.
        offset: f64,
    },
    /// The gap of a stop rises to zero within rounding, at this local time, and falls again.
    Grazed {
        /// Which.
        stop: usize,
        /// Local time.
        time: f64,
    },
    /// A stop is touched without separation.
    Resting {
        /// Which.
        stop: usize,
        /// Local time.
        time: f64,
    },
    /// No stop is met up to this local time.
    Clear(f64),
    /// A number is not finite, or the search was given up.
    Failed {
        /// At which stop.
        stop: usize,
    },
}

impl StructureMotion {
    /// The free motion of a structure.
    #[must_use]
    pub fn new(structure: &Structure) -> Self {
        let stops = stop_motions(structure);
        let motion = if structure.couples_modes() {
            let none = Closed::Frictionless(Vec::new());
            let Some(linear) = LinearMotion::new(structure, none) else {
                unreachable!("no force is asked for")
            };
            Motions::Linear(Box::new(linear))
        } else {
            Motions::Modal(Box::new(ModalMotion::new(structure, stops.clone())))
        };
        let drive = Drive::new(structure.drive_frequency(), structure.phase());
        Self { structure: structure.clone(), drive, stops, motion }
    }

    /// The structure.
    #[must_use]
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// Length of a local flight, up to which a contact is looked for at once.
    #[must_use]
    pub fn span(&self) -> f64 {
        match &self.motion {
            Motions::Modal(modal) => modal.span,
            Motions::Linear(linear) => linear.span(),
        }
    }

    /// Time after which velocities have turned; infinite where nothing turns.
    pub(crate) fn longest(&self) -> f64 {
        match &self.motion {
            Motions::Modal(modal) => modal.longest,
            Motions::Linear(linear) => linear.longest(),
        }
    }

    /// The flight that starts at `clock` from coordinates q and velocities v, each (N,).
    ///
    /// # Panics
    /// If q or v has another length.
    #[must_use]
    pub fn flight(&self, clock: Clock, q: &[f64], v: &[f64]) -> StructureFlight {
        let count = self.structure.coordinates();
        assert!(q.len() == count && v.len() == count, "{count} coordinates and velocities");
        let flight = match &self.motion {
            Motions::Modal(modal) => Flights::Modal(modal.flight(clock, q, v)),
            Motions::Linear(linear) => Flights::Linear(Box::new(linear.flight(clock, q, v))),
        };
        StructureFlight { clock, flight }
    }

    /// The clock at a local time of a flight.
    #[must_use]
    pub fn clock_after(&self, flight: &StructureFlight, time: f64, offset: f64) -> Clock {
        self.drive.advance(flight.clock, DoubleDouble::sum(time, offset))
    }

    /// Coordinates and velocities at any local time, `time + offset`.
    ///
    /// # Panics
    /// If the flight is of another structure, with modes of another kind.
    #[must_use]
    pub fn state_after(
        &self,
        flight: &StructureFlight,
        time: f64,
        offset: f64,
    ) -> (Vec<f64>, Vec<f64>) {
        let StructureState { q, v } = self.state_at(flight, DoubleDouble::sum(time, offset));
        (q.into_vec(), v.into_vec())
    }

    /// The same, as a state.
    pub(crate) fn state_at(
        &self,
        flight: &StructureFlight,
        elapsed: DoubleDouble,
    ) -> StructureState {
        match (&self.motion, &flight.flight) {
            (Motions::Modal(modal), Flights::Modal(flight)) => {
                modal.state_after(&self.structure, flight, elapsed)
            }
            (Motions::Linear(linear), Flights::Linear(flight)) => {
                let (q, v) = linear.state_after(flight, elapsed);
                StructureState { q: Coordinates::from_vec(q), v: Coordinates::from_vec(v) }
            }
            _ => panic!("{OTHER}"),
        }
    }

    /// Carries states q, v, one after another, from t = 0 on; of a structure without loads and drive.
    pub(crate) fn carry(&self, elapsed: DoubleDouble, states: &mut [f64]) {
        let count = self.structure.coordinates();
        if let Motions::Modal(modal) = &self.motion
            && states.len() > FEW_STATES * 2 * count
        {
            return modal.carry(&self.structure, elapsed, states);
        }
        for state in states.chunks_exact_mut(2 * count) {
            let (q, v) = state.split_at_mut(count);
            let after = self.state_at(&self.flight(Clock::START, q, v), elapsed);
            q.copy_from_slice(&after.q);
            v.copy_from_slice(&after.v);
        }
    }

    /// What becomes of the modes without loads and drive after a time; `None` where damping couples
    /// them.
    pub(crate) fn transitions(&self, elapsed: DoubleDouble) -> Option<Transitions> {
        match &self.motion {
            Motions::Modal(modal) => Some(modal.transitions(elapsed)),
            Motions::Linear(_) => None,
        }
    }

    /// Gap of a stop and its rate, u, at a clock, coordinates and velocities.
    #[must_use]
    #[inline(always)]
    #[allow(clippy::inline_always)] // in the lanes
    pub fn gap(&self, stop: usize, clock: Clock, q: &[f64], v: &[f64]) -> (f64, f64) {
        let StopMotion { normal, gap, amplitude, drive, .. } = &self.stops[stop];
        let Trig { cos, sin } = self.stops[stop].trig_at(clock);
        let (value, rate) = (sparse_dot(normal, q), sparse_dot(normal, v));
        (value - gap - amplitude * cos, rate + amplitude * drive.omega * sin)
    }

    /// The coordinates of a contact, whose gap is 0 to rounding, moved onto the stop so that
    /// rounding does not add up.
    #[must_use]
    pub fn on_stop(&self, stop: usize, gap: f64, q: &[f64]) -> Vec<f64> {
        let mut q = q.to_vec();
        self.move_onto(stop, gap, &mut q);
        q
    }

    /// The same in place.
    pub(crate) fn move_onto(&self, stop: usize, gap: f64, q: &mut [f64]) {
        let rows = self.structure.contact(stop);
        let part = gap / rows.mobilities[0];
        for (q, m) in q.iter_mut().zip(&rows.by_normal) {
            *q -= part * m;
        }
    }

    /// A bound of the size of a stop's gap from below, cheap and off by rounding; and the sum of the
    /// sizes of its terms, and of its change over a span at this speed.
    pub(crate) fn at_least_apart(&self, stop: usize, q: &[f64], moved: f64) -> (f64, f64) {
        let StopMotion { normal, normal_size, gap, amplitude, .. } = &self.stops[stop];
        let (mut value, mut size) = (-gap, gap.abs() + amplitude.abs());
        for &(place, n) in normal {
            value += n * q[place];
            size += (n * q[place]).abs();
        }
        (value.abs() - amplitude.abs(), size + normal_size * moved)
    }

    /// The gap of a stop at the start of a flight, with its derivatives.
    pub(crate) fn gap_at_start(&self, flight: &StructureFlight, stop: usize) -> GapPoint {
        match (&self.motion, &flight.flight) {
            (Motions::Modal(modal), Flights::Modal(flight)) => modal.gap_at_start(flight, stop),
            (Motions::Linear(linear), Flights::Linear(flight)) => linear.gap_at_start(flight, stop),
            _ => panic!("{OTHER}"),
        }
    }

    /// First contact of a flight within one span, among all stops. `starts`: how the flight starts
    /// at some of them, as on the one that has just been struck; it is apart from the others.
    ///
    /// # Panics
    /// If the flight is of another structure, with modes of another kind.
    #[must_use]
    pub fn next_contact(&self, flight: &StructureFlight, starts: &[(usize, Start)]) -> StopContact {
        match (&self.motion, &flight.flight) {
            (Motions::Modal(modal), Flights::Modal(flight)) => modal.next_contact(flight, starts),
            (Motions::Linear(linear), Flights::Linear(flight)) => {
                match linear.next_event(flight, starts) {
                    LegEvent::Met { stop, time, offset } => StopContact::Met { stop, time, offset },
                    LegEvent::Grazed { stop, time } => StopContact::Grazed { stop, time },
                    LegEvent::Resting { stop, time } => StopContact::Resting { stop, time },
                    LegEvent::Clear(time) => StopContact::Clear(time),
                    // No stop is closed: nothing else ends a free flight.
                    LegEvent::Released { stop, .. } | LegEvent::Failed { stop } => {
                        StopContact::Failed { stop }
                    }
                    LegEvent::SlipEnds { .. } | LegEvent::SlipBegins { .. } => {
                        StopContact::Failed { stop: 0 }
                    }
                }
            }
            _ => panic!("{OTHER}"),
        }
    }
}

/// So few states are carried one by one: twice the motion of a unit takes as long.
const FEW_STATES: usize = 2;

const OTHER: &str = "the flight is of another structure";

fn stop_motions(structure: &Structure) -> Vec<StopMotion> {
    let omega = structure.drive_frequency();
    let of = |(index, stop): (usize, &crate::model::Stop)| StopMotion {
        normal: stop.normal().iter().copied().enumerate().filter(|&(_, n)| n != 0.0).collect(),
        normal_size: stop.normal().iter().map(|n| n.abs()).sum(),
        row: structure.contact(index).modal_normal.iter().map(|n| n.value()).collect(),
        gap: stop.gap(),
        amplitude: stop.amplitude(),
        drive: Drive::new(omega, stop.phase()),
    };
    structure.stops().iter().enumerate().map(of).collect()
}

impl StopMotion {
    /// Its phase at a clock; any, where it is at rest.
    #[inline(always)]
    #[allow(clippy::inline_always)] // in flights, which are compiled for several instruction sets
    fn trig_at(&self, clock: Clock) -> Trig {
        if self.amplitude == 0.0 { Trig::ONE } else { self.drive.trig_at(clock) }
    }

    /// gap + A cos(omega t + phi_j) as a row over 1, tau, cos psi and sin psi of the drive.
    fn place(&self, drive: &Drive) -> [DoubleDouble; 4] {
        let (own, other) = (self.drive.trig_at(Clock::START), drive.trig_at(Clock::START));
        let cos = own.cos * other.cos + own.sin * other.sin;
        let sin = own.sin * other.cos - own.cos * other.sin;
        let Self { gap, amplitude, .. } = self;
        [*gap, 0.0, amplitude * cos, -amplitude * sin].map(DoubleDouble::new)
    }
}

/// What a search up to `left` has told. It may tell a contact that lies just beyond its end as one
/// just before, to rounding; where stops are met at nearly one instant their order is at stake, and
/// the search is made again with its end further away, within `span`.
fn again_at_the_end(
    told: Found<()>,
    left: f64,
    span: f64,
    search: impl FnOnce(f64) -> Found<()>,
) -> Found<()> {
    match told {
        Found::Contact(touch) if left < span && touch.local_time() > (1.0 - NEAR_END) * left => {
            search((2.0 * left).min(span))
        }
        _ => told,
    }
}

/// Part of a search at whose end it is made again.
const NEAR_END: f64 = 1.0 / 1024.0;

/// In twice the digits.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let terms = a.iter().zip(b);
    terms.fold(DoubleDouble::ZERO, |sum, (&a, &b)| sum + DoubleDouble::product(a, b)).value()
}

/// The same of a row's entries with their places.
#[inline(always)]
#[allow(clippy::inline_always)] // in the lanes
fn sparse_dot(row: &[(usize, f64)], x: &[f64]) -> f64 {
    if let &[(at, n)] = row {
        return n * x[at];
    }
    let terms = row.iter();
    terms.fold(DoubleDouble::ZERO, |sum, &(at, n)| sum + DoubleDouble::product(n, x[at])).value()
}
