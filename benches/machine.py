"""On which machine, with which versions and under which load something was measured."""

import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("vibroimpact", "numpy", "scipy", "heyoka", "numba", "scikit-sundae")


def cores() -> int:
    """Cores that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def processor() -> str:
    """Name of the processor."""
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def machine() -> str:
    """Processor, number of cores, system and versions of what runs."""
    return (
        f"{processor()}, {cores()} cores, {platform.system()}, "
        f"Python {platform.python_version()}, " + ", ".join(map(_versioned, PACKAGES))
    )


def load() -> str:
    """Runnable processes on average over the last minute, where the system tells."""
    return f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"


def _versioned(package: str) -> str:
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:
        # A package on the path that is not installed: that of the repository.
        return package if package == "vibroimpact" else f"{package} not installed"
