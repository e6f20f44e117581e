"""The page of a batch: it lists, sorts and filters, and leads to the page of each program."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ncfix.cli.main import run
from report.browser import Tab

GUIDE = Path(__file__).parents[2] / "examples" / "guide"


@pytest.fixture(scope="module")
def batch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the shop's programs, one of which is refused, and one of a program that cannot be read."""
    folder = tmp_path_factory.mktemp("batch")
    (folder / "shop").mkdir()
    for path in GUIDE.glob("shop/**/*.nc"):
        (folder / "shop" / path.name).write_bytes(path.read_bytes())
    (folder / "shop" / "bad.nc").write_text("%\nG1 X1 X2 ((\n%\n")
    given = ["-m", GUIDE / "mill.toml", "--setup", GUIDE / "setup.toml", "--report", folder / "night.html"]
    assert run(["fix", str(folder / "shop"), "-o", str(folder / "out"), *map(str, given), "-j", "1"]) != 0
    return folder / "night.html"


def test_each_program_has_a_page_and_they_share_the_library(batch: Path) -> None:
    pages = batch.with_name("night-pages")
    assert {path.name for path in pages.iterdir()} == {"bracket.nc.html", "grid.nc.html", "lid.nc.html", "plotly.js"}
    assert all(path.stat().st_size < 300_000 for path in pages.glob("*.html"))


def test_it_sorts_filters_and_leads_to_the_programs(batch: Path, chromium: Any) -> None:
    tab = Tab(chromium, batch)
    shown = "[...document.querySelectorAll('#programs tbody tr')].filter(each => !each.hidden)"
    names = f"{shown}.map(each => each.cells[0].innerText.split('/').pop())"
    assert sorted(tab.do(names)) == ["bad.nc", "bracket.nc", "grid.nc", "lid.nc"]
    tab.page.get_by_role("button", name="before, µm").press("Enter")
    assert tab.do(names)[0] == "bracket.nc"
    tab.page.locator("#programs th button").first.press("Enter")
    assert tab.do(names) == ["bad.nc", "bracket.nc", "grid.nc", "lid.nc"]
    tab.page.locator("#programs th button").first.press("Enter")
    assert tab.do(names)[0] == "lid.nc"
    tab.page.locator("#find").fill("ncf433")
    assert tab.do(names) == ["grid.nc"]
    tab.page.locator("#find").fill("")
    tab.page.locator("#outcome").select_option("failed")
    assert tab.do(names) == ["bad.nc"]
    tab.page.locator("#outcome").select_option("")
    tab.page.locator("tr", has_text="NCF433").get_by_role("button", name="show").press("Enter")
    assert tab.do(names) == ["grid.nc"]
    tab.page.locator("#outcome").select_option("")
    tab.page.locator("#find").fill("bracket")
    assert tab.do(names) == ["bracket.nc"]
    page = batch.parent / tab.page.locator("#programs a:visible").get_attribute("href")
    tab.close()
    Tab(chromium, page).close()


@pytest.mark.parametrize(("width", "dark"), [(390, False), (1400, True)])
def test_it_fits_the_window(batch: Path, chromium: Any, width: int, dark: bool) -> None:
    tab = Tab(chromium, batch, width, dark)
    assert tab.wide() <= 0
    tab.close()


def test_a_page_of_somebody_elses_is_not_replaced(
    batch: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page, program = tmp_path / "mine.html", batch.parent / "shop" / "lid.nc"
    given = ["report", program, "-m", GUIDE / "mill.toml", "--setup", GUIDE / "setup.toml", "-o", page]
    page.write_text("<p>mine")
    assert run(list(map(str, given))) == 2
    assert "NCF004" in capsys.readouterr().err
    assert page.read_text() == "<p>mine"
    assert run([*map(str, given), "--force"]) == 0
    first = page.read_bytes()
    assert run(list(map(str, given))) == 0
    assert page.read_bytes() == first
