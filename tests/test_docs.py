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
PAGES = sorted(["README.md", *(page.relative_to(ROOT).as_posix() for page in (ROOT / "docs").rglob("*.md"))])


def blocks(page: str) -> list[tuple[int, str, str | None]]:
    """Return ``(line, code, expected output or None)`` of each Python block of a page."""
    text = (ROOT / page).read_text()
    found = re.finditer(r"```python\n(.*?)```\n(?:\s*```text\n(.*?)```\n)?", text, re.DOTALL)
    return [(text.count("\n", 0, match.start()) + 2, match[1], match[2]) for match in found]


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)])
def test_python_of_a_page_runs_and_prints_what_is_shown(page, tmp_path, monkeypatch):
    from matplotlib import pyplot

    monkeypatch.chdir(tmp_path)
    names: dict = {"__name__": "__main__"}
    try:
        for line, code, expected in blocks(page):
            out, name = io.StringIO(), f"<{page}, line {line}>"
            linecache.cache[name] = len(code), None, code.splitlines(keepends=True), name  # laws are read again, as in a notebook
            with contextlib.redirect_stdout(out):
                exec(compile(code, name, "exec"), names)
            if expected is not None:
                assert out.getvalue() == expected, f"{page}, block at line {line}"
    finally:
        pyplot.close("all")


@pytest.mark.parametrize("page", PAGES)
def test_links_between_pages_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)", (ROOT / page).read_text()):
        if "://" not in target:
            assert ((ROOT / page).parent / target).exists(), target


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


def test_changelog_names_every_public_function():
    import bifurc as bf

    text = (ROOT / "docs" / "changelog.md").read_text()
    for name in bf._NAMES:
        if name.islower():
            assert f"`{name}" in text, name


def test_the_command_line_help_is_whole():
    for command in ("trace", "frf", "basins", "sweep", "hysteresis", "info"):
        done = subprocess.run([sys.executable, "-m", "bifurc.cli", command, "--help"], capture_output=True, text=True)
        assert done.returncode == 0
        assert "SYSTEM" in done.stdout
