"""Every page of the gallery runs, asserts its paper's numbers, and draws a picture."""
import pathlib
import runpy

import matplotlib.pyplot as plt
import pytest

import bifurc

PAGES = sorted((pathlib.Path(bifurc.__file__).parents[1] / "docs" / "gallery").glob("plot_*.py"))


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_runs_and_draws(page, monkeypatch):
    monkeypatch.delenv("QUICK", raising=False)  # as the documents show it
    before = set(plt.get_fignums())
    runpy.run_path(str(page))
    drawn = set(plt.get_fignums()) - before
    assert drawn, f"{page.name} draws nothing"
    for number in drawn:
        plt.close(number)


def test_pages_have_a_story_and_assert():
    assert len(PAGES) >= 20
    for page in PAGES:
        text = page.read_text()
        assert "assert" in text and "*Level:" in text and text.startswith('r"""\n'), page.name
