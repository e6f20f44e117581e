"""The control `siemens`: SINUMERIK 840D sl, 828D, 802D sl, with CEC and EEC tables of one input, sums and products.

Sources: Function Manual Extended Functions, 03/2013, chapter K3; 802D sl Function Manual, 11/2012; S. Esmaeili
Marzdashti (Polytechnique Montreal, 2021), chapter 7, where 40 such tables were loaded. No public text states the sign
of CEC values, and whether the factors of a product are also added by themselves: both are settings that must be given.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import Message, RefusedError, UsageError
from ncfix.machine import State
from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.control import Assumption, FileControl, Files, Least, Option, Properties, Request, Written
from ncfix.tables.correction import orientation_error, random_poses
from ncfix.tables.scheme import Scheme, SchemeTask, automatic
from ncfix.tables.scheme_fixed import fixed
from ncfix.tables.table_files import Remarks, messages_of
from ncfix_siemens.products import TableReading, as_corrections, read_folder, reading_of, tables_of
from ncfix_siemens.settings import (
    ASSUMPTIONS,
    OPTIONS,
    PROPERTIES,
    STEPS,
    SWITCH_OFF,
    Settings,
    checked_settings,
    probe_files,
)
from ncfix_siemens.tables import CecTable, cec_text, eec_text

CEC = "NC_CEC.INI"
TABLES = re.compile(rb"(?im)^[^;\n]*\$(?:AN_CEC|AA_ENC_COMP)(?:_\w+)?[ \t]*\[")
SUM_FACTOR = 1.5
"""MD32720 (largest total correction) as a multiple of the largest correction."""
WORTH = 0.9
"""Rotary axes stay uncorrected if the largest error is then below this share of that with corrected ones."""
WORTHLESS = 0.2
"""Largest error, as a share of that without tables, that is accepted (within the target) for a better orientation."""
CHECKS = 1000
"""Number of random poses at which schemes are compared."""


class Siemens(FileControl):
    """The control `siemens`."""

    name = "siemens"
    title = "Siemens SINUMERIK (CEC, EEC)"
    reaches = "L-VOL, and R-VOL as far as sums and products of pairs can say it"
    properties: ClassVar[Properties] = PROPERTIES
    assumptions: ClassVar[tuple[Assumption, ...]] = ASSUMPTIONS
    options: ClassVar[Mapping[str, Option]] = OPTIONS
    steps: ClassVar[tuple[str, ...]] = STEPS
    switch_off = SWITCH_OFF

    def _missing(self, given: Mapping[str, str]) -> Iterator[Message]:
        """See `FileControl`; if a setting is missing, `product_terms` is asked for at the same time."""
        missing = tuple(super()._missing(given))
        yield from missing
        if missing and "product_terms" not in given:
            yield self._wanting(f"where tables are multiplied: {OPTIONS['product_terms'].text}")

    def _wanting(self, why: str) -> Message:
        text = f"siemens needs the setting 'product_terms' {why}"
        return Message("NCF485", text, hint=f"--set product_terms=VALUE{self._how(OPTIONS['product_terms'])}")

    def write(self, request: Request) -> Written:
        """Write `NC_CEC.INI`, and an EEC file for each axis if `positioning=eec`."""
        settings = checked_settings(self.settings(request.settings), request.machine)
        scheme = _scheme(request, settings)
        own = [term for term in scheme.tables.terms if settings.eec and _own(term)]
        others = [term for term in scheme.tables.terms if not (settings.eec and _own(term))]
        if any(len(term.factors) > 1 for term in others) and not settings.terms:
            raise UsageError((self._wanting("for these tables, since some are multiplied"),))
        reading = TableReading(settings.axes, 1 if settings.sign == "correction" else -1, settings.terms)
        cec = tables_of(others, reading)
        if len(cec) > settings.limits.tables:
            text = f"{len(cec)} tables are needed, but {settings.model} has {settings.limits.tables}"
            hint = "give --set tables=N if your control has more; product_terms=only needs the fewest tables"
            raise RefusedError.of("NCF484", text, hint=hint)
        eec = [replace(table, index=0) for table in tables_of(own, TableReading(settings.axes, -1, ""))]
        files = {f"{table.output}_EEC.INI": eec_text(table, _heads(settings)) for table in eec}
        if cec or not eec:
            files[CEC] = cec_text(cec, _heads(settings), _titles(cec, settings), settings.style)
        rotary = {axis.name for axis in request.machine.axes if axis.rotary}
        turned = any(term.outputs[0] in rotary for term in scheme.tables.terms)
        why = "a part of the correction of this size cannot be written as a sum of functions of two axes"
        least = Least(scheme.bound, why + (", with the rotary axes corrected as here" if turned else ""))
        return Written(files, tuple(_notes(request, settings, scheme, cec)), least)

    def probe(self, request: Request) -> Written:
        """Two probe files that show `value_sign` and `product_terms` on the machine, and their instructions."""
        settings = checked_settings(request.settings, request.machine)
        ranges = {
            axis.name: (low / axis.unit, high / axis.unit)
            for axis, (low, high) in zip(request.machine.axes, request.space.tolist(), strict=True)
        }
        return Written(probe_files(dict(settings.axes), ranges, settings.style))

    def examined(self, files: Files) -> tuple[Compensation | None, list[Remarks]]:
        """The tables of both kinds, interpreted by the comments on sign, products and axis letters."""
        folder = read_folder(files)
        reading, unsaid = reading_of(folder)
        remarks = [*folder.remarks, unsaid]
        if reading is None or any(each.wrong for each in remarks):
            return None, remarks
        return as_corrections(folder, reading), remarks

    def knows(self, name: str, content: bytes) -> bool:
        """Whether the file assigns variables of compensation tables."""
        return TABLES.search(content) is not None

    def look(self, files: Files) -> tuple[Message, ...]:
        """See `Control`; sign, products and axis letters are checked only if comments of ncfix state them."""
        folder = read_folder(files)
        return self.lint(files) if folder.said else messages_of(folder.remarks)


def _scheme(request: Request, settings: Settings) -> Scheme:
    """The tables by the scheme of the settings; with `rotary=auto` the better of both ways."""
    job = SchemeTask(request.machine, request.space, request.tool_length, request.target, settings.limits)
    if settings.scheme != "auto":
        return fixed(job, settings.scheme)
    if settings.rotary != "auto" or not request.machine.rotary.any():
        return automatic(job, settings.rotary != "keep")
    keeping, turning = automatic(job, False), automatic(job, True)
    allowed = _largest(request, turning)[request.machine.rotary].max() <= request.machine.max_correction[1]
    enough = min(request.target, WORTHLESS * _wrong(request))
    return turning if allowed and turning.missed <= max(keeping.missed / WORTH, enough) else keeping


def _wrong(request: Request) -> float:
    """The largest tip error without tables at random poses, mm."""
    q = random_poses(request.space, CHECKS, seed=9)
    state = State(request.tool_length)
    gap = request.machine.actual_tip(q, state) - request.machine.tip(q, request.tool_length)
    return float(np.linalg.norm(gap, axis=-1).max())


def _largest(request: Request, scheme: Scheme) -> Array:
    """The largest correction of each axis at random poses, mm and rad."""
    q = random_poses(request.space, CHECKS, seed=9)
    return np.abs(scheme.tables.at(request.machine.axis_names, q)).max(axis=0)


def _own(term: Term) -> bool:
    return len(term.factors) == 1 and term.way is None and term.factors[0].inputs == term.outputs


def _heads(settings: Settings) -> list[str]:
    """Comments at the top of a file: the settings for the reader, and a reference for people."""
    said = [f"value_sign={settings.sign}", f"product_terms={settings.terms}"]
    said += [f"{letter}={axis}" for letter, axis in settings.axes.items()]
    said += [f"most_tables={settings.limits.tables}", f"most_points={settings.limits.points}"]
    return [f"ncfix: {' '.join(said)}", "assumptions SIEMENS-1 to SIEMENS-7: see hand-over.md"]


def _titles(tables: Sequence[CecTable], settings: Settings) -> dict[int, str]:
    """A comment for each table, with its number as used by MULT_BY_TABLE."""
    letters = {axis: letter for letter, axis in settings.axes.items()}
    pointed = {table.multiply for table in tables}
    found = {}
    for table in tables:
        what = f"table {table.index + 1}: {letters[table.output]} over {letters[table.input]}"
        if table.index + 1 in pointed:
            what += ", multiplies others"
        if table.multiply:
            what += f", multiplied by table {table.multiply}"
        if table.direction:
            what += f", while {letters[table.input]} moves towards {'plus' if table.direction > 0 else 'minus'}"
        found[table.index] = what
    return found


def _notes(request: Request, settings: Settings, scheme: Scheme, cec: Sequence[CecTable]) -> Iterator[str]:
    products = sum(bool(table.multiply) for table in cec)
    yield f"Scheme {settings.scheme}: {len(cec)} tables of {settings.limits.tables}, {products} of them multiplied."
    if scheme.rest > request.target / 10:
        yield f"{1e3 * scheme.rest:.2f} um rms of the correction depend on three axes at once and remain."
    if scheme.dropped > request.target / 10:
        yield (
            f"{1e3 * scheme.dropped:.2f} um rms of the correction were left out: the control has no tables for them, "
            "or they are too small."
        )
    yield from _turned(request, scheme)
    if cec:
        yield f"MD18342[0...]: {' '.join(str(len(table.values)) for table in cec)} points."
    yield from _sums(request, settings, scheme)
    if any(table.direction for table in cec):
        yield "Tables for one way hold the play of the axes: MD32450 $MA_BACKLASH must be what it was when measured."
    if products:
        yield "Products hold in millimetres only: do not switch the control to inches with these tables on."


def _turned(request: Request, scheme: Scheme) -> Iterator[str]:
    """Notes on the orientation error of the tool without tables and with them."""
    if not request.machine.rotary.any():
        return
    q = random_poses(request.space, CHECKS, seed=9)
    state = State(request.tool_length)
    done = scheme.tables.at(request.machine.axis_names, q)
    before, after = (orientation_error(request.machine, q, each, state) for each in (np.zeros_like(q), done))
    sizes = [1e6 * float(np.sqrt(np.mean(angle**2))) for angle in (before, after)]
    if not done[:, request.machine.rotary].any():
        yield "The rotary axes keep their values: then the error at the tip is smaller, or the setting asks for it."
    yield f"Orientation of the tool, spin included: {sizes[0]:.1f} urad rms without tables, {sizes[1]:.1f} with them."


def _sums(request: Request, settings: Settings, scheme: Scheme) -> Iterator[str]:
    """A note with limits of the total correction (MD32720), which prevent the worst if an assumption is wrong."""
    parts = []
    for axis, value in zip(request.machine.axes, (SUM_FACTOR * _largest(request, scheme)).tolist(), strict=True):
        if value:
            parts.append(f"{settings.axes[axis.name]} {value / axis.unit:.4f} {'degree' if axis.rotary else 'mm'}")
    if parts:
        yield f"MD32720 $MA_CEC_MAX_SUM, 1.5 times the largest correction: {', '.join(parts)}."
