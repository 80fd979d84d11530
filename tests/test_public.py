"""The public face: lazy, complete, cheap to import, and every name where the table says it is."""
import importlib
import importlib.metadata
import json
import pkgutil
import subprocess
import sys

import pytest

import bifurc as bf
from tests.reference import public_defaults

HEAVY = ("numba", "scipy", "matplotlib", "networkx", "pandas", "tqdm", "llvmlite")


def run(code: str) -> str:
    """Run Python code in a fresh interpreter."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("name", bf.__all__)
def test_every_name_resolves(name):
    value = getattr(bf, name)
    assert value is getattr(bf, name)
    if hasattr(value, "__name__") and name not in bf._MODULES:
        assert value.__name__ == name
        assert value.__module__.startswith("bifurc.")
        assert value.__doc__


def test_dir_lists_every_name_and_unknown_names_are_answered():
    assert set(bf.__all__) <= set(dir(bf))
    with pytest.raises(AttributeError, match="'simulat'.*simulate"):
        bf.simulat  # noqa: B018


def test_no_public_function_bears_the_name_of_a_subpackage():
    packages = {module.name for module in pkgutil.iter_modules(bf.__path__)}
    assert not packages & set(bf._NAMES)


def test_version_is_the_installed_one():
    assert bf.__version__ == importlib.metadata.version("bifurc")


def test_import_and_building_a_system_load_nothing_heavy():
    code = f"""
import json, sys
import bifurc as bf
first = [m for m in {HEAVY!r} if m in sys.modules]
system = bf.systems.impact_oscillator().with_parameters(omega=0.7)
print(json.dumps([first, [m for m in {HEAVY!r} if m in sys.modules], "numpy" in sys.modules]))
"""
    assert json.loads(run(code)) == [[], [], True]


def test_import_loads_little_over_numpy():
    """What an import costs is what it loads: some thirty modules of the package, and nothing foreign."""
    code = """
import json, sys
import numpy
before = set(sys.modules)
import bifurc
bifurc.System, bifurc.elements, bifurc.systems
print(json.dumps(sorted(set(sys.modules) - before)))
"""
    loaded = json.loads(run(code))
    own = [name for name in loaded if name.partition(".")[0] == "bifurc"]
    assert len(own) <= 32
    assert {name.partition(".")[0] for name in loaded} - {"bifurc"} <= sys.stdlib_module_names


def test_modules_named_by_load_exist():
    from bifurc import loading

    for module, name in loading._READERS.values():
        assert hasattr(getattr(importlib.import_module(module, "bifurc"), name), "from_record")


def test_a_lazy_name_is_found_once():
    bf.__dict__.pop("Grid", None)
    bf.Grid  # noqa: B018
    assert "Grid" in vars(bf)  # from now on it is an attribute like any other


def test_defaults_of_public_names_change_only_with_their_table():
    public_defaults.compare()
