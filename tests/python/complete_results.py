"""What must hold of every result: a number that is told is a number.

NaN stands only where the documentation of a result says so: what was not measured, has no outcome,
or was not reached.
"""

import math
from functools import singledispatch
from typing import Any

import numpy as np
import pandas

import vibroimpact as vi
from vibroimpact._core import PARAMETERS
from vibroimpact.orbits.curve import CodimensionTwo
from vibroimpact.sweeps import STATUS_NAMES, BasinEntropy, GridResult, UncertaintyExponent

ENDED = [STATUS_NAMES.index(name) for name in ("completed", "restarted", "rest")]
# Of a motion whose legs could not be followed there are no multipliers; it says so.
LOST = "a leg cannot be followed"


def assert_finite(values: Any, what: str) -> None:
    """Check that all of these are numbers."""
    assert np.isfinite(values).all(), f"{what}: {values}"


def assert_table(table: np.ndarray, what: str, *, but: tuple[str, ...] = ()) -> None:
    """Check all columns of a structured array, but for some."""
    for name in table.dtype.names:
        if name not in but:
            assert_finite(table[name], f"{what}.{name}")


@singledispatch
def assert_complete(result: Any) -> None:
    """Check a result of the package, or several."""
    raise TypeError(f"no check of a {type(result).__name__}")


@assert_complete.register(list)
@assert_complete.register(tuple)
def _(results: list | tuple) -> None:
    for result in results:
        assert_complete(result)


@assert_complete.register
def _(result: None) -> None:
    pass  # of what writes a file


@assert_complete.register
def _(value: float) -> None:
    assert math.isfinite(value)


@assert_complete.register
def _(array: np.ndarray) -> None:
    if array.dtype.names is None:
        assert_finite(array, "array")
        return
    # A table of single impacts: those without outcome have the regime -1.
    resolved = np.atleast_1d(array)[np.atleast_1d(array)["regime"] >= 0]
    assert_table(resolved, "impact")


@assert_complete.register
def _(system: vi.System) -> None:
    assert_finite([getattr(system, name) for name in PARAMETERS], repr(system))
    assert 0 <= system.restitution <= 1
    assert vi.System.from_json(system.to_json()) == system


@assert_complete.register
def _(structure: vi.Structure) -> None:
    assert_finite(structure.frequencies, "frequencies")
    assert_finite(structure.shapes, "shapes")
    assert vi.Structure.from_json(structure.to_json()) == structure


@assert_complete.register
def _(curve: vi.RestitutionTable | vi.RestitutionPowerLaw) -> None:
    lowest, highest = curve(0.0), curve(1e300)
    assert 0 < highest <= 1
    assert 0 < lowest <= 1
    assert type(curve).from_json(curve.to_json()) == curve


@assert_complete.register
def _(stop: vi.Stop) -> None:
    assert stop.normal.any()
    assert vi.Stop.from_dict(stop.to_dict()) == stop


@assert_complete.register
def _(run: vi.Run) -> None:
    end = run.final_state
    assert_finite([*end.state, end.time, end.time_in_period], repr(run))
    for name in ("impacts", "grazes", "contacts", "events"):
        assert_table(getattr(run, name), name)
    assert_finite(run.stroboscopic, "stroboscopic")
    assert_finite([run.time_in_contact, run.kept_from], "times")
    times = np.clip(np.linspace(run.kept_from, end.time, 5), run.kept_from, end.time)
    assert_finite(run.trajectory(times), "trajectory")
    assert run.label
    assert run.stop_reason


@assert_complete.register
def _(run: vi.StructureRun) -> None:
    end = run.final_state
    assert_finite(end.state, repr(run))
    assert_finite([end.time, end.time_in_period], repr(run))
    for name in ("impacts", "grazes", "contacts", "events"):
        assert_table(getattr(run, name), name)
    assert_finite(run.stroboscopic, "stroboscopic")
    assert_finite([run.time_in_contact, run.kept_from], "times")
    assert run.stop_reason


@assert_complete.register
def _(motion: vi.StructureOrbit) -> None:
    assert motion.stability in ("stable", "unstable", "undecided")
    assert np.isfinite(motion.state).all()
    assert np.isfinite(motion.multipliers).all()
    assert motion.sections.shape == (motion.m, *motion.state.shape)
    assert motion.n == motion.impacts.sum()


@assert_complete.register
def _(diagram: vi.StructureDiagram) -> None:
    assert (diagram.status != "pending").all()
    assert_table(diagram.impacts, "impacts")
    assert_finite(diagram.stroboscopic, "stroboscopic")
    assert_finite(diagram.residual[diagram.m > 0], "residual")
    assert_finite(diagram.values, "values")


@assert_complete.register
def _(spectrum: vi.StructureSpectrum) -> None:
    # -inf where perturbations die out at once.
    assert not np.isnan(spectrum.exponents).any()
    assert not np.isnan(spectrum.error).any()
    assert (spectrum.exponents < math.inf).all()
    assert_finite(spectrum.time, "time")


@assert_complete.register
def _(bounces: vi.Bounces) -> None:
    assert_table(bounces.impacts, "bounces")
    assert repr(bounces)


@assert_complete.register
def _(found: vi.Sensitivity) -> None:
    for table in (*found.impacts, found.stroboscopic, found.final_state):
        assert_finite(table, repr(found))


@assert_complete.register
def _(regimes: vi.ImpactRegimes) -> None:
    resolved = regimes.regime >= 0
    assert_finite(regimes.restitution[resolved], "restitution")
    if regimes.system.mass_ratio > 0.0:
        assert_finite(regimes.energy_loss[resolved], "energy_loss")


@assert_complete.register
def _(agreement: vi.ImpactAgreement) -> None:
    # The steps towards an impulse beyond the range of floats have no outcome.
    if not 0.0 < agreement.system.mass_ratio < 1e-200:
        assert_finite(agreement.difference[:, agreement.impacts > 0], "difference")


@assert_complete.register
def _(grid: GridResult) -> None:
    assert grid.complete
    ended = np.isin(grid.columns["status"], ENDED)
    assert_finite(grid.columns["final_state"][ended], "final states")
    if isinstance(grid, vi.Diagram):
        for name in ("x1", "v1", "v2", "phase", "approach_velocity", "energy_loss"):
            assert_finite(getattr(grid, name), name)
        assert_finite(grid.stroboscopic, "stroboscopic")
    known = ended & (grid.columns["m"] > 0)
    assert_finite(grid.columns["residual"][known], "residual")
    assert_finite(grid.columns["contact_fraction"][known], "contact_fraction")


@assert_complete.register
def _(spectrum: vi.LyapunovSpectrum) -> None:
    # -inf where perturbations die out at once; NaN for the two of a wall that rests.
    left_out = np.isnan(spectrum.exponents)
    system = spectrum.system
    wall = system.mass_ratio == system.force_amplitude == 0.0
    # Under a constant force it rests only if it starts there.
    resting = [0, 2] if system.static_force else [2]
    assert left_out.sum() in (resting if wall else [0]), spectrum
    assert not np.isnan(spectrum.error[~left_out]).any()
    assert (spectrum.exponents[~left_out] < math.inf).all()
    assert_finite(spectrum.time, "time")


@assert_complete.register
def _(basins: vi.Basins) -> None:
    assert basins.complete
    for attractor in basins.attractors:
        assert_complete(attractor)
    assert_finite(basins.shares, "shares")


@assert_complete.register
def _(attractor: vi.Attractor) -> None:
    assert_finite(attractor.sections, "sections")


@assert_complete.register
def _(measure: BasinEntropy) -> None:
    assert math.isfinite(measure.entropy)
    assert math.isfinite(measure.boundary_entropy) == (measure.boundary_boxes > 0)


@assert_complete.register
def _(measure: UncertaintyExponent) -> None:
    # Fewer than two distances with uncertain cells have no slope.
    assert math.isfinite(measure.exponent) == (np.count_nonzero(measure.fitted) > 1)
    assert_finite(measure.uncertain, "uncertain")


@assert_complete.register
def _(rows: pandas.DataFrame) -> None:
    assert_finite(rows.select_dtypes("number").to_numpy(), "data frame")


@assert_complete.register
def _(nothing: vi.NotFound) -> None:
    assert nothing.reason


@assert_complete.register
def _(motion: vi.PeriodicMotion) -> None:
    assert_finite(motion.nodes, "nodes")
    if motion.why_not == LOST:
        return
    assert_finite(motion.multipliers, "multipliers")
    assert_finite([motion.residual, motion.error], "errors")
    if motion.admissible:
        assert_finite(motion.sections, "sections")
        assert_table(motion.impacts, "impacts")


@assert_complete.register
def _(found: vi.PeriodicMotions) -> None:
    assert_finite(found.boxes, "boxes")
    assert_finite(found.within, "within")
    assert_complete(found.motions)


@assert_complete.register
def _(motions: vi.MotionMap) -> None:
    assert not motions.pending.any()
    assert_table(motions.solutions, "solutions")


@assert_complete.register
def _(search: vi.MotionSearch) -> None:
    assert_complete(search.motions)
    assert_finite(search.shares, "shares")
    assert search.shares.sum() + sum(search.others.values()) == 0.0 or math.isclose(
        search.shares.sum() + sum(search.others.values()), 1.0
    )


@assert_complete.register
def _(branch: vi.Branch) -> None:
    for piece in branch.pieces:
        assert_finite(piece.values, "values")
        assert_finite(piece.nodes, "nodes")
    assert_complete(branch.bifurcations)


@assert_complete.register
def _(bifurcation: vi.Bifurcation) -> None:
    assert_finite([bifurcation.value, bifurcation.test_value], repr(bifurcation))
    assert_finite(bifurcation.motion.nodes, "nodes")


@assert_complete.register
def _(point: CodimensionTwo) -> None:
    assert_finite(point.values, repr(point))


@assert_complete.register
def _(curve: vi.BifurcationCurve) -> None:
    assert_finite(curve.values, "values")
    assert_finite(curve.nodes, "nodes")


@assert_complete.register
def _(region: vi.StabilityRegion) -> None:
    assert_finite(region.border, "border")
    assert region.closed or region.why_not
    for arc in region.arcs:
        assert_complete(arc)


@assert_complete.register
def _(manifold: vi.UnstableManifold) -> None:
    assert_finite([manifold.multiplier, *manifold.saddle, *manifold.direction], repr(manifold))
    for side in manifold.sides:
        assert_finite(side.points, "points")
        assert_finite(side.length, "length")
        assert side.end


@assert_complete.register
def _(verification: vi.Verification) -> None:
    for name in ("impacts", "contacts", "sections"):
        table = getattr(verification, name)
        assert_finite(table["time"], name)
        assert not np.isnan(table["digits"]).any()
    assert verification.stopped


@assert_complete.register
def _(record: vi.Record) -> None:
    assert_finite(record.times, "times")
    assert_finite(record.values, "values")
    assert record.sigma is None or (record.sigma > 0.0).all()


@assert_complete.register
def _(found: vi.Fit) -> None:
    assert_finite(found.estimates, "values")
    assert_finite(found.covariance, "covariance")
    assert_finite(found.correlation, "correlation")
    assert_finite(found.predicted, "predicted")
    assert_finite(found.chi2, "chi2")
    # Infinite where nothing is known, and for rows that do not count.
    for errors in (found.standard_errors, found.combination_errors, found.sigma):
        assert not np.isnan(errors).any()
    assert_complete(found.machine)
    assert found.summary()


@assert_complete.register
def _(expected: vi.ExpectedErrors) -> None:
    assert_finite(expected.covariance, "covariance")
    assert not np.isnan(expected.standard_errors).any()
    assert expected.summary()


@assert_complete.register
def _(proof: vi.Proof) -> None:
    assert proof.statement
    if proof.verdict != "proved":
        assert proof.why
    if proof.verdict != "undecided":
        assert proof.box is not None
        assert_complete(proof.box)
        assert_finite([proof.unique_within], "unique_within")
    for disc in proof.multipliers:
        assert_complete(disc)


@assert_complete.register
def _(found: vi.SolutionsProof) -> None:
    assert found.statement
    assert found.verdict == "proved" or found.why
    for proof in found.proofs:
        assert_complete(proof)


@assert_complete.register
def _(found: vi.BranchProof) -> None:
    assert found.statement
    assert found.stretches or found.uncovered
    for part in (*found.stretches, *found.bifurcations, *found.uncovered):
        assert_finite([part.lo, part.hi], repr(part))
        assert part.lo <= part.hi


@assert_complete.register
def _(box: vi.ProofBox) -> None:
    assert_finite(box.center, "center")
    assert_finite(box.radius, "radius")


@assert_complete.register
def _(disc: vi.Disc) -> None:
    assert_finite([disc.center.real, disc.center.imag, disc.radius], repr(disc))
