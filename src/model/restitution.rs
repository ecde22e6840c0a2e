//! Coefficients of restitution that depend on the approach velocity u (docs/theory.md, section 4).
//!
//! ```text
//! table       r linear in u between its knots, constant beyond its ends
//! power law   r = r_low for u <= u_0, r_low (u/u_0)^(-p) above
//! ```
//!
//! Both are constant below a least speed: there bounces shrink geometrically, and chatter is
//! completed as for a number. An impact takes r at its own u, and then follows the law of
//! restitution like any other. A plastic impact, r = 0, is none of a curve: it ends in contact, at
//! whatever speed.
//!
//! Source of the power law: K. L. Johnson, Contact Mechanics (1985), section 11.5: r ~ u^(-1/4) where
//! the contact yields; C. Thornton, J. Appl. Mech. 64 (1997), 383: r constant below the velocity of
//! yield.

use serde::{Deserialize, Serialize};

use crate::model::error::ParameterError;
use crate::model::tolerances::AT_KNOT;

/// Most knots of a table.
pub const MOST_KNOTS: usize = 16;

/// Most numbers of a curve.
pub const MOST_NUMBERS: usize = 2 * MOST_KNOTS;

/// The names of a table's values,
const VALUES: [&str; MOST_KNOTS] = [
    "r_0", "r_1", "r_2", "r_3", "r_4", "r_5", "r_6", "r_7", "r_8", "r_9", "r_10", "r_11", "r_12",
    "r_13", "r_14", "r_15",
];

/// and of its speeds.
const SPEEDS: [&str; MOST_KNOTS] = [
    "speed_0", "speed_1", "speed_2", "speed_3", "speed_4", "speed_5", "speed_6", "speed_7",
    "speed_8", "speed_9", "speed_10", "speed_11", "speed_12", "speed_13", "speed_14", "speed_15",
];

/// The names of the numbers of a power law.
const POWER_LAW: [&str; 3] = ["r_low", "least_speed", "exponent"];

/// A coefficient of restitution that depends on the approach velocity u.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
#[allow(clippy::large_enum_variant)] // one of few
pub enum RestitutionCurve {
    /// Linear between knots. Made by [`RestitutionCurve::table`].
    Table(Knots),
    /// A power law. Made by [`RestitutionCurve::power_law`].
    PowerLaw {
        /// r up to the least speed, in (0, 1].
        r_low: f64,
        /// u_0 > 0.
        least_speed: f64,
        /// p in (0, 1).
        exponent: f64,
    },
}

/// The knots of a table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Knots {
    count: usize,
    speeds: [f64; MOST_KNOTS],
    values: [f64; MOST_KNOTS],
}

impl Knots {
    fn speeds(&self) -> &[f64] {
        &self.speeds[..self.count]
    }

    fn values(&self) -> &[f64] {
        &self.values[..self.count]
    }

    /// The knot at or below u, and how much of the way to the next one u is; `None` in its place
    /// beyond the ends.
    fn place(&self, u: f64) -> (usize, Option<f64>) {
        let speeds = self.speeds();
        let above = speeds.partition_point(|&speed| speed <= u);
        if above == 0 || above == speeds.len() {
            return (above.saturating_sub(1), None);
        }
        let (low, high) = (speeds[above - 1], speeds[above]);
        (above - 1, Some((u - low) / (high - low)))
    }

    /// The slope between a knot and the one below; beyond the ends 0.
    fn slope_below(&self, knot: usize) -> f64 {
        if knot == 0 || knot == self.count {
            return 0.0;
        }
        (self.values[knot] - self.values[knot - 1]) / (self.speeds[knot] - self.speeds[knot - 1])
    }
}

/// A coefficient of restitution at an approach velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RestitutionAt {
    /// r.
    pub value: f64,
    /// dr/du; at a knot that from above.
    pub by_speed: f64,
}

impl RestitutionCurve {
    /// The table of r = `values[i]` at u = `speeds[i]`, linear between, constant beyond its ends.
    ///
    /// # Errors
    /// [`ParameterError`] unless there are 2 to [`MOST_KNOTS`] speeds, positive and increasing, and as
    /// many values in (0, 1].
    ///
    /// # Example
    /// ```
    /// use vibroimpact::RestitutionCurve;
    ///
    /// let table = RestitutionCurve::table(&[0.1, 1.0], &[0.9, 0.6])?;
    /// assert_eq!([0.05, 0.55, 2.0].map(|u| table.at(u)), [0.9, 0.75, 0.6]);
    /// # Ok::<(), vibroimpact::ParameterError>(())
    /// ```
    pub fn table(speeds: &[f64], values: &[f64]) -> Result<Self, ParameterError> {
        let count = speeds.len();
        if !(2..=MOST_KNOTS).contains(&count) {
            let allowed = format!("2 to {MOST_KNOTS} speeds");
            return Err(ParameterError::new("speeds", format!("{speeds:?}"), allowed));
        }
        if values.len() != count {
            let allowed = format!("{count} values, one for each of the speeds");
            return Err(ParameterError::new("values", format!("{values:?}"), allowed));
        }
        let mut knots = Knots { count, speeds: [0.0; MOST_KNOTS], values: [0.0; MOST_KNOTS] };
        knots.speeds[..count].copy_from_slice(speeds);
        knots.values[..count].copy_from_slice(values);
        Self::Table(knots).validated()
    }

    /// The power law r = `r_low` up to `least_speed`, r_low (u/least_speed)^(-exponent) above.
    ///
    /// # Errors
    /// [`ParameterError`] unless 0 < r_low <= 1, least_speed > 0 is finite and 0 < exponent < 1.
    ///
    /// # Example
    /// ```
    /// use vibroimpact::RestitutionCurve;
    ///
    /// let yields = RestitutionCurve::power_law(0.9, 0.01, 0.25)?;
    /// assert_eq!(yields.at(0.005), 0.9);
    /// assert!((yields.at(0.16) - 0.45).abs() < 1e-15);
    /// # Ok::<(), vibroimpact::ParameterError>(())
    /// ```
    pub fn power_law(r_low: f64, least_speed: f64, exponent: f64) -> Result<Self, ParameterError> {
        Self::PowerLaw { r_low, least_speed, exponent }.validated()
    }

    /// This curve, if its numbers are in their ranges.
    pub(crate) fn validated(self) -> Result<Self, ParameterError> {
        match &self {
            Self::Table(knots) => {
                if !(2..=MOST_KNOTS).contains(&knots.count) {
                    let allowed = format!("2 to {MOST_KNOTS}");
                    return Err(ParameterError::new("knots", knots.count, allowed));
                }
                let mut last = 0.0;
                for (i, &speed) in knots.speeds().iter().enumerate() {
                    if !(speed > last && speed.is_finite()) {
                        let allowed = "finite numbers > 0 that increase";
                        return Err(ParameterError::number(format!("speeds[{i}]"), speed, allowed));
                    }
                    last = speed;
                }
                for (i, &value) in knots.values().iter().enumerate() {
                    unit(format!("values[{i}]"), value)?;
                }
            }
            &Self::PowerLaw { r_low, least_speed, exponent } => {
                unit("r_low", r_low)?;
                if !(least_speed > 0.0 && least_speed.is_finite()) {
                    let allowed = "a finite number > 0";
                    return Err(ParameterError::number("least_speed", least_speed, allowed));
                }
                if !(exponent > 0.0 && exponent < 1.0) {
                    let allowed = "a number in (0, 1)";
                    return Err(ParameterError::number("exponent", exponent, allowed));
                }
            }
        }
        Ok(self)
    }

    /// r at the approach velocity u.
    #[must_use]
    #[cold] // the impacts whose r is a number are not arranged around it
    #[inline(never)]
    pub fn at(&self, u: f64) -> f64 {
        self.with_slope(u).value
    }

    /// r of the lowest impacts.
    #[must_use]
    pub fn lowest(&self) -> f64 {
        match self {
            Self::Table(knots) => knots.values[0],
            Self::PowerLaw { r_low, .. } => *r_low,
        }
    }

    /// r if all impacts at u and below have the same one, else NaN.
    #[cold]
    #[inline(never)]
    pub(crate) fn below(&self, u: f64) -> f64 {
        if u > self.constant_to() { f64::NAN } else { self.lowest() }
    }

    /// The approach velocity up to which r is that of the lowest impacts.
    fn constant_to(&self) -> f64 {
        match self {
            Self::Table(knots) => {
                let values = knots.values();
                let equal = values.iter().take_while(|&&value| value == values[0]).count();
                if equal == values.len() { f64::INFINITY } else { knots.speeds[equal - 1] }
            }
            Self::PowerLaw { least_speed, .. } => *least_speed,
        }
    }

    /// r at u, and its derivative.
    #[cold]
    #[inline(never)]
    pub(crate) fn with_slope(&self, u: f64) -> RestitutionAt {
        match self {
            Self::Table(knots) => {
                let (i, part) = knots.place(u);
                let low = knots.values[i];
                let Some(part) = part else { return RestitutionAt { value: low, by_speed: 0.0 } };
                let (rise, run) =
                    (knots.values[i + 1] - low, knots.speeds[i + 1] - knots.speeds[i]);
                RestitutionAt { value: low + rise * part, by_speed: rise / run }
            }
            &Self::PowerLaw { r_low, least_speed, exponent } => {
                if u < least_speed {
                    return RestitutionAt { value: r_low, by_speed: 0.0 };
                }
                let ratio = u / least_speed;
                let power = if ratio.is_finite() {
                    ratio.powf(-exponent)
                } else {
                    // The quotient of speeds at both ends of the range is beyond it.
                    (exponent * (least_speed.ln() - u.ln())).exp()
                };
                let value = r_low * power;
                // Not 0 by underflow: no impact of a curve is plastic.
                let value = value.max(f64::from_bits(1));
                RestitutionAt { value, by_speed: -exponent * value / u }
            }
        }
    }

    /// Which of its smooth pieces u is on, from the lowest on.
    pub(crate) fn piece(&self, u: f64) -> usize {
        match self {
            Self::Table(knots) => knots.speeds().partition_point(|&speed| speed <= u),
            Self::PowerLaw { least_speed, .. } => usize::from(u >= *least_speed),
        }
    }

    /// Whether u is a speed at which dr/du jumps, to rounding.
    pub(crate) fn is_at_knot(&self, u: f64) -> bool {
        let near = |speed: f64| (u - speed).abs() <= AT_KNOT * speed;
        match self {
            Self::Table(knots) => (0..knots.count).any(|i| {
                let [below, above] = [i, i + 1].map(|i| knots.slope_below(i));
                let jumps = (above - below).abs() > AT_KNOT * below.abs().max(above.abs());
                near(knots.speeds[i]) && jumps
            }),
            Self::PowerLaw { least_speed, .. } => near(*least_speed),
        }
    }

    /// The names of its numbers: r_0, r_1 ..., speed_0 ... of a table; r_low, least_speed, exponent of a
    /// power law.
    #[must_use]
    pub fn names(&self) -> Vec<&'static str> {
        match self {
            Self::Table(knots) => [&VALUES[..knots.count], &SPEEDS[..knots.count]].concat(),
            Self::PowerLaw { .. } => POWER_LAW.to_vec(),
        }
    }

    /// The name of a number of any curve.
    pub(crate) fn known(name: &str) -> Option<&'static str> {
        VALUES.iter().chain(&SPEEDS).chain(&POWER_LAW).copied().find(|known| *known == name)
    }

    /// Which of its numbers has this name.
    pub(crate) fn place_of(&self, name: &str) -> Option<usize> {
        self.names().iter().position(|known| *known == name)
    }

    /// The value of one of its numbers; `None` if there is none of this name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<f64> {
        let place = self.place_of(name)?;
        Some(match self {
            Self::Table(knots) if place < knots.count => knots.values[place],
            Self::Table(knots) => knots.speeds[place - knots.count],
            Self::PowerLaw { r_low, least_speed, exponent } => {
                [*r_low, *least_speed, *exponent][place]
            }
        })
    }

    /// This curve with one of its numbers changed; `None` if there is none of this name.
    ///
    /// # Errors
    /// [`ParameterError`] for a value outside its range.
    #[must_use]
    pub fn with(mut self, name: &str, value: f64) -> Option<Result<Self, ParameterError>> {
        let set = self.set(name, value)?;
        Some(set.and_then(|()| self.validated()))
    }

    /// Changes one of its numbers, of several; then it is to be validated.
    pub(crate) fn set(&mut self, name: &str, value: f64) -> Option<Result<(), ParameterError>> {
        let place = self.place_of(name)?;
        match self {
            Self::Table(knots) if place < knots.count => {
                if let Err(error) = unit(name.to_string(), value) {
                    return Some(Err(error));
                }
                knots.values[place] = value;
            }
            Self::Table(knots) => knots.speeds[place - knots.count] = value,
            Self::PowerLaw { r_low, least_speed, exponent } => {
                *[r_low, least_speed, exponent][place] = value;
            }
        }
        Some(Ok(()))
    }

    /// The derivative of r at u by one of its numbers; at a knot that from above.
    pub(crate) fn by_number(&self, u: f64, place: usize) -> f64 {
        match self {
            Self::Table(knots) => {
                let (i, part) = knots.place(u);
                let (knot, of_speed) =
                    if place < knots.count { (place, false) } else { (place - knots.count, true) };
                let share = match part {
                    None if knot == i && !of_speed => 1.0,
                    Some(part) if knot == i => 1.0 - part,
                    Some(part) if knot == i + 1 => part,
                    _ => 0.0,
                };
                // The piece moves with its knots.
                if of_speed { -share * self.with_slope(u).by_speed } else { share }
            }
            &Self::PowerLaw { r_low, least_speed, exponent } => {
                let r = self.at(u);
                let above = u >= least_speed;
                match place {
                    0 => r / r_low,
                    1 if above => exponent * r / least_speed,
                    2 if above => -r * (u / least_speed).ln(),
                    _ => 0.0,
                }
            }
        }
    }
}

fn unit(name: impl Into<std::borrow::Cow<'static, str>>, value: f64) -> Result<(), ParameterError> {
    if value > 0.0 && value <= 1.0 {
        return Ok(());
    }
    Err(ParameterError::number(name, value, "a number in (0, 1]"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curves() -> [RestitutionCurve; 2] {
        [
            RestitutionCurve::table(&[0.1, 0.4, 2.0], &[0.9, 0.5, 0.7]).unwrap(),
            RestitutionCurve::power_law(0.8, 0.2, 0.3).unwrap(),
        ]
    }

    #[test]
    fn slopes_are_those_of_the_curve() {
        let h = 1e-6;
        for curve in curves() {
            for u in [0.05, 0.15, 0.39, 0.7, 1.9, 3.0] {
                let slope = curve.with_slope(u).by_speed;
                let difference = (curve.at(u + h) - curve.at(u - h)) / (2.0 * h);
                assert!((slope - difference).abs() < 1e-9, "{curve:?} {u}: {slope} {difference}");
                for (place, name) in curve.names().iter().enumerate() {
                    let moved = |by: f64| {
                        curve.with(name, curve.get(name).unwrap() + by).unwrap().unwrap().at(u)
                    };
                    let (slope, difference) =
                        (curve.by_number(u, place), (moved(h) - moved(-h)) / (2.0 * h));
                    assert!((slope - difference).abs() < 1e-9, "{name} {u}: {slope} {difference}");
                }
            }
        }
    }

    #[test]
    fn a_table_of_equal_values_is_that_number() {
        let table = RestitutionCurve::table(&[0.1, 0.4, 2.0], &[0.7; 3]).unwrap();
        for u in [0.0, 0.1, 0.2, 0.4, 1.1, 2.0, 1e300] {
            assert_eq!(table.at(u), 0.7);
        }
        assert_eq!(table.constant_to(), f64::INFINITY);
    }

    #[test]
    fn knots_and_ends() {
        let [table, law] = curves();
        assert_eq!([0.0, 0.1, 0.4, 2.0, 9.0].map(|u| table.at(u)), [0.9, 0.9, 0.5, 0.7, 0.7]);
        assert_eq!([0.0, 0.1, 0.4, 1.0, 2.0].map(|u| table.piece(u)), [0, 1, 2, 2, 3]);
        assert_eq!((table.constant_to(), law.constant_to()), (0.1, 0.2));
        assert_eq!([0.0, 0.2].map(|u| law.at(u)), [0.8, 0.8]);
        assert!(table.is_at_knot(0.4) && law.is_at_knot(0.2) && !table.is_at_knot(0.41));
        // Where the slope does not jump there is no border.
        let flat = RestitutionCurve::table(&[1.0, 2.0, 4.0], &[0.8, 0.8, 0.6]).unwrap();
        assert_eq!([1.0, 2.0, 4.0].map(|u| flat.is_at_knot(u)), [false, true, true]);
    }

    #[test]
    fn bad_curves_are_named() {
        let refused = |curve: Result<RestitutionCurve, ParameterError>| curve.unwrap_err().name;
        let table = RestitutionCurve::table;
        let good = [0.9, 0.8];
        for (speeds, name) in [
            (vec![0.2, 0.1], "speeds[1]"),
            (vec![0.1, 0.1], "speeds[1]"),
            (vec![0.0, 0.1], "speeds[0]"),
            (vec![0.1, f64::NAN], "speeds[1]"),
            (vec![0.1, f64::INFINITY], "speeds[1]"),
            (vec![0.1], "speeds"),
            (vec![], "speeds"),
            ((1u8..18).map(f64::from).collect(), "speeds"),
        ] {
            assert_eq!(refused(table(&speeds, &good)), name);
        }
        for (values, name) in [
            (vec![0.9, 1.1], "values[1]"),
            (vec![0.0, 0.5], "values[0]"),
            (vec![0.9, f64::NAN], "values[1]"),
            (vec![0.9], "values"),
        ] {
            assert_eq!(refused(table(&[0.1, 0.2], &values)), name);
        }
        let power = RestitutionCurve::power_law;
        assert_eq!(refused(power(1.1, 0.1, 0.2)), "r_low");
        assert_eq!(refused(power(0.9, 0.0, 0.2)), "least_speed");
        assert_eq!(refused(power(0.9, 0.1, 1.0)), "exponent");
        assert_eq!(refused(power(0.9, 0.1, f64::NAN)), "exponent");
    }
}
