//! Whole runs of structures that fall dead on their stops (r = 0), leave them and meet them again:
//! legs, events and landings together, in the plainest loop there is.

use nalgebra::{Complex, DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::flight::StructureMotion;
use crate::flight::structure::LegEvent;
use crate::impact::strike;
use crate::model::Stop;
use crate::numerics::double_double::DoubleDouble;

struct Run<'a> {
    structure: &'a Structure,
    free: StructureMotion,
    clock: Clock,
    q: Vec<f64>,
    v: Vec<f64>,
    closed: Closed,
    starts: Vec<(usize, Start)>,
    /// How often each kind of event has come: met, released, slip ended, slip began.
    counts: [usize; 4],
    /// Most events at one instant.
    most_at_once: usize,
    at_once: usize,
    /// By a Painleve point.
    ended: bool,
}

impl<'a> Run<'a> {
    fn new(structure: &'a Structure, q: Vec<f64>, v: Vec<f64>) -> Self {
        Self {
            structure,
            free: StructureMotion::new(structure),
            clock: Clock::START,
            q,
            v,
            closed: Closed::Frictionless(vec![]),
            starts: vec![],
            counts: [0; 4],
            most_at_once: 0,
            at_once: 0,
            ended: false,
        }
    }

    fn gap(&self, stop: usize) -> (f64, f64) {
        self.free.gap(stop, self.clock, &self.q, &self.v)
    }

    /// One event; the time it took.
    fn step(&mut self) -> f64 {
        let motion = LinearMotion::new(self.structure, self.closed.clone()).unwrap();
        let flight = motion.flight(self.clock, &self.q, &self.v);
        let mut event = motion.next_event(&flight, &self.starts);
        let mut grazes = 0;
        while let LegEvent::Grazed { stop, time } = event {
            grazes += 1;
            assert!(grazes < 10, "{:?} {:?}", self.closed, self.starts);
            self.starts.retain(|(other, _)| *other != stop);
            self.starts.push((stop, Start::Grazed(time)));
            event = motion.next_event(&flight, &self.starts);
        }
        let (time, offset) = match event {
            LegEvent::Met { time, offset, .. }
            | LegEvent::Released { time, offset, .. }
            | LegEvent::SlipEnds { time, offset }
            | LegEvent::SlipBegins { time, offset, .. } => (time, offset),
            LegEvent::Clear(time) | LegEvent::Resting { time, .. } => (time, 0.0),
            other => panic!("{other:?}"),
        };
        let elapsed = DoubleDouble::sum(time, offset);
        (self.q, self.v) = motion.state_after(&flight, elapsed);
        self.clock = motion.clock_after(&flight, elapsed);
        self.starts.clear();
        let mut candidates = self.closed.stops();
        match event {
            LegEvent::Met { stop, .. } => {
                self.counts[0] += 1;
                candidates.push(stop);
                self.fall(&mut candidates);
                self.land(&candidates, None);
            }
            LegEvent::Resting { stop, .. } => {
                candidates.push(stop);
                self.land(&candidates, None);
            }
            LegEvent::Released { .. } => {
                self.counts[1] += 1;
                self.land(&candidates, None);
            }
            LegEvent::SlipEnds { .. } => {
                self.counts[2] += 1;
                self.land(&candidates, Some(candidates[0]));
            }
            LegEvent::SlipBegins { direction, .. } => {
                self.counts[3] += 1;
                let stop = candidates[0];
                self.closed = Closed::Slide { stop, direction, beside: vec![] };
            }
            _ => {}
        }
        self.at_once = if time + offset > 0.0 { 0 } else { self.at_once + 1 };
        self.most_at_once = self.most_at_once.max(self.at_once);
        time + offset
    }

    /// No velocity along these normals is left, and along those of others that are touched and
    /// would then approach, by the least change of kinetic energy; with friction by the impact law.
    fn fall(&mut self, stops: &mut Vec<usize>) {
        for &stop in &*stops {
            let (gap, _) = self.gap(stop);
            self.q = self.free.on_stop(stop, gap, &self.q);
        }
        if self.structure.stops().len() == 1 {
            let (_, rate) = self.gap(stops[0]);
            strike(self.structure, stops[0], rate.max(0.0), &mut self.v).unwrap();
            return;
        }
        let before = self.v.clone();
        loop {
            self.v.clone_from(&before);
            let by = |i: usize| &self.structure.contact(stops[i]).by_normal;
            let gram = DMatrix::from_fn(stops.len(), stops.len(), |i, j| {
                let normal = self.structure.stops()[stops[i]].normal();
                normal.iter().zip(by(j)).map(|(n, m)| n * m).sum()
            });
            let rates = DVector::from_fn(stops.len(), |i, _| self.gap(stops[i]).1);
            let impulses = gram.lu().solve(&rates).unwrap();
            for (k, v) in self.v.iter_mut().enumerate() {
                *v -= (0..stops.len()).map(|i| impulses[i] * by(i)[k]).sum::<f64>();
            }
            let approaches = |stop: &usize| {
                let (gap, rate) = self.gap(*stop);
                !stops.contains(stop) && gap > -1e-12 && rate > 1e-14
            };
            match (0..self.structure.stops().len()).find(approaches) {
                Some(other) => stops.push(other),
                None => return,
            }
        }
    }

    fn land(&mut self, candidates: &[usize], at_rest: Option<usize>) {
        match land(self.structure, self.clock, (&self.q, &self.v), candidates, at_rest) {
            Landing::Hold { closed, leaving } => (self.closed, self.starts) = (closed, leaving),
            Landing::Separate { leaving } => {
                (self.closed, self.starts) = (Closed::Frictionless(vec![]), leaving);
            }
            Landing::Painleve => self.ended = true,
            Landing::TooManyWithFriction => panic!("there is one stop with friction"),
        }
    }

    fn energy(&self) -> f64 {
        let form = |matrix: &[Vec<f64>], x: &[f64]| -> f64 {
            let rows = matrix.iter().zip(x);
            rows.map(|(row, &a)| a * row.iter().zip(x).map(|(m, b)| m * b).sum::<f64>()).sum()
        };
        0.5 * (form(self.structure.mass(), &self.v) + form(self.structure.stiffness(), &self.q))
    }
}

fn random(rng: &mut ChaCha8Rng, count: usize, size: f64) -> Vec<f64> {
    (0..count).map(|_| rng.random_range(-size..size)).collect()
}

fn squares(rng: &mut ChaCha8Rng, count: usize, size: f64, least: f64) -> Vec<Vec<f64>> {
    let rows: Vec<Vec<f64>> = (0..count).map(|_| random(rng, count, size)).collect();
    let sum = |i: usize, j: usize| {
        let sum: f64 = rows.iter().map(|row| row[i] * row[j]).sum();
        if i == j { sum + least } else { sum }
    };
    (0..count).map(|i| (0..count).map(|j| sum(i, j)).collect()).collect()
}

/// Two to four coordinates; `rough`: one stop with friction, else three without.
fn structure(rng: &mut ChaCha8Rng, rough: bool, driven: bool) -> Structure {
    let count = rng.random_range(2..=4);
    let (mass, stiffness) = (squares(rng, count, 0.5, 1.0), squares(rng, count, 1.0, 0.3));
    let damping = squares(rng, count, 0.3, 0.0);
    let drive: Vec<_> = random(rng, count, if driven { 2.0 } else { 1e-300 })
        .into_iter()
        .map(|f| Complex::new(f, 0.0))
        .collect();
    let mut builder = Structure::builder(mass, stiffness).damping(damping).drive(
        drive,
        rng.random_range(0.3..1.5),
        0.4,
    );
    for _ in 0..if rough { 1 } else { 3 } {
        let (normal, tangent) = (random(rng, count, 1.0), random(rng, count, 1.0));
        let mut stop = Stop::new(normal, rng.random_range(0.1..0.3), 0.0);
        if rough {
            stop = stop.with_friction(rng.random_range(0.2..0.8), tangent);
        }
        if driven {
            stop = stop.moving(rng.random_range(0.0..0.1), 1.0);
        }
        builder = builder.stop(stop);
    }
    builder.build().unwrap()
}

fn runs(seed: u64, rough: bool, driven: bool) -> ([usize; 4], usize) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut counts, mut most, mut ended) = ([0; 4], 0, 0);
    for round in 0..30 {
        let structure = structure(&mut rng, rough, driven);
        // Apart from all stops.
        let count = structure.coordinates();
        let (q, v) = (vec![0.0; count], random(&mut rng, count, 2.0));
        let mut run = Run::new(&structure, q, v);
        let (mut energy, mut time) = (run.energy(), 0.0);
        for event in 0..120 {
            time += run.step();
            if run.ended {
                ended += 1;
                break;
            }
            for stop in 0..structure.stops().len() {
                let (gap, _) = run.gap(stop);
                assert!(gap < 1e-12, "{round} {event} stop {stop}: {gap:e}");
            }
            if !driven {
                let now = run.energy();
                assert!(now <= energy * (1.0 + 1e-12) + 1e-26, "{round} {event}: {energy} {now}");
                energy = now;
            }
        }
        assert!(run.ended || time > 1.0, "{round}: {time}");
        counts = std::array::from_fn(|k| counts[k] + run.counts[k]);
        most = most.max(run.most_at_once);
    }
    println!("{rough} {driven} {counts:?}, {most} at once, {ended} ended");
    assert!(ended < 6);
    (counts, most)
}

#[test]
fn runs_without_friction_go_on() {
    for driven in [false, true] {
        let (counts, most) = runs(31, false, driven);
        assert!(counts[0] > 30 && counts[1] > 10 && most < 4, "{counts:?} {most}");
    }
}

#[test]
fn runs_with_friction_go_on() {
    for driven in [false, true] {
        let (counts, most) = runs(32, true, driven);
        let [met, released, ended, began] = counts;
        let all = met > 50 && released > 10 && ended > 5 && began > 0;
        assert!(all && most < 4, "{counts:?} {most}");
    }
}
