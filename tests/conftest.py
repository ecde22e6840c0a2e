"""`--quick` leaves out the tests in slow.txt, which `--record-slow` writes from CPU seconds."""

import collections
import os
from pathlib import Path

import pytest

SLOW = Path(__file__).with_name("slow.txt")
# CPU seconds of a test function with all its parameters.
LONGEST = 0.25
seconds: dict[str, float] = collections.defaultdict(float)


def pytest_addoption(parser):
    parser.addoption("--quick", action="store_true", help="without the tests in tests/slow.txt")
    parser.addoption("--record-slow", action="store_true", help="write tests/slow.txt (no xdist)")


def function(item) -> str:
    """File and name of a test function, which may be run with several parameters."""
    return item.nodeid.split("[")[0].removeprefix("tests/")


def pytest_collection_modifyitems(config, items):
    if config.getoption("--quick"):
        slow = set(SLOW.read_text(encoding="utf-8").split())
        config.hook.pytest_deselected(items=[item for item in items if function(item) in slow])
        items[:] = [item for item in items if function(item) not in slow]


def used() -> float:
    """CPU seconds of this process and of those it has waited for."""
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    before = used()
    result = yield
    seconds[function(item)] += used() - before
    return result


def pytest_sessionfinish(session):
    if session.config.getoption("--record-slow"):
        slow = sorted(name for name, spent in seconds.items() if spent > LONGEST)
        SLOW.write_text("\n".join(slow) + "\n", encoding="utf-8")
