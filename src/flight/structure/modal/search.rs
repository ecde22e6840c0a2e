//! The first contact of a flight among all stops.
//!
//! Stops are looked at in the order in which they would be met if the accelerations of their gaps
//! lasted. So the first is mostly the one that is met, and of the others all that is asked is
//! whether they are met before.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use smallvec::SmallVec;

use super::begins::Begins;
use super::shared::Shared;
use super::stop_gap::StopGap;
use super::{FEW, ModalFlight, ModalMotion, StopContact};
use crate::flight::structure::again_at_the_end;
use crate::numerics::lanes::LANES;
use crate::search::first_contact::{Found, Start, first_contact};

/// A search, compiled for each set of vector instructions.
pub(super) struct ContactSearch<'a> {
    pub motion: &'a ModalMotion,
    pub flight: &'a ModalFlight,
    /// How the flight starts at some of the stops; it is apart from the others.
    pub starts: &'a [(usize, Start)],
}

impl ContactSearch<'_> {
    #[inline(always)]
    fn start(&self, stop: usize) -> Start {
        for &(of, start) in self.starts {
            if of == stop {
                return start;
            }
        }
        Start::Apart
    }
}

impl pulp::NullaryFnOnce for ContactSearch<'_> {
    type Output = StopContact;

    #[inline(always)]
    fn call(self) -> StopContact {
        let Self { motion, flight, .. } = self;
        let count = motion.stops.len();
        let modes = motion.mode_begins(flight);
        let mut begins = SmallVec::<[Begins; 1]>::new();
        for group in 0..motion.groups.len() {
            begins.push(motion.begins(flight, &modes, group));
        }
        let mut order = SmallVec::<[(f64, usize); LANES]>::new();
        for stop in 0..count {
            let begin = begins[stop / LANES].get(stop % LANES);
            order.push((begin.guess(self.start(stop)), stop));
        }
        order.sort_unstable_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        let (mut found, mut clear, mut left) = (None, f64::INFINITY, motion.span);
        let shared = Shared::default();
        let shared = (motion.modes.len() > FEW).then_some(&shared);
        for &(_, stop) in &order {
            let (start, begin) = (self.start(stop), begins[stop / LANES].get(stop % LANES));
            if start == Start::Apart && found.is_some() && begin.stays_apart(left, motion.span) {
                clear = clear.min(left);
                continue;
            }
            let until = if left < motion.span { left } else { f64::INFINITY };
            let own = &motion.stops[stop];
            let gap = StopGap { motion, flight, index: stop, stop: own, begin, until, shared };
            let told = first_contact(&gap, start, left).found;
            let told = again_at_the_end(told, left, motion.span, |further| {
                first_contact(&StopGap { until: f64::INFINITY, ..gap }, start, further).found
            });
            match told {
                Found::Contact(touch) | Found::Graze(touch) | Found::Resting(touch)
                    if touch.local_time().is_nan() =>
                {
                    return StopContact::Failed { stop };
                }
                Found::Contact(touch) if is_first(found, stop, touch.local_time(), left) => {
                    left = touch.local_time();
                    let (time, offset) = (touch.time, touch.offset);
                    found = Some((stop, StopContact::Met { stop, time, offset }));
                }
                Found::Graze(touch) if is_first(found, stop, touch.local_time(), left) => {
                    left = touch.local_time();
                    found = Some((stop, StopContact::Grazed { stop, time: left }));
                }
                Found::Resting(touch) if is_first(found, stop, touch.local_time(), left) => {
                    left = touch.local_time();
                    found = Some((stop, StopContact::Resting { stop, time: left }));
                }
                Found::Clear(time) => {
                    // Earlier than asked for only where the search goes on as a new flight.
                    clear = clear.min(time);
                    if time < left {
                        (left, found) = (time, None);
                    }
                }
                Found::Contact(_) | Found::Graze(_) | Found::Resting(_) => clear = clear.min(left),
                Found::NotFinite | Found::Stalled => return StopContact::Failed { stop },
            }
        }
        match found {
            Some((_, contact)) => contact,
            // Without a stop nothing is met: the caller looks in now and then.
            None => StopContact::Clear(if clear.is_finite() { clear } else { motion.span }),
        }
    }
}

/// Whether this local time comes first; of equal ones the lowest number does.
fn is_first(found: Option<(usize, StopContact)>, stop: usize, time: f64, left: f64) -> bool {
    match found {
        Some((other, _)) => time < left || (time == left && stop < other),
        None => time <= left,
    }
}
