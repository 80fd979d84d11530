"""The structure of the package: imports without circles, few of them inside functions, every kernel module in the list of
the cache, a few lines at the head of every folder."""
import ast
import os
import pathlib
import subprocess
import sys

import networkx

import bifurc
from bifurc import _cache

PACKAGE = pathlib.Path(bifurc.__file__).parent
LONG = 350  # lines of a file that needs no reason
MANY = 16  # files in a folder: what can be looked over at once


def modules():
    """Return {full name: path} of all modules."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = ("bifurc", *path.relative_to(PACKAGE).with_suffix("").parts)
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported(name, path, known):
    """Return the modules of the package that a module imports, inside functions too, for types alone not."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    tree = ast.parse(path.read_text())
    typed = {id(node) for test in ast.walk(tree) if isinstance(test, ast.If) and "TYPE_CHECKING" in ast.unparse(test.test)
             for node in ast.walk(test)}
    for node in ast.walk(tree):
        if id(node) in typed or not isinstance(node, ast.ImportFrom | ast.Import):
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
            continue
        parts = package.split(".")
        base = ".".join([*parts[:len(parts) - node.level + 1], *filter(None, [node.module])]) if node.level else node.module
        for alias in node.names:
            yield f"{base}.{alias.name}" if f"{base}.{alias.name}" in known else base


def test_imports_have_no_circle():

    known = modules()
    graph = networkx.DiGraph([(name, other) for name, path in known.items() for other in imported(name, path, known)
                              if other in known and other not in (name, "bifurc") and not name.startswith(f"{other}.")])
    circles = [sorted(part) for part in networkx.strongly_connected_components(graph) if len(part) > 1]
    assert not circles


def test_imports_inside_functions_are_few_and_say_why():
    """Heavy and optional packages, and modules of the package that a scene may not call for: the line says why."""
    inside, silent = 0, []
    for name, path in modules().items():
        source = path.read_text()
        lines = source.split("\n")
        found = {node.lineno for function in ast.walk(ast.parse(source)) if isinstance(function, ast.FunctionDef)
                 for node in ast.walk(function) if isinstance(node, ast.ImportFrom | ast.Import)}
        inside += len(found)
        silent += [f"{name}:{line}" for line in sorted(found) if "#" not in lines[line - 1]]
    assert inside <= 40 and not silent


def test_every_module_with_kernels_is_in_the_list_of_the_cache():
    """A kernel whose folder is not listed would be replayed in its old form after an edit of what it calls."""
    for name, path in modules().items():
        tree = ast.parse(path.read_text())
        decorated = {ast.unparse(item.func if isinstance(item, ast.Call) else item) for node in ast.walk(tree)
                     if isinstance(node, ast.FunctionDef) for item in node.decorator_list}
        if decorated & {"njit", "both", "inlined", "leaf", "separate", "separate_leaf"} and name != "bifurc._jit":
            assert _cache._path(name) is not None, f"{name} has kernels; add its folder to bifurc._cache.KERNELS"


def test_every_folder_says_what_is_in_it():
    for path in PACKAGE.rglob("__init__.py"):
        said = ast.get_docstring(ast.parse(path.read_text()))
        assert said and len(said) > 20, f"{path}: says nothing"


def test_folders_can_be_looked_over():
    """A folder with more files has groups in it: they are folders, with a name of the field."""
    full = {str(folder.relative_to(PACKAGE)): count for folder in {path.parent for path in PACKAGE.rglob("*.py")}
            if (count := len(list(folder.glob("*.py")))) > MANY}
    assert not full


def test_long_files_say_why_they_are_one():
    """More than 350 lines need a reason in the file's own docstring; a reason that is no longer needed goes."""
    for path in sorted(PACKAGE.rglob("*.py")):
        lines = path.read_text(encoding="utf-8").count("\n")
        doc = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        reason = "One file, because" in doc
        assert reason or lines <= LONG, f"{path} has {lines} lines: split it where it has a seam, or say why it is one file"
        assert not reason or lines > LONG - 30, f"{path} has {lines} lines and needs no reason to be one file"


def test_the_command_line_sets_one_thread_before_numpy_is_loaded():
    """Who has set a number keeps it."""
    code = "import os, sys, bifurc.cli.one_thread; print(os.environ['OPENBLAS_NUM_THREADS'])"
    free = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    for given, expected in ((free, "1"), ({**free, "OPENBLAS_NUM_THREADS": "3"}, "3")):
        done = subprocess.run([sys.executable, "-c", code], env=given, capture_output=True, text=True, check=True)
        assert done.stdout.strip() == expected
