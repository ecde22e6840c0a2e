//! The contact audit: random flights searched by the library and, independently, by dense sampling
//! in double-double arithmetic, and the two outcomes compared (docs/contact-audit.md).

pub mod dense;
pub mod double_double;
mod draw;
pub mod exact_motion;
pub mod judge;
pub mod linear_motion;
pub mod rounding;
pub mod structures;
mod tally;

#[allow(unused_imports)] // each test its own
pub use draw::{Draw, Flights, Kind, draw};
use exact_motion::DenseFlight;
pub use judge::{Errors, Outcome};
use judge::{Judge, Last, Searched, Told};
use rayon::prelude::*;
use vibroimpact::{Clock, Found, FreeMotion, Start, State, Touch, next_contact};

#[allow(unused_imports)]
pub use tally::{HEADER, Tally};

/// One judged flight.
pub struct Judged {
    pub index: u64,
    pub draw: Draw,
    pub outcome: Outcome,
    pub errors: Option<Errors>,
    /// Of humps told as grazes: the lowest and the highest height/e.
    pub grazes: Option<[f64; 2]>,
    pub evaluations: u64,
    pub span: f64,
    /// What the library found first: a time, `none`, `graze` or `failed`.
    pub found: String,
    pub samples: u64,
}

/// What the library's search tells, followed past grazes.
fn search(draw: &Draw, motion: &FreeMotion) -> Searched<State> {
    let flight = motion.flight(Clock::START, draw.state);
    let mut start = if draw.kind.touching() { Start::Touching } else { Start::Apart };
    let (mut grazes, mut evaluations) = (Vec::new(), 0);
    let told = |touch: Touch| Told { time: [touch.time, touch.offset], state: touch.state };
    loop {
        let report = next_contact(motion, &flight, start, motion.span());
        evaluations += report.evaluations;
        let last = match report.found {
            Found::Graze(touch) if grazes.len() < 100 => {
                grazes.push(told(touch));
                start = Start::Grazed(touch.time);
                continue;
            }
            Found::Contact(touch) => Last::Contact(told(touch)),
            Found::Clear(_) => Last::Clear,
            _ => Last::Failed,
        };
        return Searched { grazes, last, evaluations };
    }
}

/// Judges flight number `index`.
pub fn judge(flights: Flights, index: u64) -> Judged {
    judge_flight(index, draw(flights, index))
}

/// Judges any flight.
pub fn judge_flight(index: u64, draw: Draw) -> Judged {
    let motion = FreeMotion::new(&draw.system);
    let span = motion.span();
    let level = rounding::level(&draw.system, &draw.state, draw.kind.touching(), span);
    let dense = DenseFlight::new(&draw.system, &draw.state, draw.kind.touching(), span);
    let judge = Judge::new(dense, level, span);
    let searched = search(&draw, &motion);
    let (outcome, errors, grazes) = judge.judge(&searched);
    let found = match (searched.grazes.first(), &searched.last) {
        (Some(_), _) => "graze".into(),
        (None, Last::Contact(told)) => format!("{:?}", told.time[0] + told.time[1]),
        (None, Last::Clear) => "none".into(),
        _ => "failed".into(),
    };
    let (evaluations, samples) = (searched.evaluations, judge.seen.samples);
    Judged { index, draw, outcome, errors, grazes, evaluations, span, found, samples }
}

/// Judges flights 0 ... `count` - 1 and keeps the rows of all disagreements and of about `rows`
/// others.
pub fn audit(flights: Flights, count: u64, rows: u64) -> Tally {
    let every = if rows == 0 { u64::MAX } else { count.div_ceil(rows) };
    (0..count)
        .into_par_iter()
        .fold(Tally::default, |mut tally, index| {
            tally.add(&judge(flights, index), every);
            tally
        })
        .reduce(Tally::default, Tally::merge)
}
