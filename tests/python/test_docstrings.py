"""Every public docstring has an example, and every example does what it shows.

The example of a method goes on from that of its class, so it can use the names made there.
"""

import doctest
import inspect
from functools import cached_property

import pytest
from matplotlib import pyplot

import vibroimpact as vi
import vibroimpact.plot

PACKAGE = "vibroimpact"


def _here(found):
    return getattr(found, "__module__", "").startswith(PACKAGE)


def _methods(cls):
    """Return the public methods of a class that the package itself defines, by name."""
    for name in dir(cls):
        found = inspect.getattr_static(cls, name)
        if isinstance(found, classmethod | staticmethod):
            found = found.__func__
        if not name.startswith("_") and inspect.isfunction(found) and _here(found):
            yield name, found


def _properties(cls):
    """Return those of its properties whose docstring has an example, by name."""
    for name in dir(cls):
        found = inspect.getattr_static(cls, name)
        computed = isinstance(found, property | cached_property)
        if computed and not name.startswith("_") and ">>>" in (found.__doc__ or ""):
            yield name, found


def _public():
    """Return every public docstring: its name, and the docstrings to run before it and itself."""
    for module, prefix in ((vi, "vi"), (vibroimpact.plot, "vi.plot")):
        for name in module.__all__:
            found = getattr(module, name)
            if not callable(found):
                continue
            own = inspect.getdoc(found) or ""
            yield f"{prefix}.{name}", ("", own)
            if inspect.isclass(found):
                for method, function in (*_methods(found), *_properties(found)):
                    yield f"{prefix}.{name}.{method}", (own, inspect.getdoc(function) or "")


PUBLIC = dict(_public())


def test_every_public_docstring_has_an_example():
    assert len(PUBLIC) > 150
    assert [name for name, (_, own) in PUBLIC.items() if ">>>" not in own] == []


@pytest.mark.parametrize("first", sorted({name.split(".")[1] for name in PUBLIC}))
def test_examples_do_what_they_show(first, tmp_path, monkeypatch):
    """All of one public name, each in a folder that is its own."""
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner()
    parser = doctest.DocTestParser()
    for name in PUBLIC:
        if name.split(".")[1] != first:
            continue
        before, own = PUBLIC[name]
        made = {}
        if before:
            example = parser.get_doctest(before, {}, name, None, None)
            runner.run(example, clear_globs=False)
            made = example.globs
        report = []
        example = parser.get_doctest(own, made, name, None, None)
        result = runner.run(example, out=report.append)
        pyplot.close("all")
        assert result.failed == 0, "".join(report)
        assert result.attempted > 0, name
