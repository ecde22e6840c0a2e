"""The example that compares exponents with multipliers, at reduced size; it can fail."""

import dataclasses
import re
import runpy

import numpy as np
import pytest

import repository
import sizes
import vibroimpact as vi

EXAMPLE = repository.root() / "examples" / "exponents_against_multipliers.py"
START = (0.0, 0.5, 0.0, 0.0)


@pytest.fixture(scope="module")
def example():
    return runpy.run_path(str(EXAMPLE))


def measured(restitution, drive_frequency):
    """Return a periodic motion and its spectrum."""
    system = vi.System(
        mass_ratio=0.6,
        frequency_ratio=2.0,
        restitution=restitution,
        gap=0.5,
        drive_frequency=drive_frequency,
        moment_amplitude=1.0,
        damping=(0.05, 0.05),
    )
    motion = vi.simulate(system, initial=START, periods=2000, keep=100).refine()
    return motion, vi.lyapunov_spectrum(system, initial=START, periods=2500, keep=1000)


@pytest.fixture(scope="module")
def pair():
    return measured(0.8, 1.1)


def test_random_motions_have_the_exponents_of_their_multipliers(example, capsys):
    # Draws in which every branch of the derivatives plays a part, as the end of this test demands.
    seed, count = sizes.either((4, 30), (2, 60))
    assert example["main"](["--seed", str(seed), "--count", str(count)]) == 0
    text = capsys.readouterr().out
    assert f"seed {seed}: {count} periodic motions" in text
    assert "0 motions with a mismatch" in text
    compared, dead = (
        int(re.search(pattern, text)[1])
        for pattern in (r"(\d+) exponents compared", r": (\d+) of the exponents are -inf")
    )
    assert compared > sizes.either(100, 150)
    assert dead > 5
    for kind in ("circuit", "frictionless", "slip", "chatter", "slide", "wall", "plastic"):
        assert re.search(rf"\b{kind} [1-9]", text), kind


def test_a_wrong_exponent_is_a_mismatch(example, pair):
    motion, spectrum = pair
    compare, tally = example["compare"], example["Tally"]
    assert compare(motion, spectrum, tally()) == ""
    for i in range(4):
        exponents = spectrum.exponents.copy()
        # Twice the largest bound there is, three standard errors and the transient.
        exponents[i] += 2.0 * (3.0 * spectrum.error[i] + np.log(1001.0) / spectrum.time)
        wrong = compare(motion, dataclasses.replace(spectrum, exponents=exponents), tally())
        assert wrong.startswith(f"{exponents[i]:.8g} for ")
        assert ";" not in wrong


@pytest.mark.parametrize("value", [-np.inf, np.nan])
def test_an_exponent_that_is_no_number_is_a_mismatch(example, pair, value):
    motion, spectrum = pair
    exponents = spectrum.exponents.copy()
    exponents[3] = value
    assert example["compare"](
        motion, dataclasses.replace(spectrum, exponents=exponents), example["Tally"]()
    )


def test_a_finite_exponent_of_a_multiplier_0_is_a_mismatch(example):
    # A plastic impact loses a direction.
    motion, spectrum = measured(0.0, 1.8)
    assert spectrum.exponents[3] == -np.inf
    compare, tally = example["compare"], example["Tally"]()
    assert compare(motion, spectrum, tally) == ""
    assert tally.dead >= 1
    exponents = np.where(np.isinf(spectrum.exponents), -1.0, spectrum.exponents)
    wrong = compare(motion, dataclasses.replace(spectrum, exponents=exponents), tally)
    assert "-1 for " in wrong


def test_mismatches_are_printed_and_counted(example, capsys, monkeypatch):
    measure = vi.lyapunov_spectrum

    def wrong(*arguments, **options):
        spectrum = measure(*arguments, **options)
        return dataclasses.replace(spectrum, exponents=0.9 * spectrum.exponents)

    monkeypatch.setattr(vi, "lyapunov_spectrum", wrong)
    assert example["main"](["--count", "5"]) == 1
    text = capsys.readouterr().out
    assert "\n5 motions with a mismatch\n" in text
    assert text.count("System(") == 5


def test_a_measurement_that_fails_is_a_mismatch(example, capsys, monkeypatch):
    def fails(*arguments, **options):
        raise vi.SimulationError("no Lyapunov exponents: the motion ends")

    monkeypatch.setattr(vi, "lyapunov_spectrum", fails)
    assert example["main"](["--count", "2"]) == 1
    assert capsys.readouterr().out.count("no Lyapunov exponents") == 2


@pytest.mark.parametrize("arguments", [["--count", "0"], ["--seed", "-1"], ["--count", "x"]])
def test_bad_arguments_are_refused(example, arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        example["main"](arguments)
    assert caught.value.code == 2
    assert "error" in capsys.readouterr().err
