//! `_core.OneImpacts` and `_core.enclosed_sin_cos`: what a proof by intervals evaluates most.

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::analysis::one_impact::OneImpact;
use crate::model::error::ParameterError;
use crate::model::parameters::Contact;
use crate::numerics::interval::Interval;

type Column<'py> = Bound<'py, PyArray1<f64>>;
/// Lower and upper ends.
type Ends<'py> = (Column<'py>, Column<'py>);

fn ends<'py>(py: Python<'py>, intervals: &[Interval]) -> Ends<'py> {
    (
        PyArray1::from_iter(py, intervals.iter().map(|x| x.lo)),
        PyArray1::from_iter(py, intervals.iter().map(|x| x.hi)),
    )
}

fn boxes(
    lo: &PyReadonlyArray1<'_, f64>,
    hi: &PyReadonlyArray1<'_, f64>,
) -> impl Iterator<Item = Interval> {
    lo.as_array().into_iter().zip(hi.as_array()).map(|(&lo, &hi)| Interval { lo, hi })
}

/// Sine and cosine over intervals [lo, hi].
#[pyfunction]
pub(super) fn enclosed_sin_cos<'py>(
    py: Python<'py>,
    lo: PyReadonlyArray1<'py, f64>,
    hi: PyReadonlyArray1<'py, f64>,
) -> (Ends<'py>, Ends<'py>) {
    let (sin, cos): (Vec<_>, Vec<_>) = boxes(&lo, &hi).map(Interval::sin_cos).unzip();
    (ends(py, &sin), ends(py, &cos))
}

/// The conditions of periodicity of several systems with one contact.
#[pyclass(name = "OneImpacts", module = "vibroimpact._core", frozen)]
pub(super) struct PyOneImpacts(Vec<OneImpact>);

#[pymethods]
impl PyOneImpacts {
    /// Coefficients [lo, hi] of 1, kappa and kappa^2, a column for each system, and 15 rows: those
    /// of D, then (p, q) of Nc and of Ns; 6 more with constant loads: s of Nc and of Ns.
    #[new]
    fn new(
        contact: &str,
        gap: PyReadonlyArray1<'_, f64>,
        lo: PyReadonlyArray2<'_, f64>,
        hi: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let contact = Contact::from_name(contact)?;
        let (gap, lo, hi) = (gap.as_array(), lo.as_array(), hi.as_array());
        let rows = lo.shape()[0];
        let fits = matches!(rows, 15 | 21) && lo.shape()[1] == gap.len();
        if !fits || hi.shape() != lo.shape() {
            let given = format!("{:?} and {:?}", lo.shape(), hi.shape());
            return Err(ParameterError::new("lo, hi", given, "(15 or 21, systems)").into());
        }
        let of_system = |(k, &gap): (usize, &f64)| {
            let quadratic = |row: usize| {
                std::array::from_fn(|i| {
                    let at = [row + i, k];
                    Interval { lo: lo[at], hi: hi[at] }
                })
            };
            let numerators = [[quadratic(3), quadratic(6)], [quadratic(9), quadratic(12)]];
            let loaded = (rows == 21).then(|| [quadratic(15), quadratic(18)]);
            OneImpact { contact, gap, determinant: quadratic(0), numerators, loaded }
        };
        Ok(Self(gap.iter().enumerate().map(of_system).collect()))
    }

    /// F and its slope over boxes of x1, each of the system of its number.
    fn enclose<'py>(
        &self,
        py: Python<'py>,
        numbers: PyReadonlyArray1<'py, i64>,
        lo: PyReadonlyArray1<'py, f64>,
        hi: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(Ends<'py>, Ends<'py>)> {
        let unknown = |number| ParameterError::new("number", number, "that of a system");
        let condition = |(&number, x): (&i64, Interval)| {
            let place = usize::try_from(number).map_err(|_| unknown(number))?;
            Ok((self.0.get(place).ok_or_else(|| unknown(number))?, x))
        };
        let all = numbers.as_array().into_iter().zip(boxes(&lo, &hi)).map(condition);
        let all = all.collect::<Result<Vec<_>, ParameterError>>()?;
        let enclosed = py.detach(|| OneImpact::enclose_all(&all));
        let (values, slopes): (Vec<_>, Vec<_>) =
            enclosed.into_iter().map(|each| (each.value, each.slope)).unzip();
        Ok((ends(py, &values), ends(py, &slopes)))
    }
}
