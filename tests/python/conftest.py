"""The system and start that many tests share, the command line and benchmarks to call."""

import importlib
import signal

import pytest

import repository
import vibroimpact as vi
from command_lines import run_command  # noqa: F401  a fixture
from systems import ROUGH

pytest_addoption = repository.add_option
pytest_configure = repository.configure


@pytest.fixture(autouse=True)
def ctrl_c_is_heard():
    """Let Ctrl-C through, which a shell's background jobs, and what they start, ignore."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def bench(monkeypatch):
    """Import a module of the benchmarks."""
    monkeypatch.syspath_prepend(str(repository.root() / "benches"))
    return importlib.import_module


@pytest.fixture
def system() -> vi.System:
    """Return a frictional system with several impacts in every ten periods."""
    return ROUGH


@pytest.fixture
def initial() -> tuple[float, float, float, float]:
    """Return the initial state of the paper's section 4."""
    return (0.0, 0.5, 0.0, 0.0)
