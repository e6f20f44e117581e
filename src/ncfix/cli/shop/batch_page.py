"""The HTML page of a batch: results and their reasons, as totals and as a list to sort and filter."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any
from urllib.parse import quote

from ncfix.cli.listings import all_codes
from ncfix.cli.shop.summary import OutcomeKind, Summary, reasons
from ncfix.diagnostics import visible
from ncfix.reports.pages import asset, card, filled, table
from ncfix.version import __version__

Entry = Mapping[str, Any]
"""A program's entry in the output of `ncfix fix --json`."""
HEADER = (
    "program",
    "outcome",
    "corrected",
    "refused",
    "before, µm",
    "after, µm",
    "largest correction, µm",
    "why, remarks",
)
FIGURES = (2, 3, 4, 5, 6)
"""Indices of columns with numbers."""
MAX_REMARKS_SHOWN = 20
"""Largest number of reasons and remarks shown for a program; all are counted."""


def batch_page(entries: Sequence[Entry], folder: str = "", title: str = "Batch of programs") -> bytes:
    """The page; links to pages of programs are relative to its `folder`."""
    summary = Summary()
    for entry in entries:
        summary.add(entry)
    outcomes = sorted({str(OutcomeKind.of(entry)) for entry in entries})
    values = {
        "version": escape(__version__),
        "title": escape(title),
        "subtitle": f"{summary.count} programs, {summary.written} written",
        "style": asset("page.css"),
        "cards": "".join(_cards(entries, summary)),
        "totals": _totals(summary),
        "outcomes": "".join(f"<option>{escape(each)}</option>" for each in outcomes),
        "programs": _programs(entries, folder),
        "script": asset("theme.js") + asset("batch.js"),
    }
    return filled("batch.html", values)


def _cards(entries: Sequence[Entry], summary: Summary) -> Iterator[str]:
    yield card(str(summary.count), "programs")
    yield card(f'<span class="good">{summary.written}</span>', "written")
    lost = summary.count - summary.written
    yield card(f'<span class="{"bad" if lost else "good"}">{lost}</span>', "not written")
    figures = [
        [error["max"] for entry in entries if (error := entry.get(key)) and error.get("max") is not None]
        for key in ("error_before_um", "error_after_um")
    ]
    if all(figures):
        before, after = map(max, figures)
        value = f'<span class="from">{before:.2f}</span> → <span class="to">{after:.2f}</span>'
        yield card(value, "largest tip error of all programs, µm, before → after")
    yield card(str(sum(entry.get("compensated", 0) for entry in entries)), "motion blocks corrected")
    yield card(str(sum(len(entry.get("refused", ())) for entry in entries)), "motion blocks refused")


def _totals(summary: Summary) -> str:
    titles = all_codes()
    found = summary.as_dict()

    def row(count: int, outcome: str, code: str, kind: str) -> list[str]:
        title = titles[code].title if code in titles else ""
        show = f'<button type="button" data-find="{escape(code.lower())}" data-outcome="{escape(kind)}">show</button>'
        badge = f'<span class="outcome {outcome.split()[0]}">{escape(outcome)}</span>'
        return [str(count), badge, escape(code), escape(title), show]

    rows = [row(each["programs"], each["outcome"], each["code"] or "", each["outcome"]) for each in found["outcomes"]]
    remarks = sorted(found["remarks"].items(), key=lambda item: (-item[1], item[0]))
    rows += [row(count, "with remark", code, "") for code, count in remarks]
    return table(("programs", "outcome", "reason", "explanation", ""), rows, right=(0,))


def _programs(entries: Sequence[Entry], folder: str) -> str:
    kinds = [' class="n"' if column in FIGURES else "" for column in range(len(HEADER))]
    head = "".join(f'<th scope="col"{kind}>{escape(name)}</th>' for kind, name in zip(kinds, HEADER, strict=True))
    rows = "".join(_row(each, folder) for each in entries)
    return f'<table id="programs"><thead><tr>{head}</tr></thead><tbody>\n{rows}</tbody></table>'


def _row(entry: Entry, folder: str) -> str:
    outcome = OutcomeKind.of(entry)
    name = escape(visible(entry["path"]))
    if entry.get("page"):
        way = quote(os.path.relpath(entry["page"], folder or os.curdir).replace(os.sep, "/"))
        name = f'<a href="{escape(way)}">{name}</a>'
    before, after = ((entry.get(key) or {}).get("max") for key in ("error_before_um", "error_after_um"))
    numbers = [
        entry.get("compensated"),
        len(entry["refused"]) if "refused" in entry else None,
        before,
        after,
        entry.get("max_correction_um"),
    ]
    cells = [f"<td>{name}</td>", f'<td><span class="outcome {outcome.split()[0]}">{outcome}</span></td>']
    for value, digits in zip(numbers, (0, 0, 2, 2, 1), strict=True):
        known = value is not None
        cells.append(
            f'<td class="n" data-value="{value if known else ""}">{f"{value:.{digits}f}" if known else ""}</td>'
        )
    wrong, remarks = reasons(entry), [(each["code"], each["text"]) for each in entry.get("warnings", ())]
    cells.append(f"<td>{_said(wrong, remarks)}</td>")
    text = " ".join([visible(entry["path"]), outcome, *dict.fromkeys(map(" ".join, (*wrong, *remarks)))]).lower()
    return f'<tr data-outcome="{outcome}" data-text="{escape(text)}">{"".join(cells)}</tr>\n'


def _said(wrong: Sequence[tuple[str, str]], remarks: Sequence[tuple[str, str]]) -> str:
    """The first reason; further reasons and the remarks as a list of codes that unfolds to the full texts."""
    lines = [f"{escape(code)}: {escape(visible(why.splitlines()[0]))}" for code, why in (*wrong, *remarks)]
    first, rest = (lines[0], lines[1:]) if wrong else ("", lines)
    if not rest:
        return first
    codes = Counter(code for code, _ in (*wrong[1:], *remarks))
    counted = ", ".join(f"{code} ({count})" if count > 1 else code for code, count in codes.items())
    rest = [
        *rest[:MAX_REMARKS_SHOWN],
        *([f"and {len(rest) - MAX_REMARKS_SHOWN} more"] if len(rest) > MAX_REMARKS_SHOWN else []),
    ]
    return f"{first}<details><summary>{escape(counted)}</summary>{'<br>'.join(rest)}</details>"
