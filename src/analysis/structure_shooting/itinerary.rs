//! The impacts of one orbit in their order.

use std::fmt;
use std::str::FromStr;

use crate::impact::RegimeKind;
use crate::model::error::ParameterError;
use crate::model::structure::{Structure, StructureState};
use crate::numerics::cancel::CancelToken;
use crate::simulate::structure::StructureEvent;
use crate::simulate::{Horizon, Simulation};
use crate::tangent::itinerary::{ItineraryError, checked_sequence};
use crate::tangent::structure::direction_of;
use crate::tangent::tolerances::MOST_LEGS;

/// A leg of a motion of a structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum StopLeg {
    /// A flight to an impact.
    Impact {
        /// Which stop.
        stop: usize,
        /// Its regime.
        regime: RegimeKind,
        /// The sign of the slip before it, 0 without friction.
        direction: i8,
    },
    /// A motion without impacts: alone.
    Circuit,
}

impl fmt::Display for StopLeg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Circuit => f.write_str("circuit"),
            Self::Impact { stop, regime, direction: 0 } => {
                write!(f, "impact {stop}:{}", regime.name())
            }
            Self::Impact { stop, regime, direction } => {
                let sign = if *direction > 0 { '+' } else { '-' };
                write!(f, "impact {stop}:{}:{sign}", regime.name())
            }
        }
    }
}

impl FromStr for StopLeg {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let unknown = || {
            let allowed = "circuit, or as impact 0:slip:+";
            ParameterError::new("leg", text.to_owned(), allowed)
        };
        if text == "circuit" {
            return Ok(Self::Circuit);
        }
        let rest = text.strip_prefix("impact ").ok_or_else(unknown)?;
        let mut parts = rest.split(':');
        let stop = parts.next().and_then(|part| part.parse().ok()).ok_or_else(unknown)?;
        let name = parts.next().ok_or_else(unknown)?;
        let regime =
            RegimeKind::ALL.iter().copied().find(|kind| kind.name() == name).ok_or_else(unknown)?;
        let direction = match parts.next() {
            None => 0,
            Some("+") => 1,
            Some("-") => -1,
            Some(_) => return Err(unknown()),
        };
        if parts.next().is_some() || (direction == 0) != (regime == RegimeKind::Frictionless) {
            return Err(unknown());
        }
        Ok(Self::Impact { stop, regime, direction })
    }
}

/// The impacts of an orbit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StructureItinerary {
    /// The legs in order; the first follows on the last.
    pub legs: Vec<StopLeg>,
    /// Drive periods after which the motion repeats.
    pub periods: i64,
    /// Completed drive periods at the start of each leg, counted from any.
    pub clocks: Vec<i64>,
}

impl StructureItinerary {
    /// Of these legs.
    ///
    /// # Errors
    /// [`ParameterError`] for an empty or inconsistent sequence.
    pub fn new(legs: Vec<StopLeg>, periods: i64, clocks: Vec<i64>) -> Result<Self, ParameterError> {
        let circuit = legs.contains(&StopLeg::Circuit);
        checked_sequence((legs.len(), circuit), periods, &clocks)?;
        Ok(Self { legs, periods, clocks })
    }

    /// Numbers of a node of a structure of so many coordinates.
    #[must_use]
    pub fn width(&self, coordinates: usize) -> usize {
        2 * coordinates + usize::from(self.legs != [StopLeg::Circuit])
    }

    /// The legs of one orbit of so many drive periods from this state at t = 0, to which it comes
    /// back, and the nodes row by row. `cancel` ends it.
    ///
    /// # Errors
    /// [`ItineraryError`]
    pub fn follow(
        structure: &Structure,
        initial: &StructureState,
        periods: i64,
        max_events: u64,
        cancel: &CancelToken,
    ) -> Result<(Self, Vec<f64>), ItineraryError> {
        if periods < 1 || structure.drive_frequency() == 0.0 {
            let allowed = "a whole number >= 1, of a structure that is driven";
            return Err(ParameterError::new("periods", periods, allowed).into());
        }
        let mut simulation = Simulation::new(structure, initial.clone())?
            .until(Horizon::Periods(periods))
            .max_events(max_events)
            .cancel_with(cancel);
        let (mut ended, mut clocks, mut nodes) = (Vec::new(), Vec::new(), Vec::new());
        let mut last: Option<(f64, usize)> = None;
        loop {
            let Some(event) = simulation.advance(&mut ()) else { break };
            match event? {
                StructureEvent::Impact(event) => {
                    let stop = event.impact.stop;
                    if let Some((time, other)) = last
                        && time == event.time
                    {
                        return Err(ItineraryError::Together(other, stop));
                    }
                    last = Some((event.time, stop));
                    let slip = structure.slip(stop, &event.pre.v);
                    let direction = direction_of(event.impact.regime, slip) as i8;
                    let regime = event.impact.regime.kind();
                    ended.push(StopLeg::Impact { stop, regime, direction });
                    clocks.push(event.clock.period);
                    nodes.extend(event.post.q.iter().chain(&event.post.v));
                    nodes.push(event.clock.time_in_period);
                    if ended.len() > MOST_LEGS {
                        return Err(ItineraryError::TooLong(ended.len()));
                    }
                }
                StructureEvent::Chatter(event) => {
                    return Err(ItineraryError::NotImpacts("complete chatter", event.stop));
                }
                StructureEvent::Closed(event) | StructureEvent::Release(event) => {
                    return Err(ItineraryError::NotImpacts("lasting contact", event.stop));
                }
                StructureEvent::Graze(_) => {}
                StructureEvent::Stop(event) if event.reason.reached_the_end() => break,
                StructureEvent::Stop(event) => {
                    return Err(ItineraryError::Stopped(event.reason));
                }
            }
        }
        if ended.is_empty() {
            let nodes = initial.numbers().collect();
            return Ok((Self { legs: vec![StopLeg::Circuit], periods, clocks: vec![0] }, nodes));
        }
        // A leg leads from its node to the next impact.
        ended.rotate_left(1);
        Ok((Self { legs: ended, periods, clocks }, nodes))
    }
}
