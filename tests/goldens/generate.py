"""Writes the generated programs of the goldens, once: `PYTHONPATH=tests:benchmarks python -m goldens.generate`.

The generators are those of the tests. Their texts are kept in `programs.jsonl.xz`, so that the goldens compare what is
made of the same programs whatever becomes of the generators. Run this only to add kinds of programs, and renew the
goldens of the code before the change in the same step.
"""

from __future__ import annotations

import json
import lzma
import random
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import controls
import numpy as np
import programs

from classes.statements import FAMILIES
from compensate.cycles_at_random import LANGUAGES
from differential import (
    fanuc_programs,
    sinumerik_programs,
    test_block_delete,
    test_tnc,
    test_tnc_swivel,
    tnc_five,
    unsaid,
)
from differential.cases import CASES
from differential.dressing import dressed
from differential.generator import Generator
from differential.tnc_programs import Maker
from differential.tnc_swivel import SwivelMaker
from metamorphic import iso_writers, klartext_writers, siemens_writers, test_heidenhain, test_iso, test_siemens
from metamorphic.harness import Write, route
from ncfix.machine import load
from program import generated

HERE = Path(__file__).parent
ARCHIVE = HERE / "programs.jsonl.xz"
TABLE = str(HERE.parents[1] / "examples" / "machines" / "wCAYFXZSt.toml")


class Text(NamedTuple):
    """A program: its kind, the control that it is for, the rotary axes that it names, and its text."""

    kind: str
    dialect: str
    rotary: str
    text: str


def linuxcnc() -> Iterator[Text]:
    """Modes, expressions and flow at random, and one small program for each way to go wrong."""
    for seed in range(160):
        yield Text("random", "linuxcnc", "", generated.Generator(seed).program())
    for seed in range(160):
        rotary = ("", "A", "BC", "AC")[seed % 4]
        yield Text("modes", "linuxcnc", rotary, Generator(random.Random(seed), rotary).program(20))
    for case in CASES.values():
        yield Text("cases", "linuxcnc", "" if case.machine == "three" else "AC", case.source)


def skipped() -> Iterator[Text]:
    """With block delete."""
    for dialect in ("linuxcnc", "iso", "fanuc"):
        for seed in range(40):
            rotary = ("", "AC")[seed % 2]
            text = test_block_delete.source_of(dialect, seed, rotary)
            yield Text("skips", dialect, rotary, test_block_delete.deletable(text, seed))


def cycles() -> Iterator[Text]:
    """Canned cycles in all frames."""
    for dialect, write in LANGUAGES.items():
        for seed in range(30):
            yield Text("cycles", dialect, "AC", write(dialect, random.Random(f"{dialect} {seed}")))


def fanuc() -> Iterator[Text]:
    """Frames in frames."""
    for seed in range(150):
        yield Text("frames", "fanuc", "AC", fanuc_programs.Author(seed).program())
    for seed in range(70):
        dialect = ("fanuc", "haas", "mitsubishi")[seed % 3]
        yield Text("flat", dialect, "AC", fanuc_programs.Author(1000 + seed, flat=True).program())


def siemens() -> Iterator[Text]:
    """All that there is a manual's page for, patterns of holes, loops."""
    for seed in range(190):
        yield Text("pages", "siemens", "AC", sinumerik_programs.Author(seed).program())
    for seed in range(40):
        yield Text("patterns", "siemens", "AC", sinumerik_programs.patterned(seed))
        yield Text("loops", "siemens", "AC", sinumerik_programs.looped(seed))


def heidenhain() -> Iterator[Text]:
    """Flat programs, tilted planes and tip control, dressed in several manners."""
    for seed in range(120):
        text = Maker(seed, test_tnc.control(), "INCH" if seed % 10 == 9 else "MM").program(8)
        yield Text("plain", "heidenhain", "", text if seed % 3 else dressed(text, seed))
    for seed in range(70):
        text = SwivelMaker(seed, test_tnc_swivel.control()).program(2)
        yield Text("swivel", "heidenhain", "BC", dressed(text, seed) if seed % 3 else text)
    for seed in range(90):
        yield Text("five", "heidenhain", "BC", tnc_five.program(seed, test_tnc_swivel.MODEL))


def unsaid_axes() -> Iterator[Text]:
    """Frames with cycles, machine coordinates and tool changes, behind which one axis or all are named."""
    for dialect in unsaid.LANGUAGES:
        for _, text in unsaid.texts(dialect, range(2)):
            yield Text("unsaid", dialect, "BC" if dialect == "heidenhain" else "AC", text)


def statements() -> Iterator[Text]:
    """Every statement with some subsets of its words."""
    for family in FAMILIES:
        for case in family.some(95, 20261123):
            yield Text("statements", family.dialect, "", case.text)


def routes() -> Iterator[Text]:
    """One path written in many ways."""
    machine = load(TABLE)
    common = [write for each in test_iso.COMMON for write in (each.left, each.right)]
    macro = [write for each in test_iso.MACRO for write in (each.left, each.right)]
    five: Sequence[Write] = [
        iso_writers.by_tip(machine),
        iso_writers.in_axes(machine),
        iso_writers.by_direction(machine),
        iso_writers.by_angles(machine),
        *(iso_writers.in_plane(machine, form) for form in test_iso.FORMS.values()),
    ]
    for dialect in ("linuxcnc", "iso", "fanuc", "haas", "mitsubishi"):
        yield from routed(dialect, common, False)
        if dialect not in ("linuxcnc", "iso"):
            yield from routed(dialect, macro, False)
        if dialect in ("fanuc", "mitsubishi"):
            yield from routed(dialect, five, True)
    by_siemens = [write for each in test_siemens.RELATIONS for write in (each.left, each.right)]
    yield from routed("siemens", by_siemens, False)
    five = [siemens_writers.by_tip(machine), siemens_writers.in_axes, siemens_writers.in_frame(machine)]
    five += [siemens_writers.in_plane(machine), siemens_writers.in_plane_by_vector]
    calm = [siemens_writers.by_vector(machine), siemens_writers.by_angles(machine)]
    yield from routed("siemens", five, True)
    yield from routed("siemens", [lambda path, w=write: w(siemens_writers.calm(path)) for write in calm], True)
    by_klartext = [write for each in test_heidenhain.FLAT for write in (each.left, each.right)]
    yield from routed("heidenhain", by_klartext, False)
    relations = [make(machine) for make in test_heidenhain.FIVE.values()]
    yield from routed("heidenhain", [write for each in relations for write in (each.left, each.right)], True)
    yield from routed("heidenhain", [klartext_writers.in_axes], True)


def routed(dialect: str, writers: Sequence[Write], rotary: bool) -> Iterator[Text]:
    """Two routes for each writer, one text only once."""
    seen = set()
    for seed in range(2):
        for write in writers:
            text = write(route(np.random.default_rng(20261121 + seed), rotary))
            if text not in seen:
                seen.add(text)
                yield Text("routes", dialect, "AC" if rotary else "", text)


def long_ones() -> Iterator[Text]:
    """The first blocks of the programs of the benchmarks, long enough for several parts."""
    for style in programs.STYLES:
        yield Text("long", "linuxcnc", "BC", "".join(line + "\n" for line in programs.lines(600, style)))
    for control in controls.OTHERS:
        for style in control.programs.STYLES:
            text = "".join(line + "\n" for line in control.programs.lines(600, style))
            yield Text("long", control.dialect, "BC", text)


KINDS = (linuxcnc, skipped, cycles, fanuc, siemens, heidenhain, unsaid_axes, statements, routes, long_ones)


def named() -> Iterator[dict[str, Any]]:
    """All programs with their names: `fanuc/cycles-007`."""
    counts: dict[str, int] = {}
    for make in KINDS:
        for kind, dialect, rotary, text in make():
            name = f"{dialect}/{kind}"
            counts[name] = counts.get(name, -1) + 1
            yield {"name": f"{name}-{counts[name]:03}", "dialect": dialect, "rotary": rotary, "text": text}


def main() -> None:
    """Write the archive."""
    lines = [json.dumps(each) for each in named()]
    ARCHIVE.write_bytes(lzma.compress("\n".join(lines).encode(), preset=9 | lzma.PRESET_EXTREME))
    print(f"{len(lines)} programs, {sum(map(len, lines))} bytes, {ARCHIVE.stat().st_size} compressed")


if __name__ == "__main__":
    main()
