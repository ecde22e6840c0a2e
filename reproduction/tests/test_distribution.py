"""The reproduction as a distribution: one version, one licence, what it requires."""

import tomllib

import repository

ROOT = repository.root()
CARGO = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["package"]
MAIN, OWN = (
    tomllib.loads((ROOT / folder / "pyproject.toml").read_text(encoding="utf-8"))
    for folder in (".", "reproduction")
)


def test_the_version_is_that_of_the_package_and_required_as_such():
    assert OWN["project"]["version"] == CARGO["version"]
    own, *others = OWN["project"]["dependencies"]
    assert own == f"vibroimpact=={CARGO['version']}"
    assert set(others) <= set(MAIN["project"]["dependencies"])
    assert OWN["project"]["requires-python"] == MAIN["project"]["requires-python"]


def test_the_licence_is_that_of_the_package():
    assert OWN["project"]["license"] == MAIN["project"]["license"]
    assert OWN["project"]["license-files"] == MAIN["project"]["license-files"]
    for name in OWN["project"]["license-files"]:
        assert (ROOT / "reproduction" / name).read_bytes() == (ROOT / name).read_bytes()


def test_what_builds_it_is_installed_where_it_is_built():
    (backend,) = OWN["build-system"]["requires"]
    assert backend in MAIN["project"]["optional-dependencies"]["dev"]
    assert f"'{backend}'" in (ROOT / "Makefile").read_text(encoding="utf-8")
