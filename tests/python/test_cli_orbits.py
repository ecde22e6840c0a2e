"""`vibroimpact orbits`: the motions it prints and writes are those of the functions."""

import csv
import functools

import pytest
from matplotlib.image import imread

import vibroimpact as vi
from command_lines import ORBITS, START, SYSTEM
from struck import MIRRORED
from test_symmetric_motions import symmetric, symmetric_motion
from vibroimpact.cli import branches
from vibroimpact.cli import orbits as command
from vibroimpact.cli.motion_table import CSV_NAMES, PRINTED_NAMES

INITIAL = (0.0, 0.5, 0.0, 0.0)
FOLLOW = ORBITS + " --follow drive-frequency 1.7 1.9"


@pytest.fixture
def paper_system() -> vi.System:
    return vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=0.8,
        gap=0.5,
        moment_amplitude=1.0,
        drive_frequency=1.8,
    )


def written(path) -> list[dict[str, str]]:
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def assert_row(row: dict[str, str], motion: vi.PeriodicMotion) -> None:
    """Compare a row with a motion, bit for bit."""
    assert [row[name] for name in ("label", "m", "n")] == [motion.label, "1", "1"]
    assert (row["admissible"], row["stable"]) == (f"{motion.admissible:d}", f"{motion.stable:d}")
    assert row["why_not"] == motion.why_not
    state = tuple(float(row[name]) for name in ("x1", "v1", "v2", "phase"))
    assert state == motion.state
    initial = tuple(float(row[f"initial_{name}"]) for name in ("x1", "v1", "x2", "v2"))
    assert initial == motion.initial
    for number, value in enumerate(motion.multipliers, start=1):
        assert float(row[f"multiplier_{number}_real"]) == value.real
        assert float(row[f"multiplier_{number}_imag"]) == value.imag


def test_the_motion_settled_on(run_command, paper_system, tmp_path):
    code, out, err = run_command(
        ORBITS, "--csv", tmp_path / "orbit.csv", "--plot", tmp_path / "orbit.png"
    )
    assert (code, err) == (0, "")
    motion = vi.simulate(paper_system, initial=INITIAL, periods=600).refine()
    (row,) = written(tmp_path / "orbit.csv")
    assert_row(row, motion)
    heads, line = out.splitlines()
    assert tuple(heads.split()) == PRINTED_NAMES
    assert line.split()[0] == motion.label
    assert float(line.split()[5]) == pytest.approx(abs(motion.multipliers[0]), rel=1e-8)
    assert line.split()[-1] == "stable"
    assert imread(tmp_path / "orbit.png").std() > 0.0


def test_all_motions_with_one_impact(run_command, paper_system, tmp_path):
    code, out, err = run_command(
        ORBITS + " --n 1", "--csv", tmp_path / "all.csv", "--plot", tmp_path / "all.png"
    )
    expected = vi.periodic_motions(paper_system, 1)
    rows = written(tmp_path / "all.csv")
    assert code == 0
    for row, motion in zip(rows, expected, strict=True):
        assert_row(row, motion)
    lines = out.splitlines()
    assert len(lines) == len(expected) + 2
    for line, motion in zip(lines[1:-1], expected, strict=True):
        assert motion.admissible or line.endswith(f"no motion: {motion.why_not}")
    assert lines[-1].endswith("no solution lies outside")
    assert f"shows {command.MOST_DRAWN} of {len(expected)} motions" in err
    assert imread(tmp_path / "all.png").std() > 0.0


def test_an_interval_limits_the_angle(run_command, paper_system):
    code, out, _ = run_command(ORBITS + " --n 1 --within -1 1 --csv -")
    assert code == 0
    angles = [float(row["x1"]) for row in csv.DictReader(out.splitlines())]
    expected = vi.periodic_motions(paper_system, 1, within=(-1.0, 1.0))
    assert angles == [motion.state[0] for motion in expected]


def test_undecided_intervals_are_printed(run_command, monkeypatch):
    whole = command.periodic_motions

    def with_undecided(system, n, within):
        part = vi.Undecided(lo=0.1, hi=0.2, reason="a double root")
        found = whole(system, n, within=within)
        names = ("system", "n", "motions", "boxes", "within", "bounded")
        kept = {name: getattr(found, name) for name in names}
        return vi.PeriodicMotions(**kept, undecided=(part,), note="")

    monkeypatch.setattr(command, "periodic_motions", with_undecided)
    code, out, _ = run_command(ORBITS + " --n 1")
    assert code == 3
    assert out.splitlines()[-1] == "undecided x1 in [0.1, 0.2]: a double root"


def test_a_search_gives_shares(run_command, paper_system, tmp_path):
    line = f"{ORBITS} --friction 0.5 --drive-frequency 1.5752 --search 6 --seed 2 --periods 600"
    code, out, err = run_command(line, "--csv", tmp_path / "found.csv")
    system = paper_system.replace(friction=0.5, drive_frequency=1.5752)
    found = vi.search_motions(system, starts=6, seed=2, periods=600)
    rows = written(tmp_path / "found.csv")
    assert err == ""
    assert code == (3 if found.others else 0)
    assert [float(row["share"]) for row in rows] == found.shares.tolist()
    assert [row["label"] for row in rows] == [motion.label for motion in found.motions]
    assert len(out.splitlines()) == 1 + len(found.motions) + len(found.others)


def test_chaotic_starts_are_counted(run_command):
    line = f"orbits {SYSTEM} --friction 0.5 --drive-frequency 1.545 --search 3"
    code, out, _ = run_command(line)
    assert (code, out.splitlines()[-1]) == (0, "1 of the starts: chaotic")


def test_a_branch_with_its_bifurcations(run_command, paper_system, tmp_path):
    code, out, err = run_command(
        FOLLOW, "--csv", tmp_path / "branch.csv", "--plot", tmp_path / "branch.pdf"
    )
    assert (code, err) == (0, "")
    motion = vi.simulate(paper_system, initial=INITIAL, periods=600).refine()
    branch = vi.follow_motion(motion, drive_frequency=(1.7, 1.9))
    rows = written(tmp_path / "branch.csv")
    assert list(rows[0]) == ["kind", "drive_frequency", *CSV_NAMES]
    points = [row for row in rows if row["kind"] == "point"]
    assert [float(row["drive_frequency"]) for row in points] == branch.values.tolist()
    assert_row(points[-1], branch.pieces[-1].motion(len(branch.pieces[-1].values) - 1))
    special = rows[len(points) :]
    assert [(row["kind"], float(row["drive_frequency"])) for row in special] == [
        (found.kind, found.value) for found in branch.bifurcations
    ]
    (found,) = branch.bifurcations
    assert out.splitlines()[1].split() == ["1", found.kind, repr(found.value), "1-1"]
    assert out.splitlines()[-2:] == ["first end: low bound at 1.7", "last end: high bound at 1.9"]
    assert (tmp_path / "branch.pdf").read_bytes().startswith(b"%PDF")


def test_steps_can_be_made_shorter(run_command):
    long, short = (
        run_command(f"{FOLLOW} --max-step {step}")[1].splitlines()[-3] for step in (0.05, 0.01)
    )
    points = [int(line.split()[2]) for line in (long, short)]
    assert points[1] > 2 * points[0]


def test_the_value_of_a_branch_can_be_chosen(run_command, monkeypatch, tmp_path):
    values = []
    monkeypatch.setattr(vi.plot, "branches", lambda branch, **options: values.append(options))
    assert run_command(f"{FOLLOW} --value v2", "--plot", tmp_path / "b.png")[0] == 0
    assert [options["value"] for options in values] == ["v2"]
    code, _, err = run_command(f"{FOLLOW} --value energy_loss", "--plot", tmp_path / "b.png")
    assert code == 2
    assert "--value energy_loss: allowed are x1, v1" in err


def test_an_interrupted_branch_is_written_as_far_as_it_got(run_command, monkeypatch, tmp_path):
    whole = branches.follow_motion

    def interrupted(*arguments, **options):
        raise vi.Interrupted("interrupted along a branch", whole(*arguments, **options))

    monkeypatch.setattr(branches, "follow_motion", interrupted)
    code, out, err = run_command(FOLLOW, "--csv", tmp_path / "part.csv")
    assert (code, err) == (130, "vibroimpact: interrupted along a branch\n")
    assert "points" in out
    assert written(tmp_path / "part.csv")


def test_a_wall_has_two_multipliers(run_command, tmp_path):
    line = f"orbits {SYSTEM} --mass-ratio 0 --drive-frequency 2.5 {START} --n 1"
    code, _, _ = run_command(line, "--csv", tmp_path / "wall.csv")
    rows = written(tmp_path / "wall.csv")
    assert code == 0
    assert rows
    for row in rows:
        assert row["multiplier_2_real"] != ""
        assert row["multiplier_3_real"] == row["multiplier_4_imag"] == ""


def test_a_branch_says_how_branches_cross_and_why_it_ends(run_command, tmp_path, monkeypatch):
    (tmp_path / "between.json").write_text(MIRRORED.to_json(), encoding="utf-8")
    line = f"orbits --system {tmp_path / 'between.json'} --initial 0 0 0 0"
    code, out, err = run_command(f"{line} --follow drive-frequency 0.9 1.9")
    assert (code, err) == (0, "")
    known = symmetric().bifurcations
    rows = [row.split("  ") for row in out.splitlines()[1:4]]
    rows = [[*filter(None, row)] for row in rows]
    assert [row[1].strip() for row in rows] == [
        "grazing",
        *["branch_point (symmetry-breaking pitchfork)"] * 2,
    ]
    assert [row[0] for row in rows] == ["1", "2", "3"]
    assert [row[2].strip() for row in rows] == [repr(x.value) for x in known]
    assert rows[0][-1].strip() == "circuit"
    assert out.splitlines()[4].startswith("goes on as: the events of the motion beyond")
    assert out.splitlines()[-1] == "last end: high bound at 1.9"
    # As many points as are allowed.
    short = functools.partial(vi.follow_motion, max_points=4)
    monkeypatch.setattr(branches, "follow_motion", short)
    code, out, _ = run_command(f"{line} --follow drive-frequency 0.9 1.9")
    assert code == 3
    for place, row in zip(("first", "last"), out.splitlines()[-2:], strict=True):
        assert row.startswith(f"{place} end: points at ")
        assert "max_points" in row


def told_ends(out):
    return [line for line in out.splitlines() if " end: " in line or line.startswith("never")]


def test_a_bound_that_no_end_has_reached_is_named(run_command, tmp_path):
    # The branch turns back at a graze: both ends leave by the high bound.
    oscillator = vi.Structure(
        [[1]],
        [[1]],
        [vi.Stop([1], 0.3, 0.8)],
        damping_ratios=[0.05],
        drive_amplitude=[1],
        drive_frequency=0.88,
    )
    (tmp_path / "one.json").write_text(oscillator.to_json(), encoding="utf-8")
    line = f"orbits --system {tmp_path / 'one.json'} --initial 0 2"
    motion = vi.simulate(oscillator, initial=[[0], [2]], periods=600).refine()
    branch = motion.follow(drive_frequency=(0.5, 0.89))
    assert branch.ends == ("bound", "bound")
    assert branch.values[[0, -1]].tolist() == [0.89, 0.89]
    assert branch._facts()["ends"] == "high bound at 0.89, high bound at 0.89"
    code, out, err = run_command(f"{line} --follow drive-frequency 0.5 0.89")
    assert (code, err) == (0, "")
    assert told_ends(out) == [
        "first end: high bound at 0.89",
        "last end: high bound at 0.89",
        "never reached: the low bound 0.5",
    ]


@pytest.fixture
def between(tmp_path):
    (tmp_path / "between.json").write_text(MIRRORED.to_json(), encoding="utf-8")
    return f"orbits --system {tmp_path / 'between.json'} --initial 0 0 0 0 --follow drive-frequency"


def test_a_motion_with_another_mirror_image_says_so(run_command, tmp_path):
    for omega, words in ((1.0, "stable; its mirror image is another motion"), (1.3, "stable")):
        path = tmp_path / "between.json"
        path.write_text(MIRRORED.replace(drive_frequency=omega).to_json(), encoding="utf-8")
        code, out, err = run_command(f"orbits --system {path} --initial 0 0 0 0")
        assert (code, err) == (0, "")
        assert out.splitlines()[1].split("  ")[-1].strip() == words


def test_branches_that_leave_bifurcations_are_followed_too(run_command, between, tmp_path):
    code, out, err = run_command(
        f"{between} 0.9 3 --switch 3 11", "--csv", tmp_path / "b.csv", "--plot", tmp_path / "b.png"
    )
    assert (code, err) == (0, "")
    first, second, third = out.split("\n\n")
    assert second.startswith("the branch that leaves bifurcation 3:\n")
    assert third.startswith("the branch that leaves bifurcation 11:\n")
    assert told_ends(first) == ["first end: low bound at 0.9", "last end: high bound at 3"]
    known = symmetric_motion().follow(drive_frequency=(0.9, 3.0))
    switched = vi.switch_branch(known.bifurcations[2], drive_frequency=(0.9, 3.0))
    doubling = switched.bifurcations[11 - 1 - len(known.bifurcations)]
    assert doubling.kind == "period_doubling"
    # Numbers go on from branch to branch, and images are told by them.
    listed = [line for line in second.splitlines() if line[:1].isdigit()]
    assert [int(line.split()[0]) for line in listed] == [
        len(known.bifurcations) + 1 + k for k in range(len(switched.bifurcations))
    ]
    column = second.splitlines()[1].index("mirror image of")
    for line, found, image in zip(listed, switched.bifurcations, switched.images, strict=True):
        assert repr(found.value) in line
        told = line[column : column + len("mirror image of")].strip()
        assert told == ("" if image is None else str(len(known.bifurcations) + 1 + image))
    rows = written(tmp_path / "b.csv")
    assert list(rows[0])[:3] == ["branch", "kind", "drive_frequency"]
    assert list(dict.fromkeys(row["branch"] for row in rows)) == ["0", "3", "11"]
    points = [row for row in rows if (row["branch"], row["kind"]) == ("3", "point")]
    assert [float(row["drive_frequency"]) for row in points] == switched.values.tolist()
    assert (tmp_path / "b.png").stat().st_size > 10_000


def test_branches_stop_at_bifurcations_of_a_kind(run_command, between):
    code, out, err = run_command(f"{between} 0.9 1.9 --stop-at branch-point grazing --switch 2")
    assert (code, err) == (0, "")
    low, high = (point.value for point in symmetric().of_kind("branch_point"))
    graze = vi.switch_branch(
        symmetric().of_kind("branch_point")[1], drive_frequency=(0.9, 1.9), stop_at="grazing"
    ).bifurcations[0]
    assert told_ends(out) == [
        f"first end: branch_point at {low:.12g}",
        f"last end: branch_point at {high:.12g}",
        f"first end: grazing at {graze.value:.12g}",
        f"last end: grazing at {graze.value:.12g}",
    ]


@pytest.mark.parametrize(
    ("more", "code", "told"),
    [
        ("--switch 0", 2, "--switch 0: allowed are the numbers of the list, from 1"),
        ("--switch 9", 3, "--switch 9: there are 2 bifurcations so far"),
        ("--stop-at cusp", 2, "stop_at"),
    ],
)
def test_what_cannot_be_switched_at_is_named(run_command, between, more, code, told):
    found, out, err = run_command(f"{between} 1.0 1.9 {more}")
    assert found == code
    assert told in out + err


def test_a_bifurcation_without_another_branch_is_named_and_the_rest_is_written(
    run_command, between, tmp_path
):
    code, out, _ = run_command(f"{between} 0.9 1.9 --switch 1 3", "--csv", tmp_path / "b.csv")
    assert code == 3
    assert "--switch 1: bifurcation = <grazing of 1-2" in out
    assert "kind period_doubling or branch_point" in out
    assert {row["branch"] for row in written(tmp_path / "b.csv")} == {"0", "3"}


def test_switching_goes_with_following_only(run_command):
    for more in ("--switch 1", "--stop-at grazing"):
        code, _, err = run_command(f"orbits {SYSTEM} {START} {more}")
        assert code == 2
        assert f"{more.split()[0]} goes with --follow only" in err
