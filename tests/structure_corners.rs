//! Corners: stops that act on each other are met at one instant, again and again, until the
//! structure is at rest on all of them. And runs that fall dead on their stops.

use nalgebra::{Complex, DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vibroimpact::{
    CancelToken, Clock, EventKind, Horizon, Run, RunOptions, Simultaneous, Start, Stop,
    StopContact, StopReason, Structure, StructureMotion, StructureState, run,
};

use crate::support::draws;

fn random(rng: &mut ChaCha8Rng, count: usize, size: f64) -> DVector<f64> {
    DVector::from_fn(count, |_, _| rng.random_range(-size..size))
}

fn squares(rng: &mut ChaCha8Rng, count: usize, size: f64, least: f64) -> DMatrix<f64> {
    let a = DMatrix::from_fn(count, count, |_, _| rng.random_range(-size..size));
    let sum = &a * a.transpose();
    0.5 * (&sum + sum.transpose()) + DMatrix::identity(count, count) * least
}

fn rows(of: &DMatrix<f64>) -> Vec<Vec<f64>> {
    of.row_iter().map(|row| row.iter().copied().collect()).collect()
}

/// A corner of two to four stops, into which a load presses, in some units of length and time.
struct Corner {
    mass: DMatrix<f64>,
    normals: DMatrix<f64>,
    restitution: f64,
    load: DVector<f64>,
    place: DVector<f64>,
    length: f64,
    time: f64,
}

impl Corner {
    /// One whose gaps all close under the load.
    fn random(rng: &mut ChaCha8Rng, at_origin: bool) -> Self {
        loop {
            let corner = Self::draw(rng, at_origin);
            let closing = &corner.normals * corner.acceleration();
            if closing.iter().all(|a| *a > 0.1 * corner.length / corner.time.powi(2)) {
                return corner;
            }
        }
    }

    fn draw(rng: &mut ChaCha8Rng, at_origin: bool) -> Self {
        let count = rng.random_range(2..=4);
        let stops = rng.random_range(2..=count);
        let mass = squares(rng, count, 0.7, 0.5);
        // Neither narrow nor nearly dependent.
        let normals = DMatrix::from_fn(stops, count, |i, j| {
            rng.random_range(-0.4..0.4) + f64::from(u8::from(i == j))
        });
        let pressed = DVector::from_fn(stops, |_, _| rng.random_range(0.3..2.0));
        let [length, time] = [8.0, 4.0].map(|most| 10f64.powf(rng.random_range(-most..most)));
        let place = random(rng, count, if at_origin { 0.0 } else { 1.0 } + 1e-300);
        let load = normals.transpose() * pressed * (length / (time * time));
        let restitution = [0.0, 0.1, 0.3, 0.5, 0.7, 0.9][rng.random_range(0..6)];
        let place = if at_origin { place * 0.0 } else { place * length };
        Self { mass, normals, restitution, load, place, length, time }
    }

    fn structure(&self, stiffness: f64, rule: Simultaneous) -> Structure {
        let stiffness = &self.mass * (stiffness / (self.time * self.time));
        let mut builder = Structure::builder(rows(&self.mass), rows(&stiffness))
            .static_load(self.load.iter().copied().collect::<Vec<_>>())
            .simultaneous(rule);
        for normal in rows(&self.normals) {
            let gap = normal.iter().zip(&self.place).map(|(n, q)| n * q).sum();
            builder = builder.stop(Stop::new(normal, gap, self.restitution));
        }
        builder.build().unwrap()
    }

    /// The acceleration by the load.
    fn acceleration(&self) -> DVector<f64> {
        self.mass.clone().lu().solve(&self.load).unwrap()
    }

    fn run(
        &self,
        structure: &Structure,
        q: &DVector<f64>,
        v: &DVector<f64>,
        end: f64,
    ) -> Run<Structure> {
        let start = StructureState::new(q.as_slice(), v.as_slice());
        let options =
            RunOptions { max_events: 20_000, ..RunOptions::until(Horizon::Time(end * self.time)) };
        run(structure, start, options, &CancelToken::never()).unwrap()
    }

    /// How far a run goes into a stop at most, over the unit of length and the place.
    fn depth(&self, structure: &Structure, run: &Run<Structure>) -> f64 {
        let end = run.final_state.time;
        let times: Vec<f64> = (0..=200).map(|i| (end * f64::from(i) / 200.0).min(end)).collect();
        let states = run.trajectory(&times).unwrap();
        let impacts = run.impacts.iter().map(|row| row.q.clone());
        let gaps = states.into_iter().map(|state| state.q).chain(impacts).flat_map(|q| {
            let size = q.iter().fold(self.length, |most, q| most.max(q.abs()));
            let gap = move |stop: &Stop| {
                (stop.normal().iter().zip(&q).map(|(n, q)| n * q).sum::<f64>() - stop.gap()) / size
            };
            structure.stops().iter().map(gap).collect::<Vec<_>>()
        });
        gaps.fold(0.0, f64::max)
    }
}

/// Cases that were late, in the last digits of one bounce and by a stop that was left and pressed at
/// one instant.
const LATE: [usize; 2] = [1023, 2238];

/// A body falls along the acceleration by its load: it meets all stops of the corner at once, and
/// bounces as a ball on a table does, for 2 r u/(g'' (1 - r)) from the first impact on, at any place,
/// in any units, and with soft springs as with none.
#[test]
fn bounces_in_a_corner_end_after_the_sum_of_a_geometric_series() {
    let mut rng = ChaCha8Rng::seed_from_u64(1687);
    let (mut worst, mut deepest, mut impacts) = (0.0f64, 0.0f64, 0);
    let cases = draws(200, 4_000);
    for case in 0..cases.max(LATE[1] + 1) {
        let at_origin = case % 2 == 0;
        let corner = Corner::random(&mut rng, at_origin);
        // Springs pull along the fall at the origin alone.
        let stiffness = if at_origin { [0.0, 1e-14, 1e-13][case / 2 % 3] } else { 0.0 };
        let structure = corner.structure(stiffness, Simultaneous::Together);
        let (height, speed) = (rng.random_range(0.2..2.0), rng.random_range(-0.5..0.5));
        if case >= cases && !LATE.contains(&case) {
            continue;
        }
        let direction = corner.acceleration();
        let q = &corner.place - &direction * (height * corner.time * corner.time);
        let v = &direction * (speed * corner.time);
        let met = f64::sqrt(speed * speed + 2.0 * height);
        let r = corner.restitution;
        let end = met - speed + 2.0 * r * met / (1.0 - r);
        let run = corner.run(&structure, &q, &v, 1.2 * end);
        let ends = [StopReason::Completed, StopReason::Rest];
        assert!(ends.contains(&run.stop_reason), "case {case}: {:?}", run.stop_reason);
        let all: Vec<u32> = (0..structure.stops().len() as u32).collect();
        let last = run.contacts.last().unwrap();
        assert_eq!(last.closed.as_slice(), all, "case {case}, r = {r}");
        let error = (last.time / corner.time / end - 1.0).abs();
        let depth = corner.depth(&structure, &run);
        (worst, deepest) = (worst.max(error), deepest.max(depth));
        impacts += run.impacts.len();
        assert!(error < 1e-11 && depth < 1e-13, "case {case}, r = {r}: {error:e} {depth:e}");
    }
    println!("{impacts} impacts; time {worst:e}, depth {deepest:e}");
    assert!(impacts > 5_000);
}

/// Two stops are met at one instant, one by two bodies that pass 10^12 times as fast as they meet: the
/// search for that contact ends at the other, and still tells where it is, not earlier by its rounding.
#[test]
fn contacts_of_one_instant_are_told_in_all_their_digits() {
    let fast = 2f64.powi(40);
    let identity: Vec<Vec<f64>> = rows(&DMatrix::identity(3, 3));
    for ulps in -4..=4 {
        // Both gaps are t (t - 1/64), one of them with a rounding.
        let load = 128.0 * (1.0 + f64::from(ulps) * f64::EPSILON);
        let structure = Structure::builder(identity.clone(), vec![vec![0.0; 3]; 3])
            .static_load([64.0, 64.0, load])
            .stop(Stop::new([0.0, 0.0, 1.0], 0.0, 0.5))
            .stop(Stop::new([1.0, 1.0, 0.0], 0.0, 0.5))
            .build()
            .unwrap();
        let motion = StructureMotion::new(&structure);
        let flight = motion.flight(Clock::START, &[0.0; 3], &[fast, -fast - 1.0, -1.0]);
        let starts = [(0, Start::Touching), (1, Start::Touching)];
        let StopContact::Met { time, offset, .. } = motion.next_contact(&flight, &starts) else {
            panic!("{ulps}")
        };
        let error = 64.0 * (time + offset) - 1.0;
        assert!(error.abs() < 1e-14, "{ulps}: {error:e}");
    }
}

/// A fall into a corner, under one of the three rules.
struct Fall {
    corner: Corner,
    structure: Structure,
    rule: usize,
    q: DVector<f64>,
    v: DVector<f64>,
}

impl Fall {
    fn draw(rng: &mut ChaCha8Rng, at_origin: bool) -> Self {
        let mut corner = Corner::draw(rng, at_origin);
        // Chatter of one stop between the impacts on others takes the square of its impacts.
        corner.restitution = corner.restitution.min(0.5);
        let stiffness = [0.0, 1e-12, 1e-4, 1.0][rng.random_range(0..4)];
        let rule = rng.random_range(0..3);
        let named = [Simultaneous::Together, Simultaneous::Sequence, Simultaneous::Stop][rule];
        let structure = corner.structure(stiffness, named);
        let count = structure.coordinates();
        let depth = DVector::from_fn(structure.stops().len(), |_, _| rng.random_range(0.2..2.0));
        let by = corner.mass.clone().lu().solve(&corner.normals.transpose()).unwrap();
        let back = (&corner.normals * &by).lu().solve(&depth).unwrap();
        let q = &corner.place - by * back * corner.length;
        let v = random(rng, count, 1.0) * (corner.length / corner.time);
        Self { corner, structure, rule, q, v }
    }

    fn run(&self) -> Run<Structure> {
        self.corner.run(&self.structure, &self.q, &self.v, 30.0)
    }
}

/// The part of all works that the change of energy leaves open.
fn unexplained(run: &Run<Structure>) -> f64 {
    let audit = run.energy_audit(&CancelToken::never()).unwrap();
    audit.residual().abs() / audit.total
}

const FALLS: u64 = 1686;

/// Any other fall into a corner: no run enters a stop, hangs, or gains energy, whatever the rule.
#[test]
fn falls_into_a_corner_end_and_enter_no_stop() {
    let mut rng = ChaCha8Rng::seed_from_u64(FALLS);
    let (mut deepest, mut lost, mut impacts, mut rest, mut caps) = (0.0f64, 0.0f64, 0, [0; 3], 0);
    let cases = draws(150, 3_000);
    for case in 0..cases {
        let fall = Fall::draw(&mut rng, case % 2 == 0);
        let run = fall.run();
        let reasons = [
            StopReason::Completed,
            StopReason::Rest,
            StopReason::Simultaneous,
            StopReason::SequenceCap,
        ];
        // Chatter of chatters of chatters, each bounce by itself, may take more events than that.
        let capped = run.stop_reason == StopReason::EventCap;
        caps += usize::from(capped);
        assert!(capped || reasons.contains(&run.stop_reason), "case {case}: {:?}", run.stop_reason);
        let depth = fall.corner.depth(&fall.structure, &run);
        deepest = deepest.max(depth);
        assert!(depth < 1e-13, "case {case}: {depth:e}");
        let error = unexplained(&run);
        lost = lost.max(error);
        assert!(error < 1e-12, "case {case}: {error:e}");
        impacts += run.impacts.len();
        let closed = run.contacts.last().map_or(0, |row| row.closed.len());
        rest[fall.rule] += usize::from(closed == fall.structure.stops().len());
    }
    println!(
        "{impacts} impacts; at rest on all stops {rest:?}; depth {deepest:e}, energy {lost:e}, \
         {caps} capped"
    );
    assert!(rest[0] > 10 && rest[1] > 10 && caps < cases / 20);
}

/// In this fall an impact pulls a closed stop off, and the next one of the same instant presses it:
/// it then counts with the velocity at which it leaves.
#[test]
fn a_closed_stop_that_an_impact_pulls_off_is_closed_no_more() {
    let mut rng = ChaCha8Rng::seed_from_u64(FALLS);
    let fall = (0..=1788).map(|case| Fall::draw(&mut rng, case % 2 == 0)).last().unwrap();
    let run = fall.run();
    let error = unexplained(&run);
    assert!(error < 1e-12, "{error:e}");
}

/// Two to four coordinates that fall dead on their stops (r = 0); `rough`: one stop with friction,
/// else three without.
fn dead(rng: &mut ChaCha8Rng, rough: bool, driven: bool) -> Structure {
    let count = rng.random_range(2..=4);
    let (mass, stiffness) = (squares(rng, count, 0.5, 1.0), squares(rng, count, 1.0, 0.3));
    let damping = rows(&squares(rng, count, 0.3, 0.0));
    let mut builder = Structure::builder(rows(&mass), rows(&stiffness)).damping(damping);
    if driven {
        let force: Vec<_> = random(rng, count, 2.0).iter().map(|&f| Complex::from(f)).collect();
        builder = builder.drive(force, rng.random_range(0.3..1.5), 0.4);
    }
    if !rough {
        builder = builder.simultaneous(Simultaneous::Together);
    }
    for _ in 0..if rough { 1 } else { 3 } {
        let (normal, tangent) = (random(rng, count, 1.0), random(rng, count, 1.0));
        let normal = normal.as_slice().to_vec();
        let mut stop = Stop::new(normal, rng.random_range(0.1..0.3), 0.0);
        if rough {
            let tangent = tangent.as_slice().to_vec();
            stop = stop.with_friction(rng.random_range(0.2..0.8), tangent);
        }
        if driven {
            stop = stop.moving(rng.random_range(0.0..0.1), 1.0);
        }
        builder = builder.stop(stop);
    }
    builder.build().unwrap()
}

/// They close and open their stops, slide and stick, few of them at one instant; without drive their
/// energy only falls.
#[test]
fn runs_that_fall_dead_go_on() {
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    for (rough, driven) in [(false, false), (false, true), (true, false), (true, true)] {
        let (mut counts, mut most, mut ended) = ([0usize; 4], 0, 0);
        let cases = draws(30, 600);
        for case in 0..cases {
            let structure = dead(&mut rng, rough, driven);
            let count = structure.coordinates();
            let start =
                StructureState::new(&vec![0.0; count], random(&mut rng, count, 2.0).as_slice());
            let options = RunOptions { max_events: 400, ..RunOptions::until(Horizon::Time(40.0)) };
            let run = run(&structure, start, options, &CancelToken::never()).unwrap();
            let usual = [StopReason::Completed, StopReason::EventCap, StopReason::Rest];
            ended += usize::from(!usual.contains(&run.stop_reason));
            counts[0] += run.impacts.len();
            let of = |kinds: &[EventKind]| {
                run.contacts.iter().filter(|row| kinds.contains(&row.kind)).count()
            };
            counts[1] += of(&[EventKind::Release]);
            // Slip ends in stick, or in slip the other way.
            let slides = [EventKind::SlidePositive, EventKind::SlideNegative];
            let pairs = run.contacts.windows(2).map(|pair| (pair[0].kind, pair[1].kind));
            let turns = pairs
                .filter(|(one, next)| one != next && slides.contains(one) && slides.contains(next));
            counts[2] += of(&[EventKind::Stick]) + turns.count();
            counts[3] += of(&slides);
            let struck = |time: f64| run.impacts.iter().filter(|row| row.time == time).count();
            most = run.impacts.iter().map(|row| struck(row.time)).fold(most, usize::max);
            let at = |time: f64| run.contacts.iter().filter(|row| row.time == time).count();
            most = run.contacts.iter().map(|row| at(row.time)).fold(most, usize::max);
            let end = run.final_state.time;
            let times: Vec<f64> =
                (0..=300).map(|i| (end * f64::from(i) / 300.0).min(end)).collect();
            let mut energy = f64::INFINITY;
            for (time, state) in times.iter().zip(run.trajectory(&times).unwrap()) {
                for stop in structure.stops() {
                    let place: f64 = stop.normal().iter().zip(&state.q).map(|(n, q)| n * q).sum();
                    let angle = structure.drive_frequency() * time + stop.phase();
                    let gap = place - stop.gap() - stop.amplitude() * angle.cos();
                    assert!(gap < 1e-12, "{rough} {driven} {case}: {gap:e} at {time}");
                }
                if !driven {
                    let form = |matrix: &[Vec<f64>], x: &[f64]| -> f64 {
                        let product =
                            |row: &[f64]| row.iter().zip(x).map(|(m, x)| m * x).sum::<f64>();
                        matrix.iter().zip(x).map(|(row, x)| x * product(row)).sum::<f64>()
                    };
                    let now = 0.5
                        * (form(structure.mass(), &state.v)
                            + form(structure.stiffness(), &state.q));
                    assert!(now <= energy * (1.0 + 1e-12) + 1e-26, "{case}: {energy} {now}");
                    energy = now;
                }
            }
        }
        println!(
            "friction {rough}, drive {driven}: {} impacts, {} releases, {} ends of slip, {} slides, \
             {most} events of a kind at one instant, {ended} without an outcome",
            counts[0], counts[1], counts[2], counts[3]
        );
        let [met, released, stuck, slid] = counts;
        assert!(met > 30 && released > 10 && most < 8, "{counts:?} {most}");
        // With friction some states have no motion that goes on, or several: a part of all runs, and
        // none where there is no friction.
        assert!(ended <= if rough { cases / 20 } else { 0 }, "{ended} of {cases}");
        assert!(!rough || (stuck > 5 && slid > 10), "{counts:?}");
    }
}
