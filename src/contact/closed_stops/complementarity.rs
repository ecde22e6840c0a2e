//! The linear complementarity problem of frictionless stops, by an active set as for non-negative
//! least squares (Lawson & Hanson, *Solving Least Squares Problems*, chapter 23), in the form of
//! its normal equations. Stops whose normals depend on those already pressed take over from one of
//! them.

use super::{Fate, LEFT};
use crate::model::structure::Structure;
use crate::numerics::dense::{DEPENDENT, Matrix, dot};
use crate::numerics::double_double::DoubleDouble;
use crate::search::first_contact::Start;

/// Exchanges per stop before the search is given up; two or three are usual.
const MOST_EXCHANGES: usize = 50;

/// What is known of a stop.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Known {
    /// It is pressed: its force, of order 0, is positive.
    Pressed,
    Undecided,
    /// It is left, by the second derivative of its gap plus this.
    Left(usize),
}

pub(super) struct Complementarity {
    /// W.
    gram: Matrix,
    known: Vec<Known>,
    /// Of the order decided last, and those by which stops are pressed.
    forces: Vec<f64>,
    pressure: Vec<f64>,
}

impl Complementarity {
    pub fn new(structure: &Structure, stops: &[usize]) -> Self {
        let normal = |i: usize| &structure.contact(stops[i]).modal_normal;
        let count = stops.len();
        Self {
            gram: Matrix::from_fn(count, count, |i, j| dot(normal(i), normal(j))),
            known: vec![Known::Undecided; count],
            forces: vec![0.0; count],
            pressure: vec![0.0; count],
        }
    }

    /// Forces of the order decided last.
    pub fn forces(&self) -> Vec<f64> {
        self.forces.clone()
    }

    pub fn is_decided(&self) -> bool {
        !self.known.contains(&Known::Undecided)
    }

    pub fn fates(&self) -> Vec<Fate> {
        let fate = |known: &Known| match known {
            Known::Pressed => Fate::Pressed,
            Known::Undecided => Fate::Idle,
            Known::Left(0) => Fate::Leaves(LEFT),
            Known::Left(_) => Fate::Leaves(Start::Released),
        };
        self.known.iter().map(fate).collect()
    }

    /// The forces of one order, from the free accelerations of the gaps with their rounding; and
    /// what that decides. `None`: no forces keep the gaps from closing.
    pub fn decide(&mut self, order: usize, gammas: &[(f64, f64)]) -> Option<()> {
        let count = self.known.len();
        let is_pressed = |known: &[Known], i: usize| known[i] == Known::Pressed;
        let mut passive: Vec<usize> = (0..count).filter(|&i| is_pressed(&self.known, i)).collect();
        self.forces = vec![0.0; count];
        self.set(&passive, &self.solved(&passive, gammas)?);
        for _ in 0..MOST_EXCHANGES * count.max(1) {
            // The gap that closes most, over its rounding and its own mobility.
            let closing = |i: usize| {
                let (rate, noise) = (self.remaining(i, gammas), gammas[i].1);
                (rate > noise).then(|| rate / self.gram[(i, i)].hi.sqrt())
            };
            let next = (0..count)
                .filter(|i| self.known[*i] == Known::Undecided && !passive.contains(i))
                .filter_map(|i| Some((i, closing(i)?)))
                .max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((next, _)) = next else {
                self.classify(order, &passive, gammas);
                return Some(());
            };
            if let Some(parts) = self.combination(&passive, next) {
                self.take_over(order, &mut passive, next, &parts)?;
            } else {
                passive.push(next);
            }
            self.settle(&mut passive, gammas)?;
        }
        None
    }

    /// What is left of a gap's acceleration.
    fn remaining(&self, i: usize, gammas: &[(f64, f64)]) -> f64 {
        let pushed = (0..self.forces.len()).fold(DoubleDouble::new(gammas[i].0), |sum, j| {
            sum - self.gram[(i, j)].scale(self.forces[j])
        });
        pushed.value()
    }

    /// Forces that leave the gaps of these stops no acceleration.
    fn solved(&self, passive: &[usize], gammas: &[(f64, f64)]) -> Option<Vec<f64>> {
        let right =
            Matrix::from_fn(passive.len(), 1, |i, _| DoubleDouble::new(gammas[passive[i]].0));
        let forces = self.gram_of(passive).solve(&right)?;
        Some((0..passive.len()).map(|i| forces[(i, 0)].value()).collect())
    }

    fn gram_of(&self, passive: &[usize]) -> Matrix {
        let count = passive.len();
        Matrix::from_fn(count, count, |i, j| self.gram[(passive[i], passive[j])])
    }

    fn set(&mut self, passive: &[usize], forces: &[f64]) {
        self.forces.fill(0.0);
        for (&i, &force) in passive.iter().zip(forces) {
            self.forces[i] = force;
        }
    }

    /// Steps towards the forces that hold all passive stops, as far as none pulls.
    fn settle(&mut self, passive: &mut Vec<usize>, gammas: &[(f64, f64)]) -> Option<()> {
        loop {
            let wanted = self.solved(passive, gammas)?;
            let blocks = passive
                .iter()
                .zip(&wanted)
                .filter(|&(&i, &force)| self.known[i] != Known::Pressed && force <= 0.0)
                .map(|(&i, &force)| (i, self.forces[i] / (self.forces[i] - force)))
                .min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((first, part)) = blocks else {
                self.set(passive, &wanted);
                return Some(());
            };
            let part = if part.is_finite() { part } else { 0.0 };
            for (&i, force) in passive.iter().zip(&wanted) {
                self.forces[i] += part * (force - self.forces[i]);
            }
            self.forces[first] = 0.0;
            passive.retain(|&i| i != first);
        }
    }

    /// The parts of passive normals of which a stop's is made, if it is.
    fn combination(&self, passive: &[usize], stop: usize) -> Option<Vec<f64>> {
        let right = Matrix::from_fn(passive.len(), 1, |i, _| self.gram[(passive[i], stop)]);
        let parts = self.gram_of(passive).solve(&right)?;
        let own = self.gram[(stop, stop)];
        let left = (0..passive.len()).fold(own, |left, i| left - right[(i, 0)] * parts[(i, 0)]);
        let depends = left.hi <= DEPENDENT * DEPENDENT * own.hi;
        depends.then(|| (0..passive.len()).map(|i| parts[(i, 0)].value()).collect())
    }

    /// A stop that closes in although its normal is made of passive ones: its force grows at the
    /// cost of theirs until one of those is gone. `None`: none is, and they jam.
    fn take_over(
        &mut self,
        order: usize,
        passive: &mut [usize],
        stop: usize,
        parts: &[f64],
    ) -> Option<()> {
        let (place, part) = passive
            .iter()
            .zip(parts)
            .enumerate()
            .filter(|&(_, (_, &part))| part > DEPENDENT)
            .map(|(place, (&i, part))| {
                // What is pressed has a force of order 0 to give, more than any of a higher order.
                let pressed = self.known[i] == Known::Pressed;
                (place, pressed, if pressed { self.pressure[i] } else { self.forces[i] } / part)
            })
            .min_by(|a, b| (a.1, a.2).partial_cmp(&(b.1, b.2)).unwrap_or(std::cmp::Ordering::Equal))
            .map(|(place, pressed, part)| (place, (pressed, part)))?;
        let gone = passive[place];
        let (pressed, part) = part;
        if pressed && order > 0 {
            for (&i, share) in passive.iter().zip(parts) {
                self.pressure[i] -= part * share;
            }
            (self.pressure[gone], self.pressure[stop]) = (0.0, part);
            (self.known[gone], self.known[stop]) = (Known::Undecided, Known::Pressed);
            self.forces[stop] = 0.0;
        } else {
            for (&i, share) in passive.iter().zip(parts) {
                self.forces[i] -= part * share;
            }
            self.forces[stop] = part;
        }
        self.forces[gone] = 0.0;
        passive[place] = stop;
        Some(())
    }

    fn classify(&mut self, order: usize, passive: &[usize], gammas: &[(f64, f64)]) {
        for i in 0..self.known.len() {
            if self.known[i] != Known::Undecided {
                continue;
            }
            let noise = gammas[i].1;
            let remaining = self.remaining(i, gammas);
            let force = self.forces[i];
            if passive.contains(&i) {
                if force * self.gram[(i, i)].hi > noise {
                    (self.known[i], self.pressure[i]) = (Known::Pressed, force);
                }
            } else if remaining < -noise {
                self.known[i] = Known::Left(order);
            }
        }
    }
}
