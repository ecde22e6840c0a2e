"""What results show of themselves: `plot()`, notebook views, data frames, data sets."""

import base64
import dataclasses
import inspect
import sys
from html.parser import HTMLParser

import matplotlib
import numpy as np
import pandas
import pytest
from matplotlib import pyplot
from matplotlib.axes import Axes

import vibroimpact as vi
from fitting_calls import expected, found, heard
from small_results import (
    START,
    branch,
    branch_proof,
    folder,
    grid_basins,
    motion,
    motions,
    proof,
    region,
    run,
    saddle,
    solutions_proof,
)
from struck import moving_run, orbit, small_diagram, spectrum
from systems import COEXISTING, PAPER, ROUGH, STICKY
from valid_calls import calls
from vibroimpact.showing import Shown
from vibroimpact.sweeps.results import GridResult

PLANE = {"drive_frequency": (1.50, 1.52), "gap": (0.4, 0.6)}


def results() -> dict[str, object]:
    """One object of every class that is shown, by name."""
    made = calls()
    few = {"initial": START, "periods": 20}
    spread = np.linspace(1.5, 1.6, 5)
    manifold = vi.unstable_manifold(saddle(), length=0.1, spacing=0.01)
    shown = [
        PAPER,
        run(),
        vi.simulate(STICKY, initial=START, periods=8),
        vi.simulate(STICKY, initial=START, periods=8).bounces(down_to=1e-3),
        vi.simulate(STICKY, initial=START, periods=8).sensitivity("gap", "friction"),
        moving_run(),
        moving_run().final_state,
        orbit(),
        small_diagram(),
        spectrum(),
        motion(),
        branch(),
        branch().bifurcations[0],
        region(),
        motions(),
        motions().at(gap=0.5),
        grid_basins(),
        *grid_basins().attractors,
        manifold,
        *manifold.sides,
        vi.periodic_motions(PAPER),
        vi.NotFound(reason='<b>none</b> & "why"'),
        vi.bifurcation_diagram(ROUGH, drive_frequency=spread, **few),
        vi.sweep(ROUGH, drive_frequency=spread, **few),
        vi.chart(ROUGH, drive_frequency=spread, gap=[0.4, 0.5], **few),
        vi.lyapunov_spectrum(ROUGH, initial=START, periods=40, keep=20),
        vi.lyapunov_spectrum(ROUGH, initial=START, periods=40, keep=20, gap=[0.4, 0.5, 0.6]),
        heard(),
        found(),
        expected(),
        proof().box,
        branch_proof(),
        solutions_proof(),
        *(
            made[name]()
            for name in (
                *("impact_regimes", "impact_agreement", "Stop", "Structure"),
                *("RestitutionTable", "RestitutionPowerLaw"),
            )
        ),
        *(made[name]() for name in ("search_motions", "bifurcation_curve", "verify", "prove")),
    ]
    return {f"{type(each).__name__} {number}": each for number, each in enumerate(shown)}


RESULTS = results()
DRAWN = {name: each for name, each in RESULTS.items() if hasattr(type(each), "plot")}
VOID = {"img", "br", "hr"}


class Page(HTMLParser):
    """Reads HTML; every tag that is opened must be closed, in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()
        assert not self.open, self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


@pytest.fixture(autouse=True)
def _no_figure_is_left():
    yield
    pyplot.close("all")


def test_every_public_result_is_shown():
    public = {getattr(vi, name) for name in vi.__all__}
    classes = {cls for cls in public if inspect.isclass(cls) and issubclass(cls, Shown)}
    assert {type(each) for each in RESULTS.values()} >= classes
    # All that holds arrays or belongs to a grid, and what stands for them.
    arrays = {
        cls
        for cls in filter(dataclasses.is_dataclass, public)
        if any("Array" in str(field.type) for field in dataclasses.fields(cls))
    }
    grids = {cls for cls in public if inspect.isclass(cls) and issubclass(cls, GridResult)}
    assert len(arrays | grids) > 12
    assert arrays | grids | {vi.Run, vi.System, vi.NotFound, vi.Branch} <= classes
    assert {cls for cls in classes if not hasattr(cls, "plot")} == {
        *(vi.NotFound, vi.Stop, vi.StructureState),
        *(vi.RestitutionTable, vi.RestitutionPowerLaw),
        *(vi.Proof, vi.ProofBox, vi.SolutionsProof, vi.BranchProof),
        vi.Sensitivity,
        *(vi.Record, vi.ExpectedErrors),
    }


@pytest.mark.parametrize("name", RESULTS)
def test_a_notebook_view_is_well_formed_and_holds_all_it_needs(name):
    result = RESULTS[name]
    before = pyplot.get_fignums()
    text = result._repr_html_()
    page = Page(text)
    assert not {tag for tag, _ in page.tags} - {
        *("div", "table", "caption", "tbody", "tr", "th", "td", "b", "img")
    }
    for _, attributes in page.tags:
        assert not any(each[:2] == "on" or each == "href" for each in attributes)
    sources = [attributes["src"] for tag, attributes in page.tags if tag == "img"]
    assert len(sources) == (name in DRAWN)
    for source in sources:
        kind, _, data = source.partition(",")
        assert kind == "data:image/png;base64"
        picture = base64.b64decode(data, validate=True)
        assert picture[:8] == b"\x89PNG\r\n\x1a\n"
        assert picture.count(b"IEND") == 1
    assert type(result).__name__ in page.words
    assert len(result._facts()) >= 1
    for key, fact in [*result._facts().items()][:24]:
        assert key in page.words
        assert str(fact) in "".join(page.words)
    assert pyplot.get_fignums() == before


def test_words_are_escaped():
    text = next(each for key, each in RESULTS.items() if "NotFound" in key)._repr_html_()
    assert "&lt;b&gt;none&lt;/b&gt; &amp; &quot;why&quot;" in text


def test_a_result_without_anything_to_draw_has_a_table_alone():
    empty = [
        vi.simulate(ROUGH, initial=START, periods=2, keep=0),
        vi.sweep(ROUGH, initial=START, periods=2, gap=[0.5], friction=[0.1], v1=[0.5]),
        vi.sweep(ROUGH, initial=START, periods=2),
        vi.periodic_motions(PAPER, within=(1.2, 1.21)),
        vi.Branch(parameter="gap", pieces=(), bifurcations=(), ends=("start", "start")),
    ]
    for result in empty:
        page = Page(result._repr_html_())
        assert "table" in {tag for tag, _ in page.tags}


def test_a_large_result_is_not_drawn_unasked(monkeypatch):
    chart = next(each for each in RESULTS.values() if isinstance(each, vi.Chart))
    assert "<img" in chart._repr_html_()
    monkeypatch.setattr("vibroimpact.plot.notebook._MOST", len(chart) - 1)
    assert "<img" not in chart._repr_html_()


def test_the_labels_of_a_grid_are_counted(monkeypatch):
    chart = next(each for each in RESULTS.values() if isinstance(each, vi.Chart))
    found = {
        words.rpartition(" ")[0]: int(words.rpartition("(")[2].rstrip(")"))
        for words in str(chart._facts()["labels"]).split(", ")
    }
    names, numbers = np.unique(chart.label, return_counts=True)
    assert found == dict(zip(names.tolist(), numbers.tolist(), strict=True))
    assert [*found.values()] == sorted(found.values(), reverse=True)
    monkeypatch.setattr("vibroimpact.sweeps.results._MOST_CELLS", len(chart) - 1)
    assert "labels" not in chart._facts()


def test_a_long_table_says_how_much_is_left_out(monkeypatch):
    monkeypatch.setattr("vibroimpact.plot.notebook._MOST_FACTS", 3)
    text = PAPER._repr_html_()
    assert text.count("<tr>") == 4
    assert f"{len(PAPER.to_dict()) - 3} more lines" in text


@pytest.mark.parametrize("name", DRAWN)
def test_plot_draws_what_the_functions_draw(name):
    drawn = DRAWN[name].plot()
    for ax in drawn if isinstance(drawn, list) else [drawn]:
        assert isinstance(ax, Axes)
        assert ax.has_data()
        assert ax.get_xlabel() or ax.get_shared_x_axes().get_siblings(ax)
    assert len(pyplot.get_fignums()) == 1


@pytest.mark.parametrize(
    ("result", "function", "options"),
    [
        (lambda: run(), vi.plot.time_history, {"periods": 2}),
        (lambda: branch(), vi.plot.branches, {"section": "stroboscopic"}),
        (lambda: grid_basins(), vi.plot.basins, {"sections": False}),
        (lambda: motions().at(gap=0.5), vi.plot.motion_branches, {}),
        (lambda: motions(), vi.plot.stability_map, {}),
    ],
)
def test_plot_hands_on_its_options(result, function, options):
    figure = pyplot.figure()
    one, other = figure.subplots(2)
    assert result().plot(ax=one, **options) is one
    function(result(), ax=other, **options)
    assert len(one.lines) == len(other.lines)
    assert len(one.collections) == len(other.collections)
    for line, same in zip(one.lines, other.lines, strict=True):
        assert np.array_equal(line.get_xydata(), same.get_xydata(), equal_nan=True)


def test_a_run_without_a_drive_period_is_drawn_whole():
    system = ROUGH.replace(drive_frequency=0.0)
    resting = vi.simulate(system, initial=START, time=5.0)
    low, high = resting.plot().lines[0].get_xdata()[[0, -1]]
    assert (low, high) == (0.0, 5.0)


def test_what_has_no_picture_says_so():
    cube = vi.sweep(ROUGH, initial=START, periods=2, gap=[0.5], friction=[0.1], v1=[0.5])
    with pytest.raises(vi.ParameterError, match=r"a vibroimpact.Sweep over one axis"):
        cube.plot()
    with pytest.raises(TypeError, match="colour"):
        run().plot(colour="red")


def test_the_ends_of_a_sweep_over_one_axis():
    sweep = vi.sweep(ROUGH, initial=START, periods=60, drive_frequency=np.linspace(1.4, 1.6, 20))
    ax = vi.plot.final_states(sweep, value="v2")
    points = ax.collections[0].get_offsets()
    assert np.array_equal(points[:, 0], sweep.axes["drive_frequency"])
    assert np.array_equal(points[:, 1], sweep.final_states[:, 3])
    # One colour for each kind of label.
    kinds = {label.partition("-")[0] for label in sweep.label}
    assert 1 < len(np.unique(ax.collections[0].get_facecolors(), axis=0)) <= len(kinds)
    with pytest.raises(vi.ParameterError, match=r"value = 'phase' .* one of x1, v1, x2, v2"):
        vi.plot.final_states(sweep, value="phase")
    with pytest.raises(vi.ParameterError, match=r"sweep = .* over one axis"):
        vi.plot.final_states(RESULTS["Run 1"])


def test_a_picture_does_not_change_the_settings_of_matplotlib():
    before = dict(matplotlib.rcParams)
    run()._repr_html_()
    assert dict(matplotlib.rcParams) == before


# Data frames.


def test_a_table_is_a_data_frame_with_words():
    sticky = vi.simulate(STICKY, initial=START, periods=8)
    impacts = sticky.to_pandas()
    assert [*impacts.columns] == [*sticky.impacts.dtype.names]
    for name in sticky.impacts.dtype.names:
        if name != "regime":
            assert impacts[name].tolist() == sticky.impacts[name].tolist()
    words = [vi.Regime(each).name.lower() for each in sticky.impacts["regime"]]
    assert impacts["regime"].tolist() == words
    kinds = [vi.EventKind(each).name.lower() for each in sticky.events["kind"]]
    assert sticky.events.to_pandas()["kind"].tolist() == kinds
    assert {"chatter", "stick", "release"} <= {*sticky.contacts.to_pandas()["kind"]}
    assert [*sticky.grazes.to_pandas().columns] == [*sticky.grazes.dtype.names]
    orbit = motion().to_pandas()
    assert orbit["approach_velocity"].tolist() == motion().impacts["approach_velocity"].tolist()


def test_rows_of_a_diagram():
    diagram = vi.bifurcation_diagram(
        ROUGH, initial=[START, (0, 0.2, 0, 0)], periods=20, keep=10, drive_frequency=[1.5, 1.6, 1.7]
    )
    impacts, points = diagram.to_pandas(), diagram.to_pandas("point")
    assert len(impacts) == len(diagram.x1)
    assert impacts["drive_frequency"].tolist() == diagram.impact_parameter.tolist()
    assert impacts["energy_loss"].tolist() == diagram.energy_loss.tolist()
    assert points["label"].tolist() == diagram.label.tolist()
    assert points["final_state_v2"].tolist() == diagram.final_states[:, 3].tolist()
    counts = impacts.groupby("point").size()
    assert counts.tolist() == np.diff(diagram.offset).tolist()
    assert impacts.groupby("point")["branch"].first().tolist() == points["branch"].tolist()
    sections = diagram.to_pandas("stroboscopic")
    assert sections[["x1", "v1", "x2", "v2"]].to_numpy().tolist() == diagram.stroboscopic.tolist()
    with pytest.raises(vi.ParameterError, match=r"rows = 'impacts' .* 'stroboscopic' or 'point'"):
        diagram.to_pandas("impacts")
    phases = vi.bifurcation_diagram(ROUGH, initial=START, periods=10, keep=5, phase=[0.0, 1.0])
    rows = phases.to_pandas()
    assert {*rows["phase"]} <= {0.0, 1.0}
    assert rows["impact_phase"].tolist() == phases.phase.tolist()


def test_cells_as_rows():
    chart = vi.chart(ROUGH, initial=START, periods=20, gap=[0.4, 0.5], friction=[0.1, 0.2, 0.3])
    rows = chart.to_pandas()
    assert rows[["gap", "friction"]].to_numpy()[4].tolist() == [0.5, 0.2]
    assert rows["label"][4] == chart.label[1, 1]
    assert rows["largest_exponent"][4] == chart.largest_exponent[1, 1]
    grid = vi.lyapunov_spectrum(ROUGH, initial=START, periods=40, keep=20, gap=[0.4, 0.5])
    assert grid.to_pandas()["exponents_2"].tolist() == grid.exponents[:, 1].tolist()
    basins = grid_basins()
    rows = basins.to_pandas().set_index(["x1", "v1"])
    place = (basins.axes["x1"][3], basins.axes["v1"][1])
    assert rows.loc[place, "label"] == basins.label[3, 1]
    assert rows.loc[place, "settling"] == basins.settling[3, 1]


def test_motions_as_rows():
    rows = branch().to_pandas()
    assert rows["drive_frequency"].tolist() == branch().values.tolist()
    assert rows["stable"].tolist() == branch().stable.tolist()
    search = vi.search_motions(COEXISTING, starts=8, periods=500)
    rows = search.to_pandas()
    assert rows["label"].tolist() == [each.label for each in search.motions]
    assert rows["share"].tolist() == search.shares.tolist()
    assert rows.loc[0, ["x1", "v1", "x2", "v2"]].tolist() == list(search.motions[0].initial)
    solutions = vi.periodic_motions(PAPER)
    assert solutions.to_pandas()["admissible"].tolist() == [each.admissible for each in solutions]
    rows = motions().to_pandas()
    assert rows["gap"].tolist() == motions().parameter("gap").tolist()
    assert rows["x1"].tolist() == motions().solutions["x1"].tolist()
    curve = calls()["bifurcation_curve"]()
    assert curve.to_pandas()[[*curve.parameters]].to_numpy().tolist() == curve.values.tolist()
    manifold = vi.unstable_manifold(saddle(), length=0.1, spacing=0.01)
    rows = manifold.to_pandas()
    for number, side in enumerate(manifold.sides):
        part = rows[rows["side"] == number]
        assert part[["x1", "v1", "x2", "v2"]].to_numpy().tolist() == side.points.tolist()
        assert part["piece"].nunique() == len(side.pieces())


def test_without_pandas_the_error_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(
        ImportError, match=r"^a data frame needs pandas: \S+ -m pip install pandas$"
    ):
        run().to_pandas()


def test_an_empty_run_has_an_empty_frame():
    quiet = vi.simulate(ROUGH, initial=START, periods=2, keep=0)
    assert len(quiet.impacts) == len(quiet.to_pandas()) == 0
    assert isinstance(quiet.to_pandas(), pandas.DataFrame)


# Data sets.


def test_dimensions_have_names(tmp_path):
    options = {"initial": START, "periods": 10, "keep": 5, "drive_frequency": [1.5, 1.6]}
    for store in (None, tmp_path / "store"):
        diagram = vi.bifurcation_diagram(ROUGH, store=store, **options)
        data = diagram.to_xarray()
        assert data["coordinate"].values.tolist() == ["x1", "v1", "x2", "v2"]
        v1 = data["final_state"].sel(coordinate="v1", drive_frequency=1.6)
        assert float(v1) == diagram.final_states[1, 1]
        assert data["label"].values.tolist() == diagram.label.tolist()
    grid = vi.lyapunov_spectrum(ROUGH, initial=START, periods=40, keep=20, gap=[0.4, 0.5])
    second = grid.to_xarray()["exponents"].sel(exponent=2)
    assert second.values.tolist() == grid.exponents[:, 1].tolist()
    spectrum = vi.lyapunov_spectrum(ROUGH, initial=START, periods=40, keep=20)
    assert float(spectrum.to_xarray()["exponents"].sel(exponent=4)) == spectrum.exponents[3]


# Files.


def test_motions_and_spectra_come_back_to_the_last_bit(tmp_path):
    for name in ("motion", "spectrum"):
        saved = vi.load(folder() / f"{name}.npz")
        saved.save(tmp_path / f"{name}.npz")
        again = type(saved).load(tmp_path / f"{name}.npz")
        assert repr(again) == repr(saved)
        for field in dataclasses.fields(saved):
            one, other = getattr(saved, field.name), getattr(again, field.name)
            if isinstance(one, np.ndarray):
                assert one.tobytes() == other.tobytes()
                assert not other.flags.writeable
            else:
                assert one == other, field.name
    assert motion().nodes.tobytes() == vi.load(folder() / "motion.npz").nodes.tobytes()
    with pytest.raises(ValueError, match="holds a spectrum, not a motion"):
        vi.PeriodicMotion.load(tmp_path / "spectrum.npz")
    with pytest.raises(ValueError, match="holds a run, not a spectrum"):
        vi.LyapunovSpectrum.load(folder() / "run.npz")
