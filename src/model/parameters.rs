//! Validated parameters of the system (Han, Jin & Hu (2004), eqs. (22), (23); docs/notation.md).

use std::sync::Arc;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub use crate::model::choices::{Contact, ImpactLaw};
use crate::model::error::ParameterError;
use crate::model::restitution::RestitutionCurve;
use crate::model::tolerances::LEAST_FREQUENCY;

/// The refusal of a name that no numeric parameter has.
fn unknown(name: &str) -> ParameterError {
    ParameterError::new("parameter", name, format!("one of {}", System::NUMERIC.join(", ")))
}

/// What a numeric parameter is, for messages, command lines, figures and pages.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Parameter {
    /// Its name in code and files.
    pub name: &'static str,
    /// Its symbol in plain text, as reference data name it.
    pub symbol: &'static str,
    /// Its symbol in LaTeX.
    pub latex: &'static str,
    /// What it is, in one line.
    pub meaning: &'static str,
    /// The allowed range, in words.
    pub allowed: &'static str,
    /// The value where none is given; `None`: one must be given.
    pub default: Option<f64>,
}

/// Parameters of the system, dimensionless and validated. Build one with [`System::builder`].
///
/// What is read with serde is validated too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self")]
pub struct System {
    pub(crate) mass_ratio: f64,
    pub(crate) frequency_ratio: f64,
    pub(crate) restitution: f64,
    pub(crate) gap: f64,
    pub(crate) drive_frequency: f64,
    pub(crate) pendulum_damping: f64,
    pub(crate) oscillator_damping: f64,
    pub(crate) moment_amplitude: f64,
    pub(crate) force_amplitude: f64,
    #[serde(default)]
    pub(crate) static_moment: f64,
    #[serde(default)]
    pub(crate) static_force: f64,
    pub(crate) friction: f64,
    pub(crate) phase: f64,
    pub(crate) contact: Contact,
    pub(crate) law: ImpactLaw,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    /// Beside it: most systems have none, and are copied.
    pub(crate) restitution_curve: Option<Arc<RestitutionCurve>>,
}

/// Allowed range of a numeric parameter.
#[derive(Clone, Copy)]
enum Range {
    Any,
    NotNegative,
    /// Of a drive whose period is a number that can be reckoned with: its sixth power is one.
    Drive,
    Unit,
}

impl Range {
    const fn words(self) -> &'static str {
        match self {
            Self::Any => "a finite number",
            Self::NotNegative => "a finite number >= 0",
            Self::Drive => "a number in [0, 1e50]",
            Self::Unit => "a number in [0, 1]",
        }
    }

    fn holds(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Any => true,
                Self::NotNegative => value >= 0.0,
                Self::Drive => (0.0..=1e50).contains(&value),
                Self::Unit => (0.0..=1.0).contains(&value),
            }
    }
}

macro_rules! default {
    () => {
        None
    };
    ($value:literal) => {
        Some($value)
    };
}

macro_rules! numeric_parameters {
    ($(
        #[doc = $meaning:literal]
        $name:ident ($symbol:literal, $latex:literal): $range:ident $(= $default:literal)?;
    )*) => {
        impl System {
            /// The numeric parameters, any of which can be swept.
            pub const PARAMETERS: &'static [Parameter] = &[$(Parameter {
                name: stringify!($name),
                symbol: $symbol,
                latex: $latex,
                meaning: $meaning.trim_ascii(),
                allowed: Range::$range.words(),
                default: default!($($default)?),
            }),*];

            /// Their names.
            pub const NUMERIC: &'static [&'static str] = &[$(stringify!($name)),*];

            $(#[doc = concat!($symbol, ":", $meaning, ".")] #[must_use] pub fn $name(&self) -> f64 { self.$name })*

            /// The value of a numeric parameter, or of a number of the restitution curve; `None` if
            /// there is none of this name.
            #[must_use]
            pub fn get(&self, name: &str) -> Option<f64> {
                match name {
                    "restitution" if self.restitution_curve.is_some() => None,
                    $(stringify!($name) => Some(self.$name),)*
                    _ => self.restitution_curve.as_ref()?.get(name),
                }
            }

            /// This system with one numeric parameter changed, or one number of its restitution
            /// curve.
            ///
            /// # Errors
            /// [`ParameterError`] for an unknown name or a value outside its range.
            pub fn with(&self, name: &str, value: f64) -> Result<Self, ParameterError> {
                self.with_all([(name, value)])
            }

            /// This system with several of them changed, which are allowed together.
            ///
            /// # Errors
            /// As [`System::with`].
            pub fn with_all<'a>(
                &self,
                changes: impl IntoIterator<Item = (&'a str, f64)>,
            ) -> Result<Self, ParameterError> {
                let mut changed = self.clone();
                let mut curve = None;
                for (name, value) in changes {
                    changed.set(name, value, &mut curve)?;
                }
                if let Some(curve) = curve {
                    let curve = curve.validated()?;
                    changed.restitution = curve.lowest();
                    changed.restitution_curve = Some(Arc::new(curve));
                }
                changed.validated()
            }

            fn set(
                &mut self,
                name: &str,
                value: f64,
                curve: &mut Option<RestitutionCurve>,
            ) -> Result<(), ParameterError> {
                match name {
                    "restitution" if self.get(name).is_none() && value != self.restitution => {
                        return Err(self.unknown(name));
                    }
                    $(stringify!($name) => self.$name = value,)*
                    _ => {
                        let own = curve.or_else(|| self.restitution_curve().copied());
                        let mut own = own.ok_or_else(|| self.unknown(name))?;
                        own.set(name, value).ok_or_else(|| self.unknown(name))??;
                        *curve = Some(own);
                    }
                }
                Ok(())
            }

            pub(crate) fn validated(mut self) -> Result<Self, ParameterError> {
                // -0 is 0, also where it is divided by.
                $(self.$name += 0.0;)*
                $(if !Range::$range.holds(self.$name) {
                    return Err(ParameterError::new(
                        stringify!($name), format!("{:?}", self.$name), Range::$range.words()));
                })*
                // Its square would lose its digits; no run is long enough to see the difference.
                if self.frequency_ratio < LEAST_FREQUENCY {
                    self.frequency_ratio = 0.0;
                }
                if self.contact == Contact::Direct && self.friction > 0.0 {
                    return Err(ParameterError::new(
                        "friction", self.friction, "0 with contact = direct"));
                }
                if let Some(curve) = self.restitution_curve() {
                    curve.validated()?;
                    if self.restitution != curve.lowest() {
                        return Err(ParameterError::number(
                            "restitution", self.restitution, "none beside a restitution curve"));
                    }
                }
                Ok(self)
            }
        }

        /// The numeric parameters as numbers that may carry derivatives, and the contact geometry.
        #[derive(Debug, Clone, Copy)]
        pub(crate) struct Parameters<T> {
            $(pub $name: T,)*
            pub contact: Contact,
        }

        impl System {
            /// The numeric parameters, each as `number` makes it from name and value.
            pub(crate) fn parameters<T>(&self, number: impl Fn(&str, f64) -> T) -> Parameters<T> {
                Parameters {
                    $($name: number(stringify!($name), self.$name),)*
                    contact: self.contact,
                }
            }
        }

        /// Builder of a [`System`]; mass_ratio, frequency_ratio, restitution, gap and
        /// drive_frequency must be given, the rest have defaults.
        #[derive(Debug, Clone, Default)]
        pub struct SystemBuilder {
            $($name: Option<f64>,)*
            contact: Contact,
            law: ImpactLaw,
            restitution_curve: Option<Arc<RestitutionCurve>>,
        }

        impl SystemBuilder {
            $(#[doc = concat!($symbol, ":", $meaning, ".")] #[must_use] pub fn $name(mut self, value: f64) -> Self {
                self.$name = Some(value);
                self
            })*

            /// One numeric parameter by name.
            ///
            /// # Errors
            /// [`ParameterError`] for an unknown name.
            pub fn with(mut self, name: &str, value: f64) -> Result<Self, ParameterError> {
                match name {
                    $(stringify!($name) => self.$name = Some(value),)*
                    _ => return Err(unknown(name)),
                }
                Ok(self)
            }

            /// Contact geometry; oblique unless told otherwise.
            #[must_use]
            pub fn contact(mut self, contact: Contact) -> Self {
                self.contact = contact;
                self
            }

            /// Impact law; Poisson's unless told otherwise.
            #[must_use]
            pub fn law(mut self, law: ImpactLaw) -> Self {
                self.law = law;
                self
            }

            /// A coefficient of restitution that depends on the approach velocity, in place of
            /// `restitution`.
            #[must_use]
            pub fn restitution_curve(mut self, curve: RestitutionCurve) -> Self {
                self.restitution = Some(curve.lowest());
                self.restitution_curve = Some(Arc::new(curve));
                self
            }

            /// The validated system.
            ///
            /// # Errors
            /// [`ParameterError`] names the first parameter that is missing or out of range.
            pub fn build(self) -> Result<System, ParameterError> {
                System {
                    $($name: self.$name.or(default!($($default)?)).ok_or_else(|| ParameterError::new(
                        stringify!($name), "missing", Range::$range.words()))?,)*
                    contact: self.contact,
                    law: self.law,
                    restitution_curve: self.restitution_curve,
                }
                .validated()
            }
        }
    };
}

numeric_parameters! {
    /// M1/M2; 0: impacts do not act on body 2
    mass_ratio ("mbar", r"\bar m"): NotNegative;
    /// omega_1/omega_2, omega_1 = sqrt(K1/(M1 l^2)); 0, or below 1e-150: free rotor
    frequency_ratio ("omega0", r"\omega_0"): NotNegative;
    /// coefficient of restitution of the impact law; Poisson's: P_II = r P_I
    restitution ("r", "r"): Unit;
    /// Delta/l, distance between the bodies at rest
    gap ("delta", r"\delta"): Any;
    /// Omega/omega_2; 0: a drive that stands still
    drive_frequency ("omega", r"\omega"): Drive;
    /// damping ratio C1/(2 sqrt(M1 K1 l^2)) of body 1
    pendulum_damping ("zeta1", r"\zeta_1"): NotNegative = 0.0;
    /// damping ratio C2/(2 sqrt(M2 K2)) of body 2
    oscillator_damping ("zeta2", r"\zeta_2"): NotNegative = 0.0;
    /// f10/(M1 l^2 omega_2^2), amplitude of the moment on body 1
    moment_amplitude ("f1", "f_1"): Any = 0.0;
    /// f20/(K2 l), amplitude of the force on body 2
    force_amplitude ("f2", "f_2"): Any = 0.0;
    /// C10/(M1 l^2 omega_2^2), constant moment on body 1
    static_moment ("c1", "c_1"): Any = 0.0;
    /// F20/(K2 l), constant force on body 2
    static_force ("c2", "c_2"): Any = 0.0;
    /// Coulomb's coefficient; 0 with direct contact
    friction ("mu", r"\mu"): NotNegative = 0.0;
    /// phase of the drive at t = 0, in radians
    phase ("phi", r"\varphi"): Any = 0.0;
}

impl Serialize for System {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

impl<'de> Deserialize<'de> for System {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::deserialize(deserializer)?.validated().map_err(D::Error::custom)
    }
}

impl System {
    /// A builder with the defaults filled in.
    #[must_use]
    pub fn builder() -> SystemBuilder {
        SystemBuilder::default()
    }

    /// Contact geometry.
    #[must_use]
    pub fn contact(&self) -> Contact {
        self.contact
    }

    /// Impact law.
    #[must_use]
    pub fn law(&self) -> ImpactLaw {
        self.law
    }

    /// This system under another impact law.
    #[must_use]
    pub fn with_law(&self, law: ImpactLaw) -> Self {
        Self { law, ..self.clone() }
    }

    /// 2 pi/omega, infinite for a drive that stands still.
    #[must_use]
    pub fn drive_period(&self) -> f64 {
        std::f64::consts::TAU / self.drive_frequency
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper() -> SystemBuilder {
        System::builder()
            .mass_ratio(0.6)
            .frequency_ratio(2.0)
            .restitution(0.8)
            .gap(0.5)
            .drive_frequency(1.25)
    }

    #[test]
    fn missing_and_bad_values_are_named() {
        let error = System::builder().mass_ratio(1.0).build().unwrap_err();
        assert_eq!(error.name, "frequency_ratio");
        for (bad, name) in [
            (paper().restitution(1.5), "restitution"),
            (paper().friction(f64::NAN), "friction"),
            (paper().gap(f64::INFINITY), "gap"),
            (paper().pendulum_damping(-1e-300), "pendulum_damping"),
            (paper().friction(0.1).contact(Contact::Direct), "friction"),
        ] {
            assert_eq!(bad.build().unwrap_err().name, name);
        }
        assert!(paper().build().is_ok());
    }

    #[test]
    fn a_parameter_can_be_replaced_by_name() {
        let system = paper().build().unwrap().with("friction", 0.5).unwrap();
        assert_eq!(system.friction(), 0.5);
        assert_eq!(system.with("colour", 1.0).unwrap_err().name, "parameter");
        assert_eq!(system.with("friction", -1.0).unwrap_err().name, "friction");
    }
}
