"""Packages that only a part of vibroimpact needs, and the error where they are missing.

The advice names these packages and not the extras of this one: pip would look for its name on an
index, which may not have it, or has another package of that name.
"""

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
    return ImportError(f"{needed}: pip install {packages}", name=module or usual)
