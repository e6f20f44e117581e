"""Nothing that a user can supply steers a terminal: ESC, BEL, CR and the like are shown, and not obeyed.

Everything is called on a terminal of its own (a pty), with control characters in every name, text and number that is
read. `NCFIX_CONTROLS=1` tries each control character by itself, everywhere; else all of them at once.
"""

from __future__ import annotations

import io
import json
import os
import re
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cli.conftest import LONG_X, PROGRAM, THREE_AXIS
from conftest import FULL
from ncfix.cli.main import run
from ncfix.diagnostics import ExitCode, Message, Place, visible

pty = pytest.importorskip("pty", reason="a system without terminals of this kind")

BIDI = "\u061c\u200e\u200f\u2028\u2029\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"
CONTROLS = "".join(map(chr, (*range(1, 0x20), *range(0x7F, 0xA0)))) + BIDI
PAYLOADS = {
    "all": CONTROLS,
    "title": "\x1b]0;owned\x07\x1b[2J\x1b[31m",
    "back": "safe\rEVIL",
    "eight bits": "\x9b31m\x9d0;owned\x9c",
}
TRIED = list(PAYLOADS) if FULL else ["all", "back"]
if os.environ.get("NCFIX_CONTROLS"):
    PAYLOADS |= {f"U+{ord(char):04X}": char for char in CONTROLS}
    TRIED = list(PAYLOADS)
ALLOWED = "\t\n"
STEERING = re.compile(f"[{re.escape(''.join(set(CONTROLS) - set(ALLOWED)))}]")


@pytest.fixture
def on_a_terminal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[int, bytes]]:
    """Runs a command line in this process on a terminal: the exit code, and all that the terminal gets."""
    monkeypatch.chdir(tmp_path)
    for name, value in {"NO_COLOR": "1", "TERM": "dumb", "COLUMNS": "200"}.items():
        monkeypatch.setenv(name, value)

    def call(*arguments: str, stdin: bytes = b"") -> tuple[int, bytes]:
        master, slave = pty.openpty()
        found: list[bytes] = []

        def listen() -> None:
            try:
                while part := os.read(master, 1 << 16):
                    found.append(part)
            except OSError:  # how Linux says that nobody is there any more
                pass

        listening = threading.Thread(target=listen)
        listening.start()
        before = sys.stdin, sys.stdout, sys.stderr
        sys.stdin = io.TextIOWrapper(io.BytesIO(stdin))
        sys.stdout = io.TextIOWrapper(
            os.fdopen(os.dup(slave), "wb", 0), "utf-8", "backslashreplace", write_through=True
        )
        sys.stderr = io.TextIOWrapper(os.fdopen(slave, "wb", 0), "utf-8", "backslashreplace", write_through=True)
        try:
            code = run(list(arguments))
        finally:
            sys.stdout.close()
            sys.stderr.close()
            sys.stdin, sys.stdout, sys.stderr = before
            listening.join()
            os.close(master)
        return code, b"".join(found)

    return call


def steering(shown: bytes) -> list[str]:
    """What of a terminal's input steers it; the terminal itself puts CR before LF."""
    text = shown.replace(b"\r\n", b"\n").decode("utf-8", "surrogateescape")
    return STEERING.findall(text) + re.findall("[\udc80-\udcff]", text)


def toml(text: str) -> str:
    return json.dumps(text).replace("\x7f", "\\u007f")


def machine(evil: str) -> str:
    key = toml(f"k{evil}")
    given = f"name = {toml('m' + evil)}\ncontrol = {toml('c' + evil)}\n[provenance]\n{key} = {toml(evil)}\n"
    return THREE_AXIS.format(effects="").replace('name = "three axes"', "").strip() + "\n" + given + LONG_X


def files(evil: str) -> dict[str, str | bytes]:
    """File names, with what is in them."""
    raw, inside = evil.encode(), evil.replace("\n", "").replace("\r", "").encode()
    named = evil.replace("\n", "")
    return {
        "part.ngc": PROGRAM,
        "plain.toml": THREE_AXIS.format(effects=LONG_X),
        "machine.toml": machine(evil),
        f"p{named}.ngc": PROGRAM,
        f"m{named}.toml": machine(evil),
        "comment.ngc": b"G21 G90 G94\n(" + inside + b")\nG0 X10 Y10 Z-1\nG1 X110 F600 (" + inside + b")\nM2\n",
        "wrong.ngc": b"G21 G90 G94\nG0 X10\nG1 X1.." + raw + b"2\nM2\n",
        "word.ngc": b"G21 G90 G94\nG1 " + raw + b" X5 F100\nM2\n",
        "named.h": b"0 BEGIN PGM " + raw + b" MM\n1 L X+1 " + raw + b"\n2 END PGM A MM\n",
        "named.mpf": b"DEF REAL A" + raw + b'\nCALL "' + raw + b'"\nT="' + raw + b'"\nG1 X=A' + raw + b"\nM30\n",
        "call.ngc": b"G21 G90 G94\no<" + inside + b"> call\nG0 X#<" + inside + b">\nM2\n",
        "key.toml": machine("") + f"{toml('effect' + evil)} = 1\n",
        "effect.toml": THREE_AXIS.format(effects=LONG_X.replace("EXX", json.dumps("E" + evil)[1:-1])),
        "topology.toml": THREE_AXIS.format(effects="").replace("w F X", f"w F {json.dumps(evil)[1:-1]} X"),
        "broken.toml": b"name = " + raw + b"\n",
        "setup.toml": f"[work_offsets]\n{toml('G54' + evil)} = {{ X = 1 }}\n[tools]\n{toml(evil)} = {{ length = 1 }}\n",
        "tools.tbl": b"T1 P1 Z1.5 ;" + raw + b"\nT" + raw + b"\n",
        "measured.csv": f"# kind: tcp\n# {evil}: {evil}\nX,Y,Z,{evil},dx\n1,2,3,{evil},4\n",
        "other.csv": f"# kind: {evil}\nX,Y{evil}\n1,2\n",
        "result.json": json.dumps({"schema": 1, "files": [{"path": evil, evil: evil}], evil: [{evil: evil}]}),
        "broken.json": b'{"schema": ' + raw + b"}",
        "chain.toml": f"[[chain]]\n{toml('step' + evil)} = {toml(evil)}\n",
        f"d{named}/comp.ini": b"[" + raw + b"]\n",
    }


CALLS = """
check {p}
check {p} -m {m}
check comment.ngc -m plain.toml --assume-zero
check wrong.ngc
check word.ngc
check named.h
check named.mpf --dialect sinumerik
check call.ngc
check part.ngc -m {m} --assume-zero
check {p} --json
check wrong.ngc --json
check missing{e}
check part.ngc --dialect x{e}
fix {p} -m {m} --assume-zero
fix {p} -m {m} -o - --assume-zero
fix comment.ngc -m plain.toml -o - --assume-zero
fix comment.ngc -m plain.toml -o - --flatten --assume-zero
fix part.ngc -m plain.toml -o o{e} --assume-zero
fix part.ngc {p} -m {m} -o out --jobs 2 --assume-zero
fix . -m plain.toml -o out --assume-zero --jobs 1
fix {p} -m plain.toml --in-place --assume-zero
fix {p} -m plain.toml -o - --strategy s{e}
fix part.ngc -m plain.toml -o - --executor x{e}
fix part.ngc -m plain.toml -o - --setup setup.toml
fix part.ngc -m plain.toml -o - --tool-table tools.tbl
fix part.ngc -m plain.toml -o - --offset {e}=1,2,3
fix part.ngc -m plain.toml -o - --tool {e}=x
fix part.ngc -m plain.toml -o - --jobs {e}
fix part.ngc -m plain.toml -o - --assume-zero --subprograms {e}
fix part.ngc -m plain.toml -o {d}/x.ngc --{e}
trace {p} --assume-zero
trace comment.ngc
trace {p} -m {m} --assume-zero --json
trace word.ngc
verify part.ngc {p} -m {m} --assume-zero
verify {p} wrong.ngc -m plain.toml --assume-zero
simulate -m {m} --program {p} --assume-zero
simulate -m {m} --plan measured.csv
machine check {m}
machine show {m}
machine show {m} --json
machine check key.toml
machine check effect.toml
machine check topology.toml
machine check broken.toml
machine check missing{e}
machine {e}
plan -m {m} -o -
plan -m plain.toml --separate {e},EXX
plan -m plain.toml --range {e}=1,2
calibrate measured.csv -m {m} -o new.toml
calibrate other.csv -m plain.toml -o new.toml --effects {e}
diagnose measured.csv -m {m}
diagnose other.csv -m plain.toml --without {e}
export linuxcnc -m {m} -o t{e}
export {e} -m plain.toml -o t
export linuxcnc -m plain.toml -o {d} --set {e}=1
emulate linuxcnc {d} -m {m}
emulate linuxcnc missing{e} -m {m}
report {m} -o {e}.html
report result.json -o -
report result.json broken.json -o x.md
derive -m {m}
derive --chain chain.toml
derive -m plain.toml --effects {e}
effects -m {m}
dialects {e}
explain {e}
{e}
--{e}
completion {e}
plugins --{e}
machine check -
""".strip().splitlines()


@pytest.mark.parametrize("title", TRIED)
def test_nothing_comes_through(title: str, on_a_terminal: Any, tmp_path: Path) -> None:
    evil = PAYLOADS[title]
    words = {"e": evil, **{letter: letter + evil.replace("\n", "") for letter in "pmd"}}
    words |= {"p": f"{words['p']}.ngc", "m": f"{words['m']}.toml"}
    for name, content in files(evil).items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    wrong = []
    for call in CALLS:
        code, shown = on_a_terminal(*(word.format(**words) for word in call.split()), stdin=evil.encode())
        if steering(shown) or b"NCF000" in shown or code == ExitCode.FAULT:
            wrong.append((call, code, steering(shown), shown))
    assert not wrong


def test_bytes_of_a_name_that_are_no_characters(on_a_terminal: Any, tmp_path: Path) -> None:
    name = os.fsencode(tmp_path) + b"/p\x9b\xff.ngc"
    with open(name, "wb") as file:
        file.write(PROGRAM)
    (tmp_path / "machine.toml").write_text(THREE_AXIS.format(effects=LONG_X))
    for call in (
        ["check"],
        ["trace", "--assume-zero", "--json"],
        ["fix", "-m", "machine.toml", "--assume-zero", "-o", "-"],
    ):
        _, shown = on_a_terminal(*call, os.fsdecode(name))
        assert not steering(shown)
        assert b"NCF000" not in shown
        assert b"\\x9b\\xff.ngc" in shown or b"\\udc9b\\udcff" in shown or call[0] == "trace"


def test_data_elsewhere_is_as_it_is(tmp_path: Path, capfdbinary: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a file or a pipe the program is the program, byte for byte where it is not corrected."""
    monkeypatch.chdir(tmp_path)
    comment = b"(" + bytes({*range(1, 0x20), *range(0x7F, 0x100)} - set(b"\n\r")) + b")"
    Path("part.ngc").write_bytes(b"G21 G90 G94\n" + comment + b"\nG0 X10 Y10 Z-1\nG1 X110 F600\nM2\n")
    Path("machine.toml").write_text(THREE_AXIS.format(effects=LONG_X))
    call = ["fix", "part.ngc", "-m", "machine.toml", "--assume-zero", "--dialect", "linuxcnc", "-o"]
    run([*call, "-"])
    piped = capfdbinary.readouterr().out
    run([*call, "out.ngc"])
    assert piped == Path("out.ngc").read_bytes()
    assert comment in piped


def test_a_name_of_several_lines_forges_no_message() -> None:
    message = Message("NCF002", "one\nNCF001: two", Place("a\nNCF003: b", 1), "three\r\nfour")
    assert str(message).splitlines() == ["a\\nNCF003: b:1: NCF002: one\\nNCF001: two", "  hint: three\\r\\nfour"]


def test_what_is_seen_stays() -> None:
    assert visible("G1 X1.5 \u00e9\u00b5\u4e2d \\x1b") == "G1 X1.5 \u00e9\u00b5\u4e2d \\x1b"
    assert visible("a\tb\r\nc\n", lines=True) == "a\tb\nc\n"
    assert visible("\x1b\x07\r\x7f\x9b\u202e\udcff\n") == "\\x1b\\x07\\r\\x7f\\x9b\\u202e\\xff\\n"
    assert visible("a\rb", lines=True) == "a\\rb"


def test_a_batch_shows_how_far_it_is_and_nothing_steers(
    on_a_terminal: Callable[..., tuple[int, bytes]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "machine.toml").write_text(THREE_AXIS.format(effects=LONG_X))
    (tmp_path / "in").mkdir()
    for name in ("a.ngc", "b.ngc", f"w{PAYLOADS['title']}.ngc".replace("/", "")):
        (tmp_path / "in" / name).write_bytes(PROGRAM if len(name) < 6 else b"G1 X1..2\nM2\n")
    code, shown = on_a_terminal("fix", "in", "-m", "machine.toml", "--assume-zero", "-o", "out", "--jobs", "1")
    assert code == ExitCode.USAGE  # a name with control characters is none for an output
    assert steering(shown) == []
    (bad,) = (tmp_path / "in").glob("w*")
    bad.rename(tmp_path / "in" / "w.ngc")
    code, shown = on_a_terminal("fix", "in", "-m", "machine.toml", "--assume-zero", "-o", "out", "--jobs", "1")
    assert code == ExitCode.UNREADABLE
    assert b"3 programs: 2 written, 1 not" in shown
    assert steering(shown) == []
    monkeypatch.setenv("TERM", "xterm")
    options = ("-m", "machine.toml", "--assume-zero", "-o", "out", "--jobs", "1", "--resume")
    code, shown = on_a_terminal("fix", "in", *options)
    assert b"3/3" in shown
    assert b"3 programs: 2 written, 1 not" in shown
