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
//! with R dp = drho, R dp' likewise. With z = (p, p', 1, cos psi, sin psi) that is z' = A z and
//! dz' = A dz + B z, a B for each number (equation.rs). So over any time z grows by X z and dz by X dz +
//! L z, and those of twice the time are 2 X + X^2 and 2 L + X L + L X: whole steps are binary, and what
//! is left is a short Taylor series. In flight, what the derivatives are at the start moves as
//! perturbations do, beside this.

mod ahead;

use std::sync::{Arc, Mutex};

use nalgebra::{DMatrix, DVector};
use smallvec::SmallVec;

use super::equation::{Equation, Held};
use super::modes::{Flown, ModalFlights};
use super::rates::{Linearised, Rates};
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState};
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::structure::{ClosedStops, StructureMode};
use crate::simulate::{AnchorOf, Phase, Simulation};
use crate::tangent::long_flight::longest_part;
use crate::tangent::tolerances::{
    LEAST_TERM, LONGEST_STEP, MOST_STEPS, SHORTEST_CONTACT_PART, SHORTEST_PART,
};

/// Steps in which the fastest motion turns by `LONGEST_STEP`, as a power of two.
const FINER: u32 = 6;

/// How closed stops are held in a leg; none in flight.
type Kind = Option<(StructureMode, ClosedStops)>;

/// What legs of some kinds add, worked out once.
#[derive(Debug, Default)]
pub(super) struct Steppers {
    known: Mutex<Vec<(Kind, Arc<Stepper>)>>,
    /// A simulation of hops that is not in use.
    hops: Mutex<Option<Box<Simulation<Structure>>>>,
}

/// What legs of one kind add.
#[derive(Debug)]
pub(super) struct Stepper {
    pub equation: Equation,
    /// p'' and the drive in A.
    second: Rows,
    /// Columns that they add to, each with its B.
    acts: Vec<(usize, DMatrix<f64>)>,
    /// These, and in contact all others: they move in steps.
    order: Vec<usize>,
    /// The same of each B.
    seconds: Vec<Rows>,
    /// Flights in closed form, where there is one.
    modes: Option<ModalFlights>,
    /// Length of the shortest steps, and the fastest rate.
    length: f64,
    fastest: f64,
    /// Steps of 2^k such lengths.
    levels: Mutex<Vec<Arc<Level>>>,
}

/// X, and L of each column.
#[derive(Debug)]
struct Level {
    change: DMatrix<f64>,
    added: Vec<DMatrix<f64>>,
    /// Rows of these.
    change_rows: Rows,
    added_rows: Vec<Rows>,
}

/// Rows of a matrix over z, one after another, and its last two, of which only those two columns are not 0.
#[derive(Debug)]
struct Rows {
    rows: Vec<f64>,
    turn: [[f64; 2]; 2],
}

impl Rows {
    /// From the first row before that of the constant on.
    fn new(of: &DMatrix<f64>, first: usize) -> Self {
        let size = of.nrows();
        let rows = of.rows(first, size - 3 - first).transpose().as_slice().to_vec();
        let turn = [0, 1].map(|i| [0, 1].map(|j| of[(size - 2 + i, size - 2 + j)]));
        Self { rows, turn }
    }

    /// Adds a multiple of what these make of z to the rows before that of the constant, and to the last two.
    #[inline]
    fn add(&self, factor: f64, z: &DVector<f64>, to: &mut DVector<f64>) {
        let (z, to) = (z.as_slice(), to.as_mut_slice());
        let size = z.len();
        let first = size - 3 - self.rows.len() / size;
        for (row, to) in self.rows.chunks_exact(size).zip(&mut to[first..]) {
            *to += factor * dot(row, z);
        }
        for (i, [cos, sin]) in self.turn.into_iter().enumerate() {
            to[size - 2 + i] += factor * (cos * z[size - 2] + sin * z[size - 1]);
        }
    }
}

/// In four sums, which vector instructions add at once.
#[inline(always)]
#[allow(clippy::inline_always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (long_a, long_b) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = long_a.remainder().iter().zip(long_b.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; 4];
    for (a, b) in long_a.zip(long_b) {
        for i in 0..4 {
            sums[i] += a[i] * b[i];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// The motion and its derivatives, in the order of the stepper, with memory for a change.
struct Moving {
    motion: DVector<f64>,
    columns: Vec<DVector<f64>>,
    change: DVector<f64>,
}

impl Stepper {
    fn new(of: &Linearised, leg: &AnchorOf<Structure>) -> Self {
        let equation = Equation::new(of, Held::new(&of.structure, leg));
        let acts = (0..of.by.len()).filter(|&i| equation.acts(&of.by[i]));
        let acts: Vec<_> = acts.map(|i| (i, equation.varied(of, &of.by[i]))).collect();
        let count = of.structure.coordinates();
        let second = Rows::new(&equation.generator, count);
        let seconds = acts.iter().map(|(_, b)| Rows::new(b, count)).collect();
        let fastest = equation.fastest(of);
        let longest = if fastest > 0.0 { LONGEST_STEP / fastest } else { 1.0 };
        let length = longest / f64::from(1 << FINER);
        let flies = !matches!(leg.phase, Phase::Contact(_));
        let modes = if flies { ModalFlights::new(of, &equation, &acts) } else { None };
        let levels = Mutex::new(Vec::new());
        let mut order: Vec<usize> = acts.iter().map(|&(at, _)| at).collect();
        if equation.is_closed() {
            let others: Vec<_> = (0..of.by.len()).filter(|at| !order.contains(at)).collect();
            order.extend(others);
        }
        Self { equation, second, acts, order, seconds, modes, length, fastest, levels }
    }

    /// Steps of 2^k lengths.
    fn level(&self, k: usize) -> Arc<Level> {
        let Ok(mut levels) = self.levels.lock() else { unreachable!("nobody panics with it") };
        while levels.len() <= k {
            let next = match levels.last() {
                Some(last) => last.twice(),
                None => self.first(),
            };
            levels.push(Arc::new(next));
        }
        Arc::clone(&levels[k])
    }

    fn first(&self) -> Level {
        let (h, a) = (self.length, &self.equation.generator);
        let size = a.nrows();
        let mut change = DMatrix::zeros(size, size);
        let mut term = DMatrix::identity(size, size);
        let mut added = vec![change.clone(); self.acts.len()];
        let mut terms = added.clone();
        for k in 1..=self.orders(h) {
            let part = h / k as f64;
            for ((own, sum), (_, b)) in terms.iter_mut().zip(&mut added).zip(&self.acts) {
                *own = (a * &*own + b * &term) * part;
                *sum += &*own;
            }
            term = (a * term) * part;
            change += &term;
        }
        Level::new(change, added)
    }

    /// Orders that a series over this time needs.
    fn orders(&self, time: f64) -> usize {
        let (mut orders, mut size) = (2, 1.0);
        while size > LEAST_TERM {
            size *= self.fastest * time / (orders - 1) as f64;
            orders += 1;
        }
        orders
    }

    /// Over less than a step, by the series.
    fn take_rest(&self, time: f64, moving: &mut Moving) {
        let mut motion = moving.motion.clone();
        let mut columns = moving.columns.clone();
        for k in 1..=self.orders(time) {
            let part = time / k as f64;
            for (i, (own, sum)) in columns.iter_mut().zip(&mut moving.columns).enumerate() {
                self.rates(part, own, &mut moving.change);
                if let Some(b) = self.seconds.get(i) {
                    b.add(part, &motion, &mut moving.change);
                }
                std::mem::swap(own, &mut moving.change);
                *sum += &*own;
            }
            self.rates(part, &motion, &mut moving.change);
            std::mem::swap(&mut motion, &mut moving.change);
            moving.motion += &motion;
        }
    }

    /// A multiple of A z.
    fn rates(&self, factor: f64, z: &DVector<f64>, to: &mut DVector<f64>) {
        let count = (z.len() - 3) / 2;
        to.fill(0.0);
        for i in 0..count {
            to[i] = factor * z[count + i];
        }
        self.second.add(factor, z, to);
    }
}

impl Level {
    fn new(change: DMatrix<f64>, added: Vec<DMatrix<f64>>) -> Self {
        let change_rows = Rows::new(&change, 0);
        let added_rows = added.iter().map(|added| Rows::new(added, 0)).collect();
        Self { change, added, change_rows, added_rows }
    }

    fn twice(&self) -> Self {
        let Self { change: x, added, .. } = self;
        let twice = |l: &DMatrix<f64>| l * 2.0 + x * l + l * x;
        Self::new(x * 2.0 + x * x, added.iter().map(twice).collect())
    }

    fn take(&self, moving: &mut Moving) {
        let change = &mut moving.change;
        for (i, column) in moving.columns.iter_mut().enumerate() {
            change.fill(0.0);
            self.change_rows.add(1.0, column, change);
            if let Some(l) = self.added_rows.get(i) {
                l.add(1.0, &moving.motion, change);
            }
            *column += &*change;
        }
        change.fill(0.0);
        self.change_rows.add(1.0, &moving.motion, change);
        moving.motion += &*change;
    }
}

impl Steppers {
    /// What `work` makes of a simulation of hops from a leg on. What a simulation works out once is kept for
    /// the next one.
    pub(super) fn hop<R>(
        &self,
        of: &Linearised,
        (from, target): (&AnchorOf<Structure>, Clock),
        work: impl FnOnce(&mut Simulation<Structure>) -> R,
    ) -> R {
        let idle = self.hops.lock().ok().and_then(|mut idle| idle.take());
        let mut hops = match idle {
            Some(mut hops) => {
                hops.hops_from(from.clone(), target);
                hops
            }
            None => Box::new(Simulation::hopping(&of.structure, from.clone(), target)),
        };
        let found = work(&mut hops);
        if let Ok(mut idle) = self.hops.lock() {
            *idle = Some(hops);
        }
        found
    }

    /// The longest time over which derivatives along a leg keep their digits.
    pub(super) fn longest_part(&self, of: &Linearised, leg: &AnchorOf<Structure>) -> f64 {
        if of.by.is_empty() {
            return f64::INFINITY;
        }
        let stepper = self.of(of, leg);
        if stepper.modes.is_some() || stepper.order.is_empty() {
            return f64::INFINITY;
        }
        let modes = of.structure.modes().iter().map(|mode| mode.frequency.value());
        let undamped = modes.fold(of.drive().omega, f64::max);
        let least =
            if stepper.equation.is_closed() { SHORTEST_CONTACT_PART } else { SHORTEST_PART };
        longest_part((stepper.fastest, undamped), least)
    }

    /// Whether there is a closed form of this leg.
    pub(super) fn flies_at_once(&self, of: &Linearised, leg: &AnchorOf<Structure>) -> bool {
        self.of(of, leg).modes.is_some()
    }

    pub(super) fn of(&self, of: &Linearised, leg: &AnchorOf<Structure>) -> Arc<Stepper> {
        let kind: Kind = match leg.phase {
            Phase::Contact(mode) => Some((mode, leg.touching.closed())),
            _ => None,
        };
        let Ok(mut known) = self.known.lock() else { unreachable!("nobody panics with it") };
        if let Some((_, found)) = known.iter().find(|(other, _)| *other == kind) {
            return Arc::clone(found);
        }
        let made = Arc::new(Stepper::new(of, leg));
        known.push((kind, Arc::clone(&made)));
        made
    }

    /// Carries the columns along a leg from an instant to another, `elapsed` apart.
    ///
    /// # Errors
    /// The time: a structure is damped too strongly.
    pub(super) fn carry(
        &self,
        of: &Linearised,
        leg: &AnchorOf<Structure>,
        ([from, to], elapsed): ([Clock; 2], DoubleDouble),
        columns: &mut DMatrix<f64>,
    ) -> Result<(), f64> {
        if of.by.is_empty() {
            of.homogeneous.carry(leg, elapsed, columns.as_mut_slice());
            return Ok(());
        }
        let stepper = self.of(of, leg);
        if let Some(modes) = stepper.modes.as_ref().filter(|_| elapsed.hi > stepper.length)
            && let Some(transitions) = of.homogeneous.transitions(elapsed)
        {
            let phases = [from, to].map(|clock| of.drive().trig_at(clock));
            let there;
            let state = if from == leg.clock {
                &leg.state
            } else {
                there = of.state_at(leg, from);
                &there
            };
            let StructureState { q, v } = state;
            let (elapsed, transitions) = (elapsed.hi, &transitions);
            let flown = Flown { q, v, phases, elapsed, transitions };
            let turns: SmallVec<[f64; 8]> =
                of.by.iter().map(|varied| varied.turn(from.time_in_period)).collect();
            modes.carry(&flown, &turns, columns.as_mut_slice());
            return Ok(());
        }
        self.carry_in_steps(of, leg, ([from, to], elapsed), columns)
    }

    /// The same in steps, whatever the leg.
    pub(super) fn carry_in_steps(
        &self,
        of: &Linearised,
        leg: &AnchorOf<Structure>,
        ([from, _], elapsed): ([Clock; 2], DoubleDouble),
        columns: &mut DMatrix<f64>,
    ) -> Result<(), f64> {
        let stepper = self.of(of, leg);
        let closed = stepper.equation.is_closed();
        let added = stepper.moved(of, leg, (from, elapsed.hi), closed.then_some(&*columns))?;
        if !closed {
            of.homogeneous.carry(leg, elapsed, columns.as_mut_slice());
        }
        match added {
            Some(all) if closed => *columns = all,
            Some(added) => *columns += added,
            None => {}
        }
        Ok(())
    }

    /// F = (q', q'') of a leg at an instant, in this state.
    pub(super) fn rates(
        &self,
        of: &Linearised,
        leg: &AnchorOf<Structure>,
        (clock, state): (Clock, &StructureState),
    ) -> Rates {
        let Phase::Contact(_) = leg.phase else { return of.rates(leg, clock, state) };
        if of.by.is_empty() {
            return of.rates(leg, clock, state);
        }
        let stepper = self.of(of, leg);
        if !stepper.equation.is_closed() {
            return of.rates(leg, clock, state);
        }
        let motion = of.in_modes(clock, state);
        let mut rates = DVector::zeros(motion.len());
        stepper.rates(1.0, &motion, &mut rates);
        let count = state.q.len();
        let mut all = Rates::from_slice(&state.v);
        all.resize(2 * count, 0.0);
        for (mode, rate) in of.structure.modes().iter().zip(rates.rows(count, count).iter()) {
            for (to, shape) in all[count..].iter_mut().zip(&mode.shape) {
                *to += shape * rate;
            }
        }
        all
    }
}

impl Stepper {
    /// What the columns become in a leg between two instants, `elapsed` apart, from these at its start; in
    /// flight what they get, whatever they are. `None`: nothing.
    ///
    /// # Errors
    /// The time: a structure is damped too strongly.
    fn moved(
        &self,
        of: &Linearised,
        leg: &AnchorOf<Structure>,
        (from, elapsed): (Clock, f64),
        start: Option<&DMatrix<f64>>,
    ) -> Result<Option<DMatrix<f64>>, f64> {
        if self.order.is_empty() {
            return Ok(None);
        }
        let whole = (elapsed / self.length).floor();
        // Steps by which nothing leads off closed stops are short.
        let most = if start.is_some() { FINER } else { u32::BITS - 1 };
        let steps = whole / f64::from(1u32 << FINER);
        if steps.is_nan() || steps > MOST_STEPS {
            return Err(of.drive().time(from));
        }
        let mut moving = self.begin(of, leg, (from, start));
        #[allow(clippy::cast_sign_loss, clippy::cast_possible_truncation)]
        // below MOST_STEPS 2^FINER
        let mut left = whole as u64;
        while left > 0 {
            let k = left.ilog2().min(most);
            self.level(k as usize).take(&mut moving);
            left -= 1 << k;
            if k == most {
                self.keep(of, &mut moving);
            }
        }
        self.take_rest(elapsed - whole * self.length, &mut moving);
        self.keep(of, &mut moving);
        Ok(Some(self.in_coordinates(of, &moving)))
    }

    /// The motion and its derivatives where a leg begins: these, or none.
    fn begin(
        &self,
        of: &Linearised,
        leg: &AnchorOf<Structure>,
        (from, start): (Clock, Option<&DMatrix<f64>>),
    ) -> Moving {
        let count = of.structure.coordinates();
        let motion = of.in_modes(from, &of.state_at(leg, from));
        let (cos, sin) = (motion[2 * count + 1], motion[2 * count + 2]);
        let columns = self.order.iter().map(|&at| {
            let turn = of.by[at].turn(from.time_in_period);
            let start = start.map(|start| start.column(at));
            let start = start.as_ref().map_or(&[][..], |start| start.as_slice());
            of.column_in_modes(start, [-sin * turn, cos * turn])
        });
        let none = DVector::zeros(2 * count + 3);
        let mut moving = Moving { columns: columns.collect(), motion, change: none };
        self.keep(of, &mut moving);
        moving
    }

    /// Moves derivatives on the closed stops, so that no rounding leads off them.
    fn keep(&self, of: &Linearised, moving: &mut Moving) {
        for (column, at) in moving.columns.iter_mut().zip(&self.order) {
            self.equation.keep(&of.by[*at], &moving.motion, column);
        }
    }

    /// Derivatives of q and q'.
    fn in_coordinates(&self, of: &Linearised, moving: &Moving) -> DMatrix<f64> {
        let mut all = DMatrix::zeros(2 * of.structure.coordinates(), of.by.len());
        for (column, &at) in moving.columns.iter().zip(&self.order) {
            of.out_of_modes(column, all.column_mut(at).as_mut_slice());
        }
        all
    }
}
