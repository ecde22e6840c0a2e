//! The judge of the contact audit, where what a flight does is known in closed form.

use crate::support::audit::Outcome;
use crate::support::audit::dense::{ExactMotion, Gap, Sample};
use crate::support::audit::double_double::Dd;
use crate::support::audit::judge::{Judge, Last, Level, Measured, Searched, Told};

const SPAN: f64 = 2.0;

/// g = height - (s - 1)^2, a hump at s = 1; the point is the time.
struct Hump {
    height: f64,
}

impl ExactMotion for Hump {
    type Point = Dd;

    fn touching(&self) -> bool {
        false
    }

    fn start(&self) -> Dd {
        Dd::ZERO
    }

    fn first_step(&self) -> f64 {
        1.0 / 16.0
    }

    fn later(&self, point: &Dd, h: Dd) -> Dd {
        *point + h
    }

    fn gap(&self, point: &Dd) -> Gap {
        let past = *point - Dd::ONE;
        let value = Dd::new(self.height) - past * past;
        Gap { value, rate: -past.scale(2.0), second: Dd::new(-2.0) }
    }

    fn sample(&self, time: Dd, point: Dd) -> Sample<Dd> {
        let Gap { value, rate, second } = self.gap(&point);
        Sample { time, point, gap: value, rate: rate.hi, second: second.hi }
    }

    fn next(&mut self, from: &Sample<Dd>) -> Option<Sample<Dd>> {
        let time = from.time + Dd::new(self.first_step());
        (time.hi <= SPAN).then(|| self.sample(time, time))
    }
}

impl Measured for Hump {
    type State = f64;

    fn size(&self, _: &Dd) -> f64 {
        1.0
    }

    fn off(&self, _: &Dd, _: &f64) -> (f64, f64, f64) {
        (0.0, 0.0, 0.0)
    }
}

/// What is judged of a graze told at this time, and nothing after it; the height is in units of the
/// level up to which a graze may be told.
fn told_as_a_graze(height: f64, time: f64) -> Outcome {
    let level = Level::new(1.0, 2.0, false);
    let judge = Judge::new(Hump { height: height * level.undecided(1.0) }, level, SPAN);
    let graze = Told { time: [time, 0.0], state: 0.0 };
    judge.judge(&Searched { grazes: vec![graze], last: Last::Clear, evaluations: 1 }).0
}

/// A hump above the level is a contact that was missed, however low it is; below it there is nothing.
#[test]
fn a_graze_told_of_a_contact_is_a_contact_missed() {
    for height in [1.01, 1.1, 1.5, 3.0, 10.0, 1e6, 1e12] {
        assert_eq!(told_as_a_graze(height, 1.0), Outcome::Missed, "{height}");
        assert_eq!(told_as_a_graze(height, 0.01), Outcome::Spurious, "{height}");
    }
    for height in [-0.99, -0.5, 0.0, 0.5, 0.99] {
        assert_eq!(told_as_a_graze(height, 1.0), Outcome::Undecided, "{height}");
        assert_eq!(told_as_a_graze(height, 0.5), Outcome::Spurious, "{height}");
    }
    for height in [-1.01, -10.0, -1e6] {
        assert_eq!(told_as_a_graze(height, 1.0), Outcome::Spurious, "{height}");
    }
}
