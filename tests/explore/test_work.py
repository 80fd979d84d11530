"""Lanes: the newest request wins, what waits is dropped, what runs is told."""
import threading

import pytest

from bifurc.explore.work import Newest, Superseded, Ticket, Worker


@pytest.fixture
def worker():
    worker = Worker("test")
    yield worker
    worker.close()


def test_the_newest_request_wins(worker):
    started, go, finished = threading.Event(), threading.Event(), threading.Event()
    tickets, results = [], []

    def first(ticket):
        tickets.append(ticket)
        started.set()
        assert go.wait(10)
        return "first"

    worker.ask(first, results.append)
    assert started.wait(10)
    worker.ask(lambda ticket: "dropped while waiting", results.append)
    worker.ask(lambda ticket: "last", lambda result: (results.append(result), finished.set()))
    assert not tickets[0].valid
    go.set()
    assert finished.wait(10)
    assert results == ["last"]


def test_errors_are_results_and_the_thread_lives_on(worker):
    results, done = [], threading.Event()

    def fails(ticket):
        raise ValueError("no such thing")

    worker.ask(fails, lambda result: (results.append(result), done.set()))
    assert done.wait(10)
    assert isinstance(results[0], ValueError)
    done.clear()
    worker.ask(lambda ticket: 2, lambda result: (results.append(result), done.set()))
    assert done.wait(10) and results[1] == 2


def test_dropped_requests_say_nothing(worker):
    started, go, results = threading.Event(), threading.Event(), []

    def runs(ticket):
        started.set()
        assert go.wait(10)

    worker.ask(runs, results.append)
    assert started.wait(10)
    worker.drop()
    go.set()
    done = threading.Event()
    worker.ask(lambda ticket: None, lambda result: done.set())
    assert done.wait(10) and results == []


def test_threads_of_an_old_request_refuse_work():
    ticket = Ticket()
    with Newest(ticket, 2) as pool:
        assert pool.submit(pow, 2, 3).result() == 8
        ticket.valid = False
        with pytest.raises(Superseded):
            pool.submit(pow, 2, 3).result()
