"""The two halves of the first compilation run, and a filled cache is left alone."""
from bifurc import first_kernels, warm
from bifurc._cache import source_hash


def test_both_halves_run_in_this_process():
    first_kernels.motions()
    first_kernels.orbits()


def test_a_filled_cache_is_left_alone(monkeypatch, tmp_path):
    (tmp_path / warm.DONE.format(source_hash())).touch()
    monkeypatch.setattr(warm, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(warm.subprocess, "Popen", None)
    assert warm.warm_up() is False


def test_a_failing_half_costs_nothing_but_time(monkeypatch, tmp_path):
    monkeypatch.setattr(warm, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(warm.sys, "executable", "false")
    said = []
    assert warm.warm_up(said.append) is True
    assert not list(tmp_path.iterdir()) and "compiling" in said[0]
