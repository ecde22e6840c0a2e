//! Random structures of every kind, written in any units.

use nalgebra::Complex;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use vibroimpact::{ImpactLaw, Simultaneous, Stop, Structure, StructureState};

pub type Rows = Vec<Vec<f64>>;

pub fn uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    rng.random_range(low..high)
}

pub fn vector(rng: &mut ChaCha8Rng, count: usize, size: f64) -> Vec<f64> {
    (0..count).map(|_| uniform(rng, -size, size)).collect()
}

/// A matrix A A^T + least.
pub fn definite(rng: &mut ChaCha8Rng, count: usize, least: f64, size: f64) -> Rows {
    let a: Rows = (0..count).map(|_| vector(rng, count, size)).collect();
    let entry = |i: usize, j: usize| {
        let sum: f64 = (0..count).map(|k| a[i][k] * a[j][k]).sum();
        sum + if i == j { least } else { 0.0 }
    };
    (0..count).map(|i| (0..count).map(|j| entry(i.min(j), i.max(j))).collect()).collect()
}

/// Units of mass, length and time, each as a number of those in which a structure is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Units {
    pub mass: f64,
    pub length: f64,
    pub time: f64,
}

impl Units {
    pub const DRAWN: Self = Self { mass: 1.0, length: 1.0, time: 1.0 };
}

#[derive(Debug, Clone)]
pub enum Damping {
    None,
    Ratios(Vec<f64>),
    Matrix(Rows),
}

#[derive(Debug, Clone)]
pub struct DrawnStop {
    pub normal: Vec<f64>,
    pub gap: f64,
    pub restitution: f64,
    /// Coefficient and tangent.
    pub friction: Option<(f64, Vec<f64>)>,
    /// Amplitude and phase.
    pub moving: [f64; 2],
}

/// A structure of up to eight coordinates and six stops, and where it starts.
#[derive(Debug, Clone)]
pub struct Drawn {
    pub mass: Rows,
    pub stiffness: Rows,
    pub damping: Damping,
    pub drive: Vec<Complex<f64>>,
    pub load: Vec<f64>,
    pub omega: f64,
    pub phase: f64,
    pub stops: Vec<DrawnStop>,
    pub law: ImpactLaw,
    pub rule: Simultaneous,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
}

impl Drawn {
    /// Held or free, of matrices or of modes, without damping, with that of modes or any; stops at
    /// rest or moving, some with friction; all laws, and all rules for several stops; some start on
    /// a stop.
    pub fn random(rng: &mut ChaCha8Rng) -> Self {
        let count = rng.random_range(1..=8usize);
        let free = count > 1 && rng.random_bool(0.15);
        let modal = !free && rng.random_bool(0.2);
        let diagonal = |of: Vec<f64>| -> Rows {
            let entry = |i: usize, j: usize| if i == j { of[i] } else { 0.0 };
            (0..count).map(|i| (0..count).map(|j| entry(i, j)).collect()).collect()
        };
        let (mass, stiffness) = if modal {
            let masses: Vec<f64> = (0..count).map(|_| uniform(rng, 0.3, 2.0)).collect();
            let springs = masses.iter().enumerate().map(|(i, m)| {
                let frequency = (1.0 + i as f64) * uniform(rng, 0.5, 1.5);
                m * frequency * frequency
            });
            let springs = springs.collect();
            (diagonal(masses), diagonal(springs))
        } else {
            let mass = definite(rng, count, 0.5, 0.4);
            (mass, if free { chain(rng, count) } else { definite(rng, count, 0.5, 1.5) })
        };
        let mix = uniform(rng, 0.0, 0.1);
        let damping = match rng.random_range(0..4) {
            0 => Damping::None,
            1 => Damping::Matrix(definite(rng, count, 0.02, 0.2)),
            2 => {
                let row = |(m, k): (&Vec<f64>, &Vec<f64>)| {
                    m.iter().zip(k).map(|(m, k)| mix * (m + k)).collect()
                };
                Damping::Matrix(mass.iter().zip(&stiffness).map(row).collect())
            }
            _ if free => Damping::Matrix(definite(rng, count, 0.02, 0.1)),
            _ => Damping::Ratios((0..count).map(|_| uniform(rng, 0.0, 0.2)).collect()),
        };
        let (re, im) = (vector(rng, count, 1.5), vector(rng, count, 0.5));
        let drive = re.into_iter().zip(im).map(|(re, im)| Complex::new(re, im)).collect();
        let stops: Vec<_> = (0..rng.random_range(1..=6usize))
            .map(|_| DrawnStop::random(rng, count, modal))
            .collect();
        let rough = stops.iter().any(|stop| stop.friction.is_some());
        let rules = [Simultaneous::Stop, Simultaneous::Sequence, Simultaneous::Together];
        let laws = [ImpactLaw::Poisson, ImpactLaw::Newton, ImpactLaw::Energetic];
        let mut drawn = Self {
            mass,
            stiffness,
            damping,
            drive,
            load: vector(rng, count, 0.4),
            omega: uniform(rng, 0.3, 3.0),
            phase: uniform(rng, 0.0, 6.0),
            stops,
            law: laws[rng.random_range(0..3)],
            rule: rules[rng.random_range(0..if rough { 2 } else { 3 })],
            q: vec![0.0; count],
            v: vector(rng, count, 0.5),
        };
        if rng.random_bool(0.2) {
            let [amplitude, phase] = drawn.stops[0].moving;
            drawn.stops[0].gap = -(amplitude * phase.cos());
        }
        drawn
    }

    /// The same with r = 1, without damping and friction, apart from all stops at the start.
    pub fn without_loss(mut self) -> Self {
        self.damping = Damping::None;
        for stop in &mut self.stops {
            (stop.restitution, stop.friction) = (1.0, None);
            stop.gap += 0.05;
        }
        self
    }

    /// Goes back from this state, reached at this time.
    pub fn turn_back(&mut self, time: f64, from: &StructureState) {
        self.phase = -(self.omega * time + self.phase);
        for stop in &mut self.stops {
            stop.moving[1] = -(self.omega * time + stop.moving[1]);
        }
        for f in &mut self.drive {
            *f = f.conj();
        }
        self.q = from.q.to_vec();
        self.v = from.v.iter().map(|v| -v).collect();
    }

    /// In coordinates p, q = B p.
    pub fn in_coordinates(&self, b: &Rows) -> Self {
        let count = b.len();
        let on = |row: &[f64]| -> Vec<f64> {
            (0..count).map(|j| (0..count).map(|i| row[i] * b[i][j]).sum()).collect()
        };
        let congruent = |a: &Rows| -> Rows {
            let half: Rows = a.iter().map(|row| on(row)).collect();
            let entry = |i: usize, j: usize| (0..count).map(|k| b[k][i] * half[k][j]).sum::<f64>();
            // Symmetric to the bit.
            (0..count)
                .map(|i| (0..count).map(|j| 0.5 * (entry(i, j) + entry(j, i))).collect())
                .collect()
        };
        let mut other = self.clone();
        (other.mass, other.stiffness) = (congruent(&self.mass), congruent(&self.stiffness));
        if let Damping::Matrix(rows) = &self.damping {
            other.damping = Damping::Matrix(congruent(rows));
        }
        let parts = [|f: &Complex<f64>| f.re, |f: &Complex<f64>| f.im];
        let [re, im] = parts.map(|part| on(&self.drive.iter().map(part).collect::<Vec<_>>()));
        other.drive = re.into_iter().zip(im).map(|(re, im)| Complex::new(re, im)).collect();
        other.load = on(&self.load);
        for stop in &mut other.stops {
            stop.normal = on(&stop.normal);
            if let Some((_, tangent)) = &mut stop.friction {
                *tangent = on(tangent);
            }
        }
        other
    }

    /// Whether impacts may gain energy, as those by Newton's law with friction may.
    pub fn may_gain(&self) -> bool {
        self.law == ImpactLaw::Newton && self.stops.iter().any(|stop| stop.friction.is_some())
    }

    /// The structure, in these units.
    pub fn structure(&self, units: Units) -> Structure {
        let Units { mass, length, time } = units;
        let all = |rows: &Rows, unit: f64| -> Rows {
            rows.iter().map(|row| row.iter().map(|x| x * unit).collect()).collect()
        };
        let force = mass * length / (time * time);
        let mut builder =
            Structure::builder(all(&self.mass, mass), all(&self.stiffness, mass / (time * time)));
        builder = match &self.damping {
            Damping::None => builder,
            Damping::Ratios(ratios) => builder.damping_ratios(ratios.clone()),
            Damping::Matrix(rows) => builder.damping(all(rows, mass / time)),
        };
        builder = builder
            .drive(
                self.drive.iter().map(|f| f * force).collect::<Vec<_>>(),
                self.omega / time,
                self.phase,
            )
            .static_load(self.load.iter().map(|f| f * force).collect::<Vec<_>>())
            .law(self.law)
            .simultaneous(self.rule);
        for stop in &self.stops {
            let [amplitude, phase] = stop.moving;
            let mut made = Stop::new(stop.normal.clone(), stop.gap * length, stop.restitution);
            if amplitude != 0.0 {
                made = made.moving(amplitude * length, phase);
            }
            if let Some((friction, tangent)) = &stop.friction {
                made = made.with_friction(*friction, tangent.clone());
            }
            builder = builder.stop(made);
        }
        builder.build().unwrap()
    }

    pub fn start(&self, Units { length, time, .. }: Units) -> StructureState {
        let in_units = |of: &[f64], unit: f64| of.iter().map(|x| x * unit).collect::<Vec<_>>();
        StructureState::new(&in_units(&self.q, length), &in_units(&self.v, length / time))
    }
}

/// A chain that nothing holds.
fn chain(rng: &mut ChaCha8Rng, count: usize) -> Rows {
    let mut k = vec![vec![0.0; count]; count];
    for i in 0..count - 1 {
        let spring = uniform(rng, 0.5, 4.0);
        k[i][i] += spring;
        k[i + 1][i + 1] += spring;
        k[i][i + 1] -= spring;
        k[i + 1][i] -= spring;
    }
    k
}

impl DrawnStop {
    /// `modal`: at any point of a shape, else of a coordinate, or between two.
    fn random(rng: &mut ChaCha8Rng, count: usize, modal: bool) -> Self {
        let mut normal = if modal { vector(rng, count, 1.0) } else { vec![0.0; count] };
        if !modal {
            let at = rng.random_range(0..count);
            normal[at] = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            if rng.random_bool(0.3) && count > 1 {
                let other = (at + 1) % count;
                normal[other] = -normal[at];
            }
        }
        let restitution = [0.0, 0.2, 0.5, 0.8, 0.95, 1.0][rng.random_range(0..6usize)];
        let gap = uniform(rng, 0.05, 1.0);
        let moves = rng.random_bool(0.2);
        let moving =
            if moves { [uniform(rng, 0.0, 0.04), uniform(rng, 0.0, 6.0)] } else { [0.0; 2] };
        let rough = count > 1 && rng.random_bool(0.2);
        let friction = rough.then(|| (uniform(rng, 0.0, 0.8), vector(rng, count, 1.0)));
        Self { normal, gap, restitution, friction, moving }
    }
}
