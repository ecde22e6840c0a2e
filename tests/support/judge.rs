//! The judgement of one flight by the contact audit (docs/contact-audit.md): what a search tells
//! against what the dense search saw. It knows neither the library nor the machine.

use super::dense::{DenseSearch, ExactMotion, Place, Seen};
use super::double_double::Dd;

const EPS: f64 = f64::EPSILON;
/// The factors of the rounding level, and that up to which a hump is a graze.
const GAP_NOISE: f64 = 4.0;
const FLIGHT_NOISE: f64 = 6.0;
const GRAZE_NOISE: f64 = 4.0;

/// Rounding level e(s) of a flight, as docs/contact-detection.md states it: 4 EPS times the size of
/// the gap's terms at the start, and 6 EPS V s.
#[derive(Debug, Clone, Copy)]
pub struct Level {
    start: f64,
    /// V >= |g'|.
    pub rate_bound: f64,
}

impl Level {
    /// `size`: of the gap's terms at the start; they do not count after an impact.
    pub fn new(size: f64, rate_bound: f64, touching: bool) -> Self {
        let start = if touching { 0.0 } else { GAP_NOISE * EPS * size };
        Self { start, rate_bound }
    }

    /// e(s).
    pub fn at(&self, s: f64) -> f64 {
        self.start + FLIGHT_NOISE * EPS * self.rate_bound * s
    }

    /// A hump of true height within this of zero may be told as a graze, a contact or nothing:
    /// the search decides at GRAZE_NOISE e(s), from a height that is itself wrong by e(s).
    pub fn undecided(&self, s: f64) -> f64 {
        (GRAZE_NOISE + 1.0) * self.at(s)
    }
}

/// A contact or a graze as a search tells it.
#[derive(Debug, Clone, Copy)]
pub struct Told<S> {
    /// The local time, in two parts.
    pub time: [f64; 2],
    pub state: S,
}

/// What a search tells of a flight: the grazes that it has gone past, and how it ended.
#[derive(Debug, Clone)]
pub struct Searched<S> {
    pub grazes: Vec<Told<S>>,
    pub last: Last<S>,
    pub evaluations: u64,
}

/// How a search ended.
#[derive(Debug, Clone, Copy)]
pub enum Last<S> {
    Contact(Told<S>),
    Clear,
    Failed,
}

/// How far a state that a search tells is off.
pub trait Measured: ExactMotion {
    /// The state that comes with a contact.
    type State: Copy;

    /// Size of the gap's terms.
    fn size(&self, point: &Self::Point) -> f64;
    /// The largest errors of displacements and of velocities, and the size of the displacements.
    fn off(&self, point: &Self::Point, told: &Self::State) -> (f64, f64, f64);
}

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
    /// The contact is the right one, but |g| at the instant found exceeds the rounding level.
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

/// A flight with all that the dense search saw.
pub struct Judge<M: ExactMotion> {
    dense: M,
    pub seen: Seen<M::Point>,
    level: Level,
    span: f64,
}

impl<S> Told<S> {
    fn local_time(&self) -> f64 {
        self.time[0] + self.time[1]
    }
}

impl<M: Measured> Judge<M> {
    /// Searches the flight.
    pub fn new(mut dense: M, level: Level, span: f64) -> Self {
        let seen = dense.search(|s| level.undecided(s));
        Self { dense, seen, level, span }
    }

    /// The outcome of a search; errors at its contact; of humps told as grazes the lowest and the
    /// highest height/e.
    pub fn judge(
        &self,
        searched: &Searched<M::State>,
    ) -> (Outcome, Option<Errors>, Option<[f64; 2]>) {
        let (mut outcome, errors) = self.compare(searched);
        let mut grazes: Option<[f64; 2]> = None;
        for told in &searched.grazes {
            if let Some(hump) = self.hump(told.local_time()) {
                let height = hump.gap.value.hi / self.level.at(hump.time.hi);
                let [low, high] = grazes.unwrap_or([height; 2]);
                grazes = Some([low.min(height), high.max(height)]);
            } else {
                // Above the level it is a contact, gone past here; below it nothing.
                let time = told.local_time();
                let past = self.seen.contact.is_some_and(|root| time > root.time.hi);
                let missed = past || self.same_rise(time);
                outcome = if missed { Outcome::Missed } else { Outcome::Spurious };
            }
        }
        (outcome, errors, grazes)
    }

    fn compare(&self, searched: &Searched<M::State>) -> (Outcome, Option<Errors>) {
        let undecided =
            if self.seen.humps.is_empty() { Outcome::Agree } else { Outcome::Undecided };
        match (&searched.last, &self.seen.contact) {
            (Last::Clear, None) => (undecided, None),
            (Last::Clear, Some(contact)) => {
                let depth = (Dd::new(self.span) - contact.time).hi * contact.gap.rate.hi;
                let end = depth <= self.level.undecided(self.span);
                (if end { Outcome::End } else { Outcome::Missed }, None)
            }
            (Last::Contact(told), contact) => {
                let time = told.local_time();
                if let Some(contact) = contact.filter(|_| self.same_rise(time)) {
                    let errors = self.errors(told, &contact);
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

    /// Whether g comes up to zero at the end of the flight, to the level, and a time lies on that
    /// rise.
    fn rises_at_the_end(&self, time: f64) -> bool {
        self.seen.end.is_some_and(|end| {
            let level = self.level.undecided(self.span);
            let left = self.span - time;
            end.gap.hi.abs() <= level && left * end.rate <= 2.0 * level + 4.0 * EPS * self.span
        })
    }

    /// The hump within the level at whose top, or on whose slope within the level, a time lies.
    fn hump(&self, time: f64) -> Option<&Place<M::Point>> {
        self.seen.humps.iter().find(|hump| {
            let width =
                (4.0 * self.level.undecided(hump.time.hi) / hump.gap.second.hi.abs()).sqrt();
            (time - hump.time.hi).abs() <= 2.0 * width
        })
    }

    fn errors(&self, told: &Told<M::State>, root: &Place<M::Point>) -> Errors {
        let found = Dd::sum(told.time[0], told.time[1]);
        let late = found - root.time;
        let point = self.dense.later(&root.point, late);
        let gap = self.dense.gap(&point);
        let (t, u) = (root.time.hi, root.gap.rate.hi);
        let bound = self.level.rate_bound;
        let size = self.dense.size(&point);
        let (displacement, velocity, length) = self.dense.off(&point, &told.state);
        Errors {
            time: late.hi.abs() * u.min(1.0) / (EPS * t.max(1.0)),
            gap: gap.value.hi.abs() / (EPS * size),
            level: gap.value.hi.abs() / self.level.at(t),
            displacement: displacement / (EPS * (size + length + bound * t)),
            velocity: velocity / (EPS * bound),
        }
    }
}
