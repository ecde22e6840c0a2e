"""Settings of the documentation site; ``make docs`` builds it.

The source folder is the root of the repository, not this one: then links to the README, the
changelog and the pages of the tests are the same on the site and on a code host. Nothing is
fetched, neither by the build nor by a reader's browser.
"""

import logging
import os
import posixpath
import re
import sys
from pathlib import Path
from typing import Any

import docutils.nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxTranslator

import vibroimpact

project = "vibroimpact"
author = "The vibroimpact developers"
copyright = author
version = release = vibroimpact.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
]
root_doc = "docs/index"
include_patterns = ["*.md", "docs/**.md", "tests/*/README.md", "reproduction/README.md"]
exclude_patterns = ["benches", "figures", "python", "site", "src", "target", ".*"]

nitpicky = True
# Names of other packages, whose pages are not at hand, and words in descriptions of parameters are
# shown, not linked; so are types of this package that are no part of its interface.
nitpick_ignore_regex = [
    ("py:.*", r"(?!vibroimpact\.).*"),
    ("py:class", r"vibroimpact\._core\..*"),
    ("py:class", r"vibroimpact\.keyword_types\..*"),
]
nitpick_ignore = [
    ("py:class", f"vibroimpact.{name}")
    for name in (
        "sweeps.basins.attractors.Tails",
        "sweeps.basins.clouds.Cloud",
        "sweeps.results.GridResult",
        "sweeps.diagram_results.AnyDiagram",
        "sweeps.diagram_results.RunT",
        "orbits.found.MotionT",
        "run_record.MachineT",
        "run_record.RunRecord",
        "archived.Archived",
        "machine.Machine",
        "sweeps.basins.region.Follow",
        "sweeps.basins.region.Region",
        "orbits.curve_problem.CurveProblem",
        "continuation.names.OwnTest",
        "sweeps.basins.attractors.Family",
    )
]

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 4
# Dashes only: x1' is a derivative, no apostrophe.
smartquotes_action = "D"

# Pages whose blocks of Python are run; what each prints and draws stands below it.
EXECUTED = (
    *("start", "tutorial", "special-systems", "cheat-sheet", "drawing", "basins", "orbits"),
    *("howto/machine", "howto/diagram", "howto/real-orbit", "howto/basins"),
    *("howto/structure", "howto/finite-elements", "howto/from-a-picture", "other-peoples-systems"),
    *("fitting", "structures", "sweeps"),
)
sys.path.insert(0, str(Path(__file__).parent))
nb_custom_formats = {f"docs/{page}.md": ["executed.read", {}] for page in EXECUTED}
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_merge_streams = True
# That a page is run is no news.
logging.getLogger("traitlets").setLevel(logging.WARNING)
# Nothing from another host.
nb_ipywidgets_js = {}
# Figures belong below the code that draws them, whatever the caller draws with.
os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"
os.environ["MATPLOTLIBRC"] = str(Path(__file__).parent / "static" / "matplotlibrc")

# Only what a reader would type, not what it prints.
copybutton_selector = "div.cell_input pre, div.highlight-python pre, div.highlight-sh pre"

default_role = "code"
autodoc_member_order = "bysource"
autodoc_type_aliases = {"ArrayLike": "ArrayLike"}
autodoc_typehints = "signature"
autodoc_class_signature = "mixed"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_title = f"vibroimpact {release}"
html_math_renderer = "mathml"
html_copy_source = False
# The address of the site itself leads to its front page.
html_additional_pages = {"index": "redirect.html"}
templates_path = ["templates"]


def add_other_pages(app: Sphinx, name: str, source: list[str]) -> None:
    """Put the pages that the front page does not name into its last list."""
    if name != root_doc:
        return
    named = set(re.findall(r"^(?:.+<)?([\w./-]+)>?$", source[0], re.MULTILINE))
    folder = posixpath.dirname(root_doc)
    pages = {posixpath.relpath(page, folder) for page in app.env.found_docs - {root_doc}}
    others = "\n".join(sorted(pages - named))
    source[0] = source[0].replace("[every page that is not named here]", others)


def fold_sidebar(
    app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: object
) -> None:
    """Fold the lists of the side bar below their captions, but not the one with the page itself.

    On a page that is in none of them the first is open. The theme has no option for this.
    """
    tree = context["furo_navigation_tree"]
    before, *parts = re.split(
        r'<p class="caption" role="heading"><span class="caption-text">(.+?)</span></p>', tree
    )
    captions, lists = parts[::2], parts[1::2]
    has_page = ['<ul class="current">' in pages for pages in lists]
    shown = has_page.index(True) if any(has_page) else 0
    context["furo_navigation_tree"] = before + "".join(
        f"<details{' open' * (number == shown)}>"
        f'<summary class="caption">{caption}</summary>{pages}</details>'
        for number, (caption, pages) in enumerate(zip(captions, lists, strict=True))
    )


def keep_summary(
    app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]
) -> None:
    """Keep napoleon from taking what a property's summary says before a colon for its type.

    It looks at the first line that is not empty: an empty comment, which the page does not show.
    """
    if what in ("attribute", "data", "property"):
        lines[:0] = ["..", ""]


def join_names(
    app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]
) -> None:
    """Keep Sphinx from taking the first of several attributes in one line for a type."""
    for number, line in enumerate(lines):
        if found := re.match(r":ivar ((?:\w+, )+\w+):", line):
            lines[number] = line.replace(found[1], found[1].replace(", ", ","), 1)


def plain_aliases(
    app: Sphinx,
    what: str,
    name: str,
    obj: object,
    options: object,
    signature: str | None,
    returns: str | None,
) -> tuple[str | None, str | None]:
    """Write an alias by its name where it is a part of a union, too."""
    plain = [
        text and re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text)
        for text in (signature, returns)
    ]
    return plain[0], plain[1]


def write_math(translator: SphinxTranslator, node: docutils.nodes.Element) -> None:
    """Write a formula as MathML, which browsers show without scripts or fonts of a third party."""
    block = isinstance(node, docutils.nodes.math_block)
    # The converter has equations below each other only by this name.
    text = node.astext().replace("{aligned}", "{align*}")
    # It leaves no room between a function and what follows it.
    text = re.sub(r"\\(sin|cos|sinh)(?![a-zA-Z]) ?(?=[\\a-zA-Z])", r"\\\1\\,", text)
    formula = convert(text, display="block" if block else "inline")
    translator.body.append(f'<div class="math">{formula}</div>' if block else formula)
    raise docutils.nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Register what is defined above."""
    app.connect("source-read", add_other_pages)
    # After the theme has made the list.
    app.connect("html-page-context", fold_sidebar, priority=900)
    app.connect("autodoc-process-docstring", keep_summary, priority=400)
    app.connect("autodoc-process-docstring", join_names, priority=600)
    app.connect("autodoc-process-signature", plain_aliases)
    app.add_html_math_renderer("mathml", (write_math, None), (write_math, None))
