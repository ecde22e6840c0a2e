"""The tables of bars.py in Markdown."""

import statistics
from collections.abc import Sequence
from types import ModuleType
from typing import Any

from machine import cores, load, machine
from rounds import ratios, spread, table

__all__ = ["cores", "head", "markdown"]

# Two cores against one.
SCALING = 1.9


def head(rounds: int, *, quick: bool) -> str:
    """Say where and how; called before anything runs, for the load at the start."""
    title = "# A trial run, no figures\n\n" if quick else "# The bars\n\n"
    return (
        f"{title}{machine()}; load {load()} at the start. Medians of {rounds} rounds (and their "
        "ranges); G and peers are measured beside vibroimpact in each round. One core.\n"
    )


def markdown(opening: str, results: Sequence[dict[str, Any]], peers: Sequence[ModuleType]) -> str:
    """Return all tables."""
    present = [peer for peer in peers if any(peer.NAME in result["peers"] for result in results)]
    lines = [opening, _g(results), ""]
    lines += table(
        [
            "case",
            "periods",
            "us/period",
            "G/period",
            "bar",
            "met?",
            "error",
            *(f"times faster than {peer.NAME}; its error" for peer in present),
        ],
        [_row(result, present) for result in results],
    )
    lines += ["", f"Load at the end: {load()}.", "", "## Two cores against one", ""]
    lines += ["Times as fast; two processes of half the work each show what the machine gives.", ""]
    lines += _scaling(results)
    lines += ["", "## What each peer missed", ""]
    lines += table(
        ["peer", "setting", "us/period", "does not compute", "missed here"],
        [_missed(peer, results) for peer in present],
    )
    return "\n".join(lines) + "\n"


def _g(results: Sequence[dict[str, Any]]) -> str:
    values = [g for result in results for timing in result["timings"].values() for g in timing["g"]]
    return f"G = {spread(values)} ns over all runs."


def _costs(result: dict[str, Any], name: str, periods: int) -> list[float]:
    """Nanoseconds per drive period of each round."""
    return [seconds / periods * 1e9 for seconds in result["timings"][name]["seconds"]]


def _row(result: dict[str, Any], peers: Sequence[ModuleType]) -> list[str]:
    costs = _costs(result, "vibroimpact", result["periods"])
    in_g = ratios(costs, result["timings"]["vibroimpact"]["g"])
    bar = result["bar"]
    bars = [] if bar is None else [(f"{bar:g} G", statistics.median(in_g) <= bar)]
    cells = []
    for peer in peers:
        answer = result["peers"].get(peer.NAME)
        if answer is None:
            cells.append("")
            continue
        if answer["missing"]:
            cells.append(answer["missing"])
            continue
        gains = _gains(result, peer.NAME)
        note = ", smaller than ours" if answer["error"] < result["error"] else ""
        cells.append(f"{spread(gains)}; {answer['error']:.0e}{note}")
        if peer.NAME in result["factors"]:
            factor = result["factors"][peer.NAME]
            bars.append((f"{factor:,.0f} x {peer.NAME}", statistics.median(gains) >= factor))
    return [
        result["case"],
        f"{result['periods']:,}",
        f"{statistics.median(costs) / 1e3:.3g}",
        spread(in_g),
        "<br>".join(name for name, _ in bars) or "-",
        "<br>".join("yes" if met else "no" for _, met in bars) or "-",
        f"{result['error']:.0e}",
        *cells,
    ]


def _gains(result: dict[str, Any], name: str) -> list[float]:
    """How many times a peer's cost per period is vibroimpact's, in the same round."""
    theirs = _costs(result, name, result["peers"][name]["periods"])
    return ratios(theirs, _costs(result, "vibroimpact", result["periods"]))


def _scaling(results: Sequence[dict[str, Any]]) -> list[str]:
    rows = []
    for result in results:
        if not result["two cores"]:
            continue
        one, threads, processes = (
            result["two cores"][name]["seconds"] for name in ("one", "threads", "processes")
        )
        gains = ratios(one, threads)
        met = "yes" if statistics.median(gains) >= SCALING else "no"
        possible = spread(ratios(one, processes))
        share = spread(ratios(processes, threads))
        rows.append([result["case"], spread(gains), f"{SCALING}", met, possible, share])
    head = ["case", "two threads", "bar", "met?", "two processes", "threads to processes"]
    return table(head, rows) if rows else ["Not measured."]


def _missed(peer: ModuleType, results: Sequence[dict[str, Any]]) -> list[str]:
    answers = {
        result["case"]: result["peers"][peer.NAME]
        for result in results
        if peer.NAME in result["peers"]
    }
    why = next(iter(answers.values()))["missing"]
    if why:
        return [peer.NAME, peer.SETTING, why, peer.LACKS, "-"]
    costs = []
    for result in results:
        if result["case"] in answers:
            periods = answers[result["case"]]["periods"]
            middle = statistics.median(_costs(result, peer.NAME, periods)) / 1e3
            costs.append(f"{result['case']}: {middle:,.3g}")
    found = [f"{case}: {answer['missed']}" for case, answer in answers.items()]
    return [peer.NAME, peer.SETTING, "<br>".join(costs), peer.LACKS, "<br>".join(found)]
