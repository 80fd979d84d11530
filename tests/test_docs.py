"""The documents do what they say: their Python runs, block after block, and prints what stands below it."""
import contextlib
import io
import linecache
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[1]
LONG = ("docs/howto/notebooks.md", "docs/howto/own_curved_contact.md", "docs/howto/without_a_clock.md", "docs/tutorials/diagram.md")
PAGES = sorted(["README.md", *(page.relative_to(ROOT).as_posix() for page in (ROOT / "docs").rglob("*.md"))])


def blocks(page: str) -> list[tuple[int, str, str | None, bool]]:
    """Return ``(line, code, expected output or None, whether a picture is shown)`` of each Python block of a page."""
    text = (ROOT / page).read_text()
    found = re.finditer(r"```python\n(.*?)```\n(?:\s*```text\n(.*?)```\n)?(\s*<!-- picture: )?", text, re.DOTALL)
    return [(text.count("\n", 0, match.start()) + 2, match[1], match[2], match[3] is not None) for match in found]


@pytest.mark.parametrize("page", [pytest.param(page, marks=[pytest.mark.slow] if page in LONG else [])
                                  for page in PAGES if blocks(page)])
def test_python_of_a_page_runs_and_prints_what_is_shown(page, tmp_path, monkeypatch):
    from matplotlib import pyplot

    monkeypatch.chdir(tmp_path)
    names: dict = {"__name__": "__main__"}
    try:
        for line, code, expected, picture in blocks(page):
            pyplot.close("all")
            out, name = io.StringIO(), f"<{page}, line {line}>"
            linecache.cache[name] = len(code), None, code.splitlines(keepends=True), name  # laws are read again, as in a notebook
            with contextlib.redirect_stdout(out):
                exec(compile(code, name, "exec"), names)
            if expected is not None:
                assert out.getvalue() == expected, f"{page}, block at line {line}"
            assert not picture or pyplot.get_fignums(), f"{page}, block at line {line} draws nothing"
    finally:
        pyplot.close("all")


def source_of(target):
    """The file that a link leads to; pages of the gallery and of the reference are made when the documents are built."""
    if target.parent.name == "reference":
        return target.parent.parent / "conf.py"
    if target.parent.name != "auto_gallery":
        return target
    gallery = target.parent.parent / "gallery"
    return gallery / "README.rst" if target.name == "index" else gallery / f"{target.stem}.py"


@pytest.mark.parametrize("page", PAGES)
def test_links_between_pages_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)", (ROOT / page).read_text()):
        if "://" not in target:
            assert source_of((ROOT / page).parent / target).exists(), target


def test_readme_has_exactly_two_set_up_commands_of_one_line():
    commands = re.findall(r"```bash\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    assert len(commands) == 2
    assert all(command.count("\n") == 1 for command in commands)
    assert "bifurc trace impact_oscillator" in commands[0]
    assert "pytest" in commands[1]


def test_ci_runs_the_readme_command():
    script = (ROOT / ".ci" / "run").read_text()
    extract = re.search(r"command=\$\((awk .*)\)\n", script)
    done = subprocess.run(["bash", "-c", extract[1]], cwd=ROOT, capture_output=True, text=True, check=True)
    commands = re.findall(r"```bash\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    assert done.stdout == commands[1]


def test_every_picture_has_a_block_that_draws_it():
    for page in PAGES:
        shown = (ROOT / page).read_text().count("<!-- picture: ")
        assert shown == sum(picture for *_, picture in blocks(page)), page


def test_the_readme_shows_three_small_pictures_and_sets_up_on_the_first_screen():
    text = (ROOT / "README.md").read_text()
    head = text[:text.index("## Set up")]
    shown = re.findall(r'<img src="(.*?)"', head)
    assert len(shown) == 3
    for name in shown:
        file = ROOT / name
        assert file.stat().st_size < 150_000
        assert f"({file.parent.name}/{file.name})" in (ROOT / "docs" / "index.md").read_text()
    lines = sum(-(-len(line) // 110) for line in head.splitlines() if line and not line.startswith("<img"))
    assert lines < 25


def test_every_page_is_reached_from_the_start_page():
    def below(page):
        text = (ROOT / "docs" / page).read_text()
        for tree in re.findall(r"```{toctree}\n(.*?)```", text, re.DOTALL):
            for name in tree.splitlines():
                if name and not name.startswith(":"):
                    path = (pathlib.Path(page).parent / re.sub(r".*<(.*)>", r"\1", name)).as_posix()
                    if (ROOT / "docs" / f"{path}.md").exists():
                        yield f"{path}.md"
                        yield from below(f"{path}.md")

    reached = {"index.md", *below("index.md")}
    assert reached == {page.removeprefix("docs/") for page in PAGES if page.startswith("docs/")}


def test_the_reference_describes_every_public_name():
    """Every module that the settings of the documents list gives its whole ``__all__``, and every public package is listed."""
    import ast

    import bifurc

    settings = ast.parse((ROOT / "docs" / "conf.py").read_text())
    modules = next(ast.literal_eval(node.value) for node in settings.body
                   if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "MODULES")
    assert {f"bifurc.{name}" for name in bifurc._MODULES} < set(modules)
    homes = {f"bifurc{where}" for where in bifurc._NAMES.values()}
    for name in homes:  # what is offered at the top has its neighbours described too
        package = ".".join(name.split(".")[:2])
        assert package in modules or package in ("bifurc.system", "bifurc.flow", "bifurc.loading", "bifurc.models",
                                                 "bifurc.structure"), package


def test_changelog_names_every_public_function():
    import bifurc as bf

    text = (ROOT / "docs" / "changelog.md").read_text()
    for name in bf._NAMES:
        if name.islower():
            assert f"`{name}" in text, name


def test_the_command_line_help_is_whole():
    for command in ("trace", "frf", "basins", "sweep", "hysteresis", "info"):
        done = subprocess.run([sys.executable, "-m", "bifurc", command, "--help"], capture_output=True, text=True)
        assert done.returncode == 0
        assert "SYSTEM" in done.stdout
