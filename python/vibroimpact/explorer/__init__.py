"""The explorer: a live page in the browser, with linked views of one system.

A page has a state: numbers and names, which its address holds. `compute` makes of a state what the
views draw, by public functions only. `jobs` does this beside the page, and drops what has been
overtaken. Importing this package does not import Bokeh.
"""

from .server import explore

__all__ = ["explore"]
