"""The two halves of the first compilation run, and a filled cache is left alone."""
import io
import pathlib
import subprocess

import bifurc
from bifurc import first_kernels, warm
from bifurc._cache import source_hash


def test_both_halves_run_in_this_process():
    first_kernels.scenes()
    first_kernels.motions()
    first_kernels.orbits()


def test_the_helper_waits_for_the_kernels_that_both_need(monkeypatch, tmp_path):
    done = []

    class Helper:
        def __init__(self, command, **options):
            done.append("helper")
            self.stdin = io.StringIO()

        def wait(self, seconds):
            done.append("wait" if self.stdin.closed else "never told")
            return 0

        def poll(self):
            return 0

    monkeypatch.setattr(warm, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(warm.subprocess, "Popen", Helper)
    for name in ("scenes", "motions", "orbits"):
        monkeypatch.setattr(first_kernels, name, lambda name=name: done.append(name))
    assert warm.warm_up(lambda text: None) is True
    assert done == ["helper", "scenes", "orbits", "wait"]
    assert warm.warm_up(lambda text: None) is False  # it has said that all is there


def test_a_filled_cache_is_left_alone(monkeypatch, tmp_path):
    (tmp_path / warm.DONE.format(source_hash())).touch()
    monkeypatch.setattr(warm, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(warm.subprocess, "Popen", None)
    assert warm.warm_up() is False


def test_a_failing_helper_costs_nothing_but_time(monkeypatch, tmp_path):
    monkeypatch.setattr(warm, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(warm.sys, "executable", "false")
    said = []
    assert warm.warm_up(said.append) is True
    assert not list(tmp_path.iterdir()) and "compiling" in said[0]


def test_the_helper_compiles_the_package_that_asks_for_it(monkeypatch, tmp_path):
    """In a clone of the sources the folder of the command holds another package of the same name."""
    other = tmp_path / "bifurc"
    other.mkdir()
    (other / "__init__.py").write_text("raise RuntimeError('the package of the folder')")
    started = []

    class Ended:
        def __init__(self, command, **options):
            started.append((command, options))
            self.stdin = io.StringIO()

        def wait(self, seconds):
            return 1

        def poll(self):
            return 1

    monkeypatch.setattr(warm, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(warm.subprocess, "Popen", Ended)
    assert warm.warm_up(lambda text: None) is True
    monkeypatch.undo()
    [(command, options)] = started
    told = subprocess.run([*command[:-1], "import bifurc; print(bifurc.__file__)"], cwd=tmp_path, env=options["env"],
                          capture_output=True, text=True, check=True)
    assert pathlib.Path(told.stdout.strip()) == pathlib.Path(bifurc.__file__)
