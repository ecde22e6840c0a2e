//! Motion at equal steps by multiplication alone: between contacts the equations are linear, so the
//! states at the times h ... 8h after any instant are a table, worked out once per system and step
//! length, times the state and forcing phase at that instant. No sine of time is evaluated.

#![allow(clippy::inline_always)] // all of a scan must be compiled with the same instructions
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

use std::sync::OnceLock;

use super::drive::{Drive, Trig};
use super::oscillator::Oscillator;
use crate::lanes::{LANES, Lanes};

/// Step lengths, each half the one before; the first is an eighth of a local flight.
pub(crate) const LEVELS: usize = 12;

/// State of both bodies and the forcing phase at one instant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point {
    pub x1: f64,
    pub v1: f64,
    pub x2: f64,
    pub v2: f64,
    pub psi: Trig,
}

/// Motion of one body as a linear function of its state and of the forcing phase.
#[derive(Debug, Clone)]
struct Response {
    x_of_x: Lanes,
    x_of_v: Lanes,
    v_of_x: Lanes,
    v_of_v: Lanes,
    /// Displacement and rate per cos psi, and per sin psi.
    forced: Option<[[Lanes; 2]; 2]>,
}

/// The table of one step length h.
#[derive(Debug, Clone)]
pub(crate) struct Table {
    pub step: f64,
    pendulum: Response,
    oscillator: Response,
    /// cos(omega j h) and sin(omega j h).
    cos: Lanes,
    sin: Lanes,
}

/// States of both bodies and cos psi at h ... 8h.
pub(crate) struct States {
    pub x1: Lanes,
    pub v1: Lanes,
    pub x2: Lanes,
    pub v2: Lanes,
    pub cos_psi: Lanes,
}

/// Tables of all step lengths, each made when it is first asked for.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tables([OnceLock<Box<Table>>; LEVELS]);

impl Tables {
    /// The table of a level, its step being `step`.
    #[inline(always)]
    pub fn get(&self, level: usize, make: impl FnOnce() -> Table) -> &Table {
        self.0[level].get_or_init(|| Box::new(make()))
    }
}

impl Table {
    pub fn new(step: f64, drive: &Drive, pendulum: &Oscillator, oscillator: &Oscillator) -> Self {
        let times = std::array::from_fn(|j| step * (j + 1) as f64);
        let turns = times.map(|s| drive.turned(Trig::ONE, s).phase);
        Self {
            step,
            pendulum: Response::new(pendulum, drive, &times),
            oscillator: Response::new(oscillator, drive, &times),
            cos: turns.map(|turn| turn.cos),
            sin: turns.map(|turn| turn.sin),
        }
    }

    #[inline(always)]
    pub fn states(&self, from: &Point) -> States {
        let (x1, v1) = self.pendulum.motion(from.x1, from.v1, from.psi);
        let (x2, v2) = self.oscillator.motion(from.x2, from.v2, from.psi);
        let mut cos_psi = [0.0; LANES];
        for j in 0..LANES {
            cos_psi[j] = from.psi.cos * self.cos[j] - from.psi.sin * self.sin[j];
        }
        States { x1, v1, x2, v2, cos_psi }
    }

    /// The point `j + 1` steps on.
    #[inline(always)]
    pub fn point(&self, from: &Point, j: usize) -> Point {
        let (x1, v1) = self.pendulum.motion_at(from.x1, from.v1, from.psi, j);
        let (x2, v2) = self.oscillator.motion_at(from.x2, from.v2, from.psi, j);
        let Trig { cos, sin } = from.psi;
        let psi = Trig {
            cos: cos * self.cos[j] - sin * self.sin[j],
            sin: sin * self.cos[j] + cos * self.sin[j],
        };
        Point { x1, v1, x2, v2, psi }
    }
}

impl Response {
    fn new(body: &Oscillator, drive: &Drive, times: &Lanes) -> Self {
        let free = times.map(|s| body.transition_within(s));
        let forced = body.is_forced().then(|| {
            [Trig::ONE, Trig { cos: 0.0, sin: 1.0 }].map(|start| {
                let from_rest = body.flight(0.0, 0.0, start);
                let motions = times.map(|s| body.at(&from_rest, s, &drive.turned(start, s)));
                [motions.map(|m| m.increment), motions.map(|m| m.rate)]
            })
        });
        Self {
            x_of_x: free.map(|t| t[0][0]),
            x_of_v: free.map(|t| t[0][1]),
            v_of_x: free.map(|t| t[1][0]),
            v_of_v: free.map(|t| t[1][1]),
            forced,
        }
    }

    #[inline(always)]
    fn motion(&self, x: f64, v: f64, psi: Trig) -> (Lanes, Lanes) {
        let (mut xs, mut vs) = ([0.0; LANES], [0.0; LANES]);
        for j in 0..LANES {
            xs[j] = self.x_of_x[j] * x + self.x_of_v[j] * v;
            vs[j] = self.v_of_x[j] * x + self.v_of_v[j] * v;
        }
        if let Some([[x_cos, v_cos], [x_sin, v_sin]]) = &self.forced {
            for j in 0..LANES {
                xs[j] += x_cos[j] * psi.cos + x_sin[j] * psi.sin;
                vs[j] += v_cos[j] * psi.cos + v_sin[j] * psi.sin;
            }
        }
        (xs, vs)
    }

    #[inline(always)]
    fn motion_at(&self, x: f64, v: f64, psi: Trig, j: usize) -> (f64, f64) {
        let mut moved =
            (self.x_of_x[j] * x + self.x_of_v[j] * v, self.v_of_x[j] * x + self.v_of_v[j] * v);
        if let Some([[x_cos, v_cos], [x_sin, v_sin]]) = &self.forced {
            moved.0 += x_cos[j] * psi.cos + x_sin[j] * psi.sin;
            moved.1 += v_cos[j] * psi.cos + v_sin[j] * psi.sin;
        }
        moved
    }
}
