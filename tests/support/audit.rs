//! The contact audit: random flights searched by the library and, independently, by dense sampling
//! in double-double arithmetic, and the two outcomes compared (docs/contact-audit.md).

pub mod dense;
pub mod double_double;
mod draw;
pub mod exact_motion;
pub mod rounding;
mod tally;

use dense::{Place, Seen};
use double_double::Dd;
#[allow(unused_imports)] // each test its own
pub use draw::{Draw, Kind, draw};
use exact_motion::DenseFlight;
use rayon::prelude::*;
use rounding::Level;
use vibroimpact::{Clock, Found, FreeMotion, Start, Touch, next_contact};

const EPS: f64 = f64::EPSILON;

#[allow(unused_imports)]
pub use tally::{HEADER, Tally};

/// Judgement of one flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// Same first contact, or none.
    Agree,
    /// A hump within the rounding level decides; told as graze or contact, or passed over.
    Undecided,
    /// A contact within rounding of the end of the flight.
    End,
    /// A contact was passed over, or taken for a graze.
    Missed,
    /// A contact or graze where there is none.
    Spurious,
    /// The same contact, but |g| at the instant found exceeds the rounding level.
    Inaccurate,
    /// The search gave no answer.
    Failed,
}

impl Outcome {
    pub const ALL: [Self; 7] = [
        Self::Agree,
        Self::Undecided,
        Self::End,
        Self::Missed,
        Self::Spurious,
        Self::Inaccurate,
        Self::Failed,
    ];

    pub fn is_disagreement(self) -> bool {
        self > Self::End
    }
}

/// Errors at a contact that both searches found.
#[derive(Debug, Clone, Copy)]
pub struct Errors {
    /// Of the time, in units of eps max(1, t)/min(1, u).
    pub time: f64,
    /// |g| at the instant found, in units of eps (|tip| + |x2| + |delta|) there.
    pub gap: f64,
    /// |g| there, in units of the stated rounding level e.
    pub level: f64,
    /// Of displacements and of velocities at the instant found, in units of
    /// eps (|tip| + |x2| + |delta| + |x1| + V t) and eps V, V the bound of |g'|.
    pub displacement: f64,
    pub velocity: f64,
}

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

/// What the library's search reports, followed past grazes.
struct Searched {
    grazes: Vec<Touch>,
    last: Found,
    evaluations: u64,
}

fn search(draw: &Draw, motion: &FreeMotion) -> Searched {
    let flight = motion.flight(Clock::START, draw.state);
    let mut start = if draw.kind.touching() { Start::Touching } else { Start::Apart };
    let (mut grazes, mut evaluations) = (Vec::new(), 0);
    loop {
        let report = next_contact(motion, &flight, start, motion.span());
        evaluations += report.evaluations;
        match report.found {
            Found::Graze(touch) if grazes.len() < 100 => {
                grazes.push(touch);
                start = Start::Grazed(touch.time);
            }
            last => return Searched { grazes, last, evaluations },
        }
    }
}

/// Judges flight number `index` of a seed.
pub fn judge(seed: u64, index: u64) -> Judged {
    judge_flight(index, draw(seed, index))
}

/// Judges any flight.
pub fn judge_flight(index: u64, draw: Draw) -> Judged {
    let motion = FreeMotion::new(&draw.system);
    let span = motion.span();
    let level = Level::new(&draw.system, &draw.state, draw.kind.touching(), span);
    let mut dense = DenseFlight::new(&draw.system, &draw.state, draw.kind.touching(), span);
    let seen = dense.search(|s| level.undecided(s));
    let searched = search(&draw, &motion);
    let judge = Judge { dense, seen, level, span };
    let (mut outcome, errors) = judge.compare(&searched);
    let mut grazes: Option<[f64; 2]> = None;
    for touch in &searched.grazes {
        match judge.hump(touch.local_time()) {
            Some(hump) => {
                let height = hump.gap.value.hi / level.at(hump.time.hi);
                let [low, high] = grazes.unwrap_or([height; 2]);
                grazes = Some([low.min(height), high.max(height)]);
            }
            // Above the level it is a contact, below it nothing.
            None => {
                let missed = judge.same_rise(touch.local_time());
                outcome = if missed { Outcome::Missed } else { Outcome::Spurious };
            }
        }
    }
    let found = match (searched.grazes.first(), &searched.last) {
        (Some(_), _) => "graze".into(),
        (None, Found::Contact(touch)) => format!("{:?}", touch.local_time()),
        (None, Found::Clear(_)) => "none".into(),
        _ => "failed".into(),
    };
    let (evaluations, samples) = (searched.evaluations, judge.seen.samples);
    Judged { index, draw, outcome, errors, grazes, evaluations, span, found, samples }
}

struct Judge {
    dense: DenseFlight,
    seen: Seen,
    level: Level,
    span: f64,
}

impl Judge {
    fn compare(&self, searched: &Searched) -> (Outcome, Option<Errors>) {
        let undecided =
            if self.seen.humps.is_empty() { Outcome::Agree } else { Outcome::Undecided };
        match (&searched.last, &self.seen.contact) {
            (Found::Clear(_), None) => (undecided, None),
            (Found::Clear(_), Some(contact)) => {
                let depth = (Dd::new(self.span) - contact.time).hi * contact.gap.rate.hi;
                let end = depth <= self.level.undecided(self.span);
                (if end { Outcome::End } else { Outcome::Missed }, None)
            }
            (Found::Contact(touch), contact) => {
                let time = touch.local_time();
                if let Some(contact) = contact.filter(|_| self.same_rise(time)) {
                    let errors = self.errors(touch, &contact);
                    let exact = errors.level <= 1.0;
                    return (if exact { undecided } else { Outcome::Inaccurate }, Some(errors));
                }
                if self.hump(time).is_some() {
                    return (Outcome::Undecided, None);
                }
                let outcome = match contact {
                    Some(contact) if time > contact.time.hi => Outcome::Missed,
                    None if self.rises_at_the_end(time) => Outcome::End,
                    _ => Outcome::Spurious,
                };
                (outcome, None)
            }
            _ => (Outcome::Failed, None),
        }
    }

    /// Whether a time lies on the rise through zero of the contact, or on the part of its hump
    /// next to it: as far from the root as a parabola through it is within the level twice over.
    fn same_rise(&self, time: f64) -> bool {
        self.seen.contact.is_some_and(|root| {
            let u = root.gap.rate.hi;
            let reach = self.level.undecided(root.time.hi) / u;
            (time - root.time.hi).abs() <= 2.0 * reach + 4.0 * EPS * time
        })
    }

    /// Whether g comes up to zero at the end of the flight, to the level, and a time lies on that rise.
    fn rises_at_the_end(&self, time: f64) -> bool {
        self.seen.end.is_some_and(|end| {
            let level = self.level.undecided(self.span);
            let left = self.span - time;
            end.gap.hi.abs() <= level && left * end.rate <= 2.0 * level + 4.0 * EPS * self.span
        })
    }

    /// The hump within the level at whose top, or on whose slope within the level, a time lies.
    fn hump(&self, time: f64) -> Option<&Place> {
        self.seen.humps.iter().find(|hump| {
            let width =
                (4.0 * self.level.undecided(hump.time.hi) / hump.gap.second.hi.abs()).sqrt();
            (time - hump.time.hi).abs() <= 2.0 * width
        })
    }

    fn errors(&self, touch: &Touch, root: &Place) -> Errors {
        let found = Dd::sum(touch.time, touch.offset);
        let late = found - root.time;
        let point = self.dense.later(&root.point, late);
        let gap = self.dense.gap(&point);
        let (t, u) = (root.time.hi, root.gap.rate.hi);
        let bound = self.level.rate_bound;
        let worst = |errors: [f64; 2]| errors[0].max(errors[1]);
        let off = |exact: Dd, found: f64| (exact - Dd::new(found)).hi.abs();
        let (state, size) = (touch.state, self.dense.size(&point));
        let length = size + point.x[0].hi.abs() + bound * t;
        Errors {
            time: late.hi.abs() * u.min(1.0) / (EPS * t.max(1.0)),
            gap: gap.value.hi.abs() / (EPS * size),
            level: gap.value.hi.abs() / self.level.at(t),
            displacement: worst([off(point.x[0], state.x1), off(point.x[1], state.x2)])
                / (EPS * length),
            velocity: worst([off(point.v[0], state.v1), off(point.v[1], state.v2)]) / (EPS * bound),
        }
    }
}

/// Judges flights 0 ... `flights` - 1 of a seed and keeps the rows of all disagreements and of
/// about `rows` others.
pub fn audit(seed: u64, flights: u64, rows: u64) -> Tally {
    let every = if rows == 0 { u64::MAX } else { flights.div_ceil(rows) };
    (0..flights)
        .into_par_iter()
        .fold(Tally::default, |mut tally, index| {
            tally.add(&judge(seed, index), every);
            tally
        })
        .reduce(Tally::default, Tally::merge)
}
