"""Proofs as their users meet them: what is true, what is no certificate, motions at rest."""

import pytest

import vibroimpact as vi
from struck import OSCILLATOR
from systems import PAPER


@pytest.mark.parametrize(
    ("machine", "start"),
    [
        (OSCILLATOR.replace(drive_amplitude=None), [[0], [0]]),
        (PAPER.replace(moment_amplitude=0.0, damping=(0.1, 0.1)), (0, 0, 0, 0)),
    ],
)
def test_rest_without_a_drive_is_proved(machine, start):
    """No coordinate has a size there by which boxes could be measured."""
    proof = vi.prove(vi.simulate(machine, initial=start, periods=20).refine())
    assert (proof.verdict, proof.stability) == ("proved", "stable")


def test_only_what_is_proved_is_true():
    motion = vi.simulate(OSCILLATOR, initial=[[0], [-1]], periods=200, keep=50).refine()
    assert vi.prove(motion)
    branch = motion.follow(drive_frequency=(2.0, 2.01))
    proof = vi.prove(branch)
    assert proof
    assert proof.verdict == "proved"

    # No number of a certificate is that of a function.
    def loaded(load):
        return OSCILLATOR.replace(static_load=[load])

    open_branch = vi.prove(motion.follow(system=loaded, load=(-0.01, 0, 0.01)))
    assert open_branch.uncovered
    assert not open_branch
    assert open_branch.verdict == "undecided"
    paper = PAPER.replace(law="paper", friction=0.1)
    open_one = vi.simulate(paper, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    assert not vi.prove(open_one)


def test_the_number_that_varies_has_no_value_in_the_theorem():
    motion = vi.simulate(OSCILLATOR, initial=[[0], [-1]], periods=200, keep=50).refine()
    over_frequency = vi.prove(motion.follow(drive_frequency=(2.0, 2.01))).statement
    assert "drive_frequency varies" in over_frequency
    assert "drive_frequency 2.0" not in over_frequency
    over_gap = vi.prove(motion.follow(gap=(0.3, 0.301))).statement
    assert "gap varies" in over_gap
    assert "gap 0.3" not in over_gap


@pytest.mark.parametrize("content", [b"\x89PNG\r\n\x1a\n" + bytes(200), b"time,x1\n0,1\n", b""])
def test_what_is_no_certificate_is_said_in_a_line(content, tmp_path):
    path = tmp_path / "other.json"
    path.write_bytes(content)
    with pytest.raises(vi.ProofError, match=r"other\.json: no certificate") as refused:
        vi.check_proof(path)
    assert len(str(refused.value)) < 100 + len(str(path))


def test_a_certificate_is_no_file_of_arrays(tmp_path):
    path = tmp_path / "proof.json"
    motion = vi.simulate(OSCILLATOR, initial=[[0], [-1]], periods=200, keep=50).refine()
    vi.prove(motion).save(path)
    with pytest.raises(ValueError, match="check_proof reads the certificate"):
        vi.load(path)
