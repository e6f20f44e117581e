"""What a report looks like: pages that stand alone, and text that means nothing but itself."""

from __future__ import annotations

import re
from html.parser import HTMLParser

import numpy as np
import pytest

from ncfix.diagnostics import UsageError
from ncfix.reports.document import ArrowMap, Document, Dots, Line, Paragraph, Plot, ReportSection, Table
from ncfix.reports.rendering import HEIGHT, UP, WIDTH, PlotAxes, form_of, html, markdown, ticks

X = np.linspace(-10.0, 10.0, 5)
NASTY = "<script>alert('a|b')</script> & \"EXX\""
DOCUMENT = Document(
    NASTY,
    [
        ReportSection(
            "Errors", [Paragraph(NASTY), Table(("name", NASTY), [("EXX", "1"), (NASTY, "2")]), Table((), [("a", "b")])]
        ),
        ReportSection(
            "Curves", [Plot("um over X", [Line(X, X**2, 0.5 * abs(X), "up"), Line(X, -(X**2), label="down")])]
        ),
        ReportSection("Flat", [Plot("um over Y", [Line(X, 0 * X), Dots(X, X - 3.0, "residual")])]),
    ],
)


class Balanced(HTMLParser):
    """Notes tags that are not closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.wrong: list[str] = []
        self.seen: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.add(tag)
        if tag not in ("meta",):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.add(tag)

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)


def test_a_page_is_well_formed_and_stands_alone() -> None:
    text = html(DOCUMENT).decode()
    page = Balanced()
    page.feed(text)
    assert (page.open, page.wrong) == ([], [])
    assert "script" not in page.seen
    assert {"table", "svg", "polyline", "polygon", "circle", "figure"} <= page.seen
    assert not re.search(r"(src|href)=", text)


def test_a_plot_holds_its_curves_their_bands_and_zero() -> None:
    drawn = PlotAxes.around([Line(X, X + 20.0, np.full(5, 3.0))])
    assert drawn.across == (-10.0, 10.0)
    assert drawn.up == (0.0, 33.0)
    places = [tuple(map(float, each.split(","))) for each in drawn.points(X, X + 20.0).split()]
    assert all(0 <= a <= WIDTH and 0 <= b <= HEIGHT for a, b in places)
    assert [b for _, b in places] == sorted((b for _, b in places), reverse=True)


def test_markdown_has_rows_of_one_width_and_the_extremes_of_curves() -> None:
    text = markdown(DOCUMENT).decode()
    for row in re.findall(r"^\|.*\|$", text, re.MULTILINE):
        assert len(re.findall(r"(?<!\\)\|", row)) == 3
    assert "<script>" not in text
    assert "up +0 to +100; down -100 to -0" in text
    assert "residual -13 to +7" in text


def test_a_map_of_arrows_has_a_panel_for_each_title_and_one_scale() -> None:
    shifts = {"before": np.tile([3.0, 4.0], (5, 1)), "after": np.tile([0.0, 0.5], (5, 1))}
    part = ArrowMap("Residuals.", "X, mm", "Y, mm", X, -X, shifts, "um")
    text = html(Document("a", [ReportSection("b", [part])])).decode()
    page = Balanced()
    page.feed(text)
    assert (page.open, page.wrong) == ([], [])
    assert "The longest arrow is 5.0 um" in text
    ends = [tuple(map(float, each)) for each in re.findall(r'<line x1="(.*?)" y1="(.*?)" x2="(.*?)" y2="(.*?)"', text)]
    lengths = [float(np.hypot(c - a, d - b)) for a, b, c, d in ends]
    assert len(ends) == 10
    assert lengths[0] / lengths[-1] == pytest.approx(10, rel=0.05)  # tenths of a pixel
    assert "before up to 5.0 um; after up to 0.5 um" in markdown(Document("a", [ReportSection("b", [part])])).decode()


def test_a_map_of_arrows_may_have_any_number_of_panels() -> None:
    shifts = {f"{number}": np.tile([1.0, 0.0], (5, 1)) for number in range(9)}
    part = ArrowMap("Residuals.", "X, mm", "Y, mm", X, -X, shifts, "um")
    text = html(Document("a", [ReportSection("b", [part])])).decode()
    assert text.count("<line ") == 45


def test_the_suffix_says_the_form() -> None:
    assert form_of("a/b.html")(DOCUMENT) == html(DOCUMENT)
    assert form_of("page")(DOCUMENT) == html(DOCUMENT)
    assert form_of("PAGE.MD")(DOCUMENT) == markdown(DOCUMENT)
    with pytest.raises(UsageError) as caught:
        form_of("page.docx")
    assert caught.value.code == "NCF018"


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (-358.7, 359.5, [-300, -200, -100, 0, 100, 200, 300]),
        (-0.0151, 0.0124, [-0.015, -0.01, -0.005, 0, 0.005, 0.01]),
        (0.0, 900.0, [0, 200, 400, 600, 800]),
        (3.0, 3.0, [3]),
    ],
)
def test_ticks_stand_at_round_numbers_within_the_axis(low: float, high: float, expected: list[float]) -> None:
    assert ticks(low, high, 6).tolist() == pytest.approx(expected, abs=1e-12)


def test_ticks_of_any_range_are_few_and_inside() -> None:
    for power in range(-12, 12):
        for low, width in ((0.0, 1.0), (-3.3, 7.7), (100.0, 0.9)):
            ends = low * 10.0**power, (low + width) * 10.0**power
            found = ticks(*ends, UP)
            assert 2 <= len(found) <= 2 * UP
            assert ends[0] - 1e-9 * width * 10.0**power <= found.min()
            assert found.max() <= ends[1] + 1e-9 * width * 10.0**power
