//! A linear structure with closed stops in double-double, from its definition: Taylor series of the
//! equations of motion in its own coordinates, with the forces as unknowns of each order,
//!
//! > M a + D lambda = f - K q - C v,   R a = rho''
//!
//! It knows no modes and no projection, and shares no code with the library.

use super::double_double::Dd;

/// Order of the series; steps are short.
const ORDER: usize = 44;

/// A constraint: its row r . q = gap + cos part of the motion, and the direction of its force.
#[derive(Debug, Clone)]
pub struct Constraint {
    pub row: Vec<f64>,
    pub direction: Vec<Dd>,
    /// Amplitude, and phase ahead of the drive's.
    pub amplitude: f64,
    pub ahead: [f64; 2],
}

#[derive(Debug, Clone)]
pub struct Constrained {
    count: usize,
    stiffness: Vec<Vec<Dd>>,
    damping: Vec<Vec<Dd>>,
    load: Vec<Dd>,
    drive: [Vec<Dd>; 2],
    frequency: Dd,
    constraints: Vec<Constraint>,
    /// Of M and the constraints.
    inverse: Vec<Vec<Dd>>,
}

/// q, v and the phase of the drive.
#[derive(Debug, Clone)]
pub struct Point {
    pub q: Vec<Dd>,
    pub v: Vec<Dd>,
    pub cos: Dd,
    pub sin: Dd,
}

fn dd(of: &[f64]) -> Vec<Dd> {
    of.iter().map(|&x| Dd::new(x)).collect()
}

fn dot(a: &[Dd], b: &[Dd]) -> Dd {
    a.iter().zip(b).fold(Dd::ZERO, |sum, (&a, &b)| sum + a * b)
}

fn inverse(mut a: Vec<Vec<Dd>>) -> Vec<Vec<Dd>> {
    let count = a.len();
    for (i, row) in a.iter_mut().enumerate() {
        row.extend((0..count).map(|j| if i == j { Dd::ONE } else { Dd::ZERO }));
    }
    for p in 0..count {
        let best = (p..count).max_by(|&i, &j| a[i][p].hi.abs().total_cmp(&a[j][p].hi.abs()));
        a.swap(p, best.unwrap());
        let pivot = a[p][p];
        for entry in &mut a[p] {
            *entry = entry.divide(pivot);
        }
        let row = a[p].clone();
        for (i, other) in a.iter_mut().enumerate().filter(|(i, _)| *i != p) {
            let factor = other[p];
            for (entry, &of) in other.iter_mut().zip(&row) {
                *entry = *entry - factor * of;
            }
            debug_assert!(i < count);
        }
    }
    a.into_iter().map(|row| row[count..].to_vec()).collect()
}

impl Constrained {
    /// From M, K, C, the load, both parts of the drive's amplitude and its frequency.
    pub fn new(
        [mass, stiffness, damping]: [&[Vec<f64>]; 3],
        load: &[f64],
        drive: [&[f64]; 2],
        frequency: f64,
        constraints: Vec<Constraint>,
    ) -> Self {
        let count = mass.len();
        let mut all: Vec<Vec<Dd>> = mass.iter().map(|row| dd(row)).collect();
        for (i, row) in all.iter_mut().enumerate() {
            row.extend(constraints.iter().map(|c| c.direction[i]));
        }
        for constraint in &constraints {
            let mut row = dd(&constraint.row);
            row.extend(constraints.iter().map(|_| Dd::ZERO));
            all.push(row);
        }
        let of = |matrix: &[Vec<f64>]| matrix.iter().map(|row| dd(row)).collect();
        Self {
            count,
            stiffness: of(stiffness),
            damping: of(damping),
            load: dd(load),
            drive: drive.map(dd),
            frequency: Dd::new(frequency),
            constraints,
            inverse: inverse(all),
        }
    }

    /// Order k of the accelerations and of the forces.
    fn solved(&self, k: usize, q: &[Dd], v: &[Dd], cos: Dd, sin: Dd) -> Vec<Dd> {
        let mut right: Vec<Dd> = (0..self.count)
            .map(|i| {
                let load = if k == 0 { self.load[i] } else { Dd::ZERO };
                load + self.drive[0][i] * cos
                    - self.drive[1][i] * sin
                    - dot(&self.stiffness[i], q)
                    - dot(&self.damping[i], v)
            })
            .collect();
        let square = self.frequency * self.frequency;
        right.extend(self.constraints.iter().map(|c| {
            let [ahead_cos, ahead_sin] = c.ahead.map(Dd::new);
            -(square * Dd::new(c.amplitude) * (ahead_cos * cos - ahead_sin * sin))
        }));
        self.inverse.iter().map(|row| dot(row, &right)).collect()
    }

    /// Forces along the directions.
    pub fn forces(&self, Point { q, v, cos, sin }: &Point) -> Vec<Dd> {
        self.solved(0, q, v, *cos, *sin)[self.count..].to_vec()
    }

    pub fn later(&self, point: &Point, h: Dd) -> Point {
        let (mut place, mut rate) = (point.q.clone(), point.v.clone());
        let (mut cos, mut sin) = (point.cos, point.sin);
        let mut sum = point.clone();
        let mut power = Dd::ONE;
        for k in 0..ORDER {
            let order = (k + 1) as f64;
            let solved = self.solved(k, &place, &rate, cos, sin);
            let turn = self.frequency.over(order);
            power = power * h;
            place = rate.iter().map(|v| v.over(order)).collect();
            rate = solved[..self.count].iter().map(|a| a.over(order)).collect();
            (cos, sin) = (-(turn * sin), turn * cos);
            for i in 0..self.count {
                sum.q[i] = sum.q[i] + place[i] * power;
                sum.v[i] = sum.v[i] + rate[i] * power;
            }
            (sum.cos, sum.sin) = (sum.cos + cos * power, sum.sin + sin * power);
        }
        sum
    }
}
