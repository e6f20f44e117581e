"""A report as Markdown: of plots, the extremes."""

from __future__ import annotations

from ncfix.report.document import Document, Dots, Line, Part, Plot, Section, Table, Text


def rendered(document: Document) -> bytes:
    """The text, UTF-8."""
    return "\n".join([f"# {_plain(document.title)}", *map(_section, document.sections)]).encode()


def _section(section: Section) -> str:
    return "\n".join([f"\n## {_plain(section.heading)}\n", *(f"{_part(part)}\n" for part in section.parts)])


def _part(part: Part) -> str:
    match part:
        case Text(words):
            return _plain(words)
        case Table(header, rows):
            width = max([len(header), *map(len, rows)])
            cells = [list(header) or [""] * width, ["---"] * width, *rows]
            return "\n".join(f"| {' | '.join(map(_plain, row))} |" for row in cells)
        case Plot(caption, drawn):
            return f"{_plain(caption)}: {'; '.join(map(_extremes, drawn))}"


def _extremes(what: Line | Dots) -> str:
    label = f"{_plain(what.label)} " if what.label else ""
    return f"{label}{what.y.min():+.3g} to {what.y.max():+.3g}"


def _plain(text: str) -> str:
    """Text that means nothing else in Markdown."""
    for mark in "\\`*_[]<>|#":
        text = text.replace(mark, f"\\{mark}")
    return text
