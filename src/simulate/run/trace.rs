//! What a run knows of its events beyond their tables. Derivatives use it (tangent/sensitivity).

/// Of each event, and of what was copied. A run that was read from a file has none.
#[derive(Debug, Clone, Default)]
pub(crate) struct Trace {
    /// What the clocks of the events hold beyond the tables.
    pub residuals: Vec<f64>,
    /// In order.
    pub copies: Vec<Copies>,
}

/// Events that were copied from those before them: they repeat to the last bit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Copies {
    /// The first copied event.
    pub first: usize,
    /// Events of a cycle, its drive periods, and how many times it was copied.
    pub events: usize,
    pub periods: i64,
    pub times: usize,
}

/// How a run was made plays no part in what it is.
impl PartialEq for Trace {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Trace {
    /// Takes note of a copy of the last events, before it is made.
    pub fn copied(&mut self, events: usize, periods: i64) {
        let first = self.residuals.len();
        if let Some(last) = self.copies.last_mut()
            && (last.events, last.periods) == (events, periods)
            && last.end() == first
        {
            last.times += 1;
            return;
        }
        self.copies.push(Copies { first, events, periods, times: 1 });
    }
}

impl Copies {
    /// The first event after them.
    pub fn end(&self) -> usize {
        self.first + self.times * self.events
    }
}
