//! What a leg adds to derivatives by numbers of its equation, and of the places of its closed stops.
//!
//! In the modes p of the structure, which stay as they are, with R the rows of the closed stops (in
//! stick that of the tangent, too), D their force directions and rho their places,
//!
//! ```text
//! p'' = a - D^T lambda,   a = f - W^2 p - C p',   R p'' = rho''
//! dp'' = da - D^T dlambda,   R dp'' = drho''
//! da = df - W^2 dp - C dp' - (dK p + dC p' + dM p'') - dD^T lambda
//! ```
//!
//! from dp = R^T (R R^T)^-1 drho, dp' likewise: the motion and all its derivatives are summed together
//! as Taylor series, step by step. What the derivatives are at the start moves as perturbations do,
//! beside this.

use nalgebra::{DMatrix, DVector};

use super::rates::{Linearised, Varied};
use crate::flight::structure::Closed;
use crate::flight::{Drive, Trig};
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState};
use crate::numerics::dense::complement;
use crate::numerics::elementary;
use crate::simulate::{AnchorOf, Phase};
use crate::tangent::tolerances::{LEAST_TERM, LONGEST_STEP, MOST_STEPS};

/// The closed stops of a leg.
struct Held {
    /// R and D.
    rows: DMatrix<f64>,
    directions: DMatrix<f64>,
    /// (R D^T)^-1 and R^T (R R^T)^-1.
    inertia: DMatrix<f64>,
    onto: DMatrix<f64>,
    /// The stops of the rows; none of the tangent's.
    stops: Vec<Option<usize>>,
    /// Row of a stop that slides, the direction of slip, and its tangent.
    slides: Option<(usize, f64, DVector<f64>)>,
}

/// Derivatives that a leg begins with, and that it ends with: (2N, columns).
pub(super) struct Forced {
    pub start: DMatrix<f64>,
    pub end: DMatrix<f64>,
}

impl Held {
    fn new(structure: &Structure, leg: &AnchorOf<Structure>) -> Option<Self> {
        let Phase::Contact(mode) = leg.phase else { return None };
        let closed = mode.holds(structure, &leg.touching.closed());
        let places = closed.stops();
        let count = structure.coordinates();
        let rounded = |row: &[_]| -> DVector<f64> {
            let entries =
                row.iter().map(|x: &crate::numerics::double_double::DoubleDouble| x.value());
            DVector::from_iterator(count, entries)
        };
        let mut exact: Vec<Vec<_>> =
            places.iter().map(|&j| structure.contact(j).modal_normal.clone()).collect();
        let mut stops: Vec<Option<usize>> = places.iter().copied().map(Some).collect();
        let mut slides = None;
        match closed {
            Closed::Frictionless(_) => {}
            Closed::Slide { stop, direction, .. } => {
                let tangent = rounded(&structure.contact(stop).modal_tangent);
                slides =
                    places.iter().position(|&j| j == stop).map(|row| (row, direction, tangent));
            }
            Closed::Stick { stop, .. } => {
                exact.push(structure.contact(stop).modal_tangent.clone());
                stops.push(None);
            }
        }
        let (independent, _) = complement(&exact, count);
        let kept: Vec<_> = independent.iter().map(|&i| rounded(&exact[i]).transpose()).collect();
        if kept.is_empty() {
            return None;
        }
        let rows = DMatrix::from_rows(&kept);
        let mut directions = rows.clone();
        if let Some((row, direction, tangent)) = &mut slides {
            // No row is left out where one rubs.
            let friction = structure.stops()[places[*row]].friction();
            let mut own = directions.row_mut(*row);
            own += tangent.transpose() * (friction * *direction);
        }
        let stops = independent.iter().map(|&i| stops[i]).collect();
        let inertia = (&rows * directions.transpose()).try_inverse()?;
        let onto = rows.transpose() * (&rows * rows.transpose()).try_inverse()?;
        Some(Self { rows, directions, inertia, onto, stops, slides })
    }
}

impl Varied {
    /// Whether a flight adds to this column by itself.
    fn acts(&self, held: Option<&Held>) -> bool {
        let modal = &self.modal;
        let matrix = modal.mass.is_some() || modal.damping.is_some() || modal.stiffness.is_some();
        let load = modal.load.is_some() || modal.drive.is_some();
        let turns = self.by.drive_frequency != 0.0 || self.by.phase != 0.0;
        let place = |stop: &Option<usize>| {
            stop.is_some_and(|stop| {
                let own = self.by.stop(stop);
                own.gap != 0.0 || own.amplitude != 0.0 || own.phase != 0.0
            })
        };
        let rubs = |(row, ..): &(usize, f64, DVector<f64>), held: &Held| {
            held.stops[*row].is_some_and(|stop| self.by.stop(stop).friction != 0.0)
        };
        let held = held.is_some_and(|held| {
            held.stops.iter().any(place) || held.slides.as_ref().is_some_and(|at| rubs(at, held))
        });
        matrix || load || turns || held
    }
}

/// cos and sin of a phase, as series in parts of a step.
struct Turning {
    cos: Vec<f64>,
    sin: Vec<f64>,
}

impl Turning {
    fn new(start: Trig, angle: f64, orders: usize) -> Self {
        let (mut cos, mut sin) = (vec![start.cos], vec![start.sin]);
        for k in 0..orders {
            let part = angle / (k + 1) as f64;
            let (c, s) = (cos[k], sin[k]);
            cos.push(-part * s);
            sin.push(part * c);
        }
        Self { cos, sin }
    }
}

/// A series in parts of a step, as it is summed: two terms, the sum and the sum of its rates.
struct Sum {
    lower: DVector<f64>,
    upper: DVector<f64>,
    place: DVector<f64>,
    rate: DVector<f64>,
}

impl Sum {
    /// From a place and a rate per step.
    fn new(place: &DVector<f64>, rate: &DVector<f64>) -> Self {
        let (lower, upper) = (place.clone(), rate.clone());
        Self { place: &lower + &upper, rate: upper.clone(), lower, upper }
    }

    /// The term of order `next` + 1, from the second derivative's of order `next` - 1.
    fn add(&mut self, second: &DVector<f64>, next: f64) {
        let new = second / (next * (next + 1.0));
        self.place += &new;
        self.rate += &new * (next + 1.0);
        self.lower = std::mem::replace(&mut self.upper, new);
    }
}

/// Places, and rates per step.
type Pair = (DVector<f64>, DVector<f64>);

/// What a step of a leg knows.
struct Step<'a> {
    of: &'a Linearised,
    held: Option<&'a Held>,
    /// Its length, the highest order, and the time in the period at its start.
    length: f64,
    orders: usize,
    since: f64,
    drive: Turning,
    /// The phases of closed stops, by row.
    stops: Vec<Turning>,
}

impl Linearised {
    /// What the columns get from a leg between two instants, `elapsed` apart; `None`: nothing.
    ///
    /// # Errors
    /// The time: a structure is damped too strongly.
    pub(super) fn forced(
        &self,
        leg: &AnchorOf<Structure>,
        from: Clock,
        elapsed: f64,
    ) -> Result<Option<Forced>, f64> {
        let held = Held::new(&self.structure, leg);
        let held = held.as_ref();
        let acts: Vec<usize> = (0..self.by.len()).filter(|&i| self.by[i].acts(held)).collect();
        if acts.is_empty() || elapsed <= 0.0 {
            return Ok(None);
        }
        let modes = self.structure.modes();
        let count = modes.len();
        let fastest = self.fastest(held);
        let steps = (elapsed * fastest / LONGEST_STEP).ceil().max(1.0);
        if steps.is_nan() || steps > MOST_STEPS {
            return Err(self.drive().time(from));
        }
        let length = elapsed / steps;
        let (mut orders, mut size) = (2, 1.0);
        while size > LEAST_TERM {
            size *= fastest * length / (orders - 1) as f64;
            orders += 1;
        }
        let StructureState { q, v } = self.state_at(leg, from);
        let on = |x: &[f64]| {
            let entries = modes.iter().map(|mode| mode.along_exactly(x).value());
            DVector::from_iterator(count, entries)
        };
        let mut motion = (on(&q), on(&v) * length);
        let mut columns = vec![(DVector::zeros(count), DVector::zeros(count)); acts.len()];
        // The place at which a stop sticks.
        let tau = held.map_or(0.0, |held| {
            let at = held.stops.iter().position(Option::is_none);
            at.map_or(0.0, |row| (held.rows.row(row) * &motion.0)[0])
        });
        let mut start = None;
        #[allow(clippy::cast_sign_loss)] // at least 1
        for i in 0..steps as usize {
            let before = i as f64 * length;
            let step = self.step(held, (from, before), (length, orders));
            if i == 0 {
                for (at, column) in columns.iter_mut().enumerate() {
                    *column = step.begin(&self.by[acts[at]]);
                }
                start = Some(columns.clone());
            } else {
                step.keep(&acts, (&mut motion, tau), &mut columns);
            }
            step.take(&acts, &mut motion, &mut columns);
        }
        let in_coordinates = |columns: &[Pair]| {
            let mut all = DMatrix::zeros(2 * count, self.by.len());
            for (&at, (place, rate)) in acts.iter().zip(columns) {
                for (i, mode) in modes.iter().enumerate() {
                    for (k, shape) in mode.shape.iter().enumerate() {
                        all[(k, at)] += shape * place[i];
                        all[(count + k, at)] += shape * (rate[i] / length);
                    }
                }
            }
            all
        };
        let start = in_coordinates(&start.unwrap_or_default());
        Ok(Some(Forced { start, end: in_coordinates(&columns) }))
    }

    /// The fastest rate at which anything turns or decays in a leg.
    fn fastest(&self, held: Option<&Held>) -> f64 {
        let modes = self.structure.modes();
        let turn = modes.iter().map(|mode| mode.frequency.value()).fold(0.0, f64::max);
        let norm = |matrix: &DMatrix<f64>| matrix.norm();
        let decay = if self.structure.couples_modes() {
            norm(&self.damping)
        } else {
            (0..modes.len()).fold(0.0, |most: f64, i| most.max(self.damping[(i, i)]))
        };
        let factor = held.map_or(1.0, |held| {
            let turned = held.directions.transpose() * &held.inertia * &held.rows;
            let count = modes.len();
            norm(&(DMatrix::identity(count, count) - turned)).max(1.0)
        });
        (turn * factor.sqrt()).max(decay * factor).max(self.drive().omega)
    }

    fn step<'a>(
        &'a self,
        held: Option<&'a Held>,
        (from, before): (Clock, f64),
        (length, orders): (f64, usize),
    ) -> Step<'a> {
        let angle = self.drive().omega * length;
        let turning = |drive: &Drive| {
            let start = drive.trig_at(from);
            let (sin, cos) = elementary::sin_cos(drive.omega * before);
            Turning::new(start.turned_by(Trig { cos, sin }), angle, orders + 3)
        };
        let none = || Turning { cos: vec![0.0; orders + 4], sin: vec![0.0; orders + 4] };
        let stops = held.map_or_else(Vec::new, |held| {
            let of = |stop: &Option<usize>| stop.map_or_else(none, |j| turning(&self.stops[j]));
            held.stops.iter().map(of).collect()
        });
        let drive = turning(self.drive());
        Step { of: self, held, length, orders, since: from.time_in_period + before, drive, stops }
    }
}

impl Step<'_> {
    /// The derivative of a closed stop's place, of one order.
    fn place(&self, varied: &Varied, row: usize, k: usize) -> f64 {
        let (Some(held), Turning { cos, sin }) = (self.held, &self.stops[row]) else { return 0.0 };
        let Some(stop) = held.stops[row] else { return 0.0 };
        let own = varied.by.stop(stop);
        let amplitude = self.of.structure.stops()[stop].amplitude();
        let faster = varied.by.drive_frequency * self.length;
        let before = if k > 0 { faster * sin[k - 1] } else { 0.0 };
        let turned = varied.turn_of(&own, self.since) * sin[k] + before;
        let still = if k == 0 { own.gap } else { 0.0 };
        still + own.amplitude * cos[k] - amplitude * turned
    }

    /// Places, or their second derivatives, of all rows.
    fn places(&self, of: impl Fn(usize) -> f64) -> DVector<f64> {
        DVector::from_fn(self.stops.len(), |row, _| of(row))
    }

    /// What derivatives a leg begins with.
    fn begin(&self, varied: &Varied) -> Pair {
        let count = self.of.structure.coordinates();
        let Some(held) = self.held else { return (DVector::zeros(count), DVector::zeros(count)) };
        let of = |k| &held.onto * self.places(|row| self.place(varied, row, k));
        (of(0), of(1))
    }

    /// Moves what a step has left on the closed stops again, so that no rounding leads off them.
    fn keep(&self, acts: &[usize], (motion, tau): (&mut Pair, f64), columns: &mut [Pair]) {
        let Some(held) = self.held else { return };
        let onto = |part: &mut DVector<f64>, wanted: DVector<f64>| {
            *part += &held.onto * (wanted - &held.rows * &*part);
        };
        for (part, k) in [(&mut motion.0, 0), (&mut motion.1, 1)] {
            let wanted = self.places(|row| {
                let Some(stop) = held.stops[row] else { return if k == 0 { tau } else { 0.0 } };
                let stop = &self.of.structure.stops()[stop];
                let still = if k == 0 { stop.gap() } else { 0.0 };
                still + stop.amplitude() * self.stops[row].cos[k]
            });
            onto(part, wanted);
        }
        for ((place, rate), &at) in columns.iter_mut().zip(acts) {
            for (part, k) in [(place, 0), (rate, 1)] {
                onto(part, self.places(|row| self.place(&self.of.by[at], row, k)));
            }
        }
    }

    /// -W^2 p - C p' of a term in parts of the step, where p' is of order `next`.
    fn free(&self, sum: &Sum, next: f64) -> DVector<f64> {
        let modes = self.of.structure.modes();
        let rate = &sum.upper * (next * self.length);
        let damped = if self.of.structure.couples_modes() {
            &self.of.damping * &rate
        } else {
            DVector::from_fn(modes.len(), |i, _| self.of.damping[(i, i)] * rate[i])
        };
        let square = self.length * self.length;
        DVector::from_fn(modes.len(), |i, _| {
            -square * modes[i].frequency.value().powi(2) * sum.lower[i] - damped[i]
        })
    }

    /// The second derivative under forces that keep the stops closed, and those.
    fn kept(&self, free: DVector<f64>, wanted: impl Fn(usize) -> f64) -> Pair {
        let Some(held) = self.held else { return (free, DVector::zeros(0)) };
        let forces = &held.inertia * (&held.rows * &free - self.places(wanted));
        (free - held.directions.transpose() * &forces, forces)
    }

    /// The motion and the columns after the step; rates are per step.
    fn take(&self, acts: &[usize], motion: &mut Pair, columns: &mut [Pair]) {
        let structure = &self.of.structure;
        let modes = structure.modes();
        let square = self.length * self.length;
        let mut sum = Sum::new(&motion.0, &motion.1);
        let mut sums: Vec<Sum> = columns.iter().map(|(x, v)| Sum::new(x, v)).collect();
        for k in 0..self.orders {
            let next = (k + 1) as f64;
            let (cos, sin) = (self.drive.cos[k], self.drive.sin[k]);
            let orders = next * (next + 1.0);
            let mut acceleration = self.free(&sum, next);
            for (a, mode) in acceleration.iter_mut().zip(modes) {
                let still = if k == 0 { mode.load } else { 0.0 };
                *a += square * (still + mode.drive.re * cos - mode.drive.im * sin);
            }
            let (second, forces) = self.kept(acceleration, |row| {
                let held = self.held.and_then(|held| held.stops[row]);
                held.map_or(0.0, |stop| {
                    structure.stops()[stop].amplitude() * orders * self.stops[row].cos[k + 2]
                })
            });
            for (sum_of, &at) in sums.iter_mut().zip(acts) {
                let varied = &self.of.by[at];
                let mut free = self.free(sum_of, next);
                self.vary(varied, k, (&sum, &second, &forces), &mut free);
                let (own, _) = self.kept(free, |row| orders * self.place(varied, row, k + 2));
                sum_of.add(&own, next);
            }
            sum.add(&second, next);
        }
        *motion = (sum.place, sum.rate);
        for (column, sum) in columns.iter_mut().zip(sums) {
            *column = (sum.place, sum.rate);
        }
    }

    /// Adds what the number of a column does by itself, of order k.
    fn vary(
        &self,
        varied: &Varied,
        k: usize,
        (sum, second, forces): (&Sum, &DVector<f64>, &DVector<f64>),
        free: &mut DVector<f64>,
    ) {
        let square = self.length * self.length;
        let modal = &varied.modal;
        if let Some(stiffness) = &modal.stiffness {
            free.gemv(-square, stiffness, &sum.lower, 1.0);
        }
        if let Some(damping) = &modal.damping {
            free.gemv(-self.length * (k + 1) as f64, damping, &sum.upper, 1.0);
        }
        if let Some(mass) = &modal.mass {
            free.gemv(-1.0, mass, second, 1.0);
        }
        let (cos, sin) = (self.drive.cos[k], self.drive.sin[k]);
        if let (Some(load), 0) = (&modal.load, k) {
            for (a, load) in free.iter_mut().zip(load) {
                *a += square * load;
            }
        }
        if let Some(drive) = &modal.drive {
            for (a, drive) in free.iter_mut().zip(drive) {
                *a += square * (drive.re * cos - drive.im * sin);
            }
        }
        let turn = varied.turn(self.since);
        let faster = varied.by.drive_frequency * self.length;
        if turn != 0.0 || faster != 0.0 {
            let before = |of: &[f64]| if k > 0 { of[k - 1] } else { 0.0 };
            let by_sin = turn * sin + faster * before(&self.drive.sin);
            let by_cos = turn * cos + faster * before(&self.drive.cos);
            for (a, mode) in free.iter_mut().zip(self.of.structure.modes()) {
                *a -= square * (mode.drive.re * by_sin + mode.drive.im * by_cos);
            }
        }
        if let Some(held) = self.held
            && let Some((row, direction, tangent)) = &held.slides
            && let Some(stop) = held.stops[*row]
        {
            let friction = varied.by.stop(stop).friction;
            free.axpy(-friction * direction * forces[*row], tangent, 1.0);
        }
    }
}
