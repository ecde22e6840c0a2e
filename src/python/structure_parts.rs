//! Tables of a structure's run from columns of NumPy, as a file has them.

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::impact::RegimeKind;
use crate::model::structure::{Coordinates, Structure, StructureState};
use crate::simulate::event::{EventKind, EventRecord};
use crate::simulate::run::{StopContactRecord, StopGrazeRecord, StopImpactRecord, Tables};
use crate::simulate::structure::ClosedStops;

/// The columns of one table.
struct Columns<'a, 'py>(&'a Bound<'py, PyDict>);

impl<'py> Columns<'_, 'py> {
    fn get(&self, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let missing = || PyValueError::new_err(format!("no column {name}"));
        self.0.get_item(name)?.ok_or_else(missing)
    }

    fn floats(&self, name: &str) -> PyResult<Vec<f64>> {
        let array: PyReadonlyArray1<'_, f64> = self.get(name)?.extract()?;
        Ok(array.as_array().to_vec())
    }

    fn whole(&self, name: &str) -> PyResult<Vec<i64>> {
        let array: PyReadonlyArray1<'_, i64> = self.get(name)?.extract()?;
        Ok(array.as_array().to_vec())
    }

    fn rows(&self, name: &str) -> PyResult<Vec<Coordinates>> {
        let array: PyReadonlyArray2<'_, f64> = self.get(name)?.extract()?;
        Ok(array.as_array().rows().into_iter().map(|row| row.iter().copied().collect()).collect())
    }

    fn states(&self) -> PyResult<Vec<StructureState>> {
        let pairs = self.rows("q")?.into_iter().zip(self.rows("v")?);
        Ok(pairs.map(|(q, v)| StructureState { q, v }).collect())
    }

    fn closed(&self) -> PyResult<Vec<ClosedStops>> {
        let array: PyReadonlyArray2<'_, bool> = self.get("closed")?.extract()?;
        let set = |row: numpy::ndarray::ArrayView1<'_, bool>| {
            row.iter().enumerate().filter(|(_, shut)| **shut).map(|(stop, _)| stop as u32).collect()
        };
        Ok(array.as_array().rows().into_iter().map(set).collect())
    }
}

fn regime(number: i64) -> PyResult<RegimeKind> {
    let found = RegimeKind::ALL.iter().copied().find(|&kind| kind as i64 == number);
    found.ok_or_else(|| PyValueError::new_err(format!("no regime has the number {number}")))
}

fn kind(number: i64) -> PyResult<EventKind> {
    let kinds = [
        EventKind::Chatter,
        EventKind::SlidePositive,
        EventKind::SlideNegative,
        EventKind::Stick,
        EventKind::Release,
        EventKind::Closed,
    ];
    let found = kinds.into_iter().find(|&kind| kind as i64 == number);
    found.ok_or_else(|| PyValueError::new_err(format!("no change of contact is a {number}")))
}

/// The tables of a run of a structure, whose columns have as many rows each as their table.
pub(super) fn tables(
    impacts: &Bound<'_, PyDict>,
    stroboscopic: &PyReadonlyArray3<'_, f64>,
    events: &Bound<'_, PyDict>,
    grazes: &Bound<'_, PyDict>,
    contacts: &Bound<'_, PyDict>,
) -> PyResult<Tables<Structure>> {
    Ok(Tables {
        impacts: impact_rows(&Columns(impacts))?,
        stroboscopic: starts(stroboscopic),
        grazes: graze_rows(&Columns(grazes))?,
        contacts: contact_rows(&Columns(contacts))?,
        events: event_rows(&Columns(events))?,
    })
}

fn impact_rows(of: &Columns<'_, '_>) -> PyResult<Vec<StopImpactRecord>> {
    let [time, time_in_period, phase, approach, normal, tangential, loss] = [
        "time",
        "time_in_period",
        "phase",
        "approach_velocity",
        "impulse_normal",
        "impulse_tangential",
        "energy_loss",
    ]
    .map(|name| of.floats(name));
    let (time, time_in_period, phase, approach) = (time?, time_in_period?, phase?, approach?);
    let (normal, tangential, loss) = (normal?, tangential?, loss?);
    let (period, stop, regimes) = (of.whole("period")?, of.whole("stop")?, of.whole("regime")?);
    let (q, before, after) = (of.rows("q")?, of.rows("v_pre")?, of.rows("v_post")?);
    (0..time.len())
        .map(|i| {
            Ok(StopImpactRecord {
                time: time[i],
                period: period[i],
                time_in_period: time_in_period[i],
                phase: phase[i],
                stop: stop[i],
                q: q[i].clone(),
                v_pre: before[i].clone(),
                v_post: after[i].clone(),
                approach_velocity: approach[i],
                regime: regime(regimes[i])?,
                impulse_normal: normal[i],
                impulse_tangential: tangential[i],
                energy_loss: loss[i],
            })
        })
        .collect()
}

fn graze_rows(of: &Columns<'_, '_>) -> PyResult<Vec<StopGrazeRecord>> {
    let (time, time_in_period) = (of.floats("time")?, of.floats("time_in_period")?);
    let (phase, second) = (of.floats("phase")?, of.floats("gap_acceleration")?);
    let (period, stop, states) = (of.whole("period")?, of.whole("stop")?, of.states()?);
    let row = |i: usize| StopGrazeRecord {
        time: time[i],
        period: period[i],
        time_in_period: time_in_period[i],
        phase: phase[i],
        stop: stop[i],
        state: states[i].clone(),
        gap_acceleration: second[i],
    };
    Ok((0..time.len()).map(row).collect())
}

fn contact_rows(of: &Columns<'_, '_>) -> PyResult<Vec<StopContactRecord>> {
    let (time, time_in_period) = (of.floats("time")?, of.floats("time_in_period")?);
    let (normal, tangential) = (of.floats("normal_force")?, of.floats("tangential_force")?);
    let (skipped, jump) = (of.floats("impacts_skipped")?, of.floats("time_jump")?);
    let (phase, error, closed) = (of.floats("phase")?, of.floats("error")?, of.closed()?);
    let (period, stop, states) = (of.whole("period")?, of.whole("stop")?, of.states()?);
    let kinds = of.whole("kind")?;
    (0..time.len())
        .map(|i| {
            Ok(StopContactRecord {
                time: time[i],
                period: period[i],
                time_in_period: time_in_period[i],
                phase: phase[i],
                kind: kind(kinds[i])?,
                stop: stop[i],
                state: states[i].clone(),
                closed: closed[i].clone(),
                force: [normal[i], tangential[i]],
                impacts_skipped: skipped[i],
                time_jump: jump[i],
                error: error[i],
            })
        })
        .collect()
}

fn event_rows(of: &Columns<'_, '_>) -> PyResult<Vec<EventRecord>> {
    let (time, period) = (of.floats("time")?, of.whole("period")?);
    let (kind, index) = (of.whole("kind")?, of.whole("index")?);
    let row =
        |i: usize| EventRecord { time: time[i], period: period[i], kind: kind[i], index: index[i] };
    Ok((0..time.len()).map(row).collect())
}

/// States from an array (k, 2, N).
pub(super) fn starts(array: &PyReadonlyArray3<'_, f64>) -> Vec<StructureState> {
    let rows = array.as_array();
    let of = |start: numpy::ndarray::ArrayView2<'_, f64>| {
        StructureState::new(&start.row(0).to_vec(), &start.row(1).to_vec())
    };
    rows.outer_iter().map(of).collect()
}
