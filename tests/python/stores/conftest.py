"""Stores of a toy computation, which the tests of this folder share."""

import shutil

import pytest

from toy_store import stored
from toy_task import Toy, whole
from vibroimpact import sweeps


@pytest.fixture(scope="module")
def expected():
    """Return all cells of the grid, computed in memory."""
    return sweeps.compute(Toy(), whole)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "toy.zarr"


@pytest.fixture
def gate(tmp_path):
    return tmp_path / "gate"


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """Return the path of a complete store, to be copied."""
    path = tmp_path_factory.mktemp("store") / "toy.zarr"
    stored(path)
    return path


@pytest.fixture
def full(path, model):
    """Return the path of a complete store of one's own."""
    shutil.copytree(model, path)
    return path
