"""Long runs in `vi.verify`: how many passes they take, at which precision, and why they end."""

import numpy as np
import pytest

import sizes
import vibroimpact as vi

pytest.importorskip("flint", reason="verification needs python-flint")

from flint import arb, ctx

from systems import PAPER
from vibroimpact.verification.motion import Problem
from vibroimpact.verification.passes import FIRST, Entry, Pass, exact_motion
from vibroimpact.verification.structure_motion import StructureProblem
from vibroimpact.verification.watch import Watch

# Two masses, the second one between two walls: it settles on four impacts per drive period.
BETWEEN = vi.Structure(
    [[1, 0], [0, 0.5]],
    [[3, -1], [-1, 1]],
    [vi.Stop([0, 1], 0.3, 0.7), vi.Stop([0, -1], 0.3, 0.7)],
    damping_ratios=[0.05, 0.05],
    drive_amplitude=[1, 0],
    drive_frequency=1.35,
)
# It meets its wall at every half turn, a section at every second one, and loses nothing.
SWING = vi.Structure([[1]], [[1]], [vi.Stop([1], 0, 1)], drive_frequency=1.0, drive_amplitude=[0])


@pytest.fixture
def passes(monkeypatch):
    """The passes that are made: bits, and whether they enclose."""
    made = []
    for kind in (Problem, StructureProblem):
        follow = kind.follow

        def counted(self, bits, *, enclose, nudge="0", follow=follow):
            if nudge == "0":
                made.append((bits, enclose))
            return follow(self, bits, enclose=enclose, nudge=nudge)

        monkeypatch.setattr(kind, "follow", counted)
    return made


def test_a_long_run_of_a_structure_is_proved_in_one_pass(passes):
    # balls alone would lose three bits in an impact, and need 1500, or 5000, in the end
    periods = sizes.either(120, 400)
    run = vi.simulate(BETWEEN, initial=np.zeros((2, 2)), periods=periods, keep=40)
    assert run.impact_count == 4 * periods
    found = vi.verify(run)
    assert found.holds
    assert found.certified
    assert passes == [(FIRST, True)]
    assert len(found.whole_impacts) == run.impact_count
    assert found.whole_impacts["reference_error"].max() < 1e-60


def test_a_long_run_of_a_system_is_proved_in_one_pass(passes):
    run = vi.simulate(PAPER, initial=(0, 0.5, 0, 0), periods=sizes.either(150, 600), keep=20)
    found = vi.verify(run)
    assert found.holds
    assert found.certified
    assert passes == [(FIRST, True)]
    assert found.whole_impacts["reference_error"].max() < 1e-60


def test_a_section_at_an_impact_is_called_that(passes):
    run = vi.simulate(SWING, initial=[[0], [-1]], periods=3)
    found = vi.verify(run)
    assert found.stopped == "undecided"
    assert "section 0 (time 6.28319) lies at an event" in found.stop_detail
    # the impacts are proved all the same, and no more bits are tried
    assert len(found.impacts) == run.impact_count
    assert found.certified
    assert passes == [(FIRST, True)]


def test_a_chaotic_run_gives_up_for_lack_of_bits(passes, monkeypatch):
    # as if it never parted from the exact motion
    monkeypatch.setattr(Watch, "impact", lambda *_: False)
    monkeypatch.setattr(Watch, "section", lambda *_: False)
    chaotic = PAPER.replace(drive_frequency=1.4, moment_amplitude=3)
    run = vi.simulate(chaotic, initial=(0, 0.5, 0, 0), periods=560, keep=0)
    found = vi.verify(run, max_precision=512)
    assert found.stopped == "precision_cap"
    assert "precisions of 256 and 512 bits agree until time" in found.stop_detail
    assert passes == [(FIRST, True), (FIRST, False), (2 * FIRST, False)]
    assert not found.holds
    assert found.horizon.number == 28


class Widening:
    """A motion of so many events, one in a unit of time, each of which costs some bits.

    `rounded` ones are lost by passes that do not enclose.
    """

    nudges = None

    def __init__(self, events, lost, rounded=0.0, ends=""):
        self.events, self.lost, self.rounded, self.ends = events, lost, rounded, ends
        self.spreads_until = float(events)
        self.made = []

    def follow(self, bits, *, enclose, nudge="0"):
        self.made.append((bits, enclose))
        entries, wide = [], 0.0
        with ctx.workprec(bits):
            for k in range(self.events):
                lost = (self.lost if enclose else self.rounded) * k
                wide = 2.0 ** min(lost - bits, 60.0)
                if wide > 1e-3 and enclose:
                    return Pass(bits, entries, [], stopped="undecided", detail="a", blur=wide)
                value = arb(k + 1, wide) if enclose else arb(k + 1) + arb(wide)
                entries.append(Entry("impact", (value,), certified=enclose))
        return Pass(bits, entries, [], 0, self.ends, "a", blur=wide * enclose)


def test_precision_comes_from_what_one_pass_has_lost():
    small = Widening(1000, 0.1)
    assert exact_motion(small, 4096).stopped == ""
    assert small.made == [(256, True)]
    large = Widening(1000, 1.5)
    found = exact_motion(large, 4096)
    assert (found.stopped, len(found.entries)) == ("", 1000)
    assert all(entry.certified and entry.error() < 1e-20 for entry in found.entries)
    # 1500 bits are lost; no other precision is tried
    (_, (bits, enclosed)) = large.made
    assert enclosed
    assert 1500 + 67 < bits < 1800


def test_what_no_enclosure_reaches_is_compared():
    wrapped = Widening(1000, 10.0)
    found = exact_motion(wrapped, 4096)
    assert (found.stopped, len(found.entries)) == ("", 1000)
    assert wrapped.made == [(256, True), (256, False), (512, False)]
    assert 10 < sum(entry.certified for entry in found.entries) < 30


def test_a_cap_that_will_not_do_is_seen_early():
    chaotic = Widening(10_000, 2.0, 2.0)
    found = exact_motion(chaotic, 4096)
    assert found.stopped == "precision_cap"
    assert "; about 2" in found.detail
    assert "bits are needed" in found.detail
    # each impact is followed at 1024 bits at most, not at 4096
    assert chaotic.made == [(256, True), (256, False), (512, False), (1024, False)]
    assert exact_motion(Widening(10_000, 2.0, 2.0), 65_536).stopped == ""


def test_an_event_that_no_precision_decides_is_told_from_balls_that_are_too_wide():
    graze = Widening(20, 0.0, ends="undecided")
    assert (exact_motion(graze, 4096).stopped, len(graze.made)) == ("undecided", 4)
    assert max(bits for bits, _ in graze.made) == 512
