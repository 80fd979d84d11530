"""The structure of the package: imports without circles but the ones that are named, every kernel module in the cache's list, a few
lines at the head of every folder."""
import ast
import pathlib

import bifurc
from bifurc import _cache

PACKAGE = pathlib.Path(bifurc.__file__).parent
# a result that computes itself anew, a branch that is extended: lazy links; no further one joins
CIRCLES = {
    frozenset({"bifurc.basins.maps.basin_map", "bifurc.basins.maps.compute"}),
    frozenset({"bifurc.continuation.branch", "bifurc.continuation.tracing"}),
    frozenset({"bifurc.continuation.equilibria", "bifurc.continuation.shooting.autonomous",
               "bifurc.continuation.shooting.branching", "bifurc.continuation.shooting.problem"}),
    frozenset({"bifurc.orbits.autonomous", "bifurc.orbits.find"}),
}


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


def test_imports_have_no_circle_but_the_named_lazy_links():
    import networkx

    known = modules()
    graph = networkx.DiGraph([(name, other) for name, path in known.items() for other in imported(name, path, known)
                              if other in known and other not in (name, "bifurc") and not name.startswith(f"{other}.")])
    circles = {frozenset(part) for part in networkx.strongly_connected_components(graph) if len(part) > 1}
    new = [sorted(circle) for circle in circles if not any(circle <= known for known in CIRCLES)]
    assert not new


def test_every_module_with_kernels_is_in_the_list_of_the_cache():
    """A kernel whose folder is not listed would be replayed in its old form after an edit of what it calls."""
    for name, path in modules().items():
        tree = ast.parse(path.read_text())
        decorated = {ast.unparse(item.func if isinstance(item, ast.Call) else item) for node in ast.walk(tree)
                     if isinstance(node, ast.FunctionDef) for item in node.decorator_list}
        if decorated & {"njit", "both", "leaf"} and name != "bifurc._jit":
            assert _cache._path(name) is not None, f"{name} has kernels; add its folder to bifurc._cache.KERNELS"


def test_every_folder_says_what_is_in_it():
    for path in PACKAGE.rglob("__init__.py"):
        said = ast.get_docstring(ast.parse(path.read_text()))
        assert said and len(said) > 20, f"{path}: says nothing"
