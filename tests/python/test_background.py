# SPDX-License-Identifier: MIT
"""Work on another thread: in order, with its errors, and nothing left running."""

import threading
import time

import pytest

from sdftrack._internal.background import Background, read_ahead


def threads():
    return {t.name for t in threading.enumerate()}


def test_items_are_worked_on_in_order_and_close_waits_for_all():
    done = []
    work = Background(lambda n: (time.sleep(0.001), done.append(n)), 2, "test work")
    assert all(work.put(n) for n in range(30))
    work.close()
    work.close()
    assert done == list(range(30))
    assert "test work" not in threads()


def test_an_item_is_dropped_instead_of_waited_for():
    go, done = threading.Event(), []
    work = Background(lambda n: (go.wait(), done.append(n)), 1, "test work")
    taken = [work.put(n, wait=False) for n in range(50)]
    go.set()
    work.close()
    assert len(done) == sum(taken) <= 3


def test_an_error_is_raised_once_in_the_loop_and_nobody_waits_for_ever():
    def work_on(n):
        if n == 1:
            raise RuntimeError("item 1")

    work = Background(work_on, 1, "test work")

    def loop():
        for n in range(100):
            work.put(n)
            time.sleep(0.001)

    with pytest.raises(RuntimeError, match="item 1"):
        loop()
    for n in range(10):
        work.put(n)
    work.close()


def test_reading_ahead_returns_the_same_and_holds_few():
    given = []

    def items():
        for n in range(20):
            given.append(n)
            yield n

    for n in read_ahead(items(), waiting=3):
        time.sleep(0.002)
        assert len(given) <= n + 1 + 3 + 2  # those that wait, and one in each hand
    assert given == list(range(20))
    assert list(read_ahead([])) == []


def test_a_loop_that_ends_early_stops_the_reading():
    read = read_ahead(iter(int, 1), waiting=2)  # without end
    assert next(read) == 0
    read.close()
    assert "read ahead" not in threads()


def test_an_error_of_reading_comes_in_its_place():
    def items():
        yield 1
        raise ValueError("second")

    read = read_ahead(items())
    assert next(read) == 1
    with pytest.raises(ValueError, match="second"):
        next(read)
    assert "read ahead" not in threads()
