"""Animations show the run: its states, its impacts at their instants, and files of all formats."""

import math
import re
import runpy
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.animation import writers
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from PIL import Image

import repository
import vibroimpact as vi
from struck import MIRRORED, masses_run, moving_run
from systems import PAPER, ROUGH, STICKY
from vibroimpact.plot.parts import BALL
from vibroimpact.plot.stop_rows import places_of, rows_of
from vibroimpact.plot.style import STOPS

TWO = vi.System(
    mass_ratio=0.5,
    frequency_ratio=1.5,
    restitution=0.7,
    gap=0.2,
    drive_frequency=1.2,
    moment_amplitude=0.5,
    force_amplitude=0.3,
    damping=(0.1, 0.05),
    contact="direct",
)
WALL = TWO.replace(mass_ratio=0.0, force_amplitude=0.0)
START = (0.0, 0.5, 0.0, 0.0)


@pytest.fixture(scope="module")
def run() -> vi.Run:
    return vi.simulate(ROUGH, initial=START, periods=40, keep=20)


@pytest.fixture
def ax():
    return Figure().subplots()


def tip(ax) -> tuple[float, float]:
    (ball,) = (each for each in ax.patches if isinstance(each, Circle) and each.radius == BALL)
    return ball.center


def left_edges(ax) -> list[float]:
    return sorted(each.get_x() for each in ax.patches if isinstance(each, Rectangle))


def test_the_pendulum_is_to_scale(ax):
    assert vi.plot.machine(PAPER, (0.8, 0.0, 0.1, 0.0), phase=0.3, ax=ax) is ax
    assert tip(ax) == pytest.approx((math.sin(0.8), -math.cos(0.8)))
    assert left_edges(ax) == pytest.approx([BALL + PAPER.gap + 0.1])
    assert ax.get_aspect() == 1.0


def test_in_contact_the_ball_touches_the_face(ax):
    x1 = 0.7
    vi.plot.machine(PAPER, (x1, 0.0, math.sin(x1) - PAPER.gap, 0.0), ax=ax)
    assert left_edges(ax) == pytest.approx([tip(ax)[0] + BALL])


def test_bodies_on_one_line_touch_in_contact(ax):
    vi.plot.machine(TWO, (0.5, 0.0, 0.3, 0.0), ax=ax)
    first, second = (each for each in ax.patches if isinstance(each, Rectangle))
    left, right = sorted((first, second), key=Rectangle.get_x)
    assert left.get_x() + left.get_width() == pytest.approx(right.get_x())


@pytest.mark.parametrize(
    ("system", "state"),
    [
        ("paper", START),
        (PAPER, (0, 0)),
        (PAPER, [START, START]),
        (PAPER, (0, 0, 0, math.nan)),
    ],
)
def test_a_machine_needs_a_system_and_a_state(system, state):
    with pytest.raises(ValueError, match=r"^(system =|state( |\[))"):
        vi.plot.machine(system, state)


@pytest.mark.parametrize(
    "system", [ROUGH, STICKY, TWO, WALL], ids=["rough", "sticky", "two", "wall"]
)
def test_frames_show_the_states_of_the_run(system):
    run = vi.simulate(system, initial=START, periods=30, keep=10)
    moving = vi.plot.animation(run, periods=2, frames=24)
    assert len(moving) == 24
    assert np.all(np.diff(moving.times) > 0.0)
    portrait, history = moving.figure.axes[1:]
    for frame in (0, 7, 23):
        assert moving.show(frame) is moving.figure
        (state,) = run.trajectory(moving.times[frame : frame + 1])
        dot = next(
            line
            for line in portrait.lines
            if line.get_marker() == "o" and len(line.get_xdata()) == 1
        )
        assert dot.get_xdata()[0] == state[0]
        assert dot.get_ydata()[0] == state[1]
        assert moving.times[frame] in [line.get_xdata()[0] for line in history.lines]


def test_every_impact_is_seen_at_its_instant(run):
    moving = run.animate(periods=4)
    end = run.final_state.time
    step = 4 * run.system.drive_period / len(moving)
    times = run.impacts["time"]
    shown = times[(times > end - 4 * run.system.drive_period) & (times < end - step)]
    assert len(shown) >= 3
    assert np.isin(shown, moving.times).all()
    machine = moving.figure.axes[0]
    frame = int(np.flatnonzero(moving.times == shown[-1])[0])
    moving.show(frame)
    assert any(f"impact at {shown[-1]:.2f}, " in text.get_text() for text in machine.texts)
    # The ball touches the mass.
    assert left_edges(machine)[0] == pytest.approx(tip(machine)[0] + BALL)


def test_sustained_contact_has_its_words(run):
    sticky = vi.simulate(STICKY, initial=(0, 0, 0, 0), periods=60, keep=10)
    moving = sticky.animate(periods=1)
    said = set()
    for frame in range(len(moving)):
        moving.show(frame)
        said |= {text.get_text().partition("\n")[2] for text in moving.figure.axes[0].texts}
    assert {"apart", "contact, sliding"} <= said
    assert any(re.fullmatch(r"impact at \d+\.\d\d, slip", text) for text in said)


def test_a_periodic_motion_runs_without_a_seam():
    run = vi.simulate(PAPER, initial=START, periods=600, keep=100)
    moving = run.animate()
    assert len(moving) == 48
    period = run.system.drive_period
    assert moving.times[0] == pytest.approx(run.final_state.time - period, abs=period / 48)
    assert moving.times[-1] == pytest.approx(run.final_state.time - period / 48, abs=period / 48)


def test_a_gif_has_all_frames_and_runs_again(run, tmp_path):
    out = tmp_path / "machine.gif"
    moving = run.animate(out, frames=6, frames_per_second=20)
    with Image.open(out) as picture:
        assert picture.n_frames == len(moving) == 6
        assert picture.info["duration"] == 50
        assert picture.info["loop"] == 0
        assert picture.size == (720, 360)
        first = np.asarray(picture.convert("RGB"))
        picture.seek(3)
        assert (np.asarray(picture.convert("RGB")) != first).any()
        # Mostly paper, some ink, in place.
        assert 0.5 < (first > 240).all(axis=2).mean() < 0.99


def test_html_holds_the_frames(run, tmp_path):
    moving = run.animate(frames=3)
    page = moving._repr_html_()
    assert page.count("data:image/png;base64") == 3
    # Nothing from another host, and a sign on each button.
    assert "http" not in page.replace("http://www.w3.org", "")
    assert "<link" not in page
    assert "fa fa-" not in page
    buttons = re.findall(r"<button[^>]*>\s*(.*?)\s*</button>", page, re.DOTALL)
    assert len(buttons) == 9
    assert all(buttons)
    out = tmp_path / "machine.html"
    moving.save(out)
    assert out.read_text(encoding="utf-8").count("data:image/png;base64") == 3


def test_an_mp4_needs_ffmpeg(run, tmp_path, monkeypatch):
    monkeypatch.setattr(writers, "is_available", lambda name: False)
    out = tmp_path / "machine.mp4"
    with pytest.raises(vi.ParameterError, match=r"\.gif or \.html: \.mp4 needs .* ffmpeg"):
        run.animate(out)
    assert not out.exists()


@pytest.mark.skipif(not writers.is_available("ffmpeg"), reason="ffmpeg is not installed")
def test_an_mp4_is_written(run, tmp_path):
    out = tmp_path / "machine.mp4"
    run.animate(out, frames=4)
    assert out.read_bytes()[4:8] == b"ftyp"


@pytest.mark.parametrize("path", ["machine.avi", "machine", 3, ""])
def test_other_files_are_refused(run, path):
    with pytest.raises(vi.ParameterError, match="path ="):
        run.animate(path, frames=2)


@pytest.mark.parametrize(
    "options",
    [
        {"frames": 1},
        {"frames": 2001},
        {"frames": 2.5},
        {"frames_per_second": 0},
        {"frames_per_second": 101},
        {"periods": -1},
        {"window": (3.0, 2.0)},
    ],
)
def test_arguments_are_checked(run, options):
    with pytest.raises(vi.ParameterError, match=next(iter(options))):
        vi.plot.animation(run, **options)


def test_an_unknown_argument_is_refused(run):
    with pytest.raises(TypeError, match="did you mean frames"):
        run.animate(frame=3)


def test_there_is_no_frame_beyond_the_last(run):
    moving = run.animate(frames=3)
    with pytest.raises(vi.ParameterError, match="frame = 3"):
        moving.show(3)
    assert repr(moving).startswith("<Animation of 3 frames, 0.12 s")


@pytest.fixture(scope="module")
def script() -> SimpleNamespace:
    return SimpleNamespace(**runpy.run_path(str(repository.root() / "examples" / "animation.py")))


def test_the_script_writes_it(script, tmp_path, capsys):
    assert script.motion().label == "4-5"
    out = tmp_path / "out.gif"
    script.main(["--out", str(out), "--frames", "4"])
    assert capsys.readouterr().out == f"{out}\n"
    with Image.open(out) as picture:
        assert picture.n_frames == 4


def test_pages_show_it():
    root = repository.root()
    kept = root / "docs" / "images" / "animation.gif"
    assert kept.stat().st_size < 2_000_000
    with Image.open(kept) as picture:
        assert picture.n_frames == 4 * 48
    for page in ("README.md", "docs/index.md"):
        assert "images/animation.gif)" in (root / page).read_text(encoding="utf-8")
    makefile = (root / "Makefile").read_text(encoding="utf-8")
    assert "python examples/animation.py --out docs/images/animation.gif\n" in makefile


def shown_in(moving, frame) -> tuple[list[Rectangle], list[float], str]:
    """Return the blocks in a frame, from above, the faces of the walls, and what is said."""
    moving.show(frame)
    machine = moving.figure.axes[0]
    blocks = [each for each in machine.patches if each.get_hatch() is None]
    faces = [float(line.get_xdata()[0]) for line in machine.lines if vertical(line)]
    said = next(text.get_text() for text in machine.texts if text.get_text().startswith("$t$"))
    return blocks, sorted(faces), said.partition("\n")[2]


def vertical(line) -> bool:
    x = line.get_xdata()
    return len(x) == 2 and x[0] == x[1]


def right(block: Rectangle) -> float:
    return block.get_x() + block.get_width()


def gaps_at(run, time) -> np.ndarray:
    states = run.trajectory(time)
    return np.array(
        [
            stop.gap
            + stop.amplitude * np.cos(run.system.drive_frequency * time + stop.phase)
            - states[:, 0] @ stop.normal
            for stop in run.system.stops
        ]
    )


def test_the_stops_of_a_structure_move_as_its_gaps():
    run = masses_run()
    moving = run.animate(periods=4)
    portrait = moving.figure.axes[1]
    states, time = run.trajectory(moving.times), moving.times
    gaps = gaps_at(run, time)
    seen = 0
    for frame in range(len(moving)):
        blocks, faces, said = shown_in(moving, frame)
        assert len(blocks) == len(faces) == 2
        struck = run.impacts[run.impacts["time"] == time[frame]]
        if len(struck):
            seen += 1
            stop = struck["stop"][-1]
            assert min(abs(right(blocks[stop]) - face) for face in faces) < 1e-9
            assert said.startswith(f"impact on stop {stop} at {time[frame]:.2f}")
        dots = [line for line in portrait.lines if len(line.get_xdata()) == 1]
        places = {(float(x.get_xdata()[0]), float(x.get_ydata()[0])) for x in dots}
        assert {tuple(states[frame, :, i].tolist()) for i in (0, 1)} <= places
    assert seen > 3
    # Distances of block and wall are the gaps, each row in its own unit.
    for stop, row in enumerate(places_of(run.system, each, time, states[:, 0]) for each in ROWS):
        away = (row.walls[:, 0] - row.block) * (row.high - row.low)
        assert away == pytest.approx(np.maximum(gaps[stop], 0.0), abs=1e-12)


ROWS = rows_of(masses_run().system)


def test_stops_on_either_side_of_a_mass_are_walls_of_one_row():
    for normals in ([[0, 2], [0, -1], [3, 0]], [[0, -1], [3, 0], [0, 2]]):
        stops = [vi.Stop(normal, 0.4, 0.8) for normal in normals]
        rows = rows_of(vi.Structure(np.eye(2), np.eye(2), stops))
        assert len(rows) == 2
        (pair,) = (row for row in rows if len(row.stops) == 2)
        assert pair.normal.tolist() == [0, 1]
        assert sorted(pair.factors) == [-1, 2]
    run = vi.simulate(MIRRORED, initial=np.zeros((2, 2)), periods=300, keep=10)
    moving = run.animate(periods=2)
    touched = set()
    for frame in range(len(moving)):
        (block,), (left, face), _ = shown_in(moving, frame)
        assert left - 1e-12 <= block.get_x()
        assert right(block) <= face + 1e-12
        for stop, away in ((0, face - right(block)), (1, block.get_x() - left)):
            struck = run.impacts[run.impacts["time"] == moving.times[frame]]["stop"]
            assert (away < 1e-9) == (stop in struck)
            touched |= {*struck.tolist()}
    assert touched == {0, 1}
    names = [text.get_text() for text in moving.figure.axes[0].texts]
    assert {"q₁", "stop 0", "stop 1"} <= {*names}
    # A wall beyond the motion would leave nothing of it, unless there is no other.
    far = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.3, 0.8), vi.Stop([-1], 900, 0.8)])
    time, q = np.linspace(0, 1, 5), np.linspace(-1, 0.3, 5)[:, None]
    shown = places_of(far, rows_of(far)[0], time, q)
    assert (shown.row.stops, shown.low, shown.high) == ((0,), -1.0, 0.3)


def test_an_impact_keeps_its_time_while_it_is_seen():
    run = moving_run()
    moving = run.animate(periods=2)
    said = [shown_in(moving, frame)[2] for frame in range(len(moving))]
    times = [float(text.split(" at ")[1].split(",")[0]) for text in said if text[:6] == "impact"]
    struck = run.impacts["time"]
    assert len(times) > len({*times}) > 2
    assert all(np.abs(struck - time).min() < 0.006 for time in times)


def test_a_stop_that_is_closed_is_filled():
    run = moving_run()
    moving = run.animate(periods=1)
    _, forces = run.trajectory(moving.times, forces=True)
    words = set()
    for frame in range(len(moving)):
        (block,), (_, face), said = shown_in(moving, frame)
        words.add(said.partition(" at ")[0])
        filled = block.get_facecolor()[:3] == to_rgb(STOPS[0][0])
        # At a border of contact the force is zero.
        if forces[frame, 0, 0] > 1e-9:
            assert filled
            assert right(block) == pytest.approx(face, abs=1e-9)
        elif (np.abs(run.contacts["time"] - moving.times[frame]) > 1e-9).all():
            assert not filled
    assert {"stop 0 closed", "impact on stop 1", "apart"} <= words


def test_a_structure_without_stops_and_one_with_many_are_shown():
    free = vi.Structure([[1]], [[1]], [], drive_amplitude=[1], drive_frequency=2.0)
    moving = vi.simulate(free, initial=[[0], [0]], periods=3).animate(frames=4)
    assert shown_in(moving, 1) == ([], [], "no stops")
    many = vi.Structure(
        np.eye(10),
        np.eye(10),
        [vi.Stop(row, 0.2 + 8 * i, 0.8) for i, row in enumerate(np.eye(10))],
        damping_ratios=[0.02] * 10,
        drive_amplitude=np.ones(10),
        drive_frequency=1.0,
    )
    run = vi.simulate(many, initial=np.zeros((2, 10)), periods=20)
    assert 0 < len(np.unique(run.impacts["stop"])) < 8
    moving = run.animate(periods=1, frames=3)
    blocks, _, _ = shown_in(moving, 0)
    assert len(blocks) == 8
    said = [text.get_text() for text in moving.figure.axes[0].texts]
    assert "and 2 more, which are struck less; marks on walls: impacts" in said
    shown = {int(text.split()[1].strip(":")) for text in said if text.startswith("stop ")}
    assert shown >= {*np.unique(run.impacts["stop"]).tolist()}
