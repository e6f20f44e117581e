"""All readers of files, fed with damaged files: each is read or refused in words, in bounded time.

    PYTHONPATH=tests python -m robustness.readers --seconds 600

goes through all readers in turn until the time is over, and keeps what went wrong in `tests/robustness/found`, one file
a case, named by its reader. The suite runs these cases again, and some new ones.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from types import FrameType

from certificate.planting import GIVEN, LANGUAGES, SETUP, Writer, machine
from ncfix.batch.journal import JOURNAL, Journal
from ncfix.certificate.certificate import loads as load_certificate
from ncfix.certificate.proof import prove
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import traced
from ncfix.control.setup import Setup
from ncfix.control.setup_file import loads as load_setup
from ncfix.control.tool_files.tables import load_tool_table
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine
from ncfix.machine import loads as load_machine
from ncfix.measure.reader import reads as read_measurement
from ncfix.project import Project
from ncfix.tables.forms import lint_files
from ncfix.text.dialect import get
from ncfix.text.reader import read

ROOT = Path(__file__).parents[2]
FOUND = Path(__file__).parent / "found"
LONGEST = 10
"""s, that a reader may take for one file."""
Reader = Callable[[bytes], None]

EXTRAS: Mapping[str, tuple[bytes, ...]] = {
    "linuxcnc": (
        b"o1 while [#1 LT 3]",
        b"o1 endwhile",
        b"#1=[#1+1]",
        b"G33 Z1 K2",
        b"G10 L2 P1 X1",
        b"@5 ^30",
        b"G38.2 Z-1",
        b"/G55",
        b"/2 G1 X7. Y8.",
    ),
    "iso": (b"G81 X1 Y1 Z-5 R2", b"G68 R30", b"G92 X0", b"G41 D1", b"G2 X1 R1", b"#100=1", b"/G55", b"/2 G0 Z9."),
    "fanuc": (
        b"IF[#1EQ2]GOTO10",
        b"G65 P9000 A1",
        b"G68.2 X1 Y1 Z1 I1 J2 K3",
        b"G53.1",
        b"#101=#5041",
        b"M98 P100 L2",
        b"/G55",
        b"/2 G69",
    ),
    "siemens": (
        *(b"TRANS X1", b"ROT RPL=30", b"CYCLE81(10,0,2,-5)", b"R1=R2*2", b"IF R1>2 GOTOF A", b"A:", b"MCALL CYCLE83("),
        *(
            b'CYCLE800(1,"T",200000,57,20,-30,5,30,0,0,0,0,0,-1)',
            b"G2 CR=5 X1",
            b"G1 AP=30 RP=5",
            b"DEF REAL B",
            b"/G500",
            b"/1 AROT Z20",
        ),
    ),
    "heidenhain": (
        *(b"CYCL DEF 200 DRILLING Q200=2 ~", b"Q201=-5", b"CALL LBL 1 REP 3", b"LBL 1", b"Q1 = Q2 * 3", b"CC X+1 Y+1"),
        *(
            b"PLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN",
            b"CP IPA+90 DR+",
            b"FN 9: IF +Q1 EQU +2 GOTO LBL 1",
            b"LN X+1 NX0.1",
            b"/L Z+9 FMAX",
            b"/CYCL DEF 7.1 X+3",
        ),
    ),
}
"""Lines of each language besides those of plain programs."""
PIECES: tuple[bytes, ...] = (
    *(
        b"X1",
        b"Y-2.5",
        b"Z.1",
        b"--",
        b"..",
        b",",
        b"1e999",
        b"nan",
        b"inf",
        b"-",
        b"99999999999999999999",
        b"1,5",
        b"=",
    ),
    *(
        b"\x00",
        b"\xff",
        b"\xef\xbb\xbf",
        b"\t",
        b"\r",
        b"\n",
        b"(",
        b")",
        b"[",
        b"]",
        b"{",
        b"}",
        b'"',
        b"'",
        b";",
        b"%",
    ),
    *(
        b"/",
        b"\\",
        b"#",
        b"$",
        b"~",
        b"*",
        b"G0",
        b"G1",
        b"G2",
        b"G91",
        b"M99",
        b"true",
        b"null",
        b"[[effect]]",
        b"[axis.X]",
    ),
)
FILES: Mapping[str, Sequence[str]] = {
    "machine": (
        "examples/machines/dmu50.toml",
        "examples/machines/three_axis.toml",
        "tests/goldens/machines/play.toml",
    ),
    "setup": ("examples/programs/siemens.setup.toml", "tests/goldens/setup.toml"),
    "measurement": ("examples/guide/rtest.csv", "examples/guide/laser.csv", "examples/guide/autumn.csv"),
}
PROJECT = b'machine = "mill.toml"\noutput = "out"\n[options]\ntolerance_um = 2.0\n[[programs]]\nmatch = "a/*.nc"\n'
TOOLS = (
    b"T1 P1 Z120.5 D10 ; drill\nT2 P2 Z80 D3\n",
    b"tool,length,radius\n1,120.5,5\n2,80,1.5\n",
    b"BEGIN TOOL .T MM\nT NAME L R DL DR\n1 DRILL +120.5 +5 +0 +0\n[END]\n",
)
RECORD = b'{"name": "a.nc", "digest": "0", "source": "/a.nc"}\n{"schema": 1, "name": "b.nc", "key": "1"}\n'
CERTIFICATE = b'{"schema": 1, "verdict": "proved", "original": {"sha256": "b"}, "corrected": {"sha256": "c"}}'
TABLES = (
    b"N1A1P100A2P-20A3P5;\n%\nN10Q0L2P1R100\n",
    b"-100 -101 -99\n0 0 0\n100 100.2 100.1\n",
    b"$AA_ENC_COMP[0,0,AX1]=0.002\n$AA_ENC_COMP_STEP[0,AX1]=10\n$AA_ENC_COMP_MIN[0,AX1]=0\nM17\n",
    b"BEGIN X.COM MM DATUM:+0 DIST:100\nNR AXISPOS BACKLASH 1\n0 +0 +0 +0.1\n[END]\n",
)


@cache
def _machine(name: str) -> Machine:
    return machine(name)


@cache
def _setup() -> Setup:
    return SETUP


def _program(language: str, text: bytes) -> None:
    traced(read(text, "part", get(language)), _machine("table"), _setup())


def _corrected(language: str, text: bytes, name: str = "three") -> None:
    """Correct it, and let the second reader judge: where both follow it they must agree."""
    program, known = read(text, "part", get(language)), _machine(name)
    fixed = fix_program(program, known, _setup(), FixOptions(figures=False, allow_refused=True, force=True))
    if b"ncfix" in text.lower():
        return
    proof = prove(text, fixed.text, known, GIVEN, language)
    assert not proof.faults, f"{proof.faults[:3]}\n{fixed.text.decode('latin-1')}"


def _second(language: str, text: bytes) -> None:
    prove(text, text[: len(text) // 2] + text[len(text) // 2 + 9 :], _machine("table"), GIVEN, language)


def _tool_table(text: bytes) -> None:
    with tempfile.NamedTemporaryFile(suffix=".csv" if text.startswith(b"tool") else ".t") as file:
        file.write(text)
        file.flush()
        load_tool_table(file.name)


def _project(text: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "ncfix.toml"
        path.write_bytes(text)
        found = Project.load(str(path))
        found.settings(str(Path(folder) / "a" / "part.nc"))


def _journal(text: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / JOURNAL).write_bytes(text)
        Journal(folder)


def _readers() -> Iterator[tuple[str, Reader]]:
    for language in LANGUAGES:
        yield f"program.{language}", partial(_program, language)
        yield f"corrected.{language}", partial(_corrected, language)
        yield f"second.{language}", partial(_second, language)
        for name in ("table", "play"):
            yield f"{name}.{language}", partial(_corrected, language, name=name)
    yield "machine", lambda text: load_machine(text) and None
    yield "setup", lambda text: load_setup(text.decode("latin-1")) and None
    yield "measurement", lambda text: read_measurement(text, _machine("table")) and None
    yield "tools", _tool_table
    yield "project", _project
    yield "journal", _journal
    yield "certificate", lambda text: load_certificate(text, "certificate") and None
    yield "tables", lambda text: lint_files({"table.txt": text}) and None


READERS = dict(_readers())


@cache
def seeds(reader: str) -> tuple[bytes, ...]:
    """Sound files for a reader."""
    kind, _, language = reader.partition(".")
    if language:
        rng = random.Random(reader)
        turns = {"linuxcnc": "", "iso": "turned"}.get(language, "tilted" if kind == "table" else "turned")
        plain = []
        for k, length in enumerate((5, 5, 3, 3)):
            five, frame = kind == "table" and k == 3, turns if k < 2 else ""
            plain.append(Writer(language, rng, bool(k % 2), five, {}, [], frame).program(length))
        lines = EXTRAS[language]
        return tuple(plain + [_with(text, lines, rng) for text in plain])
    if kind in FILES:
        return tuple((ROOT / path).read_bytes() for path in FILES[kind])
    others = {"tools": TOOLS, "project": (PROJECT,), "journal": (RECORD,), "certificate": (CERTIFICATE,)}
    return others.get(kind, TABLES)


def _with(text: bytes, lines: Sequence[bytes], rng: random.Random) -> bytes:
    rows = text.split(b"\n")
    for line in lines:
        rows.insert(rng.randrange(5, len(rows)), line)
    return b"\n".join(rows)


def damaged(text: bytes, rng: random.Random) -> bytes:
    """The file with one to four small accidents."""
    for _ in range(rng.choice((1, 1, 2, 2, 3, 4))):
        at = rng.randrange(len(text) + 1)
        match rng.randrange(7):
            case 0:
                text = text[:at] + rng.choice(PIECES) + text[at:]
            case 1:
                text = text[:at] + text[at + rng.randint(1, 12) :]
            case 2:
                text = text[:at] + bytes([rng.randrange(256)]) + text[at + 1 :]
            case 3:
                rows = text.split(b"\n")
                rows.insert(rng.randrange(len(rows)), rng.choice(rows))
                text = b"\n".join(rows)
            case 4:
                rows = text.split(b"\n")
                del rows[rng.randrange(len(rows))]
                text = b"\n".join(rows)
            case 5:
                rows = text.split(b"\n")
                row = rng.randrange(len(rows))
                words = rows[row].split(b" ")
                rng.shuffle(words)
                rows[row] = b" ".join(words)
                text = b"\n".join(rows)
            case _:
                digits = [place for place, byte in enumerate(text) if byte in b"0123456789"]
                if digits:
                    place = rng.choice(digits)
                    text = text[:place] + rng.choice(PIECES) + text[place + 1 :]
    return text


class HangError(Exception):
    """A reader took too long."""


@contextmanager
def in_time() -> Iterator[None]:
    """Raise `HangError` after `LONGEST` seconds of processor time."""

    def stop(_signal: int, _frame: FrameType | None) -> None:
        raise HangError(f"more than {LONGEST} s")

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def went(reader: str, text: bytes) -> str:
    """What came of a file: "read", "refused", or the fault."""
    try:
        with warnings.catch_warnings(), in_time():
            warnings.simplefilter("ignore")
            READERS[reader](text)
    except NcfixError:
        return "refused"
    except Exception:
        return traceback.format_exc()
    return "read"


def keep(reader: str, text: bytes) -> Path:
    """Keep a case that went wrong."""
    FOUND.mkdir(exist_ok=True)
    path = FOUND / f"{reader}-{hashlib.sha256(text).hexdigest()[:10]}.bin"
    path.write_bytes(text)
    return path


def kept() -> list[Path]:
    """All cases that went wrong once."""
    return sorted(FOUND.glob("*.bin")) if FOUND.is_dir() else []


def main() -> int:
    """Feed all readers until the time is over; exit code 1 if anything went wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--only", default="", help="readers whose names contain this")
    asked = parser.parse_args()
    rng, counts, wrong = random.Random(asked.seed), Counter[tuple[str, str]](), set[str]()
    end = time.monotonic() + asked.seconds
    names = [name for name in READERS if asked.only in name]
    while time.monotonic() < end:
        for name in names:
            text = damaged(rng.choice(seeds(name)), rng)
            what = went(name, text)
            if what not in ("read", "refused"):
                last = what.strip().splitlines()
                sign = name.partition(".")[0] + last[-1][:60] + last[-3][:80]
                if sign not in wrong:
                    wrong.add(sign)
                    print(f"{keep(name, text)}\n{what}", flush=True)
                what = "FAULT"
            counts[name, what] += 1
    for name in names:
        print(name, *(f"{what}: {counts[name, what]}" for what in ("read", "refused", "FAULT") if counts[name, what]))
    print(f"{sum(counts.values())} cases, {len(wrong)} different faults, seed {asked.seed}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
