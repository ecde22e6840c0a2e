//! Counts and worst cases of an audit, and its rows for the ball-arithmetic referee
//! (tests/reference/certify.py).

use std::fmt;

use super::draw::Kind;
use super::{Judged, Outcome};

/// Columns of the rows.
pub const HEADER: &str = "id,mbar,omega0,r,delta,zeta1,zeta2,f1,f2,c1,c2,omega,mu,contact,touching,\
                          x1,v1,x2,v2,phase0,t_end,found";

/// Decades of the histogram of time errors: up to 1, 10, 100, 1000 units, and beyond.
const DECADES: usize = 5;

/// A largest value and the flight it belongs to.
#[derive(Debug, Clone, Copy, Default)]
pub struct Worst {
    pub value: f64,
    pub index: u64,
}

impl Worst {
    fn see(&mut self, value: f64, index: u64) {
        let value = if value.is_nan() { f64::INFINITY } else { value };
        if value > self.value {
            *self = Self { value, index };
        }
    }

    fn merge(self, other: Self) -> Self {
        if other.value > self.value || (other.value == self.value && other.index < self.index) {
            other
        } else {
            self
        }
    }
}

impl fmt::Display for Worst {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} (flight {})", self.value, self.index)
    }
}

/// Everything counted.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    pub flights: u64,
    pub contacts: u64,
    pub grazes: u64,
    /// By kind of start and outcome.
    pub counts: [[u64; Outcome::ALL.len()]; Kind::ALL.len()],
    pub time_decades: [u64; DECADES],
    pub time: Worst,
    pub gap: Worst,
    pub level: Worst,
    pub displacement: Worst,
    pub velocity: Worst,
    /// Depth below and height above zero of humps told as grazes, in units of e.
    pub graze_below: Worst,
    pub graze_above: Worst,
    pub evaluations: u64,
    pub most_evaluations: Worst,
    pub samples: u64,
    pub disagreements: Vec<(u64, Outcome)>,
    /// Index and text of the rows kept.
    pub rows: Vec<(u64, String)>,
}

impl Tally {
    /// Counts a flight; keeps its row if it disagrees or its number is a multiple of `every`.
    pub fn add(&mut self, judged: &Judged, every: u64) {
        let Judged { index, outcome, .. } = *judged;
        self.flights += 1;
        self.counts[judged.draw.kind as usize][outcome as usize] += 1;
        if let Some(errors) = judged.errors {
            self.contacts += 1;
            let decade =
                [1.0, 10.0, 100.0, 1000.0].iter().filter(|&&top| errors.time > top).count();
            self.time_decades[decade] += 1;
            self.time.see(errors.time, index);
            self.gap.see(errors.gap, index);
            self.level.see(errors.level, index);
            self.displacement.see(errors.displacement, index);
            self.velocity.see(errors.velocity, index);
        }
        if let Some([low, high]) = judged.grazes {
            self.grazes += 1;
            self.graze_below.see(-low, index);
            self.graze_above.see(high, index);
        }
        self.evaluations += judged.evaluations;
        self.most_evaluations.see(judged.evaluations as f64, index);
        self.samples += judged.samples;
        if outcome.is_disagreement() {
            self.disagreements.push((index, outcome));
        }
        if outcome.is_disagreement() || index % every == 0 {
            self.rows.push((index, row(judged)));
        }
    }

    pub fn merge(mut self, other: Self) -> Self {
        self.flights += other.flights;
        self.contacts += other.contacts;
        self.grazes += other.grazes;
        for (mine, theirs) in self.counts.iter_mut().flatten().zip(other.counts.iter().flatten()) {
            *mine += theirs;
        }
        for (mine, theirs) in self.time_decades.iter_mut().zip(other.time_decades) {
            *mine += theirs;
        }
        self.time = self.time.merge(other.time);
        self.gap = self.gap.merge(other.gap);
        self.level = self.level.merge(other.level);
        self.displacement = self.displacement.merge(other.displacement);
        self.velocity = self.velocity.merge(other.velocity);
        self.graze_below = self.graze_below.merge(other.graze_below);
        self.graze_above = self.graze_above.merge(other.graze_above);
        self.evaluations += other.evaluations;
        self.most_evaluations = self.most_evaluations.merge(other.most_evaluations);
        self.samples += other.samples;
        self.disagreements.extend(other.disagreements);
        self.rows.extend(other.rows);
        self.disagreements.sort_unstable();
        self.rows.sort_unstable();
        self
    }

    pub fn count(&self, outcome: Outcome) -> u64 {
        self.counts.iter().map(|row| row[outcome as usize]).sum()
    }
}

fn row(judged: &Judged) -> String {
    let Judged { index, draw, span, found, .. } = judged;
    let (p, s) = (&draw.system, &draw.state);
    let start = [p.mass_ratio(), p.frequency_ratio(), p.restitution(), p.gap()];
    let rest = [
        p.pendulum_damping(),
        p.oscillator_damping(),
        p.moment_amplitude(),
        p.force_amplitude(),
        p.static_moment(),
        p.static_force(),
        p.drive_frequency(),
        p.friction(),
    ];
    let text = |values: &[f64]| {
        values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(",")
    };
    let touching = u8::from(draw.kind.touching());
    format!(
        "{index},{},{},{},{touching},{},{span:?},{found}",
        text(&start),
        text(&rest),
        p.contact().name(),
        text(&[s.x1, s.v1, s.x2, s.v2, p.phase()]),
    )
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:>16}", "start")?;
        for outcome in Outcome::ALL {
            write!(f, "{:>11}", format!("{outcome:?}").to_lowercase())?;
        }
        writeln!(f)?;
        for (kind, counts) in Kind::ALL.iter().zip(&self.counts) {
            write!(f, "{:>16}", format!("{kind:?}"))?;
            for count in counts {
                write!(f, "{count:>11}")?;
            }
            writeln!(f)?;
        }
        write!(f, "{:>16}", "all")?;
        for outcome in Outcome::ALL {
            write!(f, "{:>11}", self.count(outcome))?;
        }
        writeln!(f)?;
        let flights = self.flights.max(1) as f64;
        writeln!(f, "flights {}, with grazes {}", self.flights, self.grazes)?;
        writeln!(f, "contacts compared {}", self.contacts)?;
        writeln!(f, "time error/(eps max(1, t)/min(1, u)): worst {}", self.time)?;
        writeln!(f, "  up to 1, 10, 100, 1000, beyond: {:?}", self.time_decades)?;
        writeln!(f, "|g| found/(eps (|tip| + |x2| + |delta|)): worst {}", self.gap)?;
        writeln!(f, "|g| found/e: worst {}", self.level)?;
        writeln!(f, "displacement error/(eps (size + |x1| + V t)): worst {}", self.displacement)?;
        writeln!(f, "velocity error/(eps V): worst {}", self.velocity)?;
        writeln!(f, "grazes: lowest -{} e, highest {} e", self.graze_below, self.graze_above)?;
        let mean = self.evaluations as f64 / flights;
        writeln!(f, "evaluations: mean {mean:.2}, most {}", self.most_evaluations)?;
        writeln!(f, "dense samples: mean {:.0}", self.samples as f64 / flights)?;
        for (index, outcome) in self.disagreements.iter().take(100) {
            writeln!(f, "flight {index}: {outcome:?}")?;
        }
        Ok(())
    }
}
