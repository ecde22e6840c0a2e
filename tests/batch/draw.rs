//! Random systems of every kind, and which of them share a batch.

use std::f64::consts::PI;

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vibroimpact::{Cell, Contact, ImpactLaw, State, System};

/// What is special about a system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    /// Damping 0 ... 0.2: nothing special.
    Usual,
    /// Friction 0.3 ... 2: impacts of every regime.
    Rough,
    /// mbar = 0; the wall is driven, swings freely or rests.
    Wall,
    /// The drive within 1e-9 ... 1e-1 of one of the natural frequencies, or on it.
    Resonant,
    /// Restitution 0 ... 0.3: chatter, slides and sticks.
    Plastic,
    /// Damping up to 1.5, critical or next to it, or a pendulum without a spring.
    Damped,
    /// Neither body is driven.
    Unforced,
    /// omega = 0.
    Constant,
}

pub const DRIVEN: [Family; 7] = [
    Family::Usual,
    Family::Rough,
    Family::Wall,
    Family::Resonant,
    Family::Plastic,
    Family::Damped,
    Family::Unforced,
];

/// How a start lies to the contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    Apart,
    Touching,
    Resting,
    Overlapping,
}

#[derive(Debug, Clone)]
pub struct Job {
    pub family: Family,
    pub place: Place,
    pub cell: Cell,
}

pub struct Drawer(ChaCha8Rng);

impl Drawer {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.0.random_range(from..to)
    }

    pub fn power(&mut self, from: f64, to: f64) -> f64 {
        10f64.powf(self.uniform(from, to))
    }

    pub fn once_in(&mut self, times: u32) -> bool {
        self.0.random_ratio(1, times)
    }

    pub fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.0.random_range(0..all.len())]
    }

    /// 1 up to rounding and beyond: 1e-15 ... 0.1 away.
    pub fn next_to_one(&mut self, least: f64) -> f64 {
        1.0 + self.one_of(&[-1.0, 1.0]) * self.power(least, -1.0)
    }

    pub fn damping(&mut self, family: Family) -> f64 {
        match family {
            Family::Damped => match self.0.random_range(0..5) {
                0 => 1.0,
                1 => self.next_to_one(-15.0),
                _ => self.uniform(0.0, 1.5),
            },
            _ if self.once_in(2) => 0.0,
            _ => self.uniform(0.0, 0.2),
        }
    }

    pub fn job(&mut self, family: Family) -> Job {
        use Family::*;
        let direct = family != Rough && self.once_in(4);
        let frequency_ratio = match family {
            Damped if self.once_in(5) => 0.0,
            _ => self.uniform(0.5, 3.5),
        };
        let drive_frequency = match family {
            Constant => 0.0,
            Resonant => {
                let own = if self.once_in(2) { 1.0 } else { frequency_ratio };
                if self.once_in(6) { own } else { own * self.next_to_one(-9.0) }
            }
            _ => self.uniform(0.4, 4.0),
        };
        let friction = match family {
            _ if direct => 0.0,
            Rough => self.uniform(0.3, 2.0),
            _ if self.once_in(2) => 0.0,
            _ => self.uniform(0.0, 0.5),
        };
        let restitution = match family {
            Plastic if self.once_in(2) => 0.0,
            Plastic => self.uniform(0.0, 0.3),
            _ if self.once_in(8) => 1.0,
            _ => self.uniform(0.3, 1.0),
        };
        let forced = |drawer: &mut Self, most: f64| {
            if family == Unforced { 0.0 } else { drawer.uniform(0.2, most) }
        };
        let moment_amplitude = forced(self, 3.0);
        let shaken = !self.once_in(3);
        let force_amplitude = if shaken { forced(self, 2.0) } else { 0.0 };
        let law = self.one_of(&[
            ImpactLaw::Poisson,
            ImpactLaw::Poisson,
            ImpactLaw::Poisson,
            ImpactLaw::Newton,
            ImpactLaw::Energetic,
            ImpactLaw::Paper,
        ]);
        let system = System::builder()
            .mass_ratio(if family == Wall { 0.0 } else { self.power(-1.0, 0.7) })
            .frequency_ratio(frequency_ratio)
            .restitution(restitution)
            .gap(self.uniform(-0.2, 0.8))
            .drive_frequency(drive_frequency)
            .pendulum_damping(self.damping(family))
            .oscillator_damping(self.damping(family))
            .moment_amplitude(moment_amplitude)
            .force_amplitude(force_amplitude)
            .friction(friction)
            .phase(self.uniform(-PI, PI))
            .contact(if direct { Contact::Direct } else { Contact::Oblique })
            .law(law)
            .build()
            .unwrap();
        let place = match self.0.random_range(0..20) {
            0 => Place::Overlapping,
            1..4 => Place::Touching,
            4 => Place::Resting,
            _ => Place::Apart,
        };
        let (x1, v1) = (self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0));
        let (tip, slope) = if direct { (x1, 1.0) } else { (x1.sin(), x1.cos()) };
        let apart = match place {
            Place::Apart => self.uniform(1e-3, 1.0),
            Place::Overlapping => -self.uniform(1e-3, 1.0),
            _ => 0.0,
        };
        let still = family == Wall && !shaken && self.once_in(2);
        let (system, x2) = if still && place != Place::Overlapping {
            // The wall rests at 0, and the gap is what is left to it.
            (system.with("gap", tip + apart).unwrap(), 0.0)
        } else {
            let x2 = tip - system.gap() + apart;
            (system, x2)
        };
        let v2 = match place {
            Place::Resting => v1 * slope,
            _ if still => 0.0,
            _ => self.uniform(-1.0, 1.0),
        };
        let initial = State::new(x1, v1, x2, v2).unwrap();
        Job { family, place, cell: Cell { system, initial } }
    }

    pub fn jobs(&mut self, families: &[Family], count: usize) -> Vec<Job> {
        (0..count).map(|i| self.job(families[i % families.len()])).collect()
    }

    /// `jobs`, by their numbers, in batches of 1 ... 40.
    pub fn batches(&mut self, jobs: usize) -> Vec<Vec<usize>> {
        let mut order: Vec<usize> = (0..jobs).collect();
        order.shuffle(&mut self.0);
        let (mut batches, mut left) = (Vec::new(), &order[..]);
        while !left.is_empty() {
            let (batch, rest) = left.split_at(self.0.random_range(1..=40).min(left.len()));
            batches.push(batch.to_vec());
            left = rest;
        }
        batches
    }
}
