"""Docstrings of the public face: their examples run, their sections are whole."""
import doctest
import inspect

import pytest

import bifurc as bf

PARTS = ("elements", "systems")
NAMES = sorted([f"bifurc.{name}" for name in bf._NAMES] + [f"bifurc.{part}.{name}" for part in PARTS
                                                           for name in getattr(bf, part).__all__])
# of numpydoc: a docstring, every parameter by its name with a type well said, what is returned (a builder returns its system)
RULES = {"GL08", "PR01", "PR02", "PR05", "PR06", "PR10", "RT01", "RT02"}


def named(name):
    """Return a public object."""
    _, *path = name.split(".")
    found = bf
    for part in path:
        found = getattr(found, part)
    return found


@pytest.mark.parametrize("name", [name for name in NAMES if ">>>" in (inspect.getdoc(named(name)) or "")])
def test_example_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    for test in doctest.DocTestFinder(recurse=False).find(named(name), name):
        runner.run(test)
    assert runner.tries and not runner.failures


@pytest.mark.parametrize("name", [name for name in NAMES if name.count(".") == 1 and callable(named(name))])
def test_public_name_has_an_example(name):
    if not (inspect.isclass(named(name)) and issubclass(named(name), Warning)):
        assert ">>>" in (inspect.getdoc(named(name)) or "")


@pytest.mark.slow
def test_sections_of_functions_are_whole():
    """The rules of numpydoc that are chosen hold for every public function."""
    validate = pytest.importorskip("numpydoc.validate").validate
    broken = {}
    for name in filter(lambda name: inspect.isfunction(named(name)), NAMES):
        rules = RULES - {"RT01"} if ".systems." in name else RULES
        broken[name] = [text for code, text in validate(name)["errors"] if code in rules]
    assert not {name: texts for name, texts in broken.items() if texts}
