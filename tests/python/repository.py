"""Where the files of the repository are that no package has: documentation, benchmarks, sources.

An installed package is tested from a copy of the tests alone (`make wheel-test`), with ``pytest
--installed``. Tests that ask here for more are then skipped, and say so; without that option they
are not, whatever is missing.
"""

from contextlib import suppress
from pathlib import Path

import pytest

OPTION = "--installed"
_ROOT = Path(__file__).parents[2]
_installed = False


def add_option(parser: pytest.Parser) -> None:
    """Add the option, which the tests of the package and of the reproduction share."""
    with suppress(ValueError):  # it is there already
        parser.addoption(
            OPTION,
            action="store_true",
            help="the package is tested without its repository: skip tests that read files of it",
        )


def configure(config: pytest.Config) -> None:
    """Take the option over, before any test is collected."""
    global _installed
    _installed = config.getoption(OPTION)


def root() -> Path:
    """Return the root of the repository; skip the test, or the module, that has none."""
    if _installed:
        pytest.skip(f"reads files of the repository ({OPTION})", allow_module_level=True)
    return _ROOT
