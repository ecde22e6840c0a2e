//! The search of one flight among its stops, in steps: between them the exact contacts are found
//! for all lanes together (as in ../search.rs).

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use super::{FlightLanes, MOST_STOPS, by_modes};
use crate::flight::structure::modal::shared::Shared;
use crate::flight::structure::modal::stop_gap::StopGap;
use crate::flight::structure::{NEAR_END, StructureFlight, StructureMotion};
use crate::numerics::double_double::DoubleDouble;
use crate::search::gap::noise;
use crate::search::scan::{Scan, scan};
use crate::search::steps::SteppedGap;

/// What comes next in the search of a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Looked {
    /// A contact lies near a time, and is to be found.
    Near,
    /// The first contact is known.
    Met,
    /// Anything else, left to the single search.
    Unusual,
}

/// The first contact of a flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Met {
    pub stop: usize,
    /// Local time, and what its rounding left out.
    pub time: f64,
    pub offset: f64,
}

/// Where the search of one lane stands.
#[derive(Default)]
pub(super) struct StopSearch {
    /// The stops in the order in which they are looked at.
    order: [(f64, usize); MOST_STOPS],
    next: usize,
    /// The stop on which the flight begins.
    touched: Option<usize>,
    /// The stop near which a contact is to be found.
    stop: usize,
    /// Later contacts are of no interest.
    left: f64,
    found: Option<Met>,
    shared: Shared,
}

impl FlightLanes {
    /// Begins the search of lane `j`, whose flight begins on this stop, or on none.
    #[inline(always)]
    pub fn begin_search(&mut self, j: usize, motion: &StructureMotion, touched: Option<usize>) {
        let search = &mut self.searches[j];
        for (stop, lanes) in self.stops.iter().enumerate().take(self.shape.stops) {
            let touching = touched == Some(stop);
            let guess = if touching { lanes.guess_touching[j] } else { lanes.guess_apart[j] };
            // Those before it are in order.
            let mut place = stop;
            while place > 0 && guess.total_cmp(&search.order[place - 1].0).is_lt() {
                search.order[place] = search.order[place - 1];
                place -= 1;
            }
            search.order[place] = (guess, stop);
        }
        (search.next, search.touched, search.found) = (0, touched, None);
        search.left = motion.span();
        search.shared.clear();
    }

    /// Looks at the stops of lane `j` that are still to be looked at, up to one near which a
    /// contact is to be found.
    #[inline(always)]
    pub fn look(&mut self, j: usize, motion: &StructureMotion, flight: &StructureFlight) -> Looked {
        let Some((motion, flight)) = by_modes(motion, flight) else { return Looked::Unusual };
        let search = &mut self.searches[j];
        while search.next < self.shape.stops {
            let (_, stop) = search.order[search.next];
            search.next += 1;
            let (begin, left) = (self.stops[stop].begins.get(j), search.left);
            let touching = search.touched == Some(stop);
            if !touching && search.found.is_some() && begin.stays_apart(left, motion.span) {
                continue;
            }
            let until = if left < motion.span { left } else { f64::INFINITY };
            let (own, shared) = (&motion.stops[stop], &search.shared);
            let gap = StopGap { motion, flight, index: stop, stop: own, begin, until, shared };
            match scan(&gap, &gap.scan_start(), touching, left).0 {
                Scan::Clear(time) if time >= left => continue,
                Scan::RisingStep(rise) => {
                    self.rising_steps.set(j, &rise);
                    self.on_step[j] = 1;
                }
                Scan::Hop(near) => (self.near[j], self.on_step[j]) = (near, 0),
                Scan::Clear(_) | Scan::Unsure(_) => return Looked::Unusual,
            }
            search.stop = stop;
            for (part, of) in self.parts.iter_mut().zip(&self.stops[stop].parts) {
                part[j] = of[j];
            }
            self.bounds.set(j, &begin.bounds);
            (self.start[j], self.start_noise[j]) =
                if touching { (0.0, 0.0) } else { (begin.value, noise(begin.size)) };
            return Looked::Near;
        }
        // Without any the flight goes on after a while.
        if search.found.is_some() { Looked::Met } else { Looked::Unusual }
    }

    /// Takes the contact that was found in lane `j`, if it is the first so far; whether the search
    /// can go on.
    #[inline(always)]
    pub fn take_contact(&mut self, j: usize, motion: &StructureMotion) -> bool {
        let search = &mut self.searches[j];
        let (time, offset, stop, left) = (self.near[j], self.offset[j], search.stop, search.left);
        let local_time = time + offset;
        // Near the end of what was searched it is searched again.
        let at_end = left < motion.span() && local_time > (1.0 - NEAR_END) * left;
        if self.certain[j] == 0 || at_end || offset.abs() > motion.span() {
            return false;
        }
        let is_first = match search.found {
            Some(other) => local_time < left || (local_time == left && stop < other.stop),
            None => local_time <= left,
        };
        if !is_first {
            return search.found.is_some();
        }
        (search.left, search.found) = (local_time, Some(Met { stop, time, offset }));
        true
    }

    /// The first contact of lane `j`, whose state is asked for.
    #[inline(always)]
    pub fn met(&mut self, j: usize) -> Option<Met> {
        let met = self.searches[j].found?;
        let elapsed = DoubleDouble::sum(met.time, met.offset);
        (self.time[j], self.rest[j]) = (elapsed.hi, elapsed.lo);
        Some(met)
    }
}
