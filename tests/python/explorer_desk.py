"""A page of the explorer on a document without a browser, and what a test does with it."""

from bokeh.document import Document
from bokeh.events import RangesUpdate

from vibroimpact.explorer import compute
from vibroimpact.explorer.app import Page
from vibroimpact.explorer.presets import DEFAULT

# For maps that a test computes.
SMALL = compute.Detail(columns=9, rows=5, periods=60, keep=20)


class Desk:
    """A page whose callbacks wait until they are run."""

    def __init__(self, state=DEFAULT):
        self.document, self.waiting, self.answers = Document(), [], True
        self.document.add_next_tick_callback = self.waiting.append
        self.document.add_timeout_callback = lambda call, _time: self.waiting.append(call)
        self.page = Page(self.document, state)
        for name in ("motion", "map"):
            self.named(f"{name}-sent").on_change("tags", self.acknowledge(name))
        self.settle()

    def acknowledge(self, name):
        """Answer as a browser does that draws at once, or not at all."""

        def answer(_name, _old, new):
            if self.answers:
                self.named(f"{name}-drawn").tags = new

        return answer

    def settle(self):
        """Run what waits until nothing is computed any more."""
        while self.page.busy or self.waiting:
            while self.waiting:
                self.waiting.pop(0)()

    def named(self, name):
        return self.document.get_model_by_name(name)


def zoom(desk, x0, x1, y0=-0.5, y1=0.5):
    """Draw a box in the map that is seen."""
    maps = desk.page.maps
    name = desk.page.state.map
    maps._zoomed(name, RangesUpdate(maps._views()[name].figure, x0=x0, x1=x1, y0=y0, y1=y1))
    desk.settle()
