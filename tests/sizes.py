"""How many cases the tests look at: enough to notice a fault, or all under `make thorough`."""

import os
from typing import TypeVar

T = TypeVar("T")
THOROUGH = "VIBROIMPACT_THOROUGH" in os.environ


def either(usual: T, thorough: T) -> T:
    """Return the second under `make thorough`, else the first."""
    return thorough if THOROUGH else usual
