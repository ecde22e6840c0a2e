"""The work beside a page of the explorer: what is overtaken is replaced or cancelled."""

import queue
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import vibroimpact as vi
from han_jin_hu_2004.parameters import INITIAL
from systems import ROUGH
from vibroimpact.explorer.jobs import Lane, Work
from vibroimpact.explorer.pace import Pace
from vibroimpact.interruption import Cancellation, heeding


def test_a_cancelled_call_on_a_thread_is_interrupted():
    cancellation = Cancellation()
    cancellation.cancel()

    def call(**more):
        with heeding(cancellation):
            return vi.simulate(ROUGH, initial=INITIAL, periods=10**9, keep=1, **more)

    with ThreadPoolExecutor(1) as pool:
        with pytest.raises(vi.Interrupted) as caught:
            pool.submit(call).result()
        assert isinstance(caught.value.result, vi.Run)
        # The thread heeds it inside the block alone.
        assert pool.submit(vi.simulate, ROUGH, initial=INITIAL, periods=3).result()
    with pytest.raises(vi.Interrupted), heeding(cancellation):
        vi.basins(ROUGH, x1=np.linspace(0, 0.1, 9), v1=np.linspace(0, 0.1, 9))


def test_running_work_is_cancelled_from_another_thread():
    shown, lane = [], Lane(lambda finish: finish(), grace=0.0)
    begun, ended = threading.Event(), threading.Event()

    def forever():
        begun.set()
        return vi.simulate(ROUGH, initial=INITIAL, periods=10**9, keep=1, max_events=10**15)

    lane.submit(Work(forever, shown.append, shown.append))
    begun.wait()

    def show(result):
        shown.append(result)
        ended.set()

    lane.submit(Work(lambda: "newer", show, shown.append))
    ended.wait()
    assert shown == ["newer"]


def test_work_that_waits_is_replaced_and_errors_are_handed_on():
    posted, lane = [], Lane(lambda finish: posted.append(finish), grace=0.0)
    begun, gate, shown = threading.Event(), threading.Event(), []

    def hold():
        begun.set()
        gate.wait()

    lane.submit(Work(hold, shown.append, shown.append))
    begun.wait()
    lane.submit(Work(lambda: "never", shown.append, shown.append))

    def fail():
        raise ValueError("refused")

    lane.submit(Work(fail, shown.append, shown.append))
    gate.set()
    while lane.busy:
        pass
    for finish in posted:
        finish()
    (error,) = shown
    assert isinstance(error, ValueError)


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, vi.Interrupted])
def test_a_lane_goes_on_after_an_interruption(interruption):
    shown, ended = [], threading.Event()
    lane = Lane(lambda finish: finish(), grace=0.0)

    def interrupted():
        raise interruption("interrupted while a motion was followed")

    def show(result):
        shown.append(result)
        ended.set()

    lane.submit(Work(interrupted, shown.append, shown.append))
    while lane.busy:
        pass
    lane.submit(Work(lambda: "newer", show, shown.append))
    ended.wait()
    assert shown == ["newer"]


def test_a_picture_is_drawn_when_its_own_number_comes_back():
    pace = Pace()
    number = pace.begin()
    # Another number frees nothing; the browser may send anything.
    for other in (number + 1, number - 1, str(number), None):
        pace.drawn(other)
        assert not pace.wait()
    pace.drawn(number)
    assert pace.wait()
    pace.begin()
    pace.drawn(number)
    assert not pace.wait()
    pace.skip()
    assert pace.wait()


def test_the_next_picture_is_begun_when_the_last_has_been_drawn():
    numbers, begun, shown = queue.SimpleQueue(), [], []
    pace = Pace(numbers.put, patience=300.0)
    lane = Lane(lambda finish: finish(), pace=pace)

    def submit(value):
        lane.submit(Work(lambda: begun.append(value) or value, shown.append, shown.append))

    submit(0)
    number = numbers.get()
    for value in range(1, 40):
        submit(value)
    assert begun == [0]
    pace.drawn(number)
    pace.drawn(numbers.get())
    assert begun == shown == [0, 39]


@pytest.mark.parametrize("fault", ["show", "refuse", "ask"])
def test_a_fault_on_the_page_does_not_hold_back_the_next_picture(fault):
    posted, shown, asked = queue.SimpleQueue(), [], []

    def fail(*_):
        raise RuntimeError(fault)

    def ask(number):
        asked.append(number)
        if fault == "ask" and len(asked) == 1:
            fail()

    lane = Lane(posted.put, pace=Pace(ask, patience=300.0))
    show = fail if fault == "show" else shown.append
    lane.submit(Work(fail if fault == "refuse" else lambda: 0, show, fail))
    with pytest.raises(RuntimeError, match=fault):
        posted.get()()
    # The lane is free, with nothing drawn.
    assert lane._pace.wait()
    lane.submit(Work(lambda: 1, shown.append, shown.append))
    posted.get()()
    assert shown[-1] == 1
    lane.cancel()


def test_a_lost_acknowledgement_does_not_stop_a_lane():
    numbers, shown = queue.SimpleQueue(), []
    lane = Lane(lambda finish: finish(), pace=Pace(numbers.put, patience=0.01))
    for value in range(3):
        lane.submit(Work(lambda value=value: value, shown.append, shown.append))
        numbers.get()
    assert shown == [0, 1, 2]
