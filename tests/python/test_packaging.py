"""The repository as what is released: metadata, workflows, what wheels and sdists may hold."""

import importlib
import importlib.metadata
import io
import os
import re
import runpy
import subprocess
import sys
import tarfile
import tomllib
import zipfile

import pytest
import yaml

import repository
import vibroimpact as vi

ROOT = repository.root()
CARGO = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["package"]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CI, WHEELS = (ROOT / ".github" / "workflows" / f"{name}.yml" for name in ("ci", "wheels"))
WORKFLOWS = sorted(CI.parent.glob("*.yml"))


def read(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_version_and_addresses_have_one_source():
    assert PROJECT["dynamic"] == ["version", "urls"]
    assert not {"version", "urls"} & PROJECT.keys()
    assert vi.__version__ == CARGO["version"] == importlib.metadata.version("vibroimpact")


def test_both_packages_say_the_same():
    assert PROJECT["license"] == CARGO["license"]
    assert PROJECT["readme"] == CARGO["readme"]
    for name in PROJECT["license-files"]:
        assert read(name).strip()


def test_the_citation_is_of_this_version_and_this_paper():
    citation = yaml.safe_load(read("CITATION.cff"))
    assert citation["version"] == CARGO["version"]
    assert " OR ".join(citation["license"]) == CARGO["license"]
    (paper,) = citation["references"]
    names = [f"{person['given-names']} {person['family-names']}" for person in paper["authors"]]
    readme = " ".join(read("README.md").split())
    assert f"{', '.join(names)}, *{paper['title']}* ({paper['year']})" in readme


def test_every_release_says_which_numbers_changed():
    releases = re.split(r"^## ", read("CHANGELOG.md"), flags=re.M)[1:]
    assert releases
    for release in releases:
        text = release.split("\n### Numerical results\n", 1)[1].split("\n### ")[0]
        assert text.strip(), release.splitlines()[0]


def test_public_modules_name_what_they_offer():
    row = next(line for line in read("docs/deprecation.md").splitlines() if "`__all__`" in line)
    modules = re.findall(r"`(vibroimpact(?:\.\w+)?)`", row)
    assert len(modules) == 5
    for name in modules:
        module = importlib.import_module(name)
        assert module.__all__
        assert all(hasattr(module, public) for public in module.__all__)


def test_only_one_module_knows_where_the_repository_is():
    # What reads its files otherwise fails where only the tests are (repository.py).
    mine = {"repository.py", "test_packaging.py"}
    found = [
        path.name
        for folder in ("tests/python", "reproduction/tests")
        for path in (ROOT / folder).rglob("*.py")
        if path.name not in mine and "parents[2]" in path.read_text(encoding="utf-8")
    ]
    assert found == []


@pytest.mark.parametrize(
    ("options", "verdict"), [((), "1 passed"), (("--installed",), "1 skipped")]
)
def test_what_reads_the_repository_is_skipped_only_if_asked(options, verdict):
    test = "tests/python/test_impact.py::test_columns_are_those_of_the_notation"
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", test, *options]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert verdict in done.stdout
    assert ("(--installed)" in done.stdout) == bool(options)


# Workflows


def jobs(path):
    return yaml.safe_load(path.read_text(encoding="utf-8"))["jobs"]


def steps(path):
    return [step for job in jobs(path).values() for step in job["steps"]]


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_a_workflow_is_pinned_and_may_little(path):
    whole = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert whole["permissions"] == {"contents": "read"}
    # By the hash of a commit, which nobody can move, with its version beside it.
    for line in re.findall(r"uses: (.*)", path.read_text(encoding="utf-8")):
        assert re.fullmatch(r"[\w-]+/[\w-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", line), line
    for step in steps(path):
        if step.get("uses", "").startswith("actions/checkout@"):
            assert step["with"]["persist-credentials"] is False
    for job in jobs(path).values():
        assert job["timeout-minutes"] <= 90
        assert "latest" not in str(job["runs-on"])


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_what_a_workflow_runs_is_there(path):
    text = "\n".join(step["run"] for step in steps(path) if "run" in step)
    targets = set(re.findall(r"^(\w[\w-]*):", read("Makefile"), re.M))
    assert set(re.findall(r"\bmake ([\w-]+)", text)) <= targets
    named = re.findall(r"packaging/\w+\.py|tests/python/\w+\.py", path.read_text(encoding="utf-8"))
    for name in named:
        assert (ROOT / name).is_file(), name


def test_an_action_has_one_pin():
    text = "".join(path.read_text(encoding="utf-8") for path in WORKFLOWS)
    pins = {*re.findall(r"uses: (\S+)@(.*)", text)}
    assert len(pins) == len({action for action, _ in pins}) > 3


def test_every_lock_file_is_watched():
    found = [ROOT / "Cargo.lock", *ROOT.glob("*/Cargo.lock")]
    updates = yaml.safe_load(read(".github/dependabot.yml"))["updates"]
    (cargo,) = (each for each in updates if each["package-ecosystem"] == "cargo")
    folders = {f"/{path.parent.relative_to(ROOT).as_posix()}".replace("/.", "/") for path in found}
    assert {*cargo["directories"]} == folders == {"/", "/fuzz"}


def test_every_crate_is_compiled_before_a_change_is_in():
    text = "\n".join(step["run"] for step in steps(CI) if "run" in step)
    assert re.search(r"cargo check .*--manifest-path fuzz/Cargo.toml", text)
    assert "make test" in text


@pytest.mark.parametrize(
    ("target", "extras"),
    [("figures", set()), ("test", {"test", "dev"}), ("docs", {"test", "dev", "docs"})],
)
def test_a_target_installs_the_extras_it_needs(target, extras, tmp_path):
    # What `make` would do from nothing.
    outside = {name: value for name, value in os.environ.items() if not name.startswith("MAKE")}
    command = ["make", "--dry-run", f"VENV={tmp_path / 'venv'}", target]
    planned = subprocess.run(
        command, cwd=ROOT, env=outside, capture_output=True, text=True, check=True
    ).stdout
    named = re.findall(r'for name in "([^"]*)"', planned)
    assert {extra for names in named for extra in names.split()} == extras
    assert planned.count("maturin develop") == planned.count("--editable ./reproduction") == 1
    assert "--extras" not in planned
    assert extras <= set(PROJECT["optional-dependencies"])


def test_the_oldest_python_is_tested():
    oldest = PROJECT["requires-python"].removeprefix(">=")
    assert oldest in jobs(CI)["test"]["strategy"]["matrix"]["python"]
    assert oldest in jobs(WHEELS)["test"]["strategy"]["matrix"]["python"]
    assert f'"abi3-py{oldest.replace(".", "")}"' in read("Cargo.toml")


def test_every_wheel_is_tested_before_anything_is_published():
    found = jobs(WHEELS)
    built = {each["target"] for each in found["wheel"]["strategy"]["matrix"]["include"]}
    tested = {*found["test"]["strategy"]["matrix"]["target"]}
    tested |= {each["target"] for each in found["test-musl"]["strategy"]["matrix"]["include"]}
    assert built == tested
    publishing = [name for name, job in found.items() if "id-token" in job.get("permissions", {})]
    assert publishing == ["publish", "publish-reproduction", "publish-crate"]
    # The reproduction needs the package of the same version, so it waits for that.
    assert found["publish-reproduction"]["needs"] == "publish"
    for name in ("publish", "publish-crate"):
        assert {*found[name]["needs"]} == found.keys() - {*publishing}
    for name in publishing:
        assert found[name]["if"] == "startsWith(github.ref, 'refs/tags/v')"


@pytest.mark.parametrize(
    ("tag", "more", "is_fit"),
    [
        (f"v{CARGO['version']}", 'repository = "https://example.org/x"\n', True),
        ("v99.0.0", 'repository = "https://example.org/x"\n', False),
        (f"v{CARGO['version']}", "", False),
    ],
    ids=["fit", "another version", "no address"],
)
def test_a_tag_is_published_only_if_version_and_address_are_there(tag, more, is_fit, tmp_path):
    (step,) = (each for each in jobs(WHEELS)["sdist"]["steps"] if "A tag" in each.get("name", ""))
    manifest = re.sub(r"^repository = .*\n", "", read("Cargo.toml"), flags=re.M)
    (tmp_path / "Cargo.toml").write_text(
        manifest.replace("[package]\n", f"[package]\n{more}", 1), encoding="utf-8"
    )
    # As the workflow runs it.
    command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
    done = subprocess.run(
        command, cwd=tmp_path, env=os.environ | {"GITHUB_REF_NAME": tag}, check=False
    )
    assert (done.returncode == 0) == is_fit


# Where the package is installed without matplotlib, as nothing has it there.
WITHOUT = """
import sys

sys.modules["matplotlib"] = None
from vibroimpact.cli import main

sys.exit(main(sys.argv[1:]))
"""


def test_what_is_run_where_there_is_no_matplotlib_needs_none():
    job = jobs(WHEELS)["test-musl"]
    bare = [each for each in job["strategy"]["matrix"]["include"] if each["options"]]
    assert [each["options"] for each in bare] == ["--no-deps"]
    (script,) = (step["run"] for step in job["steps"] if "run" in step)
    lines = re.findall(r"'(.*)'", script)[0].split("; ")
    needed = {re.match(r"[\w-]+", each)[0] for each in PROJECT["dependencies"]}
    there = lines[0].removeprefix("pip install --only-binary=:all: ").split()
    assert {*there} == needed - {"matplotlib"}
    commands = [line.split()[1:] for line in lines if line.startswith("vibroimpact ")]
    assert commands
    for words in commands:
        command = [sys.executable, "-c", WITHOUT, *words]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


# What the crate, wheels and sdists hold


def test_the_crate_is_packed_without_complaint(tmp_path):
    command = ["cargo", "package", "--locked", "--offline", "--no-verify", "--allow-dirty"]
    done = subprocess.run(
        [*command, "--target-dir", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "warning" not in done.stderr
    (crate,) = (tmp_path / "package").glob("*.crate")
    with tarfile.open(crate) as archive:
        names = {member.name.split("/", 1)[1] for member in archive}
    front = re.findall(r'include_str!\("\.\./(.*)"\)', read("src/lib.rs"))
    assert {*front, "LICENSE-MIT", "LICENSE-APACHE", "tests/data/random.json"} <= names
    pages = {name for name in names if name.startswith("docs/")}
    assert pages == {"docs/notation.md", "docs/theory.md"}


@pytest.fixture(scope="module")
def check():
    return runpy.run_path(str(ROOT / "packaging" / "check_dist.py"))


def made_wheel(folder, *more, without="", name="vibroimpact-1.0-cp311-abi3-linux.whl", size=0):
    info = "vibroimpact-1.0.dist-info"
    names = [
        *("vibroimpact/__init__.py", "vibroimpact/_core.abi3.so", "vibroimpact/_core.pyi"),
        *("vibroimpact/py.typed", f"{info}/METADATA", *more),
        *(f"{info}/licenses/LICENSE-MIT", f"{info}/licenses/LICENSE-APACHE"),
    ]
    path = folder / name
    with zipfile.ZipFile(path, "w") as archive:
        for each in names:
            if not without or without not in each:
                archive.writestr(each, b"\0" * (size if each.endswith(".so") else 1))
    return path


def test_a_wheel_is_looked_into(check, tmp_path):
    faults = check["wheel_faults"]
    assert faults(made_wheel(tmp_path)) == []
    assert "tests/x.py does not belong there" in faults(made_wheel(tmp_path, "tests/x.py"))
    for part in ("py.typed", "_core.pyi", "_core.abi3.so", "LICENSE-MIT"):
        (missing,) = faults(made_wheel(tmp_path, without=part))
        assert "is missing" in missing
    assert "bytes" in faults(made_wheel(tmp_path, size=5_000_000))[0]
    (one,) = faults(made_wheel(tmp_path, name="vibroimpact-1.0-cp311-cp311-linux.whl"))
    assert "one version of Python" in one


def test_the_wheel_of_the_reproduction_is_looked_into(check, tmp_path):
    info = "han_jin_hu_2004-1.0.dist-info"
    names = [pattern.replace("*", "x") for pattern in check["REPRODUCTION"][:3]]
    names += [f"{info}/{each}" for each in ("METADATA", "entry_points.txt")]
    names += [f"{info}/licenses/{each}" for each in ("LICENSE-MIT", "LICENSE-APACHE")]

    def faults(names, tag="py3-none-any"):
        path = tmp_path / f"han_jin_hu_2004-1.0-{tag}.whl"
        with zipfile.ZipFile(path, "w") as archive:
            for name in names:
                archive.writestr(name, b"")
        return check["wheel_faults"](path)

    assert faults(names) == []
    assert faults([*names, "tests/x.py"]) == ["tests/x.py does not belong there"]
    for missing in ("reference.json", "entry_points.txt", "LICENSE-MIT"):
        (fault,) = faults([name for name in names if missing not in name])
        assert "is missing" in fault
    assert faults(names, "cp311-abi3-linux") == ["is not for every platform"]


def test_an_sdist_is_looked_into(check, tmp_path):
    whole = [pattern.replace("*", "x") for pattern in check["SDIST"]]

    def faults(names):
        with tarfile.open(tmp_path / "x.tar.gz", "w:gz") as archive:
            for name in names:
                archive.addfile(tarfile.TarInfo(f"vibroimpact-1.0/{name}"), io.BytesIO())
        return check["sdist_faults"](tmp_path / "x.tar.gz")

    assert faults(whole) == []
    for strange in ("target/release/x.so", "figures/fig2.png", "docs/images/x.png", ".venv/x"):
        assert faults([*whole, strange]) == [f"{strange} does not belong there"]
    for missing in ("Cargo.lock", "LICENSE-MIT", "SECURITY.md", "tests/data/x.json", "src/x.rs"):
        (fault,) = faults([name for name in whole if name != missing])
        assert "is missing" in fault


def test_rust_is_taken_off_the_path(tmp_path):
    script = runpy.run_path(str(ROOT / "packaging" / "try_installed.py"))
    with_rust, without = tmp_path / "rust", tmp_path / "none"
    for folder, tool in ((with_rust, "rustc"), (without, "gcc")):
        folder.mkdir()
        (folder / tool).touch(mode=0o755)
    assert script["without_rust"](f"{with_rust}:{without}") == str(without)


def test_the_page_on_releases_names_the_jobs_that_publish():
    workflow = (ROOT / ".github" / "workflows" / "wheels.yml").read_text(encoding="utf-8")
    jobs = re.findall(r"^  (publish[\w-]*):\n((?:    .*\n|\n)*)", workflow, re.M)
    used = {job: re.findall(r"^    environment: (.*)$", text, re.M) for job, text in jobs}
    page = (ROOT / "docs" / "releasing.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(publish[\w-]*)` \|.*\| `([\w-]+)` \|$", page, re.M)
    assert used == {job: [environment] for job, environment in rows}
    # PyPI tells two pending publishers of one workflow apart by their environments.
    assert len({environment for _, environment in rows}) == len(rows) > 1
