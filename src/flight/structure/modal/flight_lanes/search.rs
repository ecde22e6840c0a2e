//! The search of one flight among its stops (as in ../search.rs), up to where its first contact is
//! to be found; that is done for all lanes together.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use super::{FlightLanes, MOST_STOPS, StopLanes, by_modes};
use crate::flight::structure::modal::stop_gap::StopGap;
use crate::flight::structure::{NEAR_END, StructureFlight, StructureMotion};
use crate::numerics::double_double::DoubleDouble;
use crate::search::gap::noise;
use crate::search::scan::{Scan, scan};
use crate::search::steps::SteppedGap;
use crate::search::tolerances::SCAN_SLACK;

/// What comes next in the search of a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Looked {
    /// The first contact lies near a time, and is to be found.
    Near,
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

/// What the search of one lane has found.
#[derive(Default)]
pub(super) struct StopSearch {
    /// The stops in the order in which they are looked at.
    order: [(f64, usize); MOST_STOPS],
    /// The stop on which the flight begins.
    touched: Option<usize>,
    /// The stop near which the first contact is to be found; up to which local time no other one is
    /// met,
    stop: usize,
    left: f64,
    /// but those that rise through zero once, and about then or later; a bit for each.
    overtaken: u32,
    latest: f64,
}

impl FlightLanes {
    /// Begins the search of lane `j`, whose flight begins on this stop, or on none.
    #[inline(always)]
    pub fn begin_search(&mut self, j: usize, touched: Option<usize>) {
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
        search.touched = touched;
    }

    /// Looks for the first contact of lane `j` among all stops. Which of two comes first is told by
    /// scans, and only that one is to be found.
    #[inline(always)]
    pub fn look(&mut self, j: usize, motion: &StructureMotion, flight: &StructureFlight) -> Looked {
        let Some((motion, flight)) = by_modes(motion, flight) else { return Looked::Unusual };
        let search = &mut self.searches[j];
        let (mut left, mut first) = (motion.span, None);
        // Scans tell contacts much better than this.
        let margin = NEAR_END * motion.step(0);
        (search.overtaken, search.latest) = (0, f64::INFINITY);
        for &(_, stop) in &search.order[..self.shape.stops] {
            let begin = self.stops[stop].begins.get(j);
            let touching = search.touched == Some(stop);
            if !touching && first.is_some() && begin.stays_apart(left, motion.span) {
                continue;
            }
            let until = if left < motion.span { left } else { f64::INFINITY };
            let own = &motion.stops[stop];
            let gap =
                StopGap { motion, flight, index: stop, stop: own, begin, until, shared: None };
            let near = match scan(&gap, &gap.scan_start(), touching, left).0 {
                Scan::Clear(time) if time >= left => continue,
                Scan::RisingStep(rise) => rise.near(),
                Scan::Hop(near) => near,
                Scan::Clear(_) | Scan::Unsure(_) => return Looked::Unusual,
            };
            if let Some((other, time)) = first {
                // Nearly at one instant, only exact contacts tell which comes first.
                if near > time - margin {
                    return Looked::Unusual;
                }
                search.overtaken |= 1u32 << other;
                search.latest = time;
            }
            first = Some((stop, near));
            left = (near + margin).min(motion.span);
            for (part, of) in self.parts.iter_mut().zip(&self.stops[stop].parts) {
                part[j] = of[j];
            }
            self.bounds.set(j, &begin.bounds);
            (self.start[j], self.start_noise[j]) =
                if touching { (0.0, 0.0) } else { (begin.value, noise(begin.size)) };
        }
        // Without any the flight goes on after a while.
        let Some((stop, near)) = first else { return Looked::Unusual };
        (search.stop, search.left, self.near[j]) = (stop, left, near);
        Looked::Near
    }

    /// The contact that was found in lane `j`, if it is exact; the state there is asked for.
    #[inline(always)]
    pub fn take_contact(&mut self, j: usize, motion: &StructureMotion) -> Option<Met> {
        let search = &self.searches[j];
        let (time, offset, stop) = (self.near[j], self.offset[j], search.stop);
        let local_time = time + offset;
        let in_time = local_time <= search.left && local_time < search.latest;
        if self.certain[j] == 0 || !in_time || offset.abs() > motion.span() {
            return None;
        }
        let elapsed = DoubleDouble::sum(time, offset);
        (self.time[j], self.rest[j]) = (elapsed.hi, elapsed.lo);
        Some(Met { stop, time, offset })
    }

    /// Whether no stop has risen through zero before, by the state at the contact of lane `j`.
    #[inline(always)]
    pub fn is_first(&self, j: usize) -> bool {
        let (mut is_first, mut overtaken) = (true, self.searches[j].overtaken);
        while overtaken != 0 {
            is_first &= self.is_later(j, overtaken.trailing_zeros() as usize % MOST_STOPS);
            overtaken &= overtaken - 1;
        }
        is_first
    }

    /// Whether a stop has certainly not yet risen through zero at the contact of lane `j`.
    #[inline(always)]
    fn is_later(&self, j: usize, stop: usize) -> bool {
        let StopLanes { parts, gap, size, .. } = &self.stops[stop];
        let (mut value, mut size) = (-gap[j], size[j]);
        for (mode, part) in self.modes[..self.shape.modes].iter().zip(parts) {
            let term = part[j] * mode.met[j];
            value += term;
            size += term.abs();
        }
        value < -SCAN_SLACK * size
    }
}
