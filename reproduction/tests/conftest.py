"""What the tests of the reproduction share with those of the package (tests/python)."""

import repository
from command_lines import run_command  # noqa: F401  a fixture

pytest_addoption = repository.add_option
pytest_configure = repository.configure
