//! The first event of a leg, by the one contact search.

use super::gap::{Ends, LinearGap};
use super::{Closed, LinearFlight, LinearMotion};
use crate::flight::structure::again_at_the_end;
use crate::flight::tolerances::{LEADING_NOISE, MOST_GRAZES};
use crate::search::first_contact::{Found, Start, first_contact};
use crate::search::gap::{Gap, GapPoint};

/// What ends a leg first, at the local time `time + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum LegEvent {
    /// An open stop is met.
    Met { stop: usize, time: f64, offset: f64 },
    /// The gap of an open stop rises to zero within rounding, and falls again.
    Grazed { stop: usize, time: f64 },
    /// An open stop is touched without separation.
    Resting { stop: usize, time: f64 },
    /// The force in a closed stop falls through 0.
    Released { stop: usize, time: f64, offset: f64 },
    /// The velocity of slip of the stop that slides is 0.
    SlipEnds { time: f64, offset: f64 },
    /// The stop that sticks begins to slide in this direction.
    SlipBegins { direction: f64, time: f64, offset: f64 },
    /// Nothing up to this local time.
    Clear(f64),
    /// A number is not finite, or the search was given up, at a stop.
    Failed { stop: usize },
}

impl Ends {
    fn at(self, time: f64, offset: f64) -> LegEvent {
        match self {
            Self::Open(stop) => LegEvent::Met { stop, time, offset },
            Self::Held(stop) => LegEvent::Released { stop, time, offset },
            Self::Slip => LegEvent::SlipEnds { time, offset },
            Self::Stick(direction) => LegEvent::SlipBegins { direction, time, offset },
        }
    }
}

impl LinearMotion {
    /// First event of a leg: within one span, or clear of all up to a time that may be several
    /// spans. `starts`: how it starts at some of the open stops; it is apart from the others.
    pub fn next_event(&self, flight: &LinearFlight, starts: &[(usize, Start)]) -> LegEvent {
        let span = self.equation.span;
        let (mut left, mut clear, mut first) = (span, f64::INFINITY, None);
        for condition in &self.conditions {
            let gap = LinearGap::new(self, flight, condition);
            let mut start = match condition.ends {
                Ends::Open(stop) => {
                    let start = starts.iter().find(|(of, _)| *of == stop);
                    start.map_or(Start::Apart, |&(_, start)| start)
                }
                ends => match Begins::of(&gap) {
                    Begins::Apart => Start::Apart,
                    Begins::Touching => Start::Touching,
                    Begins::Flat => Start::Released,
                    Begins::Zero => {
                        let (time, sign) = gap.quiet_until();
                        clear = clear.min(time);
                        if sign > 0.0 && time <= left {
                            (left, first) = (time, Some(ends.at(time, 0.0)));
                        } else if time < left {
                            // A leg from there knows which way it goes.
                            (left, first) = (time, None);
                        }
                        continue;
                    }
                    Begins::Ended => return ends.at(0.0, 0.0),
                },
            };
            let mut grazes = 0;
            loop {
                let told = first_contact(&gap, start, left).found;
                match again_at_the_end(told, left, span, |span| {
                    first_contact(&gap, start, span).found
                }) {
                    Found::Contact(touch) | Found::Graze(touch) | Found::Resting(touch)
                        if touch.local_time().is_nan() =>
                    {
                        return LegEvent::Failed { stop: self.stop_of(condition.ends) };
                    }
                    Found::Contact(touch) if sooner(first, touch.local_time(), left) => {
                        left = touch.local_time();
                        first = Some(condition.ends.at(touch.time, touch.offset));
                    }
                    Found::Graze(touch) if sooner(first, touch.local_time(), left) => {
                        let time = touch.local_time();
                        match condition.ends {
                            Ends::Open(stop) => {
                                left = time;
                                first = Some(LegEvent::Grazed { stop, time });
                            }
                            // At rest for an instant: what follows is decided anew.
                            Ends::Slip => {
                                left = time;
                                first = Some(condition.ends.at(time, 0.0));
                            }
                            // A force that falls to 0 and rises again.
                            Ends::Held(_) | Ends::Stick(_) if grazes < MOST_GRAZES => {
                                grazes += 1;
                                start = Start::Grazed(time);
                                continue;
                            }
                            Ends::Held(_) | Ends::Stick(_) => {
                                return LegEvent::Failed { stop: self.stop_of(condition.ends) };
                            }
                        }
                    }
                    Found::Clear(time) => {
                        // Earlier than asked for only where the search goes on as a new leg.
                        clear = clear.min(time);
                        if time < left {
                            (left, first) = (time, None);
                        }
                    }
                    Found::Contact(_) | Found::Graze(_) => clear = clear.min(left),
                    Found::Resting(touch) => {
                        left = touch.local_time();
                        first = Some(match condition.ends {
                            Ends::Open(stop) => LegEvent::Resting { stop, time: left },
                            ends => ends.at(left, 0.0),
                        });
                    }
                    Found::NotFinite | Found::Stalled => {
                        return LegEvent::Failed { stop: self.stop_of(condition.ends) };
                    }
                }
                break;
            }
        }
        // Without a condition nothing is asked for: the caller looks in now and then.
        first.unwrap_or(LegEvent::Clear(if clear.is_finite() { clear } else { span }))
    }

    /// The gap of an open stop at the start of a leg, with its derivatives; zeros where it is closed.
    pub fn gap_at_start(&self, flight: &LinearFlight, stop: usize) -> GapPoint {
        let condition = self.conditions.iter().find(|c| c.ends == Ends::Open(stop));
        condition.map_or(GapPoint::default(), |condition| {
            LinearGap::new(self, flight, condition).change(0.0).0
        })
    }

    /// Whether nothing moves, or ever will: no coordinate is free, closed stops do not move, and all
    /// that would end the leg stays below 0, whatever the phase.
    pub fn rests(&self, flight: &LinearFlight) -> bool {
        let slides = matches!(self.closed, Closed::Slide { .. });
        self.equation.free == 0
            && !slides
            && !self.equation.moves()
            && self.conditions.iter().all(|condition| condition.stays_below(flight.tau))
    }

    fn stop_of(&self, ends: Ends) -> usize {
        match (ends, &self.closed) {
            (Ends::Open(stop) | Ends::Held(stop), _) => stop,
            (_, Closed::Slide { stop, .. } | Closed::Stick { stop, .. }) => *stop,
            (_, Closed::Frictionless(_)) => 0,
        }
    }

    /// Whether the force in a closed stop, 0 now, falls.
    pub fn force_falls(&self, flight: &LinearFlight, stop: usize) -> bool {
        let condition = self.conditions.iter().find(|c| c.ends == Ends::Held(stop));
        let sign = |condition| LinearGap::new(self, flight, condition).leading(LEADING_NOISE);
        condition.and_then(sign).is_some_and(|(_, sign)| sign > 0.0)
    }
}

/// How a condition begins.
enum Begins {
    /// Beyond rounding below 0.
    Apart,
    /// At 0, and on its way down by its first or second derivative,
    Touching,
    /// or by a higher one.
    Flat,
    /// It is 0 to many orders.
    Zero,
    /// Above 0, or on its way up.
    Ended,
}

impl Begins {
    /// At a limit of the leg's own closed stops.
    fn of(gap: &LinearGap<'_>) -> Self {
        match gap.leading(LEADING_NOISE) {
            None => Self::Zero,
            Some((_, sign)) if sign > 0.0 => Self::Ended,
            Some((0, _)) => Self::Apart,
            Some((1 | 2, _)) => Self::Touching,
            Some(_) => Self::Flat,
        }
    }
}

/// Whether this local time comes first; of equal ones the first that was asked for does.
fn sooner(first: Option<LegEvent>, time: f64, left: f64) -> bool {
    if first.is_some() { time < left } else { time <= left }
}
