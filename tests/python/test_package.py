"""The package as a whole: exports, light import, lazy plotting."""

import subprocess
import sys

import pytest

import vibroimpact as vi


def _run(code: str) -> str:
    """Run code in a fresh interpreter with warnings as errors; return what it prints."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_every_export_exists_and_is_documented():
    for name in vi.__all__:
        assert getattr(vi, name).__doc__, name
    assert set(vi.__all__) <= set(dir(vi))


def test_import_loads_neither_matplotlib_nor_tqdm():
    code = (
        "import sys, vibroimpact; print(sorted({'matplotlib', 'tqdm', 'scipy'} & set(sys.modules)))"
    )
    assert _run(code) == "[]"


def test_plot_is_loaded_on_first_use():
    code = "import sys, vibroimpact as vi; vi.plot; print('vibroimpact.plot' in sys.modules)"
    assert _run(code) == "True"


def test_unknown_attributes_are_attribute_errors():
    with pytest.raises(AttributeError, match="colour"):
        vi.colour  # noqa: B018


def test_enums_have_the_numbers_of_the_files():
    assert [(regime.name.lower(), regime.value) for regime in vi.Regime] == [
        ("frictionless", 0),
        ("slip", 1),
        ("reversal_approach", 2),
        ("reversal_restitution", 3),
        ("stick_approach", 4),
        ("stick_restitution", 5),
    ]
    assert [(kind.name.lower(), kind.value) for kind in vi.EventKind] == [
        ("impact", 0),
        ("graze", 1),
        ("chatter", 2),
        ("slide_positive", 3),
        ("slide_negative", 4),
        ("stick", 5),
        ("release", 6),
        ("stop", 7),
    ]
