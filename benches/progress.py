"""What a benchmark is doing: one line per part on the error output, with its time at the end."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter


@contextmanager
def step(title: str) -> Iterator[None]:
    """Print the title now and the seconds that its block took when that ends, both at once."""
    print(f"{title} ... ", end="", file=sys.stderr, flush=True)
    start = perf_counter()
    yield
    print(f"{perf_counter() - start:.0f} s", file=sys.stderr, flush=True)
