"""The page of a program in a browser: it renders, every control works, by keyboard too, and it fits every window."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import require_module
from ncfix.cli.main import run
from ncfix.compensate import FixOptions
from ncfix.compensate.figures.path_record import COLUMNS, DRAWN, PathRecord, selection
from ncfix.compensate.report import FixReport
from ncfix.machine import load
from ncfix.reports.picture import picture
from ncfix.reports.program_page import ProgramPage
from report.browser import Tab

EXAMPLES = Path(__file__).parents[2] / "examples"


def blade(folder: Path, *more: object) -> Path:
    """The page of the example of five axes."""
    program, setup, machine = "programs/blade.nc", "programs/blade.setup.toml", "machines/wCBXFZYSt.toml"
    page = folder / "blade.html"
    with pytest.MonkeyPatch.context() as here:
        here.chdir(EXAMPLES)
        assert run(["report", *map(str, (program, "-m", machine, "--setup", setup, "-o", page, *more))]) == 0
    return page


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory, chromium: Any) -> Path:
    """The page of the example."""
    return blade(tmp_path_factory.mktemp("page"))


@pytest.fixture(scope="module")
def tab(page: Path, chromium: Any) -> Any:
    """It, in a wide light window, which complains of nothing in all tests."""
    found = Tab(chromium, page)
    yield found
    found.close()


def test_all_pictures_are_drawn(tab: Tab) -> None:
    tab.shot("page.png")
    assert tab.do("document.querySelectorAll('#view canvas').length") >= 1
    for name in ("along", "spread", "linear"):
        tab.do(f"document.getElementById('{name}').scrollIntoView()")
        tab.page.wait_for_function(f"document.querySelectorAll('#{name} .scatterlayer .trace').length >= 2")
    titles = tab.do("[...document.querySelectorAll('.xtitle, .ytitle')].map(each => each.textContent)")
    assert {"length of path, mm", "tip error, µm", "share of the path, %", "correction, µm"} <= set(titles)
    assert tab.do("document.getElementById('trouble').hidden")
    assert tab.do("document.querySelectorAll('.curves svg').length") > 20


def test_the_colours_before_and_after_are_on_one_scale(tab: Tab) -> None:
    line = "(({color, cmin, cmax}) => [Math.max(...color), cmin, cmax])(document.getElementById('view').data[0].line)"
    before = tab.do(line)
    tab.page.get_by_label("after", exact=True).focus()
    tab.page.keyboard.press("Space")
    after = tab.do(line)
    assert before[1:] == after[1:] == [0, before[0]]
    assert after[0] < before[0] / 5
    tab.page.keyboard.press("ArrowLeft")
    assert tab.do(line) == before
    tab.page.get_by_label("logarithmic").first.evaluate("each => each.click()")
    assert tab.do(line)[2] == pytest.approx(np.log10(before[0]))
    tab.page.get_by_label("linear", exact=True).evaluate("each => each.click()")


def test_the_view_is_turned_by_buttons_and_keys(tab: Tab) -> None:
    eye = "Object.values(document.getElementById('view').layout.scene.camera.eye)"
    seen = [tab.do(eye)]
    for view in ("top", "front", "side", "corner"):
        tab.page.get_by_label(view, exact=True).evaluate("each => each.click()")
        seen.append(tab.do(eye))
    assert seen[0] == seen[-1]
    assert len({tuple(each) for each in seen}) == 4
    tab.page.locator("#view").focus()
    for key in ("ArrowLeft", "ArrowUp"):
        tab.page.keyboard.press(key)
        seen.append(tab.do(eye))
        assert seen[-1] != seen[-2]
    scale = "document.getElementById('view').layout.scene.aspectratio.x"
    before = tab.do(scale)
    tab.page.keyboard.press("+")
    assert tab.do(scale) > before
    tab.page.keyboard.press("0")
    assert tab.do(eye) == seen[0]
    assert tab.do(scale) == before


def test_a_line_of_a_list_shows_its_place(tab: Tab) -> None:
    button = tab.page.locator("#lists button[data-spot]").first
    line = button.inner_text()
    button.focus()
    tab.page.keyboard.press("Enter")
    assert tab.page.locator("#here dd").first.inner_text() == line
    assert tab.page.locator("#here .here").inner_text().split()[0] == line
    assert tab.do("document.querySelectorAll('tr[aria-current]').length") == 1
    tip = tab.page.locator("#lists tbody tr").first.locator("td").nth(3).inner_text()
    marker = "(({x, y, z}) => [x[0], y[0], z[0]].map(each => each.toFixed(2)).join(' '))"
    tab.page.wait_for_function(f"{marker}(document.getElementById('view').data[4]) === '{tip}'")


def test_the_slider_and_buttons_walk_along_the_path(tab: Tab) -> None:
    tab.page.get_by_role("button", name="largest error").press("Enter")
    error = "document.querySelectorAll('#here dd')[3].textContent"
    assert tab.do(error).split()[0] == tab.do("document.querySelector('.card .from').textContent")
    at = int(tab.do("document.getElementById('at').value"))
    tab.page.get_by_role("button", name="next place").press("Enter")
    assert int(tab.do("document.getElementById('at').value")) == at + 1
    tab.page.locator("#at").press("ArrowLeft")
    tab.page.get_by_role("button", name="previous place").press("Enter")
    assert int(tab.do("document.getElementById('at').value")) == at - 1
    for box in ("zoom to the place", "rapids"):
        before = tab.do("JSON.stringify(document.getElementById('view').layout.scene.aspectratio)")
        tab.page.get_by_label(box).press("Space")
        tab.page.get_by_label(box).press("Space")
        assert tab.do("JSON.stringify(document.getElementById('view').layout.scene.aspectratio)") == before


def test_a_click_on_the_curve_shows_the_place(tab: Tab) -> None:
    tab.page.locator("#along").scroll_into_view_if_needed()
    box = tab.page.locator("#along .nsewdrag").bounding_box()
    tab.page.mouse.move(box["x"] + box["width"] * 0.7, box["y"] + box["height"] * 0.5)
    tab.page.wait_for_timeout(200)
    tab.page.mouse.click(box["x"] + box["width"] * 0.7, box["y"] + box["height"] * 0.5)
    way = float(tab.do("document.querySelectorAll('#here dd')[1].textContent").split()[0])
    low, high = tab.do("document.getElementById('along').layout.xaxis.range")
    assert way == pytest.approx(low + 0.7 * (high - low), abs=0.02 * (high - low))
    tab.page.locator("#log").press("Space")
    assert tab.do("document.getElementById('along').layout.yaxis.type") == "log"
    tab.page.locator("#log").press("Space")


def test_every_control_is_reached_by_the_tab_key(tab: Tab) -> None:
    wanted = """[...document.querySelectorAll('main button, main input, main select, [tabindex="0"], header input')]
        .filter(each => each.offsetParent && (each.type !== 'radio' || each.checked))
        .map((each, k) => { each.dataset.order = k; return k; })"""
    left = set(tab.do(wanted))
    tab.do("document.activeElement.blur(); scrollTo(0, 0)")
    for _ in range(3 * len(left)):
        tab.page.keyboard.press("Tab")
        left.discard(int(tab.do("document.activeElement.dataset.order ?? -1")))
        if not left:
            break
    assert left == set()


PAINT = "getComputedStyle(document.body).backgroundColor"


def test_it_fits_a_wide_window_and_follows_its_colours(tab: Tab) -> None:
    assert tab.wide() <= 0
    light = tab.do(PAINT)
    tab.page.get_by_label("dark", exact=True).evaluate("each => each.click()")
    assert tab.do(PAINT) != light
    assert tab.wide() <= 0
    tab.page.get_by_label("auto", exact=True).evaluate("each => each.click()")
    assert tab.do(PAINT) == light


def test_it_fits_a_narrow_window(page: Path, chromium: Any) -> None:
    found = Tab(chromium, page, 390, True)
    assert found.wide() <= 0
    dark = found.do(PAINT)
    found.page.get_by_label("light", exact=True).evaluate("each => each.click()")
    assert found.do(PAINT) != dark
    assert found.wide() <= 0
    found.shot("page-narrow.png")
    found.close()


def test_refused_and_passed_blocks_are_listed_with_their_text(tmp_path: Path, chromium: Any) -> None:
    program, page = tmp_path / "loop.nc", tmp_path / "loop.html"
    text = (EXAMPLES / "guide" / "shop" / "grid.nc").read_text()  # what its loop does needs a correction each time
    program.write_text(text.replace("N140 G0 Z100.", "N140 G53 G0 Z400."))
    machine = EXAMPLES / "guide" / "mill.toml"
    assert (
        run(
            [
                "fix",
                *map(
                    str,
                    (program, "-m", machine, "--setup", EXAMPLES / "guide" / "setup.toml", "-o", tmp_path / "out.nc"),
                ),
                "--report",
                str(page),
            ]
        )
        == 4
    )
    assert not (tmp_path / "out.nc").exists()
    found = Tab(chromium, page)
    headings = found.do("[...document.querySelectorAll('h2')].map(each => each.textContent)")
    assert {"Refused", "Passed by rule"} <= set(headings)
    row = found.page.locator("section", has_text="Refused").last.locator("tbody tr").first
    assert "NCF433" in row.inner_text()
    assert "N80 G0 X#1 Y0." in row.inner_text()
    row.locator("button").press("Enter")
    assert found.page.locator("#here dd").first.inner_text() == "10"
    assert "nothing written" in found.page.locator("h1").inner_text()
    found.close()


def walk(count: int) -> dict[str, Any]:
    """Places of a long path: a spiral with errors at random."""
    random = np.random.default_rng(1)
    turn = np.linspace(0, 400 * np.pi, count)
    path = {"x": 50 * np.cos(turn), "y": 50 * np.sin(turn), "z": turn / 40, "way": 50 * turn}
    errors = {"before": random.exponential(9.0, count), "after": random.exponential(0.2, count)}
    numbers = {"line": np.arange(count) + 1, "kind": np.zeros(count)}
    return {name: values.astype(COLUMNS[name]) for name, values in {**path, **errors, **numbers}.items()}


def test_a_selection_keeps_the_largest_errors_and_the_shape() -> None:
    values = walk(300_000)
    rows = selection(values, DRAWN)
    assert len(rows) <= DRAWN
    for side in ("before", "after"):
        assert int(values[side].argmax()) in rows
        for stretch in np.array_split(np.arange(300_000), 500):
            assert values[side][rows[(rows >= stretch[0]) & (rows <= stretch[-1])]].max() >= np.quantile(
                values[side][stretch], 0.98
            )
    record = PathRecord()
    record._hold(values, np.zeros((300_000, 5)))
    _, _, strays = record.columns()
    assert 0 < strays < 0.25


def long_page(parts: int, count: int) -> ProgramPage:
    """The page of a program of so many parts, with so many places in each."""
    record = PathRecord()
    for _ in range(parts):
        record._hold(walk(count), np.random.default_rng(2).normal(0, 0.01, (count, 5)))
    blocks = parts * count
    machine = load(str(EXAMPLES / "machines" / "dmu50.toml"))
    return ProgramPage(
        record, FixReport("big.nc", blocks, blocks, blocks, 0, True), machine, FixOptions(), b"G1 X1\n" * blocks
    )


def test_a_page_says_what_it_leaves_out_and_stays_small(tmp_path: Path, chromium: Any) -> None:
    content = long_page(3, 400_000).html()
    assert len(content) < 8e6
    (said,) = re.findall(rb"(\d+) of 1200000 examined points.*by at most ([\d.]+) mm", content, re.DOTALL)
    assert int(said[0]) <= DRAWN
    path = tmp_path / "big.html"
    path.write_bytes(content)
    found = Tab(chromium, path)
    assert found.do("document.getElementById('view').data[0].x.length") >= int(said[0])
    assert found.do("document.getElementById('along').data[0].y.length") > 500
    found.close()


def test_a_page_has_the_same_bytes_again(chromium: Any) -> None:
    assert long_page(2, 20_000).html() == long_page(2, 20_000).html()


@pytest.mark.parametrize("form", ["svg", "pdf", "png"])
def test_a_picture_for_a_paper_has_the_same_bytes_again(form: str) -> None:
    require_module("matplotlib")
    made = [picture(long_page(1, 2000), form) for _ in range(2)]
    assert made[0] == made[1]
    assert made[0][:4] in (b"<?xm", b"%PDF", b"\x89PNG")


def test_a_program_that_cuts_nothing_has_a_page_too(tmp_path: Path, chromium: Any) -> None:
    program, page, plot = tmp_path / "rapid.nc", tmp_path / "rapid.html", tmp_path / "p.svg"
    program.write_text("%\nG21 G90 G54\nG0 X1. Y1. Z50. A0. C0.\nG0 X50.\nM30\n%\n")
    for machine in ("mill.toml", "nominal.toml"):
        given = ["-m", EXAMPLES / "guide" / machine, "--assume-zero", "-o", page, "--plot", plot, "--force"]
        assert run(["report", *map(str, (program, *given))]) == 0
    Tab(chromium, page).close()
