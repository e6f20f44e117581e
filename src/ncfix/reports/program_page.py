"""The HTML page of a corrected program: pictures, figures and lists on the path of the tool tip."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, field
from functools import cache
from html import escape

import numpy as np

from ncfix.arrays import Array
from ncfix.compensate import FixOptions
from ncfix.compensate.figures.path_record import EDGES, LISTED, Extent, ListedBlock, ListedPlace, PathRecord
from ncfix.compensate.report import FixReport
from ncfix.machine import Axis, Machine
from ncfix.reports.content import machine_sections
from ncfix.reports.document import Plot
from ncfix.reports.pages import LIBRARY, asset, card, filled, library, packed, table, with_columns
from ncfix.reports.rendering import html_plot
from ncfix.values import mutable
from ncfix.version import __version__

WHOLE = 300_000
"""Largest size, bytes, of a text that a page contains completely; else it has the lines around listed places."""
AROUND = 2
MAX_LINE_CHARACTERS = 160
"""Largest number of characters of a line that are shown."""
NOTES = 100
"""Largest number of remarks that are shown, the first `FIRST` of them unfolded."""
FIRST = 3
REFUSED = "motion blocks that could not be corrected safely; they are unchanged."
PASSED = "blocks that stay unchanged by a rule, and the rule."
CHOOSE = "Choose a line to see where its motion ends."
CURVES = (
    "The errors in the machine file. Error of the tool tip: actual minus nominal position in the workpiece frame, as "
    "one axis moves and the others are in the middle of their travel. Below it the errors of each axis; bands are "
    "two standard deviations, if the file has them."
)
HIGH = 0.8
"""Share of a limit from which on it is marked as high."""


@mutable
class ProgramPage:
    """The content of a page.

    text    the original program
    output  path of the corrected program; None: not written
    """

    record: PathRecord
    report: FixReport
    machine: Machine
    options: FixOptions
    text: bytes
    output: str | None = None
    _spots: list[ListedPlace] = field(default_factory=list)
    _lines: list[bytes] = field(default_factory=list)

    def html(self, beside: str | None = None) -> bytes:
        """The page, with the library embedded; in a batch, `beside` is the relative path of the library's folder."""
        record, report = self.record, self.report
        self._lines, self._spots = self.text.splitlines(), []
        columns, shift, strays = record.columns()
        script = f'<script src="{escape(beside)}{LIBRARY}"></script>' if beside is not None else _inside()
        name = report.path.replace("\\", "/").rsplit("/", 1)[-1]
        written = f"written to {self.output}" if self.output else "nothing written"
        refused, passed = record.refused, record.passed
        lists = {
            "worst": self._worst(),
            "refused": self._blocks("Refused", refused, len(report.refused), REFUSED),
            "passed": self._blocks("Passed by rule", passed, report.passed, PASSED),
        }  # fmt: skip
        axes, shown = self._axes(shift)
        whole = np.maximum(record.share.sum(axis=1, keepdims=True), 1e-12)
        head = {
            "axes": axes,
            "edges": np.round(EDGES, 6).tolist(),
            "share": dict(zip(("before", "after"), np.round(100 * record.share / whole, 4).tolist(), strict=True)),
            "spots": [_flat(spot) for spot in self._spots],
            "source": self._source(),
        }
        values = {
            "version": escape(__version__),
            "from": "'self' file:" if beside is not None else "",
            "name": escape(name),
            "machine": escape(self.machine.name),
            "subtitle": escape(f"{report.path} on {self.machine.name}, {self.options.strategy}; {written}"),
            "style": asset("page.css"),
            "cards": "".join(self._cards()),
            "said": self._said(),
            "selection": escape(_selection(record, len(shift), strays)),
            "limits": self._limits(),
            **lists,
            "curves": self._curves(),
            "footer": escape(f"ncfix {__version__} · machine {self.machine.name}, hash {self.machine.hash}"),
            "data": packed(with_columns(head, {**columns, **shown})),
            "library": script,
            "script": asset("theme.js") + asset("program.js"),
        }
        return filled("program.html", values)

    def _cards(self) -> Iterator[str]:
        report = self.report
        before, after = report.error_before_um, report.error_after_um
        for key, about in (
            ("max", "largest tip error, µm, before → after"),
            ("rms", "rms tip error, µm, before → after"),
        ):
            if before.get(key) is not None and after.get(key) is not None:
                value = f'<span class="from">{before[key]:.2f}</span> → <span class="to">{after[key]:.2f}</span>'
                yield card(value, about)
        yield card(f"{report.compensated}", "motion blocks corrected")
        colour = ' class="bad"' if report.refused else ""
        yield card(f"<span{colour}>{len(report.refused)}</span> · {report.passed}", "blocks refused · passed by rule")
        if report.max_correction_um is not None:
            yield card(f"{report.max_correction_um:.1f} µm", "largest correction of X, Y and Z")
        yield card(
            f"{report.rounding_um:.2f} µm",
            f"of rounding to the control's digits, besides the tolerance of {self.options.tolerance_um:g} µm",
        )

    def _said(self) -> str:
        """The remarks, the first ones unfolded."""
        report, found = self.report, []
        if len(report.block_delete) > 1:
            found.append(
                "The program was corrected for several positions of block delete; the pictures show the first of them."
            )
        for message in report.warnings[:NOTES]:
            line = f"line {message.place.line}: " if message.place and message.place.line else ""
            found.append(f"{message.code}: {line}{message.text}")
        if len(report.warnings) > NOTES:
            found.append(f"And {len(report.warnings) - NOTES} more.")
        said = [f'<p class="said">{escape(words)}</p>' for words in found]
        if len(said) <= FIRST + 1:
            return "".join(said)
        rest = f"<details><summary>{len(said) - FIRST} more remarks</summary>{''.join(said[FIRST:])}</details>"
        return "".join(said[:FIRST]) + rest

    def _axes(self, shift: Array) -> tuple[list[dict[str, object]], dict[str, Array]]:
        """The axes, and their corrections at the places drawn: um, thousandths of a degree."""
        axes: list[dict[str, object]] = []
        columns = {}
        for axis in self._in_order():
            unit, factor = _unit(axis.rotary)
            axes.append({"name": axis.name, "rotary": axis.rotary, "unit": unit})
            values = shift[:, self.machine.axis_names.index(axis.name)] if shift.size else np.zeros(len(shift))
            columns[f"shift_{axis.name}"] = np.round(values * factor, 3).astype("f4")
        return axes, columns

    def _in_order(self) -> list[Axis]:
        """The axes sorted by letter, linear ones first."""
        return sorted(self.machine.axes, key=lambda axis: (axis.rotary, axis.name))

    def _limits(self) -> str:
        linear, rotary = self.machine.max_correction
        rows = [_limit("X Y Z together", self.record.linear, False, linear)]
        for axis in self._in_order():
            found = self.record.corrections.get(axis.name, Extent())
            rows.append(_limit(axis.name, found, axis.rotary, rotary if axis.rotary else None))
        header = ("axis", "smallest", "largest", "unit", "limit", "used", "line")
        return table(header, rows, right=(1, 2, 4, 6))

    def _worst(self) -> str:
        rows = [
            [self._button(spot), f"{spot.before:.2f}", f"{spot.after:.2f}", self._place(spot), self._code(spot.line)]
            for spot in self.record.worst
        ]
        return (
            table(("line", "before, µm", "after, µm", "X Y Z, mm", "block"), rows, right=(0, 1, 2, 3))
            if rows
            else "<p>None.</p>"
        )

    def _blocks(self, heading: str, blocks: Sequence[ListedBlock], count: int, about: str) -> str:
        if not blocks:
            return ""
        rows = [
            [self._button(each.spot) if each.spot else str(each.line), escape(each.reason), self._code(each.line)]
            for each in blocks
        ]
        more = f" The first {LISTED} of them." if count > len(rows) else ""
        return (
            f'<section><h2>{heading}</h2><p class="note">{count} {about}{more} {CHOOSE}</p>'
            f'<div class="scroll" tabindex="0" role="region" aria-label="{heading}">'
            f"{table(('line', 'why', 'block'), rows, right=(0,))}</div></section>"
        )

    def _button(self, spot: ListedPlace) -> str:
        self._spots.append(spot)
        return f'<button type="button" class="row" data-spot="{len(self._spots) - 1}">{spot.line}</button>'

    def _place(self, spot: ListedPlace) -> str:
        return " ".join(f"{value:.2f}" for value in spot.tip)

    def _text(self, line: int) -> str:
        return (
            self._lines[line - 1].decode("utf-8", "replace")[:MAX_LINE_CHARACTERS]
            if 0 < line <= len(self._lines)
            else ""
        )

    def _code(self, line: int) -> str:
        return f"<code>{escape(self._text(line))}</code>"

    def _source(self) -> dict[int, str]:
        """The lines shown as text: all lines of a short program, else those around listed places."""
        if len(self.text) <= WHOLE:
            wanted = set(range(1, len(self._lines) + 1))
        else:
            wanted = {spot.line + k for spot in self._spots for k in range(-AROUND, AROUND + 1)}
        return {line: self._text(line) for line in sorted(wanted) if 0 < line <= len(self._lines)}

    def _curves(self) -> str:
        sections = [
            each for each in machine_sections(self.machine, "") if any(isinstance(part, Plot) for part in each.parts)
        ]
        if not sections:
            return ""
        body = "".join(
            f'<h3>{escape(each.heading)}</h3><div class="curves">'
            + "".join(html_plot(part) for part in each.parts if isinstance(part, Plot))
            + "</div>"
            for each in sections
        )
        return f'<section><h2>Errors of the machine</h2><p class="note">{CURVES}</p>{body}</section>'


@cache
def _inside() -> str:
    return f'<script type="text/plain" id="library">{packed(library())}</script>'


def _unit(rotary: bool) -> tuple[str, float]:
    """The unit in which corrections are shown, and its factor from mm or rad."""
    return ("mdeg", 1e3 * float(np.degrees(1.0))) if rotary else ("µm", 1e3)


def _limit(name: str, found: Extent, rotary: bool, limit: float | None) -> list[str]:
    """A row of the table of corrections; limit None: the limit holds for the axes together."""
    unit, factor = _unit(rotary)
    low, high = (f"{factor * value + 0.0:+.2f}" if value else "0" for value in (found.low, found.high))
    line = str(found.line) if found.line else ""
    if limit is None:
        return [escape(name), low, high, unit, "", "", line]
    share = max(-found.low, found.high, 0.0) / limit if limit else 0.0
    meter = f'<i{" class=high" if share > HIGH else ""} style="width:{min(100 * share, 100):.1f}%"></i>'
    used = f'{100 * share:.1f} %<span class="meter">{meter}</span>'
    return [escape(name), low, high, unit, f"{factor * limit:g}", used, line]


def _flat(spot: ListedPlace) -> dict[str, object]:
    found = asdict(spot)
    found.update(zip("xyz", found.pop("tip"), strict=True))
    return found


def _selection(record: PathRecord, drawn: int, strays: float) -> str:
    if drawn >= record.total:
        return f"All {record.total} examined points of the path are drawn."
    return (
        f"{drawn} of {record.total} examined points of the path are drawn: in each stretch those with the largest "
        "error before and after, and those that define the shape of the path. The drawn lines differ from the path "
        f"by at most {strays:.2g} mm."
    )
