//! A run whose system, start and wishes are given as text, for counts of what each wish costs.

use std::hint::black_box;

use serde::Deserialize;
use vibroimpact::{
    CancelToken, Horizon, Observer, RunOptions, Simulation, State, System, lyapunov_spectrum, run,
};

/// What is wanted of a run; each is a computation of its own.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Wanted {
    /// Its events one by one, nothing kept.
    Events,
    /// The same, and the states at its stroboscopic sections.
    Sections,
    /// What is kept of its last periods.
    History,
    /// The label from them.
    Label,
    /// The Lyapunov exponents over them.
    Exponents,
}

/// A run of the library as a caller sets it up.
#[derive(Deserialize)]
pub struct Setup {
    system: System,
    initial: [f64; 4],
    periods: i64,
    keep: i64,
    wanted: Wanted,
}

impl Setup {
    /// Does it all, from the system's parameters to the outcome.
    pub fn work(&self) {
        let [x1, v1, x2, v2] = self.initial;
        let start = State::new(x1, v1, x2, v2).unwrap();
        let system = black_box(&self.system);
        let kept = |periods: i64, keep: i64| {
            run(system, start, RunOptions::periods(periods).keep(keep), &CancelToken::never())
                .unwrap()
        };
        match self.wanted {
            Wanted::Events => simulate(system, start, self.periods, &mut ()),
            Wanted::Sections => simulate(system, start, self.periods, &mut Sections),
            Wanted::History => drop(black_box(kept(self.periods, self.keep))),
            Wanted::Label => {
                black_box(kept(self.periods, self.keep).period(&CancelToken::never()));
            }
            Wanted::Exponents => {
                // As the call from Python: measured on the orbit to which the motion comes.
                let before = self.periods - self.keep;
                let before = kept(before, before.min(100));
                let (_, later) = before.on_attractor(&CancelToken::never());
                let settled = later.as_ref().unwrap_or(&before);
                let steps = u32::try_from(self.keep).unwrap();
                drop(black_box(
                    lyapunov_spectrum(settled, steps, None, &CancelToken::never()).unwrap(),
                ));
            }
        }
    }
}

/// A simulation of so many drive periods.
pub fn simulate<O: Observer>(system: &System, start: State, periods: i64, observer: &mut O) {
    let simulation = Simulation::new(black_box(system), start).unwrap();
    let mut simulation = simulation.until(Horizon::Periods(periods));
    while let Some(event) = simulation.advance(observer) {
        black_box(event.unwrap());
    }
}

/// Looks at stroboscopic sections.
pub struct Sections;

impl Observer for Sections {
    const SECTIONS: bool = true;

    fn section(&mut self, _: i64, state: &State) {
        black_box(state);
    }
}
