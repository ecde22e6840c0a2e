"""docs/claims.md is what the package writes, its commands run, and wrong formulas are noticed."""

import json
import math
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import repository
import sizes
import vibroimpact as vi
from han_jin_hu_2004 import printed_impact, theorems
from han_jin_hu_2004.claims import Claim
from han_jin_hu_2004.statements import (
    GROUPS,
    STATEMENTS,
    model,
    page,
    printed_motion,
    stability,
)
from han_jin_hu_2004.statements.page import WORDS, to_markdown
from han_jin_hu_2004.statements.statement import SOURCE, formula, mended
from vibroimpact import cli

DOCS = repository.root() / "docs"
PAGE = (DOCS / "claims.md").read_text(encoding="utf-8")
# Each takes seconds.
LONGEST = {"one-two", "eq48b"}
QUICK = [
    name
    for name, statement in STATEMENTS.items()
    if not statement.slow and (sizes.THOROUGH or name not in LONGEST)
]


def shown(cell: str) -> str:
    """What a reader sees of a cell."""
    return re.sub(r"\\(.)", r"\1", cell)


def read_page() -> dict[str, Claim]:
    """The claims as far as the committed page holds them, by the commands in their rows."""
    rows = re.findall(r"^\| (.*) \| `(vibroimpact .*)` \|$", PAGE, re.M)
    evidence = dict(re.findall(r"^- `(\S+)`: (.*)\.$", PAGE, re.M))
    claims = {}
    assert len(rows) == len(STATEMENTS)
    for (cells, command), statement in zip(rows, STATEMENTS.values(), strict=True):
        says, place, found, verdict = map(shown, re.split(r" (?<!\\)\| ", cells))
        assert command == statement.command
        verdict, _, after = verdict.partition(", [theorem](proofs.md)")
        assert not after
        word = re.sub(r"^\[(.*)\]\(.*\)$", r"\1", verdict)
        (kind,) = [kind for kind, name in WORDS.items() if name == word]
        decided_by, _, theorem = shown(evidence.get(statement.id, found)).partition("; theorem: ")
        claims[statement.id] = Claim(
            id=statement.id,
            figure=statement.figure,
            source=f"{SOURCE}, {place}",
            paper_says=says,
            found=found,
            residual=None,
            reference={},
            verdict=kind,
            decided_by=decided_by,
            details="",
            command=command,
            theorem=theorem,
        )
    return claims


WRITTEN = read_page()


def test_names_are_unique_and_need_no_quotes_in_a_shell():
    names = [statement.id for statements in GROUPS.values() for statement in statements]
    assert len(names) == len(set(names)) == len(STATEMENTS) > 100
    assert all(re.fullmatch(r"[a-z0-9][a-z0-9.-]*", name) for name in names)


def test_the_committed_page_is_what_the_package_writes():
    # All but the findings themselves, which the next test computes where that is quick.
    assert to_markdown(WRITTEN) == PAGE
    for name, claim in WRITTEN.items():
        assert claim.paper_says == STATEMENTS[name].says
        assert claim.source == f"{SOURCE}, {STATEMENTS[name].place}"


THEOREMS = {
    "fig5a": ["1-1"],
    "fig5b": ["1-1"],
    "fig5c": ["2-1"],
    "fig6a": ["1-2"],
    "fig6b": ["2-4"],
    "fig6c": ["8-6"],
    "fig9-1": ["1-3"],
    "fig9-3": ["6-7", "4-5"],
    "fig9-4": ["154-77"],
}
"""What the page says is proved."""


def proved(theorem: str) -> list[str]:
    """The stable motions that a theorem is about."""
    return re.findall(r"the (\d+-\d+) motion exists, [^;]* and is stable,", theorem)


def test_the_page_marks_what_is_proved():
    assert {name: proved(claim.theorem) for name, claim in WRITTEN.items() if claim.theorem} == (
        THEOREMS
    )


@pytest.mark.parametrize(
    "name", [name for name in THEOREMS if name not in ("fig9-3", "fig9-4") or sizes.THOROUGH]
)
def test_the_theorems_of_the_page_are_proved_again(name):
    pytest.importorskip("flint")
    claim = STATEMENTS[name].evaluate()
    assert proved(claim.theorem) == THEOREMS[name]
    assert ", [theorem](proofs.md) |" in page.row(claim)


def test_without_flint_nothing_is_marked(monkeypatch):
    def missing(motion):
        raise ImportError("python-flint")

    monkeypatch.setattr(theorems, "prove", missing)
    claim = STATEMENTS["fig5a"].evaluate()
    assert (claim.verdict, claim.theorem) == ("reproduced", "")
    assert "theorem]" not in page.row(claim)


def test_what_is_not_proved_is_not_marked(monkeypatch):
    def open_still(motion):
        return vi.Proof(verdict="undecided", why="nothing", label=motion.label)

    monkeypatch.setattr(theorems, "prove", open_still)
    assert STATEMENTS["fig5a"].evaluate().theorem == ""


def words(text: str) -> str:
    """A text without its numbers, of which the last digits may differ on another machine."""
    return re.sub(r"[-+]?\d[\d.,]*(e[-+]?\d+)?", "#", text)


def blocks(out: str) -> list[dict[str, str]]:
    """What is printed for each statement, by its heads."""
    return [
        dict(re.split(r"\s{2,}", line, maxsplit=1) for line in block.splitlines())
        for block in out.strip().split("\n\n")
    ]


def test_the_commands_of_quick_statements_print_the_verdicts_of_the_page(run_command, tmp_path):
    stored = tmp_path / "claims.json"
    code, out, err = run_command(f"claims {' '.join(QUICK)} --quiet --json", stored)
    assert (code, err) == (0, "")
    made = json.loads(stored.read_text(encoding="utf-8"))
    assert [claim["id"] for claim in made] == QUICK
    assert len(QUICK) > 0.6 * len(STATEMENTS)
    for name, printed, claim in zip(QUICK, blocks(out), made, strict=True):
        before = WRITTEN[name]
        assert printed["statement"] == before.paper_says
        assert printed["verdict"] == WORDS[before.verdict], name
        assert claim["verdict"] == before.verdict, name
        assert printed["computed"] == claim["found"]
        assert words(claim["found"]) == words(before.found), name


@pytest.mark.parametrize("name", STATEMENTS)
def test_every_command_can_be_given(name):
    program, *rest = shlex.split(STATEMENTS[name].command)
    assert program == "vibroimpact"
    chosen = cli._parser().parse_args(rest)
    if rest[0] == "claims":
        assert chosen.ids == [name]
    else:
        assert chosen.figures == [STATEMENTS[name].figure]


def anchors(path: Path) -> set[str]:
    """The anchors of the headings of a page."""
    heads = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", head.lower()).strip().replace(" ", "-") for head in heads}


@pytest.mark.parametrize("link", sorted({item.page for item in STATEMENTS.values() if item.page}))
def test_explanations_are_where_the_page_says(link):
    name, _, anchor = link.partition("#")
    assert (DOCS / name).is_file()
    assert not anchor or anchor in anchors(DOCS / name)


def test_what_is_not_decided_says_why():
    for name, claim in WRITTEN.items():
        if claim.verdict == "open":
            assert len(claim.evidence) > 20, name


@pytest.mark.parametrize(
    ("off", "verdict"),
    [(1e-15, "reproduced"), (1e-6, "open"), (0.1, "refuted"), (math.nan, "refuted")],
)
def test_a_formula_is_judged_by_its_error(off, verdict):
    assert formula(off, "anywhere").verdict == verdict


@pytest.mark.parametrize(
    ("printed", "corrected", "verdict"),
    [
        (1e-15, 1e-15, "reproduced"),
        (0.1, 1e-15, "corrected"),
        (math.nan, 1e-15, "corrected"),
        (0.1, 0.1, "refuted"),
        (0.1, math.nan, "refuted"),
        (1e-6, 1e-15, "open"),
    ],
)
def test_a_correction_has_to_help(printed, corrected, verdict):
    assert mended(printed, corrected, "anywhere", "it").verdict == verdict


def scaled(function, factor=1.5):
    """A function whose first result is wrong."""

    def wrong(*given, **named):
        result = function(*given, **named)
        if isinstance(result, tuple):
            return (result[0] * factor, *result[1:])
        return result * factor

    return wrong


@pytest.mark.parametrize(
    ("module", "formula_name", "statement"),
    [
        (printed_impact, "approach_impulse", "eq9"),
        (printed_impact, "reversal_impulse", "eq10"),
        (printed_motion, "flight", "eq25"),
        (printed_motion, "flight", "eq29"),
        (printed_motion, "linear_system", "eq31"),
        (printed_motion, "coefficients", "eq32"),
        (printed_motion, "simplified_period", "eq36"),
        (printed_motion, "condition_37", "eq37"),
        (printed_motion, "equation_38", "eq38"),
        (printed_motion, "state_39_40", "eq39-40"),
        (printed_motion, "jacobian_43", "eq42-43"),
        (stability, "coefficient_slopes", "eq44"),
        (stability, "characteristic", "eq45"),
        (stability, "roots", "eq46-47"),
    ],
)
def test_a_wrong_formula_is_noticed(module, formula_name, statement, monkeypatch):
    monkeypatch.setattr(module, formula_name, scaled(getattr(module, formula_name)))
    assert STATEMENTS[statement].evaluate().verdict == "refuted"


def test_the_wrong_solution_of_35_is_noticed(monkeypatch):
    right = model.coefficients
    monkeypatch.setattr(model, "coefficients", lambda motion: right(motion) * 1.01)
    assert STATEMENTS["eq35"].evaluate().verdict != "reproduced"


def test_a_number_that_does_not_agree_to_its_digits_is_refuted(monkeypatch):
    from han_jin_hu_2004.statements import existence_figures

    monkeypatch.setattr(existence_figures, "PRINTED", 1e-6)
    assert STATEMENTS["fig2-digits"].evaluate().verdict == "refuted"


def test_diagrams_without_a_difference_refute_the_effect_of_damping(monkeypatch):
    from han_jin_hu_2004.statements import general

    monkeypatch.setattr(general, "changes", lambda name: 7)
    assert STATEMENTS["damping-calms"].evaluate().verdict == "refuted"


def test_cells_show_every_letter():
    assert page._cell("|x_1| < 2 * 3") == r"\|x\_1\| \< 2 \* 3"
    assert page._cell("[a](b_c.md)") == "[a](b_c.md)"


def test_the_list_names_all_without_judging(run_command):
    code, out, _ = run_command("claims --list")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(STATEMENTS)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("claims eq5aa", "'eq5aa' is no statement; `vibroimpact claims --list` names all, did you"),
        ("claims eq5a --markdown page.md", "--markdown: the page holds all statements"),
    ],
)
def test_bad_input_is_named(line, message, run_command):
    code, out, err = run_command(line)
    assert (code, out) == (2, "")
    assert message in err


def test_random_impacts_are_the_same_each_time():
    from han_jin_hu_2004.statements.samples import impacts

    first = impacts(size=50).copy()
    impacts.cache_clear()
    assert np.array_equal(impacts(size=50), first)
