//! Is a solution of the conditions of periodicity a motion of its system? First every condition of
//! its legs, then a simulation over one orbit, whose contact search has a guarantee, and which must
//! pass the same events and come back (docs/orbits.md).

use std::fmt;

use nalgebra::Matrix4;
use rayon::prelude::*;

use super::trajectory::product;
use super::{FollowedLeg, NOWHERE, Orbit};
use crate::analysis::tolerances::{CLOSES, NEAR_EVENT, ON_BORDER};
use crate::impact::RegimeKind;
use crate::model::parameters::System;
use crate::model::state::State;
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::StopReason;
use crate::simulate::run::{RunError, RunOptions, run};
use crate::tangent::border::{Border, BorderKind, ConditionValue};
use crate::tangent::itinerary::{Itinerary, ItineraryError, Leg, Signs, StickEnd};

/// What a solution is.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Derivative of the return map ([`Orbit::return_map`]): its eigenvalues are the multipliers.
    pub return_map: Matrix4<f64>,
    /// Why it is no motion of its system; `None` if it is one.
    pub rejection: Option<Rejection>,
}

/// Why a solution is no motion of its system.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Rejection {
    /// A leg cannot be followed: its derivative is not finite.
    NotFollowed,
    /// The bodies separate before an impact: u <= 0.
    Separating(f64),
    /// A condition of a leg that does not hold.
    Violated(ConditionValue),
    /// The state at which a simulation would start is not defined.
    NoStart,
    /// A simulation of it has no itinerary.
    Simulation(ItineraryError),
    /// A simulation of it passes other events.
    OtherEvents,
    /// A simulation of it ends at this distance from its start.
    NotClosed(f64),
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFollowed => write!(f, "a leg cannot be followed"),
            Self::Separating(u) => {
                write!(f, "separating before the impact (u = {})", Digits(*u))
            }
            Self::Violated(ConditionValue { condition, value, .. }) => {
                let (value, leg) = (Digits(*value), condition.leg);
                match condition.border {
                    Border::ApproachVelocity => {
                        write!(f, "separating before the impact (u = {value})")
                    }
                    Border::Flight => {
                        let overlap = Digits(-value.0);
                        write!(f, "the bodies overlap during the flight (gap {overlap})")
                    }
                    border => {
                        let kind = border.kind().name().replace('_', " ");
                        write!(f, "{kind}: {} ({value}, leg {leg})", border.text())
                    }
                }
            }
            Self::NoStart => write!(f, "the state at the start of a simulation is not defined"),
            Self::Simulation(why) => write!(f, "a simulation of it: {why}"),
            Self::OtherEvents => write!(f, "a simulation of it passes other events"),
            Self::NotClosed(off) => {
                write!(f, "a simulation of it does not come back (by {})", Digits(*off))
            }
        }
    }
}

/// A number with three digits, without zeros at its end; as a power of ten if it is small or large.
pub(crate) struct Digits(pub(crate) f64);

impl fmt::Display for Digits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scientific = format!("{:.2e}", self.0);
        let Some((mantissa, exponent)) = scientific.split_once('e') else {
            return write!(f, "{}", scientific.to_lowercase());
        };
        let shorter = |digits: &str| {
            let kept = if digits.contains('.') { digits.trim_end_matches('0') } else { digits };
            kept.trim_end_matches('.').to_owned()
        };
        let exponent: i32 = exponent.parse().map_err(|_| fmt::Error)?;
        #[allow(clippy::cast_sign_loss)] // not negative in this range
        if (-4..3).contains(&exponent) {
            return f.write_str(&shorter(&format!("{:.*}", (2 - exponent) as usize, self.0)));
        }
        let sign = if exponent < 0 { '-' } else { '+' };
        write!(f, "{}e{sign}{:02}", shorter(mantissa), exponent.abs())
    }
}

impl Orbit<'_> {
    /// The verdicts on several solutions, computed on all processors.
    ///
    /// # Errors
    /// As [`Orbit::verdict`].
    pub fn verdicts(
        orbits: &[Self],
        max_events: u64,
        cancel: &CancelToken,
    ) -> Result<Vec<Verdict>, ItineraryError> {
        orbits.par_iter().map(|orbit| orbit.verdict(max_events, cancel)).collect()
    }

    /// The verdict on the solution. A simulation of it is given up after `max_events`.
    ///
    /// # Errors
    /// [`ItineraryError`] if the start of a simulation is refused, or `cancel` ends it.
    pub fn verdict(
        &self,
        max_events: u64,
        cancel: &CancelToken,
    ) -> Result<Verdict, ItineraryError> {
        let legs = self.followed();
        let transfer: Vec<_> = legs.iter().map(|leg| self.transfer_of(leg.as_ref())).collect();
        let return_map = product(&transfer);
        let rejection = self.rejection(&return_map, &legs, max_events, cancel)?;
        Ok(Verdict { return_map, rejection })
    }

    fn rejection(
        &self,
        return_map: &Matrix4<f64>,
        legs: &[Option<FollowedLeg>],
        max_events: u64,
        cancel: &CancelToken,
    ) -> Result<Option<Rejection>, ItineraryError> {
        let known: &[usize] = match (self.itinerary.wall_at_rest, self.is_circuit()) {
            (false, _) => &[0, 1, 2, 3],
            (true, true) => &[0, 1],
            (true, false) => &[1, 3],
        };
        if known.iter().any(|&i| known.iter().any(|&j| !return_map[(i, j)].is_finite())) {
            return Ok(Some(Rejection::NotFollowed));
        }
        // Checked first: the maxima of the gap take longer to find.
        if let Some(u) = self.separates(legs) {
            return Ok(Some(Rejection::Separating(u)));
        }
        if let Some(violated) = self.violated() {
            return Ok(Some(Rejection::Violated(violated)));
        }
        let growth = largest(return_map.iter());
        self.simulated_otherwise(growth, max_events, cancel)
    }

    /// The first approach velocity that is not positive, in order of time.
    fn separates(&self, legs: &[Option<FollowedLeg>]) -> Option<f64> {
        let (count, periods) = (self.nodes.len(), self.itinerary.periods);
        let mut impacts: Vec<(i64, f64, f64)> = legs
            .iter()
            .enumerate()
            .filter(|&(i, _)| matches!(self.itinerary.legs[i], Leg::Impact(..)))
            .map(|(i, leg)| {
                let before = leg.as_ref().map_or(NOWHERE, |leg| leg.pre);
                let next = (i + 1) % count;
                let clock = self.itinerary.clocks[next].rem_euclid(periods);
                (clock, self.nodes[next].time, self.system.approach_velocity(&before))
            })
            .collect();
        impacts.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        // A NaN is not positive.
        impacts.into_iter().map(|(_, _, u)| u).find(|u| u.is_nan() || *u <= 0.0)
    }

    /// The first condition that does not hold, those of grazing before the others.
    fn violated(&self) -> Option<ConditionValue> {
        let mut tests = self.tests();
        tests.sort_by_key(|test| test.condition.border.kind() != BorderKind::Grazing);
        tests.into_iter().find(|test| is_violated(test.condition.border, test.value))
    }

    fn simulated_otherwise(
        &self,
        growth: f64,
        max_events: u64,
        cancel: &CancelToken,
    ) -> Result<Option<Rejection>, ItineraryError> {
        let moment = self.clear_of_events();
        let State { x1, v1, x2, v2 } = self.state_at(moment);
        let Ok(start) = State::new(x1, v1, x2, v2) else { return Ok(Some(Rejection::NoStart)) };
        let mut system = self.system.clone();
        if moment != 0.0 {
            let ahead = moment % system.drive_period();
            system = system.with("phase", system.phase() + system.drive_frequency() * ahead)?;
        }
        let periods = self.itinerary.periods;
        let followed = Itinerary::follow(&system, start, periods, max_events, cancel);
        let passed = match followed {
            Ok((itinerary, _)) => told(&system, &itinerary.legs),
            Err(error) => return refused_or(error),
        };
        if !is_same_cycle(&passed, &told(&system, &self.itinerary.legs)) {
            return Ok(Some(Rejection::OtherEvents));
        }
        let end = match run(&system, start, RunOptions::periods(periods).keep(0), cancel) {
            Ok(run) if run.stop_reason == StopReason::Interrupted => {
                return Err(ItineraryError::Stopped(StopReason::Interrupted));
            }
            Ok(run) => run.final_state.state.to_array(),
            Err(error) => return refused_or(error.into()),
        };
        let start = start.to_array();
        let off =
            start.iter().zip(end).fold(0.0, |off: f64, (from, to)| off.max((to - from).abs()));
        let scale = largest(start.iter());
        Ok((off > CLOSES * scale * growth).then_some(Rejection::NotClosed(off)))
    }

    /// Time from which to simulate an orbit: 0 unless there is an event.
    ///
    /// A simulation that begins or ends within rounding of an event may count it twice, or not at
    /// all.
    fn clear_of_events(&self) -> f64 {
        let period = self.system.drive_period();
        let to_section =
            |time: f64| ((time + 0.5 * period).rem_euclid(period) - 0.5 * period).abs();
        let is_clear = self.nodes.iter().all(|node| to_section(node.time) > NEAR_EVENT * period);
        if self.is_circuit() || is_clear {
            return 0.0;
        }
        let starts = self.node_times();
        let end = |i: usize| starts.get(i + 1).copied().unwrap_or(starts[0] + self.length());
        let mut longest: Option<(f64, f64)> = None;
        for (i, leg) in self.itinerary.legs.iter().enumerate() {
            let length = end(i) - starts[i];
            if matches!(leg, Leg::Impact(..)) && longest.is_none_or(|(_, most)| length > most) {
                longest = Some((starts[i], length));
            }
        }
        longest.map_or(0.0, |(start, length)| start + 0.5 * length)
    }
}

/// The size of the largest number, at least 1.
pub(crate) fn largest<'a>(numbers: impl Iterator<Item = &'a f64>) -> f64 {
    numbers.fold(1.0, |most: f64, x| most.max(x.abs()))
}

/// Whether the value of a condition says that it does not hold. On a border between regimes the
/// motion belongs to both, also at a graze.
pub(crate) fn is_violated(border: Border, value: f64) -> bool {
    let least = if border == Border::ApproachVelocity { 0.0 } else { -ON_BORDER };
    value.is_nan() || value <= least
}

/// Whether two cycles pass the same legs, wherever they begin.
pub(crate) fn is_same_cycle<T: PartialEq>(one: &[T], other: &[T]) -> bool {
    let same = |shift: usize| one[shift..].iter().chain(&one[..shift]).eq(other);
    one.len() == other.len() && (0..one.len()).any(same)
}

/// A refused start and a wish to end are no verdicts.
fn refused_or(error: ItineraryError) -> Result<Option<Rejection>, ItineraryError> {
    match error {
        ItineraryError::Parameter(_)
        | ItineraryError::State(_)
        | ItineraryError::Stopped(StopReason::Interrupted) => Err(error),
        why => Ok(Some(Rejection::Simulation(why))),
    }
}

impl From<RunError> for ItineraryError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Parameter(error) => error.into(),
            RunError::State(error) => error.into(),
            RunError::Simulation { error, .. } => error.into(),
        }
    }
}

/// What must agree of the legs of two passages of one orbit.
fn told(system: &System, legs: &[Leg]) -> Vec<Leg> {
    if system.friction() > 0.0 {
        return significant(legs.to_vec());
    }
    // Without friction neither the regime nor the kind of contact counts: stick and slide are one
    // phase of contact, to its release.
    let without = |&leg: &Leg| match leg {
        Leg::Impact(..) => Some(Leg::Impact(RegimeKind::Frictionless, Signs::NONE)),
        Leg::SlideToRelease(_) | Leg::Stick(StickEnd::Release) => Some(Leg::SlideToRelease(true)),
        Leg::SlideToStop(_) | Leg::Stick(_) => None,
        Leg::Chatter | Leg::Circuit => Some(leg),
    };
    significant(legs.iter().filter_map(without).collect())
}

/// Leaves out the impacts that lead into chatter: how many are listed is a matter of choice.
fn significant(legs: Vec<Leg>) -> Vec<Leg> {
    let mut kept: Vec<Leg> = Vec::new();
    for &leg in legs.iter().chain(&legs) {
        if leg == Leg::Chatter {
            while matches!(kept.last(), Some(Leg::Impact(..))) {
                kept.pop();
            }
        }
        kept.push(leg);
    }
    // Only the second repetition: the first may begin among such impacts.
    let chatters: Vec<usize> = (0..kept.len()).filter(|&i| kept[i] == Leg::Chatter).collect();
    match chatters.first() {
        None => legs,
        Some(&first) => kept[first..chatters[chatters.len() / 2]].to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::{Digits, Rejection, significant};
    use crate::analysis::shooting::Orbit;
    use crate::impact::RegimeKind;
    use crate::model::parameters::System;
    use crate::model::state::State;
    use crate::numerics::cancel::CancelToken;
    use crate::simulate::run::{RunOptions, run};
    use crate::tangent::border::Border;
    use crate::tangent::itinerary::{Itinerary, ItineraryError, Leg, Node, Signs};

    const MOST_EVENTS: u64 = 1000;
    const IMPACT: Leg = Leg::Impact(RegimeKind::Frictionless, Signs::NONE);

    fn system() -> System {
        let paper = System::builder().mass_ratio(0.6).frequency_ratio(2.0).restitution(0.8);
        paper.gap(0.5).drive_frequency(1.8).moment_amplitude(1.0).build().unwrap()
    }

    /// The stable 1-1 motion, to the precision of a long simulation.
    fn settled() -> (Itinerary, Vec<Node>) {
        let (system, never) = (system(), CancelToken::never());
        let start = State::new(0.0, 0.5, 0.0, 0.0).unwrap();
        let end = run(&system, start, RunOptions::periods(1000), &never).unwrap().final_state;
        Itinerary::follow(&system, end.state, 1, MOST_EVENTS, &never).unwrap()
    }

    fn rejection(itinerary: &Itinerary, nodes: &[Node]) -> Option<Rejection> {
        let orbit = Orbit::new(&system(), itinerary, nodes).unwrap();
        orbit.verdict(MOST_EVENTS, &CancelToken::never()).unwrap().rejection
    }

    #[test]
    fn a_motion_that_is_simulated_is_not_rejected() {
        let (itinerary, nodes) = settled();
        assert_eq!(rejection(&itinerary, &nodes), None);
        let orbit = Orbit::new(&system(), &itinerary, &nodes).unwrap();
        let period = system().drive_period();
        for time in [0.0, 0.3, 2.0] {
            let (once, later) = (orbit.state_at(time), orbit.state_at(time - 5.0 * period));
            for (a, b) in once.to_array().into_iter().zip(later.to_array()) {
                assert!((a - b).abs() < 1e-13, "{once:?} {later:?}");
            }
        }
    }

    #[test]
    fn what_is_no_motion_says_why() {
        let (itinerary, nodes) = settled();
        let moved = |v1: f64, v2: f64| {
            let Node { x1, time, .. } = nodes[0];
            rejection(&itinerary, &[Node { x1, v1, v2, time }])
        };
        let found = moved(nodes[0].v1 + 1e-3, nodes[0].v2);
        assert!(matches!(found, Some(Rejection::NotClosed(off)) if off > 1e-5), "{found:?}");
        let found = moved(nodes[0].v2, nodes[0].v1).unwrap();
        match &found {
            Rejection::Violated(test) => assert_eq!(test.condition.border, Border::Flight),
            other => assert!(matches!(other, Rejection::Separating(_)), "{other:?}"),
        }
        assert_eq!(moved(f64::NAN, 0.0), Some(Rejection::NotFollowed));
        assert_eq!(Rejection::NotFollowed.to_string(), "a leg cannot be followed");
    }

    #[test]
    fn a_wish_to_end_is_no_verdict() {
        let (itinerary, nodes) = settled();
        let orbit = Orbit::new(&system(), &itinerary, &nodes).unwrap();
        let ended = orbit.verdict(MOST_EVENTS, &CancelToken::after(1));
        assert!(matches!(ended, Err(ItineraryError::Stopped(_))), "{ended:?}");
    }

    #[test]
    fn low_bounces_before_chatter_do_not_count() {
        let bounces = |count| [vec![IMPACT; count], vec![Leg::Chatter]].concat();
        assert_eq!(significant(bounces(2)), significant(bounces(5)));
        assert_eq!(significant(vec![IMPACT; 3]).len(), 3);
    }

    #[test]
    fn numbers_have_three_digits() {
        let told = |x: f64| Digits(x).to_string();
        assert_eq!(told(-1.236), "-1.24");
        assert_eq!(told(0.5), "0.5");
        assert_eq!(told(99.96), "100");
        assert_eq!(told(999.6), "1e+03");
        assert_eq!(told(0.000_123_4), "0.000123");
        assert_eq!(told(-0.000_012_34), "-1.23e-05");
        assert_eq!(told(0.0), "0");
        assert_eq!(told(f64::NAN), "nan");
        assert_eq!(told(f64::INFINITY), "inf");
    }
}
