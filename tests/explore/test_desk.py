"""The desk: what a page asks for is computed beside it, coarse before fine, and every page is told."""
import threading
import time

import pytest

import bifurc as bf
from bifurc.explore import model
from bifurc.explore.desk import Desk

WINDOW = {"q0": (-3.0, 1.0), "v0": (-4.0, 4.0)}


@pytest.fixture
def desk(tmp_path):
    first = model.of_system(bf.systems.impact_oscillator(omega=1.4), bounds=(1.3, 1.5), window=WINDOW)
    desk = Desk(first, tmp_path, workers=2, fine=24, coarse=12)
    yield desk
    desk.close()


def until(condition, seconds=60.0):
    """Wait for something that other threads do."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.005)


def test_the_first_page_begins_the_work_and_maps_are_coarse_then_fine(desk):
    seen, told = [], threading.Event()

    def page():
        told.set()
        if desk.now.basins is not None:
            seen.append(desk.now.basins.value.labels.shape[0])

    desk.attach(page)
    until(lambda: len(desk.now.branches) == 1 and not desk.busy)
    assert told.is_set() and desk.now.orbit.value.success
    desk.map()
    until(lambda: desk.now.basins is not None and desk.now.basins.value.labels.shape == (24, 24) and not desk.busy)
    assert list(dict.fromkeys(seen)) == [12, 24]
    fine = desk.now.basins.value
    desk.zoom({"q0": (-1.0, 0.0), "v0": (0.0, 1.0)})
    until(lambda: desk.now.window == {"q0": (-1.0, 0.0), "v0": (0.0, 1.0)} and not desk.busy)
    desk.zoom({"q0": (-1.0, 0.0), "v0": (0.0, 1.0)})  # the same again: nothing to do
    assert not desk.busy
    desk.back()
    assert desk.now.basins.value is fine
    desk.change("omega", 1.45, done=True)  # the map follows
    until(lambda: desk.now.basins.value.system.omega == 1.45 and desk.now.basins.value.labels.shape == (24, 24) and not desk.busy)
    desk.reset()
    assert desk.now.basins is None and desk.now.branches
    desk.save()
    until(lambda: "saved explored.py" in desk.now.message)
    desk.detach(page)


def test_a_revisited_slice_is_read_from_its_file(desk, monkeypatch):
    desk.session.put(model.begin(desk.now))
    desk.map()
    until(lambda: desk.now.basins is not None and desk.now.basins.value.labels.shape == (24, 24) and not desk.busy)
    desk.zoom({"q0": (-1.0, 0.0), "v0": (0.0, 1.0)})
    until(lambda: desk.now.window["q0"] == (-1.0, 0.0) and desk.now.basins.value.labels.shape == (24, 24) and not desk.busy)
    first = desk.now.basins.value
    desk.zoom(WINDOW)
    until(lambda: desk.now.window == WINDOW and not desk.busy)

    def refuse(*arguments, **keywords):
        raise AssertionError("computed again")

    monkeypatch.setattr("bifurc.basins.maps.compute.label_starts", refuse)
    desk.zoom({"q0": (-1.0, 0.0), "v0": (0.0, 1.0)})
    until(lambda: desk.now.window["q0"] == (-1.0, 0.0) and not desk.busy)
    assert (desk.now.basins.value.labels == first.labels).all()
