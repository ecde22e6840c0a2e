//! Motion at equal steps by multiplication alone: between contacts the equations are linear, so the
//! states at the times h ... 8h after any instant are a table, worked out once per system and step
//! length, times the state and forcing phase at that instant. No sine of time is evaluated.

#![allow(clippy::inline_always)] // all of a scan must be compiled with the same instructions
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

use std::sync::OnceLock;

use super::drive::{Drive, Trig, Turn};
use super::oscillator::Oscillator;
use crate::numerics::lanes::{LANES, Lanes};
use crate::search::steps::{LEVELS, Weights};
use crate::search::tolerances::SCAN_STEPS;

/// State of both bodies and the forcing phase at one instant.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Point {
    pub x1: f64,
    pub v1: f64,
    pub x2: f64,
    pub v2: f64,
    pub psi: Trig,
}

/// Motion of one body as a function of its state and of the forcing phase: linear, and a constant of
/// a loaded body.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Response {
    x_of_x: Lanes,
    x_of_v: Lanes,
    v_of_x: Lanes,
    v_of_v: Lanes,
    /// Displacement and rate per cos psi, and per sin psi, of a forced body.
    x_of_cos: Lanes,
    v_of_cos: Lanes,
    x_of_sin: Lanes,
    v_of_sin: Lanes,
    /// Displacement and rate of a loaded body from rest.
    x_from_rest: Lanes,
    v_from_rest: Lanes,
}

/// Whether a body is driven, and whether it has a constant load.
#[derive(Debug, Clone, Copy)]
pub(super) struct Loads {
    driven: bool,
    constant: bool,
}

impl Loads {
    pub fn of(body: &Oscillator) -> Self {
        Self { driven: body.is_forced(), constant: body.has_constant() }
    }
}

/// The table of one step length h. No lanes of it lie on two cache lines.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct Table {
    pendulum: Response,
    oscillator: Response,
    /// cos(omega j h) and sin(omega j h).
    cos: Lanes,
    sin: Lanes,
    pub weights: Weights,
    /// What moves pendulum and oscillator.
    loads: [Loads; 2],
}

/// States of both bodies and the forcing phase at h ... 8h.
#[derive(Debug, Clone, Default)]
#[repr(align(64))]
pub(crate) struct States {
    pub x1: Lanes,
    pub v1: Lanes,
    pub x2: Lanes,
    pub v2: Lanes,
    pub cos_psi: Lanes,
    pub sin_psi: Lanes,
}

/// Tables of all step lengths, each made when it is first asked for.
#[derive(Debug, Clone)]
pub(crate) struct Tables {
    /// Step lengths.
    pub steps: [f64; LEVELS],
    tables: [OnceLock<Box<Table>>; LEVELS],
}

impl Tables {
    /// For local flights of this length.
    pub fn new(span: f64) -> Self {
        let first = SCAN_STEPS * span;
        let steps = std::array::from_fn(|level| first / (LANES << level) as f64);
        Self { steps, tables: std::array::from_fn(|_| OnceLock::new()) }
    }

    /// The table of a level, its step being `step`.
    #[inline(always)]
    pub fn get(&self, level: usize, make: impl FnOnce() -> Table) -> &Table {
        self.tables[level].get_or_init(|| Box::new(make()))
    }
}

impl Table {
    pub fn new(step: f64, drive: &Drive, pendulum: &Oscillator, oscillator: &Oscillator) -> Self {
        let times = std::array::from_fn(|j| step * (j + 1) as f64);
        let turns = times.map(|s| drive.turned(Trig::ONE, s));
        Self {
            weights: Weights::new(step),
            pendulum: Response::new(pendulum, &times, &turns),
            oscillator: Response::new(oscillator, &times, &turns),
            cos: turns.map(|turn| turn.phase.cos),
            sin: turns.map(|turn| turn.phase.sin),
            loads: [Loads::of(pendulum), Loads::of(oscillator)],
        }
    }

    #[inline(always)]
    pub fn states(&self, from: &Point) -> States {
        let (x1, v1) = self.pendulum.motion(from.x1, from.v1, from.psi, self.loads[0]);
        let (x2, v2) = self.oscillator.motion(from.x2, from.v2, from.psi, self.loads[1]);
        let Trig { cos, sin } = from.psi;
        let (mut cos_psi, mut sin_psi) = ([0.0; LANES], [0.0; LANES]);
        for j in 0..LANES {
            cos_psi[j] = cos.mul_add(self.cos[j], -(sin * self.sin[j]));
            sin_psi[j] = sin.mul_add(self.cos[j], cos * self.sin[j]);
        }
        States { x1, v1, x2, v2, cos_psi, sin_psi }
    }
}

impl States {
    /// The point `j + 1` steps on.
    #[inline(always)]
    pub fn point(&self, j: usize) -> Point {
        let psi = Trig { cos: self.cos_psi[j], sin: self.sin_psi[j] };
        Point { x1: self.x1[j], v1: self.v1[j], x2: self.x2[j], v2: self.v2[j], psi }
    }
}

impl Response {
    /// `turns`: of the forcing, from the phase 0 on.
    pub fn new(body: &Oscillator, times: &Lanes, turns: &[Turn; LANES]) -> Self {
        let bases = times.map(|s| body.basis(s));
        let free = bases.map(|basis| body.equation.transition_by(basis));
        let response = |body: &Oscillator, start: Trig| {
            let from_rest = body.flight(0.0, 0.0, start);
            let motions: [_; LANES] = std::array::from_fn(|j| {
                let turn = Turn::new(start, turns[j].cos_minus_1, turns[j].sin);
                body.at_basis(&from_rest, times[j], bases[j], &turn)
            });
            [motions.map(|m| m.increment), motions.map(|m| m.rate)]
        };
        let none = [[0.0; LANES]; 2];
        let [[x_of_cos, v_of_cos], [x_of_sin, v_of_sin]] = if body.is_forced() {
            let starts = [Trig::ONE, Trig { cos: 0.0, sin: 1.0 }];
            body.without_constant(|driven| starts.map(|start| response(driven, start)))
        } else {
            [none; 2]
        };
        let [x_from_rest, v_from_rest] =
            if body.has_constant() { response(&body.without_drive(), Trig::ONE) } else { none };
        Self {
            x_of_x: free.map(|t| t[0][0]),
            x_of_v: free.map(|t| t[0][1]),
            v_of_x: free.map(|t| t[1][0]),
            v_of_v: free.map(|t| t[1][1]),
            x_of_cos,
            v_of_cos,
            x_of_sin,
            v_of_sin,
            x_from_rest,
            v_from_rest,
        }
    }

    /// Displacements and rates per x, x', cos psi and sin psi, and those of a loaded body from rest.
    pub fn parts(&self) -> [(&Lanes, &Lanes); 5] {
        [
            (&self.x_of_x, &self.v_of_x),
            (&self.x_of_v, &self.v_of_v),
            (&self.x_of_cos, &self.v_of_cos),
            (&self.x_of_sin, &self.v_of_sin),
            (&self.x_from_rest, &self.v_from_rest),
        ]
    }

    #[inline(always)]
    pub fn motion(&self, x: f64, v: f64, psi: Trig, loads: Loads) -> (Lanes, Lanes) {
        let (mut xs, mut vs) = ([0.0; LANES], [0.0; LANES]);
        for j in 0..LANES {
            xs[j] = self.x_of_x[j].mul_add(x, self.x_of_v[j] * v);
            vs[j] = self.v_of_x[j].mul_add(x, self.v_of_v[j] * v);
        }
        if loads.constant {
            for j in 0..LANES {
                xs[j] += self.x_from_rest[j];
                vs[j] += self.v_from_rest[j];
            }
        }
        if loads.driven {
            let Trig { cos, sin } = psi;
            for j in 0..LANES {
                xs[j] = self.x_of_cos[j].mul_add(cos, self.x_of_sin[j].mul_add(sin, xs[j]));
                vs[j] = self.v_of_cos[j].mul_add(cos, self.v_of_sin[j].mul_add(sin, vs[j]));
            }
        }
        (xs, vs)
    }
}
