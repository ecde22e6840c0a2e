"""Draw Figs. 2 to 10 of the paper and its impact law, judge its claims: parameters to files.

Source of the parameters: captions of Han, Jin & Hu (2004). The ranges of the axes are ours.
"""

import contextlib
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path

from vibroimpact import Interrupted, ParameterError
from vibroimpact.plot import publication_style

from . import (
    claims,
    coexistence,
    contents,
    existence,
    islands,
    motions,
    restitution,
    sustained_contact,
    transitions,
)
from .claims import Claim
from .layout import Page
from .parameters import FIGURES, MOTIONS, TRANSITIONS
from .whole_file import whole_file

FORMATS = ("png", "pdf", "svg")
_PLAIN: tuple[transitions.Color, str] = (None, "")
_BY_REGIME: tuple[transitions.Color, str] = ("regime", "-regimes")
_ENLARGED = ("4", "7c", "8a")
_IMPACT_LAW, _COEXISTENCE, _ISLANDS = "impact law", "coexisting motions", "islands"
# What takes longest is begun first, so that no process waits for it in the end.
_BEGUN_FIRST = ("figure 7", _ISLANDS, "figure 8", _COEXISTENCE)


@dataclass(frozen=True)
class Reproduction:
    """The result of `reproduce`: the paths written, and the claims."""

    files: list[Path] = field(default_factory=list)
    claims: list[Claim] = field(default_factory=list)


def reproduce(
    out: str | os.PathLike[str],
    *,
    formats: Sequence[str] = ("png",),
    figures: Iterable[int] | None = None,
    frequencies: int = 4000,
    workers: int | None = None,
    processes: int = 1,
    progress: bool = True,
) -> Reproduction:
    """Draw the paper's simulated figures and write its claims with a verdict on each.

    Beside them index.md says what each file shows.

    Parameters
    ----------
    out : path
        Directory for the files; made if missing.
    formats : sequence of {"png", "pdf", "svg"}
        One file per page and format.
    figures : iterable of int, optional
        Which of Figs. 2 to 10; by default all, and the pages on the impact law and
        on coexisting motions besides. The claims
        are those of the chosen figures.
    frequencies : int
        Drive frequencies of each bifurcation diagram, at least 2; Figs. 2 and 3 take at most 561.
    workers : int, optional
        Threads for the diagrams; all cores by default, one in each of several processes.
    processes : int
        Figures that are made side by side, each in a process of its own. A script that asks for
        more than one needs ``if __name__ == "__main__"``, as `multiprocessing` does.
    progress : bool
        Report each step to the standard error stream.

    Returns
    -------
    Reproduction

    Raises
    ------
    ParameterError
        If a figure or format is unknown, `frequencies` is less than 2 or `processes` less than 1.
    Interrupted
        After Ctrl-C; ``.result`` is the Reproduction so far. The files with all claims are left as
        they were.
    OSError
        If a file cannot be written; one that was there before is as it was.
    """
    chosen = list(FIGURES) if figures is None else sorted(set(figures))
    if unknown := [figure for figure in chosen if figure not in FIGURES]:
        raise ParameterError(f"figures = {unknown}: allowed are {', '.join(map(str, FIGURES))}")
    if unknown_formats := [name for name in formats if name not in FORMATS]:
        raise ParameterError(f"formats = {unknown_formats}: allowed are {', '.join(FORMATS)}")
    if frequencies < 2:
        raise ParameterError(f"frequencies = {frequencies}: allowed is an integer >= 2")

    if processes < 1:
        raise ParameterError(f"processes = {processes}: allowed is an integer >= 1")

    job = _Job(Path(out), tuple(formats), frequencies, workers, progress)
    job.out.mkdir(parents=True, exist_ok=True)
    parts = [f"figure {figure}" for figure in chosen]
    if figures is None:
        parts += [_IMPACT_LAW, _COEXISTENCE, _ISLANDS]
    job.total = len(parts)
    beside = min(processes, len(parts))
    job.report(f"{len(parts)} parts, {beside} at a time; the time of each is told when it is done")
    try:
        if beside > 1:
            job.make_beside_each_other(parts, processes)
        else:
            for part in parts:
                job.count(part, job.make(part))
    except KeyboardInterrupt:  # Interrupted is a KeyboardInterrupt
        raise Interrupted(
            f"interrupted after {len(job.files)} files",
            Reproduction(job.files, job.claims),
            holds="them and their claims",
        ) from None
    for name, text in (
        ("claims.json", claims.to_json(job.claims)),
        ("claims.md", claims.to_markdown(job.claims)),
        (contents.NAME, contents.contents(job.files)),
    ):
        path = job.out / name
        with whole_file(path) as file:
            file.write(text.encode())
        job.files.append(path)
    return Reproduction(job.files, job.claims)


def _colors(regimes: set[int]) -> list[tuple[transitions.Color, str]]:
    """Return how a page is coloured: by regime, too, where its impacts have more than one."""
    return [_PLAIN, _BY_REGIME] if len(regimes) > 1 else [_PLAIN]


def _made(job: "_Job", part: str) -> tuple["_Job", float]:
    """Make a part in a process of its own; return what it has made, and the seconds it took."""
    seconds = job.make(part)
    return job, seconds


@contextlib.contextmanager
def _executor(processes: int) -> Iterator[ProcessPoolExecutor]:
    """Yield what runs so many processes, which end at once if an exception leaves."""
    before = set(multiprocessing.active_children())
    executor = ProcessPoolExecutor(
        processes,
        # Threads of this process would not survive a fork.
        multiprocessing.get_context("spawn"),
        # Ctrl-C in a terminal reaches all processes: this one ends the others.
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    )
    try:
        yield executor
    except BaseException:
        for child in set(multiprocessing.active_children()) - before:
            child.terminate()
        raise
    finally:
        # The executor's thread joins its processes. Joining them here as well would be a race:
        # whoever comes second returns while the other has not yet noted that the process is gone.
        executor.shutdown(cancel_futures=True)


class _Job:
    """One call of `reproduce`: its options, and what it has made so far."""

    def __init__(
        self,
        out: Path,
        formats: Sequence[str],
        frequencies: int,
        workers: int | None,
        progress: bool,
    ) -> None:
        self.out = out
        self.formats = formats
        self.frequencies = frequencies
        self.workers = workers
        self.progress = progress
        self.files: list[Path] = []
        self.claims: list[Claim] = []
        # Parts that are done, of all.
        self.done, self.total = 0, 0

    def report(self, text: str) -> None:
        if self.progress:
            print(text, file=sys.stderr, flush=True)

    def count(self, part: str, seconds: float) -> None:
        """Report a part that is done."""
        self.done += 1
        self.report(f"{part}: {seconds:.1f} s ({self.done} of {self.total})")

    def make(self, part: str) -> float:
        """Make the pages of a figure, or those that belong to none; return the seconds it took."""
        started = time.perf_counter()
        with publication_style():
            if part == _IMPACT_LAW:
                self.impact_pages()
            elif part == _COEXISTENCE:
                self.coexistence_pages()
            elif part == _ISLANDS:
                self.islands_page()
            else:
                self.figure_pages(next(f for f in FIGURES if part == f"figure {f}"))
        return time.perf_counter() - started

    def make_beside_each_other(self, parts: Sequence[str], processes: int) -> None:
        """Make each part in another process; files and claims are in the order of the parts."""
        alone = _Job(self.out, self.formats, self.frequencies, self.workers or 1, self.progress)
        order = sorted(parts, key=lambda part: [*_BEGUN_FIRST, part].index(part))
        made: dict[str, _Job] = {}
        try:
            with _executor(min(processes, len(parts))) as executor:
                futures = {executor.submit(_made, alone, part): part for part in order}
                for future in as_completed(futures):
                    part = futures[future]
                    made[part], seconds = future.result()
                    self.count(part, seconds)
        finally:
            for part in parts:
                if part in made:
                    self.files += made[part].files
                    self.claims += made[part].claims

    def figure_pages(self, figure: int) -> None:
        """Make the pages of a figure of the paper."""
        if figure in existence.PERIODS_PER_ORBIT:
            self.existence_page(figure)
        elif any(transition.figure == figure for transition in TRANSITIONS):
            self.transition_pages(figure)
        else:
            self.motion_pages(figure)

    def save(self, page: Page, name: str) -> None:
        self.files += page.save(self.out, name, self.formats)

    def existence_page(self, figure: int) -> None:
        """Solve for all period n-1 motions, judge the paper's verdicts, and write the page."""
        computed = existence.compute(figure, self.frequencies)
        judged = existence.judge(computed)
        self.claims += judged
        self.save(existence.draw(computed, judged), f"fig{figure}")

    def transition_pages(self, figure: int) -> None:
        """Compute the diagrams of a figure and write them, black and perhaps coloured by regime."""
        panels = [
            (transition, transitions.compute(transition, self.frequencies, self.workers))
            for transition in TRANSITIONS
            if transition.figure == figure
        ]
        regimes = transitions.regimes_of([diagram for _, diagram in panels])
        for color, suffix in _colors(regimes):
            self.save(transitions.draw(figure, panels, color), f"fig{figure}{suffix}")
        for transition, diagram in panels:
            if transition.id == "7c":
                observed = sustained_contact.observe(transition, workers=self.workers)
                self.claims.append(sustained_contact.evaluate(observed))
            if transition.id not in _ENLARGED:
                continue
            parts = transitions.enlarge(transition, diagram, self.frequencies, self.workers)
            if not parts:
                self.report(f"figure {figure}: no window of period m > 2 on this grid")
                continue
            regimes = transitions.regimes_of([part.diagram for part in parts])
            for color, suffix in _colors(regimes):
                page = transitions.draw_enlargements(transition, parts, color)
                self.save(page, f"fig{transition.id}-enlarged{suffix}")

    def motion_pages(self, figure: int) -> None:
        """Simulate the motions of a figure, judge them, and write the pages."""
        shown = [
            motions.simulated(motion, self.workers) for motion in MOTIONS if motion.figure == figure
        ]
        for item in shown:
            self.claims.append(
                claims.evaluate(
                    item.motion,
                    item.run,
                    coexistence=item.other,
                    long_run=item.long_run,
                )
            )
        for color, suffix in _colors(motions.regimes_of(shown)):
            page = (
                motions.draw_sporadic(shown[0], color)
                if figure == 10
                else motions.draw(figure, shown, color)
            )
            self.save(page, f"fig{figure}{suffix}")

    def impact_pages(self) -> None:
        """Map the impacts of the paper's system, judge its first conclusion, write the pages."""
        computed = restitution.compute()
        claim = restitution.judge(computed)
        self.claims.append(claim)
        self.save(restitution.draw(computed, claim), "impact-regimes")
        self.save(restitution.draw_agreement(restitution.agreement()), "impact-incremental")

    def coexistence_pages(self) -> None:
        """Follow the motions that coexist in Fig. 9(3) until they end, write the pages."""
        computed = coexistence.compute(max(self.frequencies // 4, 2), self.workers)
        self.save(coexistence.draw_branches(computed), "orbits-coexistence")
        self.save(coexistence.draw_multipliers(computed), "orbits-multipliers")
        self.save(coexistence.draw_portraits(computed), "orbits-portraits")

    def islands_page(self) -> None:
        """Find the islands of section 4.1 with their borders, and write the page."""
        # As coarse as the diagrams, at most as fine as its own grid.
        computed = islands.compute(
            frequencies=min(islands.FREQUENCIES, self.frequencies), workers=self.workers
        )
        self.save(islands.draw(computed), "islands")
