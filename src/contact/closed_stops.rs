//! Which stops of a structure stay closed, and which it leaves, from an instant at which some of
//! them are touched without approach, g = g' = 0 (docs/structures.md).
//!
//! Without friction the forces P solve a linear complementarity problem in accelerations,
//!
//! ```text
//! g'' = gamma - W P <= 0,   P >= 0,   P . g'' = 0,     W_ij = n_i M^-1 n_j
//! ```
//!
//! with the free accelerations gamma of the gaps. W is positive semidefinite, so that the motion is
//! unique where there is any (complementarity.rs). Where both P and g'' are zero to rounding their
//! next derivatives decide, by the same problem, in which the forces of stops that are pressed may
//! change either way. What is zero to all orders stays closed, and carries nothing.
//!
//! With friction one stop slides or sticks as in sustained.rs, beside stops that do not see it.

mod complementarity;
mod instant;
#[cfg(test)]
mod tests;

use self::complementarity::Complementarity;
use self::instant::Instant;
use crate::contact::sustained::{ContactMode, Next};
use crate::flight::structure::{Closed, LinearMotion};
use crate::model::state::Clock;
use crate::model::structure::Structure;
use crate::numerics::dense::{DEPENDENT, dot, length};
use crate::search::first_contact::Start;

/// How a flight starts at a stop that is left by g'' < 0: that velocities have rounding, from those
/// before an impact, plays no part.
const LEFT: Start = Start::Grazed(0.0);
/// Derivatives of the gaps, from the second on, that may decide.
const ORDERS: usize = 6;

/// What follows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Landing {
    /// These stay closed. The structure leaves the others, and how a flight starts at them.
    Hold { closed: Closed, leaving: Vec<(usize, Start)> },
    /// It leaves all of them.
    Separate { leaving: Vec<(usize, Start)> },
    /// No contact forces fit, or more than one set of them: with friction, or between stops that
    /// close in on the structure.
    Painleve,
    /// More than one stop would stay closed with friction, or others that see one that does.
    TooManyWithFriction,
}

/// What becomes of each candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fate {
    /// Closed, with a force; closed, without.
    Pressed,
    Idle,
    Leaves(Start),
}

/// What follows from q and q' at an instant, with the `candidates` touched without approach, to
/// rounding. `at_rest`: one of them whose velocity of slip is 0 by what came before, whatever
/// rounding has made of it: slip has just ended, or an impact has ended in stick.
pub(crate) fn land(
    structure: &Structure,
    clock: Clock,
    (q, v): (&[f64], &[f64]),
    candidates: &[usize],
    at_rest: Option<usize>,
) -> Landing {
    let instant = Instant::new(structure, clock, q, v);
    let rubs = |stop: &usize| structure.stops()[*stop].friction() > 0.0;
    let (mut smooth, mut groups) = (Vec::new(), Vec::new());
    for group in groups_that_see_each_other(structure, candidates) {
        if group.iter().any(rubs) { groups.push(group) } else { smooth.extend(group) }
    }
    let Some(mut fates) = smooth_fates(&instant, &smooth) else { return Landing::Painleve };
    let mut rubbing = None;
    for group in groups {
        let rub = Rub { instant: &instant, group: &group, at: (clock, q, v), at_rest };
        match rub.outcome() {
            Outcome::Smooth(others) => fates.extend(others),
            Outcome::Rubs(stop, mode, others) => {
                if rubbing.replace((stop, mode)).is_some() {
                    return Landing::TooManyWithFriction;
                }
                fates.extend(others);
            }
            Outcome::Painleve => return Landing::Painleve,
            Outcome::TooMany => return Landing::TooManyWithFriction,
        }
    }
    fates.sort_unstable_by_key(|(stop, _)| *stop);
    let of = |fate: Fate| {
        let such = fates.iter().filter(move |(_, other)| *other == fate);
        such.map(|(stop, _)| *stop).collect::<Vec<_>>()
    };
    // Forces are those of the first that are no combination of others before them.
    let closed: Vec<usize> = of(Fate::Pressed).into_iter().chain(of(Fate::Idle)).collect();
    let leaving = fates
        .iter()
        .filter_map(|&(stop, fate)| match fate {
            Fate::Leaves(start) => Some((stop, start)),
            _ => None,
        })
        .collect();
    match rubbing {
        None if closed.is_empty() => Landing::Separate { leaving },
        None => Landing::Hold { closed: Closed::Frictionless(closed), leaving },
        Some((stop, ContactMode::Stick)) => {
            Landing::Hold { closed: Closed::Stick { stop, beside: closed }, leaving }
        }
        Some((stop, mode)) => {
            let direction = mode.direction();
            Landing::Hold { closed: Closed::Slide { stop, direction, beside: closed }, leaving }
        }
    }
}

/// Candidates in groups, none of which changes the motion along the normals and tangents of
/// another.
fn groups_that_see_each_other(structure: &Structure, candidates: &[usize]) -> Vec<Vec<usize>> {
    let rows = |stop: usize| {
        let of = structure.contact(stop);
        [&of.modal_normal, &of.modal_tangent]
    };
    let product = |a: &[_], b: &[_]| dot(a, b).hi.abs() > DEPENDENT * length(a) * length(b);
    let see = |i: usize, j: usize| rows(i).iter().any(|a| rows(j).iter().any(|b| product(a, b)));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for &stop in candidates {
        let (seen, apart): (Vec<_>, Vec<_>) =
            groups.into_iter().partition(|group| group.iter().any(|&other| see(stop, other)));
        groups = apart;
        groups.push(seen.into_iter().flatten().chain([stop]).collect());
    }
    groups
}

/// What becomes of stops without friction; `None`: they jam.
fn smooth_fates(instant: &Instant<'_>, stops: &[usize]) -> Option<Vec<(usize, Fate)>> {
    let mut problem = Complementarity::new(instant.structure, stops);
    let mut motion = instant.motion();
    for order in 0..ORDERS {
        let free = motion.free();
        let gammas: Vec<(f64, f64)> =
            stops.iter().map(|&stop| motion.gap_acceleration(&free, stop)).collect();
        problem.decide(order, &gammas)?;
        motion.go_on(&free, stops.iter().copied().zip(problem.forces()).map(|(j, p)| (j, p, 0.0)));
        if problem.is_decided() {
            break;
        }
    }
    Some(stops.iter().copied().zip(problem.fates()).collect())
}

/// Candidates that see each other, some with friction.
struct Rub<'a> {
    instant: &'a Instant<'a>,
    group: &'a [usize],
    at: (Clock, &'a [f64], &'a [f64]),
    at_rest: Option<usize>,
}

enum Outcome {
    Smooth(Vec<(usize, Fate)>),
    /// This stop stays closed, and the others of the group do not.
    Rubs(usize, ContactMode, Vec<(usize, Fate)>),
    Painleve,
    TooMany,
}

impl Rub<'_> {
    fn structure(&self) -> &Structure {
        self.instant.structure
    }

    fn outcome(&self) -> Outcome {
        if let [stop] = *self.group {
            return self.alone(stop);
        }
        // All but one must leave beyond doubt, or what holds them would depend on friction
        // elsewhere.
        let rubs = |stop: &usize| self.structure().stops()[*stop].friction() > 0.0;
        let (rough, smooth): (Vec<usize>, Vec<usize>) = self.group.iter().partition(|j| rubs(j));
        let mut fitting = Vec::new();
        if let Some(fates) = smooth_fates(self.instant, &smooth) {
            let mut motion = self.instant.motion();
            let mut problem = Complementarity::new(self.structure(), &smooth);
            let free = motion.free();
            let gammas: Vec<_> =
                smooth.iter().map(|&stop| motion.gap_acceleration(&free, stop)).collect();
            let solved = problem.decide(0, &gammas).is_some();
            let forces = smooth.iter().copied().zip(problem.forces());
            motion.go_on(&free, forces.map(|(j, p)| (j, p, 0.0)));
            if solved && let Some(leaving) = leaving(&motion, &rough) {
                fitting.push(Outcome::Smooth(fates.into_iter().chain(leaving).collect()));
            }
        }
        for &stop in &rough {
            match self.alone(stop) {
                Outcome::Rubs(_, mode, _) => {
                    let mut motion = self.instant.motion();
                    let free = motion.free();
                    let force = self.instant.contact(stop, self.slip_of(stop), &free).force(mode);
                    motion.go_on(&free, [(stop, force.normal, force.tangential)]);
                    let others: Vec<usize> =
                        self.group.iter().copied().filter(|&other| other != stop).collect();
                    if let Some(leaving) = leaving(&motion, &others) {
                        fitting.push(Outcome::Rubs(stop, mode, leaving));
                    }
                }
                Outcome::Smooth(_) => {}
                other => return other,
            }
        }
        let one = fitting.pop();
        match one {
            Some(one) if fitting.is_empty() => one,
            Some(_) => Outcome::Painleve,
            None => Outcome::TooMany,
        }
    }

    /// The velocity of slip, 0 where it is rounding.
    fn slip_of(&self, stop: usize) -> f64 {
        if self.at_rest == Some(stop) { 0.0 } else { self.instant.slip(stop) }
    }

    /// One stop with friction as if there were no other.
    fn alone(&self, stop: usize) -> Outcome {
        let (clock, q, v) = self.at;
        let free = self.instant.motion().free();
        let contact = self.instant.contact(stop, self.slip_of(stop), &free);
        let falls = |mode: ContactMode| {
            let closed = match mode {
                ContactMode::Stick => Closed::Stick { stop, beside: Vec::new() },
                mode => Closed::Slide { stop, direction: mode.direction(), beside: Vec::new() },
            };
            LinearMotion::new(self.structure(), closed)
                .is_some_and(|motion| motion.force_falls(&motion.flight(clock, q, v), stop))
        };
        match contact.land(falls) {
            Next::Hold(mode) => Outcome::Rubs(stop, mode, Vec::new()),
            Next::Separate => Outcome::Smooth(vec![(stop, Fate::Leaves(LEFT))]),
            Next::Release => Outcome::Smooth(vec![(stop, Fate::Leaves(Start::Released))]),
            Next::Painleve | Next::Jammed => Outcome::Painleve,
        }
    }
}

/// These stops, if all of them are left by more than rounding.
fn leaving(motion: &instant::Motion<'_>, stops: &[usize]) -> Option<Vec<(usize, Fate)>> {
    stops
        .iter()
        .map(|&stop| {
            let (acceleration, noise) = motion.gap_after(stop);
            (acceleration < -noise).then_some((stop, Fate::Leaves(LEFT)))
        })
        .collect()
}

/// Impulses P >= 0 of stops without friction with W P >= b, complementary; b is `wanted`, with its
/// rounding. `None`: there are none.
pub(crate) fn impulses(
    structure: &Structure,
    stops: &[usize],
    wanted: &[(f64, f64)],
) -> Option<Vec<f64>> {
    let mut problem = Complementarity::new(structure, stops);
    problem.decide(0, wanted)?;
    Some(problem.forces())
}
