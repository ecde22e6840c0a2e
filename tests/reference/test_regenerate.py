"""`python -m reference.regenerate` tells data that differ from data that do not."""

from __future__ import annotations

import json
from typing import Any

import pytest

pytest.importorskip("flint", reason="the high-precision reference needs python-flint")

from . import regenerate
from .generate import DATA, flight_cases, flight_record
from .ladder import graze_records

ROW = {"x": "0.1234567890123456789012345", "pair": ["1", "2"], "error": "2.0e-50"}


def test_every_generated_file_has_its_maker() -> None:
    text = (DATA / "README.md").read_text()
    table = [line for line in text.splitlines() if "`python -m reference.regenerate" in line]
    assert {line.split("|")[1].strip() for line in table} == set(regenerate.MAKERS)


@pytest.mark.parametrize(
    ("change", "fields"),
    [
        ({}, []),
        ({"pair": ("1", "2")}, []),
        ({"x": "0.1234567890123456789012346"}, ["x"]),
        ({"pair": ["1", "3"], "more": 1}, ["more", "pair"]),
        ({"error": "1.9e-49"}, []),
        ({"error": "2.1e-49"}, ["error"]),
    ],
)
def test_differences_are_named(change: dict[str, Any], fields: list[str]) -> None:
    assert regenerate.differences(ROW, ROW | change) == fields


def test_the_command_fails_where_a_row_differs(
    tmp_path: Any, monkeypatch: Any, capsys: Any
) -> None:
    monkeypatch.setattr(regenerate, "DATA", tmp_path)
    maker = regenerate.Maker(lambda: ["0", "1"], lambda part: [(part, ROW)])
    monkeypatch.setitem(regenerate.MAKERS, "flights.json", maker)
    here = ["flights.json", "--workers", "1"]
    assert regenerate.main([*here, "--write"]) == 0
    assert regenerate.main(here) == 0
    told = capsys.readouterr().out
    assert "flights.json: 2 rows, 0 differ" in told
    assert "flights.json, 1: made in" in told
    (tmp_path / "flights.json").write_text(json.dumps([ROW, ROW | {"x": "0.1"}, ROW]))
    assert regenerate.main(here) == 1
    told = capsys.readouterr().out
    assert "flights.json, 1: x differ" in told
    assert "flights.json, 2: made by no generator" in told
    assert regenerate.main([*here, "--only", "0"]) == 0
    told = capsys.readouterr().out
    assert "flights.json: 1 rows, 0 differ" in told
    assert "made by no generator" not in told
    assert regenerate.main([*here, "--only", "0", "1"]) == 1
    for wrong in (["--only", "7"], ["--only", "0", "--write"]):
        with pytest.raises(SystemExit, match="2"):
            regenerate.main([*here, *wrong])


def test_parts_made_in_other_processes_are_the_file_in_its_order(
    tmp_path: Any, monkeypatch: Any
) -> None:
    file = regenerate.generate_orbits.NAME
    committed, scenes = regenerate.read(file), regenerate.orbit_scenes.SCENES
    two = ["wall_direct", "no_impact"]  # the quickest, the first one not as quick as the second
    monkeypatch.setattr(regenerate.orbit_scenes, "SCENES", {name: scenes[name] for name in two})
    monkeypatch.setattr(regenerate, "DATA", tmp_path)
    assert regenerate.main([file, "--write", "--workers", "2"]) == 0
    written = json.loads((tmp_path / file).read_text())
    assert list(written) == two
    for name in two:
        assert regenerate.differences(committed[name], written[name]) == []


def test_the_parts_of_the_flights_are_all_of_them() -> None:
    numbers: list[int] = []
    for part in regenerate.MAKERS["flights.json"].parts():
        first, last = map(int, part.split("-"))
        numbers += range(first, last + 1)
    assert numbers == list(range(len(regenerate.read("flights.json"))))


def test_some_rows_of_the_lists_are_what_their_makers_make() -> None:
    committed = regenerate.read("flights.json")
    for number, case in list(enumerate(flight_cases()))[7::60]:
        assert regenerate.differences(committed[str(number)], flight_record(case)) == []
    committed = regenerate.read("near_grazes.json")
    rows = graze_records()
    for number in range(3):
        assert regenerate.differences(committed[str(number)], next(rows)) == []
