"""Sphinx settings: pages in Markdown, the reference from the docstrings of everything public."""
import importlib
import inspect
import pathlib

import bifurc

project = "bifurc"
author = "the bifurc developers"
release = version = bifurc.__version__
extensions = ["myst_parser", "numpydoc", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
autodoc_typehints = "none"  # numpydoc sections tell types with shapes and units
numpydoc_show_class_members = False  # autodoc shows them
html_theme = "pydata_sphinx_theme"
html_title = "bifurc"
html_theme_options = {"show_toc_level": 2, "navigation_with_keys": False}

MODULES = {"bifurc": "Top level", "bifurc.systems": "Systems", "bifurc.elements": "Elements",
           "bifurc.continuation": "Continuation", "bifurc.plotting": "Pictures"}


def write_reference():
    """Write one page a module with its public classes and functions; a name is described where it is met first."""
    folder = pathlib.Path(__file__).parent / "reference"
    folder.mkdir(exist_ok=True)
    described = set()
    for module, title in MODULES.items():
        found, text = importlib.import_module(module), [title, "=" * len(title), ""]
        for name in found.__all__:
            item = getattr(found, name)
            if item in described or not (inspect.isclass(item) or inspect.isfunction(item)):
                continue
            described.add(item)
            text += [name, "-" * len(name), "", f".. currentmodule:: {module}", ""]
            text += [f".. autoclass:: {name}", "   :members:", ""] if inspect.isclass(item) else [f".. autofunction:: {name}", ""]
        (folder / f"{module}.rst").write_text("\n".join(text))


write_reference()


def setup(app):
    """Let the bars of absolute values in docstrings be bars."""
    def escape(app, what, name, obj, options, lines):
        lines[:] = [line.replace("|", r"\|") if "``" not in line else line for line in lines]

    app.connect("autodoc-process-docstring", escape)
