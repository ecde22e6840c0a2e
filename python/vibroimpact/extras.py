"""Packages that only a part of vibroimpact needs, and the error where they are missing.

The advice names these packages and not the extras of this one: pip would look for its name on an
index, which may not have it, or has another package of that name. It names the interpreter that
runs: the first pip of a shell may be that of another one.
"""

import shlex
import sys
from typing import Literal

Extra = Literal["verify", "xarray", "dask", "explore"]

# For each extra of pyproject.toml: the module whose import fails, and what pip is to install.
NEEDED: dict[Extra, tuple[str, str]] = {
    "verify": ("flint", "python-flint"),
    "xarray": ("xarray", '"zarr>=3.1.3" xarray'),
    "dask": ("distributed", "distributed"),
    "explore": ("bokeh", "bokeh"),
}


def missing(extra: Extra, needed: str, *, module: str | None = None) -> ImportError:
    """Return the error for a missing package: what is needed, and the command that installs it.

    ``module`` is the one whose import failed, if it is not the usual one of this extra.
    """
    usual, packages = NEEDED[extra]
    return ImportError(f"{needed}: {install(packages)}", name=module or usual)


def install(packages: str) -> str:
    """Return the command that installs packages where this interpreter finds them."""
    return f"{shlex.quote(sys.executable or 'python')} -m pip install {packages}"
