//! The laws of restitution: where the walk along the impulse ends.
//!
//! With P_I the impulse at which u = 0, and u0 the approach velocity:
//!
//! ```text
//! poisson     P = (1 + r) P_I                              impulses
//! newton      u = -r u0                                    velocities
//! energetic   -int u dP (restitution) = r^2 int u dP (approach)   works of the normal impulse
//! ```
//!
//! While the tip slips one way u(P) is one straight line, of slope -a1, and all three end at
//! (1 + r) u0/a1: the regime does not depend on the law, nor does the outcome of `frictionless`
//! and `slip`. The laws part where slip ends, at P*: u(P) bends there, its slope is -a2 after.
//!
//! Where a2 = 0 (mbar = 0 and the tip sticks) u changes no more. `newton` then never gets to
//! -r u0, and `energetic` with u = 0 never returns any work: the walk ends at P*, since no further
//! impulse changes a velocity.
//!
//! Source: docs/theory.md, section 4; W. J. Stronge, Impact Mechanics (2000), and Beghin and
//! Boulanger as quoted by Han, Jin & Hu (2004), section 2.

/// An impact whose slip ends at P*, seen from there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bend {
    /// r.
    pub restitution: f64,
    /// u before the impact.
    pub approach_velocity: f64,
    /// x2' before the impact.
    pub v2: f64,
    /// P*.
    pub switch: f64,
    /// P_I.
    pub impulse_approach: f64,
    /// u at P*: not negative in approach, not positive in restitution, but for rounding.
    pub u: f64,
    /// a1 = -du/dP before P*.
    pub slows_before: f64,
    /// a2 = -du/dP after P*: not negative.
    pub slows_after: f64,
    /// Whether P* < P_I.
    pub in_approach: bool,
    /// Whether the tip sticks after P* on a body that impacts move (mbar > 0).
    pub sticks_on_mass: bool,
}

/// How the walk goes on after P*.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    /// Impulse after P*, not negative but for rounding.
    pub impulse: f64,
    /// u after the impact where the law knows it better than the difference of the velocities.
    pub separation: Option<f64>,
}

impl End {
    /// The end at -`speed` after so much impulse, or at P* if no finite impulse gets there.
    fn at(speed: f64, impulse: f64) -> Self {
        if impulse.is_finite() {
            Self { impulse: impulse.max(0.0), separation: Some(-speed) }
        } else {
            Self { impulse: 0.0, separation: None }
        }
    }
}

/// A law of restitution.
pub(super) trait Restitution {
    /// Whether an impact under this law may gain energy.
    const CAN_GAIN: bool;

    /// The end of an impact whose slip ends at P*.
    fn end(bend: &Bend) -> End;
}

/// P_II = r P_I.
pub(super) struct Poisson;

impl Restitution for Poisson {
    const CAN_GAIN: bool = false;

    #[inline]
    fn end(bend: &Bend) -> End {
        let impulse = (1.0 + bend.restitution) * bend.impulse_approach - bend.switch;
        End {
            impulse: if bend.in_approach { impulse } else { impulse.max(0.0) },
            // u = -x2' = -mbar (P - P_I) in stick: exactly -r of what it was without slip.
            separation: (bend.in_approach && bend.sticks_on_mass)
                .then_some(bend.restitution * bend.v2),
        }
    }
}

/// u_post = -r u.
pub(super) struct Newton;

impl Restitution for Newton {
    const CAN_GAIN: bool = true;

    fn end(bend: &Bend) -> End {
        let speed = bend.restitution * bend.approach_velocity;
        End::at(speed, (speed + bend.u) / bend.slows_after)
    }
}

/// Work of the normal impulse in restitution = r^2 that in approach.
pub(super) struct Energetic;

impl Restitution for Energetic {
    const CAN_GAIN: bool = false;

    fn end(bend: &Bend) -> End {
        let &Bend { restitution, approach_velocity, switch, u, slows_before, slows_after, .. } =
            bend;
        // Products under a root are rooted one by one: their squares could leave the range.
        if bend.in_approach {
            // Approach: P* (u0 + u)/2 before P*, u^2/(2 a2) after; restitution: u_post^2/(2 a2).
            let before = (slows_after * switch).sqrt() * (approach_velocity + u).max(0.0).sqrt();
            let speed = restitution * u.hypot(before);
            End::at(speed, (speed + u) / slows_after)
        } else {
            // Approach: u0^2/(2 a1); restitution: u^2/(2 a1) before P*, the rest after.
            let (reached, whole) = ((-u).max(0.0), restitution * approach_velocity);
            let lacking = (whole - reached).max(0.0);
            let ratio = slows_after / slows_before;
            let after = (ratio * lacking).sqrt() * (whole + reached).sqrt();
            let speed = reached.hypot(after);
            End::at(speed, lacking * ((whole + reached) / (speed + reached)) / slows_before)
        }
    }
}
