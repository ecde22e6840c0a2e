//! Numbers, systems, states and options from bytes. No bytes left: zeros, which give usual values.

use arbitrary::Unstructured;
use vibroimpact::{Contact, Horizon, ImpactLaw, RunOptions, State, System, SystemBuilder};

use crate::shown;

/// Numbers at which something changes.
const SPECIAL: [f64; 32] = [
    0.0,
    -0.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    f64::MIN_POSITIVE,
    -f64::MIN_POSITIVE,
    5e-324,
    -5e-324,
    2.2e-308,
    f64::EPSILON,
    -f64::EPSILON,
    1.0,
    -1.0,
    1.0 - f64::EPSILON,
    1.0 + f64::EPSILON,
    0.5,
    2.0,
    std::f64::consts::PI,
    std::f64::consts::FRAC_PI_2,
    std::f64::consts::TAU,
    1e-8,
    1e-16,
    1e-154,
    1e8,
    1e16,
    9_007_199_254_740_992.0,
    1e114,
    1e154,
    -1e154,
];

/// A draw from the bytes of an input.
pub struct Draw<'a>(Unstructured<'a>);

impl<'a> Draw<'a> {
    /// From these bytes.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(Unstructured::new(bytes))
    }

    pub fn byte(&mut self) -> u8 {
        self.0.arbitrary().unwrap_or(0)
    }

    /// A whole number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        usize::from(self.byte()) % count
    }

    pub fn integer(&mut self) -> i64 {
        match self.below(4) {
            0 | 1 => i64::from(self.byte()),
            2 => [i64::MIN, i64::MAX, -1, 1 << 53, (1 << 53) + 1, -(1 << 53) - 1, 1 << 32, 1 << 62]
                [self.below(8)],
            _ => self.0.arbitrary().unwrap_or(0),
        }
    }

    /// Any number: its bits, a special one, or one of any size.
    pub fn any(&mut self) -> f64 {
        match self.below(3) {
            0 => SPECIAL[self.below(SPECIAL.len())],
            1 => f64::from_bits(self.0.arbitrary().unwrap_or(0)),
            _ => {
                let sign = if self.byte().is_multiple_of(4) { -1.0 } else { 1.0 };
                let exponent = f64::from(self.0.arbitrary::<u16>().unwrap_or(0)) / 65_536.0;
                sign * 10f64.powf(-324.0 + 632.0 * exponent)
            }
        }
    }

    /// A usual number.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        match self.below(8) {
            0 => low,
            1 => high,
            2 => 0f64.clamp(low, high),
            _ => {
                let part = f64::from(self.0.arbitrary::<u16>().unwrap_or(0)) / 65_535.0;
                low + part * (high - low)
            }
        }
    }

    /// Usually a usual number.
    pub fn number(&mut self, low: f64, high: f64) -> f64 {
        if self.below(8) == 7 { self.any() } else { self.within(low, high) }
    }

    pub fn contact(&mut self) -> Contact {
        if self.below(4) == 3 { Contact::Direct } else { Contact::Oblique }
    }

    pub fn law(&mut self) -> ImpactLaw {
        let laws = [ImpactLaw::Poisson, ImpactLaw::Newton, ImpactLaw::Energetic, ImpactLaw::Paper];
        laws[self.below(4)]
    }

    /// A builder: in most draws all parameters but one are usual, in the others any may be
    /// anything.
    pub fn builder(&mut self) -> SystemBuilder {
        let odd = self.byte();
        let mut place = 0;
        let mut next = |low: f64, high: f64, draw: &mut Self| {
            place += 1;
            if odd >= 192 {
                draw.number(low, high)
            } else if odd % 32 == place {
                draw.any()
            } else {
                draw.within(low, high)
            }
        };
        let contact = self.contact();
        let builder = System::builder()
            .mass_ratio(next(0.0, 2.0, self))
            .frequency_ratio(next(0.0, 3.0, self))
            .restitution(next(0.0, 1.0, self))
            .gap(next(-0.5, 1.0, self))
            .drive_frequency(next(0.0, 4.0, self))
            .pendulum_damping(next(0.0, 1.5, self))
            .oscillator_damping(next(0.0, 1.5, self))
            .moment_amplitude(next(-2.0, 5.0, self))
            .force_amplitude(next(-2.0, 5.0, self))
            .phase(next(-7.0, 7.0, self))
            .contact(contact)
            .law(self.law());
        let builder = if odd & 32 == 0 {
            builder
        } else {
            builder.static_moment(next(-2.0, 2.0, self)).static_force(next(-2.0, 2.0, self))
        };
        // Friction in direct contact is refused: seldom worth a try.
        if contact == Contact::Direct && self.below(8) != 7 {
            return builder;
        }
        builder.friction(next(0.0, 3.0, self))
    }

    /// A system, if the numbers drawn make one.
    pub fn system(&mut self) -> Option<System> {
        shown(self.builder().build().ok())
    }

    /// Four numbers that may be a state: apart, on the contact, overlapping or no state at all.
    pub fn state_numbers(&mut self, system: &System) -> [f64; 4] {
        if self.below(8) == 7 {
            return std::array::from_fn(|_| self.number(-1.5, 1.5));
        }
        let x1 = self.within(-2.0, 2.0);
        let (v1, v2) = (self.within(-2.0, 2.0), self.within(-2.0, 2.0));
        let apart = self.within(0.0, 1.0);
        let tip = if system.contact() == Contact::Direct { x1 } else { x1.sin() };
        [x1, v1, tip - system.gap() + apart, v2]
    }

    /// A state whose fields may hold anything.
    pub fn state(&mut self, system: &System) -> State {
        let [x1, v1, x2, v2] = self.state_numbers(system);
        shown(State { x1, v1, x2, v2 })
    }

    /// A horizon that may be anything.
    pub fn horizon(&mut self) -> Horizon {
        match self.below(8) {
            0..=3 => Horizon::Periods(self.below(12) as i64),
            4 => Horizon::Periods(self.integer()),
            5 => Horizon::Time(self.within(0.0, 30.0)),
            6 => Horizon::Time(self.any()),
            _ => Horizon::Impacts {
                count: self.integer() as u64,
                max_time: if self.below(2) == 0 { self.within(0.0, 30.0) } else { self.any() },
            },
        }
    }

    /// Options of a run that may be anything, but for a cap on its events.
    pub fn options(&mut self) -> RunOptions {
        let mut options = RunOptions::until(self.horizon());
        if self.below(3) == 2 {
            options.keep = Some(match options.horizon {
                Horizon::Periods(periods) if self.below(4) < 3 => periods.min(5),
                _ => self.integer(),
            });
        }
        options.max_events = u64::from(self.byte()) % (crate::MOST_EVENTS + 1);
        if options.max_events == 0 && self.below(2) == 0 {
            options.max_events = crate::MOST_EVENTS;
        }
        if self.below(6) == 5 {
            options.chatter_tolerance = self.any();
        }
        if self.below(4) == 3 {
            options.section_phase = self.number(0.0, 6.28);
        }
        shown(options)
    }

    /// Options of a run of a few drive periods, all of which are kept.
    pub fn few_periods(&mut self, most: usize) -> RunOptions {
        let mut options = RunOptions::periods(1 + self.below(most) as i64);
        options.max_events = crate::MOST_EVENTS;
        if self.below(4) == 3 {
            options.section_phase = self.within(0.0, 6.28);
        }
        shown(options)
    }

    /// The rest of the bytes, as text.
    pub fn text(&mut self) -> String {
        let length = self.below(64);
        String::from_utf8_lossy(self.0.bytes(length.min(self.0.len())).unwrap_or(&[])).into_owned()
    }
}
