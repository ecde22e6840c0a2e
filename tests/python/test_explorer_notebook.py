"""The explorer in a Jupyter notebook: the output of the cell, and the page that it asks for."""

import re
import urllib.request

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")

CODE = """
import vibroimpact as vi

system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
                   drive_frequency=1.8, moment_amplitude=1)
vi.explore(system)
"""


def test_a_cell_shows_the_page():
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(CODE)])
    client = nbclient.NotebookClient(notebook, timeout=None)
    with client.setup_kernel():
        cell = client.execute_cell(notebook.cells[0], 0)
        shown = [output["data"] for output in cell.outputs if output["output_type"] != "stream"]
        loaded = [data for data in shown if "application/vnd.bokehjs_load.v0+json" in data]
        (page,) = [data for data in shown if "application/vnd.bokehjs_exec.v0+json" in data]
        # Bokeh itself comes with the notebook, which asks this machine for the page.
        assert loaded
        (address,) = re.findall(r'"(http://localhost:\d+/autoload\.js\?[^"]*)"', page["text/html"])
        with urllib.request.urlopen(address) as answer:
            script = answer.read().decode()
    assert re.search(r'"token":"[\w.-]+"', script)
