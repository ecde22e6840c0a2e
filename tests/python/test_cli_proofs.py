"""`vibroimpact check-proof`, and `orbits --prove`."""

import csv

import pytest

import vibroimpact as vi
from command_lines import ORBITS

pytest.importorskip("flint")


def test_motions_are_proved_and_their_certificates_checked(run_command, tmp_path):
    folder = tmp_path / "proofs"
    code, out, err = run_command(ORBITS, "--proof-out", folder, "--csv", tmp_path / "all.csv")
    assert (code, err) == (0, "")
    assert out.splitlines()[1].endswith("proved, stable")
    with open(tmp_path / "all.csv", encoding="utf-8", newline="") as file:
        assert [row["proof"] for row in csv.DictReader(file)] == ["proved, stable"]
    (path,) = folder.iterdir()
    code, out, err = run_command("check-proof", path)
    assert (code, err) == (0, "")
    assert out == vi.check_proof(path).statement + "\n"
    path.write_text(path.read_text().replace('"stable"', '"unstable"'))
    code, out, err = run_command("check-proof", path)
    assert (code, out) == (4, "")
    assert "claims more than is shown" in err


def test_solutions_that_are_no_motion_are_disproved(run_command):
    code, out, _ = run_command(ORBITS + " --n 1", "--prove")
    assert code == 0
    for line in out.splitlines()[1:-1]:
        assert ("no motion" in line) == ("disproved" in line)


def test_a_branch_is_proved(run_command, tmp_path):
    folder = tmp_path / "proofs"
    code, out, err = run_command(ORBITS + " --follow gap 0.499 0.501", "--proof-out", folder)
    assert (code, err) == (0, "")
    assert "For every gap in [0.499, 0.501] there is exactly one 1-1 solution" in out
    path = folder / "0_branch.json"
    code, again, err = run_command("check-proof", path)
    assert (code, err) == (0, "")
    assert again in out


def test_a_file_for_a_folder_is_refused(run_command, tmp_path):
    (tmp_path / "file").write_text("")
    code, out, err = run_command(ORBITS, "--proof-out", tmp_path / "file")
    assert (code, out) == (2, "")
    assert "not a folder" in err
