"""Every public parameter has a description of its own: no two share one."""

import inspect
import re

import vibroimpact as vi

MODULES = (vi, vi.plot, vi.sweeps, vi.orbits)
# An entry of a section: names at its indentation, perhaps with a type after a colon.
ENTRY = re.compile(r"^(?P<names>\*{0,2}\w+(?:, \*{0,2}\w+)*)(?: : .*)?$")


def _documented() -> dict[str, str]:
    """Return the docstring of everything public that can be called, by its name."""
    found: dict[str, str] = {}
    for module in MODULES:
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.isfunction(thing) or inspect.isclass(thing):
                found[f"{module.__name__}.{name}"] = inspect.getdoc(thing) or ""
            if inspect.isclass(thing):
                for key, member in vars(thing).items():
                    bare = getattr(member, "__func__", member)
                    if inspect.isfunction(bare) and not key.startswith("_"):
                        found[f"{module.__name__}.{name}.{key}"] = inspect.getdoc(bare) or ""
    return found


def parameters(text: str) -> list[tuple[str, str]]:
    """Return names and descriptions in the section Parameters of a docstring."""
    match = re.search(r"^Parameters\n-+\n(.*?)(?=^\w[^\n]*\n-+$|\Z)", text, re.M | re.S)
    found: list[tuple[str, str]] = []
    for line in match.group(1).splitlines() if match else ():
        entry = None if line.startswith(" ") else ENTRY.match(line)
        if entry:
            found.append((entry["names"], ""))
        elif found:
            names, said = found[-1]
            found[-1] = names, f"{said} {line.strip()}".strip()
    return found


DOCUMENTED = _documented()


def test_the_section_is_read_as_it_is_written():
    text = "Do.\n\nParameters\n----------\na, b\n    Both.\nc : int\n    One\n    more.\n\n"
    assert parameters(f"{text}Returns\n-------\nint\n") == [("a, b", "Both."), ("c", "One more.")]
    assert sum(bool(parameters(text)) for text in DOCUMENTED.values()) > 40


def test_no_two_parameters_share_a_description():
    for name, text in DOCUMENTED.items():
        found = parameters(text)
        assert [names for names, _ in found if "," in names] == [], name
        assert len({said for _, said in found}) == len(found), name


def test_no_description_leads_to_what_is_not_public():
    assert [name for name, text in DOCUMENTED.items() if "`sample`" in text] == []
