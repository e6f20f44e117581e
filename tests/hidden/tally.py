"""Records to the table of docs/accuracy.md: each line with its interval, what is wanted, and the prototype's figure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from textwrap import wrap

import numpy as np

from .families import FAMILIES
from .intervals import bootstrap, wilson
from .score import CLOSE, Record

BEGIN, END = "<!-- hidden-effect benchmark: begin -->", "<!-- hidden-effect benchmark: end -->"
WORSE = 1.02
Judge = Callable[[Record], bool | None]


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the table; `limit` is the least value wanted, or the most where `most`."""

    title: str
    count: int
    value: float
    interval: tuple[float, float]
    limit: float | None = None
    most: bool = False
    prototype: str = ""

    @property
    def met(self) -> str:
        """yes, no, or nothing where nothing is required or nothing was counted."""
        if self.limit is None or self.count == 0:
            return ""
        good = self.value <= self.limit if self.most else self.value >= self.limit
        return "yes" if good else "no"

    def row(self) -> str:
        """A row of a Markdown table."""
        low, high = self.interval
        wanted = "" if self.limit is None else f"{'at most' if self.most else 'at least'} {self.limit:g}"
        value = f"{self.value:.3f} | {low:.3f} to {high:.3f}" if self.count else "not run | "
        return f"| {self.title} | {self.count} | {value} | {wanted} | {self.met} | {self.prototype} |"


def share(
    title: str,
    records: Iterable[Record],
    judge: Judge,
    limit: float | None = None,
    most: bool = False,
    prototype: str = "",
) -> Line:
    """A share of records with its Wilson interval; a record that is judged None does not count."""
    answers = [a for a in map(judge, records) if a is not None]
    hits = sum(answers)
    return Line(title, len(answers), hits / max(len(answers), 1), wilson(hits, len(answers)), limit, most, prototype)


def quantile(
    title: str, values: Sequence[float], q: float, limit: float | None = None, most: bool = False, prototype: str = ""
) -> Line:
    """A quantile of values with its bootstrap interval."""
    value = float(np.quantile(values, q)) if len(values) else float("nan")
    return Line(title, len(values), value, bootstrap(values, q), limit, most, prototype)


def mean(
    title: str, values: Sequence[float], limit: float | None = None, most: bool = False, prototype: str = ""
) -> Line:
    """A mean with its normal interval."""
    if not values:
        return Line(title, 0, float("nan"), (float("nan"),) * 2, limit, most, prototype)
    value, half = float(np.mean(values)), 1.96 * float(np.std(values)) / np.sqrt(len(values))
    return Line(title, len(values), value, (value - half, value + half), limit, most, prototype)


def removed(record: Record) -> float | None:
    """Share of the excess gap that is gone: 1 - (after^2 - floor^2) / (before^2 - floor^2), not above 1.

    Nothing is gone where the file that came out cannot be read; None where there is no excess to begin with.
    """
    excess = record.gap_before_um**2 - record.floor_um**2
    if excess <= 0:
        return None
    if record.gap_after_um is None:
        return 0.0
    return 1 - max(record.gap_after_um**2 - record.floor_um**2, 0.0) / excess


def worse(record: Record) -> bool:
    """Whether the machine file that came out is worse than the one that went in, or cannot be read."""
    return record.gap_after_um is None or record.gap_after_um > WORSE * record.gap_file_um


def lines(records: Sequence[Record]) -> list[Line]:
    """All lines, those of families that were not run too."""
    of = {name: [r for r in records if r.family == name] for name in FAMILIES}
    single, deleted = of["single"], of["deleted"]
    far, near = ([r for r in deleted if (r.closest < CLOSE) == lone] for lone in (True, False))
    gone = [x for x in map(removed, single) if x is not None]
    false, besides = ([float(r.false_names) for r in rows] for rows in (single, of["two"] + of["three"]))
    paced = [r.per_300_rows for r in records if r.rows]
    named: Judge = lambda r: bool(r.reported)  # noqa: E731
    return [
        share("one effect 5 to 20 um: first name right", single, lambda r: r.first_right, 0.97, prototype="0.98"),
        share("one effect 5 to 20 um: true name in the set", single, lambda r: r.in_set, 0.99, prototype="0.99"),
        mean("one effect 5 to 20 um: mean size of the set", [r.set_size for r in single if r.set_size], 1.3, True),
        mean("one effect 5 to 20 um: wrong names a scenario", false, prototype="0.15 to 0.20"),
        share("one effect 2.5 um: first name right", of["weak"], lambda r: r.first_right, 0.88, prototype="0.88"),
        share("one effect 2.5 um: true name in the set", of["weak"], lambda r: r.in_set),
        share("clean null: any name", of["clean"], named, 0.02, True, "0.038"),
        share("null with 1 um clutter: any name", of["clutter"], named, 0.05, True, "0.04 to 0.10"),
        share("null, clean or cluttered: said to be unknown", of["clean"] + of["clutter"], lambda r: r.unknown),
        share("foreign effect: said to be unknown", of["foreign"], unknown_or_right, 0.97, prototype="0.99"),
        share("name deleted, no close relative: confident wrong name", far, confident, 0.05, True, "0.10"),
        share("name deleted, a close relative: family right or unknown", near, family_or_unknown, 0.90),
        share("software and set-up mistakes: named", of["mistake"], mistake_named, 28 / 30),
        share("two effects: both right", of["two"], lambda r: r.all_right, 0.90, prototype="0.90"),
        share("three effects: all right", of["three"], lambda r: r.all_right, 0.85, prototype="0.95"),
        mean("two or three effects: wrong names a scenario", besides),
        quantile("excess gap removed: median", gone, 0.5, 0.97, prototype="0.986"),
        quantile("excess gap removed: worst tenth", gone, 0.1, 0.90, prototype="0.96"),
        share("gap made worse", single, worse, 0.01, True, "0"),
        share("ambiguous pairs: true name in the set before more is measured", of["pair"], lambda r: r.in_set),
        share("ambiguous pairs resolved by 12 poses proposed", of["pair"], lambda r: r.resolved, 0.7, prototype="0.45"),
        share("ambiguous pairs resolved by 12 poses by chance", of["pair"], lambda r: r.resolved_by_random),
        share("line error the file lacks: first name right, where data can tell", of["location"], first_if_told),
        share("line error the file lacks: true name in the set", of["location"], lambda r: r.in_set),
        share("one tool, one direction, in order: true name in the set", of["poor"], lambda r: r.in_set),
        share("110 rows: first name right, where data can tell", of["small"], first_if_told, prototype="0.92"),
        share("110 rows: true name in the set", of["small"], lambda r: r.in_set, prototype="0.92"),
        share("hidden from these poses: any other name", of["blind"], lambda r: r.false_names > 0),
        quantile("seconds of one core for one answer: median", [r.cpu_seconds for r in records], 0.5, 5.0, True),
        quantile("seconds of one core for one answer: 95 %", [r.cpu_seconds for r in records], 0.95),
        quantile("seconds of one core for 300 rows: median", paced, 0.5, 5.0, True),
        quantile("seconds of one core for 300 rows: 95 %", paced, 0.95),
        share("no answer (fault, time out)", records, lambda r: bool(r.error), 0.0, True),
    ]  # fmt: skip


def confident(record: Record) -> bool:
    """A name without a doubt: found, no unknown rest, no aliases beside it."""
    return record.verdict == "found" and bool(record.reported) and not record.unknown and record.set_size == 1


def mistake_named(record: Record) -> bool:
    """The first name; of a wrong pivot the set, since probing does not always tell one rotary axis' point from the
    other's (what is across both moves the same way).
    """
    return bool(record.in_set if record.hidden[0].startswith("pivot") else record.first_right)


def first_if_told(record: Record) -> bool | None:
    """Whether the first name is right; no question where an ideal observer would say several."""
    return None if record.fellows else record.first_right


def unknown_or_right(record: Record) -> bool:
    """Said to be unknown; or named, where even a foreign effect has a row in some catalogue (cable drag, slip)."""
    return record.unknown or bool(record.first_right)


def family_or_unknown(record: Record) -> bool:
    """What is still right when the true name is not to be had."""
    return record.unknown or bool(record.family_right)


HEADING = """## Hidden effects

A machine is simulated with something in it that its machine file does not have, by a generator that shares no code with
ncfix; `ncfix diagnose` gets the machine file and the measurements. Unless a line says otherwise: some 300 poses of a
good design, 3 um of noise a coordinate with tails, outliers and memory, every other effect at once at 1 um in total, 52
to 73 effects that may be hidden, four machines, kinds tcp, probe and length. Machines, shapes, lags and noise are drawn
anew for every seed. What is simulated and how an answer is judged is in `tests/hidden/README.md`. Written by `make
hidden`. "Met" is about the value as it came; the interval says how sure it is with that many scenarios. "Wanted" was
set before anything was run; "prototype" is what a first program came to, which is no part of ncfix, on scenarios of its
own."""


def markdown(records: Sequence[Record], run: str, earlier: str = "") -> str:
    """The whole section: which run, the table, the main figure by topology, kind of data and size; an earlier run."""
    head = "| what | scenarios | value | 95 % interval | wanted | met | prototype |\n|---|---|---|---|---|---|---|"
    counted = [line for line in lines(records) if line.count]
    left_out = ", ".join(name for name in FAMILIES if not any(r.family == name for r in records))
    said = f"{run} {len(records)} scenarios{_sizes(records)}." + (f" Not run: {left_out}." if left_out else "")
    parts = [
        BEGIN,
        HEADING,
        "",
        *wrap(said, 120),
        "",
        head,
        *(line.row() for line in counted),
        "",
        *_breakdown(records),
        *(["", earlier] if earlier else []),
    ]
    return "\n".join([*parts, END])


def _sizes(records: Sequence[Record]) -> str:
    """How many of each family, and of how many there are."""
    count = Counter(r.family for r in records)
    return ": " + ", ".join(f"{name} {n} of {FAMILIES[name].count}" for name, n in count.items()) if count else ""


def _breakdown(records: Sequence[Record]) -> list[str]:
    single = [r for r in records if r.family == "single"]
    if not single:
        return []
    keys: list[Callable[[Record], str]] = [lambda r: r.topology, lambda r: r.kind, lambda r: f"{r.rms_um:.0f} um"]
    parts = ["One effect, first name right:", "", "| group | scenarios | share | 95 % interval |", "|---|---|---|---|"]
    for key in keys:
        for name in sorted({key(r) for r in single}):
            line = share(name, [r for r in single if key(r) == name], lambda r: r.first_right)
            parts.append(
                f"| {name} | {line.count} | {line.value:.3f} | {line.interval[0]:.3f} to {line.interval[1]:.3f} |"
            )
    missed = Counter(
        (r.hidden[0], ", ".join(r.reported) or r.verdict or "no answer") for r in single if not r.first_right
    )
    listed = [f"- {true}: {said}" + (f" ({n} times)" if n > 1 else "") for (true, said), n in sorted(missed.items())]
    return [*parts, "", "Missed:" if listed else "None missed.", "", *listed]


def replaced(text: str, section: str) -> str:
    """A document with its section between the marks replaced, or with the section at its end."""
    if BEGIN in text and END in text:
        return text[: text.index(BEGIN)] + section + text[text.index(END) + len(END) :]
    return f"{text.rstrip()}\n\n{section}\n" if text.strip() else f"{section}\n"
