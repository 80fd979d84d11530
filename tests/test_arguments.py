"""Functions take at most a dozen arguments: more are a record.  What still takes more stands here, and the list only shrinks."""
import ast
import pathlib

import bifurc

MOST = 12
PUBLIC = {  # options by keyword, each documented
    "atlases/verb.py:atlas", "basins/cells/compute.py:cell_mapping", "basins/sweeps/attractor_sweep.py:sweep",
    "basins/sweeps/chart.py:parameter_chart", "basins/sweeps/diagram.py:bifurcation_diagram", "continuation/tracing.py:trace",
    "systems/dampers.py:micro_slip_ring", "systems/dampers.py:micro_slip_strip",
}
STEPS = {  # a C function takes addresses and sizes one by one
    "flow/laws/collocation.py:_step",
}


def test_no_other_function_takes_more_than_a_dozen_arguments():
    root, found = pathlib.Path(bifurc.__file__).parent, set()
    for path in sorted(root.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                names = [a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
                if len(names) - (names[:1] in (["self"], ["cls"])) > MOST:
                    found.add(f"{path.relative_to(root).as_posix()}:{node.name}")
    assert found == PUBLIC | STEPS
