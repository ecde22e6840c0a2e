//! A caller that is asked now and then whether to go on.

use super::Observer;
use crate::model::state::State;

/// Local flights between two looks at the caller's wish to go on: some milliseconds.
const FLIGHTS_PER_LOOK: u32 = 2048;

/// By itself an observer that looks for nothing but that.
pub(crate) struct Caller<G> {
    flights: u32,
    go_on: G,
}

impl<G: FnMut() -> bool> Caller<G> {
    pub fn new(go_on: G) -> Self {
        Self { flights: 0, go_on }
    }

    /// Counts a flight, and asks if it is time to.
    pub fn goes_on(&mut self) -> bool {
        self.flights += 1;
        if self.flights < FLIGHTS_PER_LOOK {
            return true;
        }
        self.flights = 0;
        (self.go_on)()
    }

    /// Much has been done at once: the next flight asks.
    pub fn ask_next(&mut self) {
        self.flights = FLIGHTS_PER_LOOK;
    }
}

impl<G: FnMut() -> bool> Observer for Caller<G> {
    const SECTIONS: bool = false;
    fn section(&mut self, _: i64, _: &State) {}
    fn go_on(&mut self) -> bool {
        self.goes_on()
    }
    fn long_search(&mut self) {
        self.ask_next();
    }
}
