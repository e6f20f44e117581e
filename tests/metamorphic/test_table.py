"""The table in docs/accuracy.md: rows stay until they are measured again."""

from __future__ import annotations

from pathlib import Path

from metamorphic.table import BEGIN, END, note, rows_of

PAGE = f"before\n{BEGIN}\n{END}\nafter\n"


def test_figures_become_rows_by_relation(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    for text in (
        "metamorphic, fanuc, G91 and G90: 500 pairs, worst 0.100 um or mdeg",
        "metamorphic, haas, G91 and G90: 500 pairs, worst 0.200 um or mdeg",
        "metamorphic, siemens, X= and X: 3 pairs, worst 0.000 um or mdeg",
        "another figure",
    ):
        note(page, text)
    assert rows_of(page.read_text()) == {
        ("G91 and G90", 500): {"fanuc": "0.100", "haas": "0.200"},
        ("X= and X", 3): {"siemens": "0.000"},
    }
    assert page.read_text().startswith("before\n")
    assert page.read_text().endswith("\nafter\n")


def test_a_new_figure_takes_the_place_of_the_old_one(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    note(page, "metamorphic, siemens, X= and X: 3 pairs, worst 0.000 um or mdeg")
    note(page, "metamorphic, siemens, X= and X: 500 pairs, worst 0.010 um or mdeg")
    assert rows_of(page.read_text()) == {("X= and X", 500): {"siemens": "0.010"}}


def test_the_page_has_a_place_for_the_table(root: Path) -> None:
    rows = rows_of((root / "docs/accuracy.md").read_text(encoding="utf-8"))
    assert all(float(worst) < 1.0 for cells in rows.values() for worst in cells.values())
