"""Sphinx extension: a page in Markdown shows the pictures that its own Python draws when the documents are built.

A comment ``<!-- picture: caption -->`` below a block of Python stands for the figures that the block leaves open. A page with
such a comment is run once, block after block, as a test runs it (``tests/test_docs.py``).
"""
import os
import pathlib
import re
import tempfile

PART = re.compile(r"```python\n(?P<code>.*?)```\n|<!-- picture: (?P<caption>.*?) -->\n?", re.DOTALL)
FOLDER = "drawn"  # beside the pages, made by the build


def draw(app, docname, source):
    """Replace the comments of a page by the figures that the Python above them draws."""
    if "<!-- picture: " not in source[0] or pathlib.Path(app.env.doc2path(docname)).suffix != ".md":
        return
    import linecache

    from matplotlib import pyplot

    folder = pathlib.Path(app.srcdir) / FOLDER
    folder.mkdir(exist_ok=True)
    names, count, here = {"__name__": "__main__"}, 0, os.getcwd()

    def shown(part):
        nonlocal count
        if part["code"] is not None:
            name = f"<{docname}, {part.start()}>"
            linecache.cache[name] = len(part["code"]), None, part["code"].splitlines(keepends=True), name
            pyplot.close("all")
            exec(compile(part["code"], name, "exec"), names)
            return part[0]
        if not pyplot.get_fignums():
            raise RuntimeError(f"{docname}: the Python above the picture '{part['caption']}' draws nothing")
        text = ""
        for number in pyplot.get_fignums():
            count += 1
            file = f"{docname.replace('/', '-')}-{count}.png"
            pyplot.figure(number).savefig(folder / file, dpi=110, bbox_inches="tight")
            text += f"```{{figure}} /{FOLDER}/{file}\n:alt: {part['caption']}\n\n{part['caption']}\n```\n"
        return text

    with tempfile.TemporaryDirectory() as scratch:
        os.chdir(scratch)
        try:
            source[0] = PART.sub(shown, source[0])
        finally:
            os.chdir(here)
            pyplot.close("all")


def setup(app):
    """Connect to the reading of pages."""
    app.connect("source-read", draw)
    return {"parallel_read_safe": True}
