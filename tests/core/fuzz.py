"""The compiled core under sanitizers, fed with damaged programs: `make fuzz-core SECONDS=600`.

    python tests/core/fuzz.py --seconds 600 [--seed 7]

It compiles the core once more, with the sanitizers for addresses and undefined behaviour, in a copy of the sources in
`build/fuzz`, and runs itself there. Programs of plain motions in all languages are damaged and corrected, some of them
by both forms of the core side by side (`twins.both_forms`): every call must have the same bits. Bounds are checked in
the core as it is released, too; the sanitizers see what is not an index: sums that overflow, shifts, memory of others.

A program at which anything goes wrong is kept in `build/fuzz/found`; the exit code is 1 then.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import subprocess
import sys
import time
import traceback
from collections import Counter
from contextlib import nullcontext
from itertools import count
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "fuzz"
FOUND = BUILD / "found"
SANITIZERS = "-fsanitize=address,undefined"
FLAGS = ["-O1", "-g", "-fno-sanitize-recover=all", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=off"]
"""As in `build_core.py`, where they say how numbers are rounded."""
DEFINED = "-fno-sanitize=float-divide-by-zero,pointer-overflow,alignment"
LANGUAGES = ("linuxcnc", "fanuc", "siemens", "heidenhain")
PAIRED = 16
"""One of so many programs goes through both forms of the core: the interpreted one takes a hundred times as long."""
EXTREMES = (
    *(b"0", b"-0", b".", b"-", b"+-1", b"1e9", b"1e308", b"99999999999999999999", b"0.00000000000000000001", b"1..2"),
    *(b"123456789012345678", b"9223372036854775808", b"-.5", b"000000000000000000001", b"1 2", b"nan", b"[1+2]", b"#1"),
)
"""Instead of a number of the program."""


def compile_core() -> None:
    """The sanitized core, in a copy of the sources."""
    for name in ("src", "plugins", "grammars"):
        ignored = shutil.ignore_patterns("*.so", "compiled.txt", "__pycache__")
        shutil.copytree(ROOT / name, BUILD / name, dirs_exist_ok=True, ignore=ignored)
    shutil.copy(ROOT / "build_core.py", BUILD)
    sys.path.insert(0, str(BUILD))
    os.environ["LDFLAGS"] = SANITIZERS
    import build_core

    build_core.FLAGS[:] = [SANITIZERS, DEFINED, *FLAGS]
    for path in build_core.compiled(BUILD, stable=False):
        shutil.copy(path, BUILD / build_core.CORE)


def library(name: str) -> str:
    """Where the compiler has a library of its own."""
    return subprocess.run(
        ["gcc", f"-print-file-name={name}"], capture_output=True, text=True, check=True
    ).stdout.strip()


def environment() -> dict[str, str]:
    """What the run in the copy needs: the sanitizers come first, and Python's own blocks of memory are watched."""
    paths = [BUILD / "src", BUILD / "plugins", ROOT / "tests", ROOT / "benchmarks"]
    return {
        **os.environ,
        "LD_PRELOAD": f"{library('libasan.so')} {library('libubsan.so')}",
        "ASAN_OPTIONS": "detect_leaks=0",
        "UBSAN_OPTIONS": "print_stacktrace=1",
        "PYTHONMALLOC": "malloc",
        "PYTHONPATH": os.pathsep.join(map(str, paths)),
    }


def sources() -> dict[str, bytes]:
    """A sound program of each language: a surface, arcs among the straight motions."""
    import fanuc_programs
    import klartext_programs
    import programs
    import sinumerik_programs

    makers = (programs, fanuc_programs, sinumerik_programs, klartext_programs)
    return {
        language: "\n".join(maker.lines(4100, "mixed")).encode() + b"\n"
        for language, maker in zip(LANGUAGES, makers, strict=True)
    }


def excerpt(text: bytes, rng: random.Random) -> bytes:
    """The head of a program and some of its other lines, with a few accidents."""
    from robustness.readers import damaged

    lines = text.splitlines(keepends=True)
    first = rng.choice((rng.randrange(8, len(lines)), rng.randrange(2450, 2550)))
    chosen = lines[:8] + lines[first : first + rng.choice((5, 40, 80))]
    for _ in range(rng.choice((0, 1, 1, 3))):
        row = rng.randrange(len(chosen))
        words = chosen[row].split(b" ")
        word = rng.randrange(len(words))
        words[word] = words[word][: rng.choice((1, 1, 2))] + rng.choice(EXTREMES)
        chosen[row] = b" ".join(words).rstrip(b"\n") + b"\n"
    whole = b"".join(chosen)
    return damaged(whole, rng) if rng.random() < 0.7 else whole


def fuzz(seconds: float, seed: int) -> int:
    """Correct damaged programs until the time is over; exit code 1 if a form of the core fails or they differ."""
    from core.twins import both_forms
    from ncfix import core
    from ncfix.compensate import FixOptions
    from ncfix.compensate.driver import fix_program
    from ncfix.control.setup import Setup
    from ncfix.diagnostics import NcfixError
    from ncfix.machine import load
    from ncfix.text.reader import read

    assert str(BUILD) in str(core.FOLDER), core.FOLDER
    FOUND.mkdir(exist_ok=True)
    setup, options = Setup(assume_zero=True, no_point="calculator"), FixOptions(tolerance_um=5.0, allow_refused=True)
    machines = [load(ROOT / name) for name in ("benchmarks/five_axis.toml", "examples/machines/wCBXFZYSt.toml")]
    programs, outcomes, calls, began = sources(), Counter[str](), Counter[str](), time.monotonic()
    core.use("compiled")
    for number in count():
        if time.monotonic() - began > seconds:
            break
        rng = random.Random(f"{seed} {number}")
        language, machine = rng.choice(LANGUAGES), rng.choice(machines)
        text = excerpt(programs[language], rng)
        under_way = FOUND / f"{language}-{seed}-{number}.txt"
        under_way.write_bytes(text)  # it stays if the process is ended
        try:
            with nullcontext(Counter[str]()) if number % PAIRED else both_forms() as compared:
                fix_program(read(text, "part", language), machine, setup, options)
            outcomes["corrected"] += 1
        except NcfixError:
            outcomes["refused"] += 1
        except Exception:
            traceback.print_exc()
            outcomes["wrong"] += 1
            continue
        calls.update(compared)
        under_way.unlink()
    print(f"seed {seed}: {dict(outcomes)}; calls that were compared: {dict(calls)}", flush=True)
    return int(outcomes["wrong"] > 0)


def main() -> int:
    """Compile, then fuzz in a process that the sanitizers may end."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.inside:
        return fuzz(given.seconds, given.seed)
    compile_core()
    command = [sys.executable, str(Path(__file__)), "--inside", "--seconds", str(given.seconds)]
    done = subprocess.run([*command, "--seed", str(given.seed)], env=environment(), check=False)
    if done.returncode:
        print(f"exit code {done.returncode}; the programs are in {FOUND}", file=sys.stderr)
    return min(abs(done.returncode), 1)


if __name__ == "__main__":
    sys.exit(main())
