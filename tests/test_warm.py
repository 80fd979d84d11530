"""The two halves of the first compilation run, and a filled cache is left alone."""
import pathlib
import subprocess

import bifurc
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


def test_the_halves_compile_the_package_that_asks_for_them(monkeypatch, tmp_path):
    """In a clone of the sources the folder of the command holds another package of the same name."""
    other = tmp_path / "bifurc"
    other.mkdir()
    (other / "__init__.py").write_text("raise RuntimeError('the package of the folder')")
    started = []

    class Ended:
        def __init__(self, command, **options):
            started.append((command, options))

        def wait(self, seconds):
            return 1

        def poll(self):
            return 1

    monkeypatch.setattr(warm, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(warm.subprocess, "Popen", Ended)
    assert warm.warm_up(lambda text: None) is True
    monkeypatch.undo()
    assert len(started) == 2
    for command, options in started:
        told = subprocess.run([*command[:-1], "import bifurc; print(bifurc.__file__)"], cwd=tmp_path, env=options["env"],
                              capture_output=True, text=True, check=True)
        assert pathlib.Path(told.stdout.strip()) == pathlib.Path(bifurc.__file__)
