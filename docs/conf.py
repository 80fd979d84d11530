"""Sphinx settings: pages in Markdown, the reference from the docstrings of everything public."""
import collections.abc
import importlib
import inspect
import os
import pathlib
import sys

import bifurc
from bifurc.orbits.base import Orbit

sys.path.insert(0, str(pathlib.Path(__file__).parent))  # for gallery_style

project = "bifurc"
author = "the bifurc developers"
release = version = bifurc.__version__
sys.path.insert(0, str(pathlib.Path(__file__).parent / "extension"))
extensions = ["drawn", "myst_parser", "numpydoc", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "sphinx_gallery.gen_gallery"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build", "gallery", "pictures"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
autodoc_typehints = "none"  # numpydoc sections tell types with shapes and units
numpydoc_show_class_members = False  # autodoc shows them
html_theme = "pydata_sphinx_theme"
html_title = "bifurc"
html_sidebars = dict.fromkeys(("start", "validation", "answers", "comparison", "changelog"), [])  # single pages
html_theme_options = {"show_toc_level": 2, "navigation_with_keys": False, "header_links_before_dropdown": 7}

sphinx_gallery_conf = {
    "examples_dirs": "gallery", "gallery_dirs": "auto_gallery", "filename_pattern": r"/plot_", "download_all_examples": False,
    "abort_on_example_error": True, "show_signature": False, "matplotlib_animations": False,
    "reset_modules": ("matplotlib", "gallery_style.house_style"), "parallel": min(os.cpu_count() or 1, 4),
}

MODULES = {
    "bifurc": ("Top level", "What ``import bifurc as bf`` gives: ``bf.name``."),
    "bifurc.systems": ("Systems", "Ready systems of the literature; their keywords are their parameters."),
    "bifurc.elements": ("Elements", "What acts on a system, and what elements of one's own are made of."),
    "bifurc.continuation": ("Continuation", "Branches, special points, curves, and problems of one's own."),
    "bifurc.continuation.grazing": ("Grazing", "What happens at a touch."),
    "bifurc.continuation.maps": ("Maps", "Piecewise-smooth maps as systems."),
    "bifurc.orbits": ("Orbits", "Periodic orbits and their kinds of failure."),
    "bifurc.basins": ("Basins", "Basin maps, cell maps, boundaries, sweeps."),
    "bifurc.atlases": ("Atlases", "The whole diagram."),
    "bifurc.backbones": ("Backbones", "Frequency and damping of nonlinear modes over amplitude."),
    "bifurc.control": ("Control of chaos", "Delayed feedback and small changes of a parameter."),
    "bifurc.certify": ("Certificates", "Proofs in ball arithmetic."),
    "bifurc.piecewise": ("Systems of first order", "Fields, surfaces, resets; states of rest."),
    "bifurc.plotting": ("Pictures", "What ``plot`` of the results calls."),
    "bifurc.explore": ("Explorer", "A system in the browser."),
}
# what results hold, and is not imported by name
PARTS = {
    "bifurc.flow.trajectory": ("Event", "Events"), "bifurc.flow.status": ("Status",),
    "bifurc.flow.hysteresis": ("Hysteresis", "Loop", "LoopEvent"), "bifurc.orbits.lyapunov": ("LyapunovExponents",),
    "bifurc.orbits.equilibria.equilibrium": ("EquilibriumStatus",), "bifurc.hbm.status": ("BalanceStatus",),
    "bifurc.continuation.branches.audit": ("Audit",), "bifurc.continuation.resimulation": ("Resimulated",),
    "bifurc.basins.maps.reliability": ("Reliability", "ReliabilityKind"), "bifurc.basins.maps.entropy": ("BasinEntropy",),
    "bifurc.basins.maps.uncertainty_exponent": ("Uncertainty",), "bifurc.structure.reduction": ("Reduction",),
}


def entry(module, name, item):
    """Return the lines that describe a public name."""
    lines = [name, "-" * len(name), "", f".. currentmodule:: {module}", ""]
    if inspect.isclass(item):
        inherited = ["   :inherited-members: Notebook"] if issubclass(item, Orbit) else []
        return [*lines, f".. autoclass:: {name}", "   :members:", *inherited, ""]
    if inspect.isfunction(item):
        return [*lines, f".. autofunction:: {name}", ""]
    if inspect.ismodule(item):
        return [*lines, f".. automodule:: {item.__name__}", "   :members:", "   :no-index:", ""]
    return [*lines, f".. data:: {name}", "", f"   ``{item!r}``", ""]


def write_reference():
    """Write one page a module with all its public names; a name is described where it is met first, and named elsewhere."""
    folder = pathlib.Path(__file__).parent / "reference"
    folder.mkdir(exist_ok=True)
    described = {}
    for module, (title, words) in MODULES.items():
        found, text = importlib.import_module(module), [title, "=" * len(title), "", words, ""]
        extra = ("builder",) if module == "bifurc.systems" else ()
        for name in (*found.__all__, *extra):
            item = getattr(found, name)
            if inspect.ismodule(item) and item.__name__ in MODULES:
                continue
            if isinstance(item, collections.abc.Hashable) and item in described:
                text += [name, "-" * len(name), "", f"See :py:obj:`{described[item]}.{name}`.", ""]
                continue
            if isinstance(item, collections.abc.Hashable):
                described[item] = module
            text += entry(module, name, item)
        (folder / f"{module}.rst").write_text("\n".join(text))
    text = ["Parts of results", "================", "", "What results hold; made by the package.", ""]
    for module, names in PARTS.items():
        for name in names:
            text += entry(module, name, getattr(importlib.import_module(module), name))
    (folder / "parts.rst").write_text("\n".join(text))
    pages = "\n".join(f"   {page}" for page in (*MODULES, "parts"))
    (folder / "index.rst").write_text("Reference\n=========\n\nEvery public name, with shapes, units, errors and sources.\n\n"
                                      f".. toctree::\n   :maxdepth: 1\n\n{pages}\n")


write_reference()


def setup(app):
    """Let the bars of absolute values in docstrings be bars."""
    def escape(app, what, name, obj, options, lines):
        lines[:] = [line.replace("|", r"\|") if "``" not in line else line for line in lines]

    app.connect("autodoc-process-docstring", escape)
