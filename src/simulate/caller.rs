//! A caller that is asked now and then whether to go on.

use super::Observer;
use crate::state::State;

/// Local flights between two looks at the caller's wish to go on: some milliseconds.
pub(crate) const FLIGHTS_PER_LOOK: u32 = 2048;

/// Looks for nothing but that.
pub(crate) struct Caller<'a> {
    flights: u32,
    go_on: &'a mut dyn FnMut() -> bool,
}

impl<'a> Caller<'a> {
    pub fn new(go_on: &'a mut dyn FnMut() -> bool) -> Self {
        Self { flights: 0, go_on }
    }
}

impl Observer for Caller<'_> {
    const SECTIONS: bool = false;
    fn section(&mut self, _: i64, _: &State) {}
    fn go_on(&mut self) -> bool {
        self.flights += 1;
        if self.flights < FLIGHTS_PER_LOOK {
            return true;
        }
        self.flights = 0;
        (self.go_on)()
    }
}
