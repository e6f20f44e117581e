"""Mutated lines of real programs: whatever comes in, no fault comes out, and no motion changes in silence."""

from __future__ import annotations

import os
import random
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from conftest import some
from differential import corpus, product
from differential.canon import Canon
from differential.errors import Machine
from differential.judge import Terms, judge

CASES = int(os.environ.get("NCFIX_FUZZ") or some(120))
JUDGED = some(60)
HEAD = b"G21 G90 G17 G94 G54\nG0 X10 Y5 Z20\nF300\n"
PIECES = (
    b"G0", b"G1", b"G2", b"G3", b"G91", b"G90", b"G53", b"G28", b"G92", b"G93", b"G81", b"G80", b"G41", b"G20", b"X1",
    b"Y-2.5", b"Z.1", b"I3", b"J-4", b"R2", b"A5", b"F10", b"#1=2", b"X#1", b"[1+2]", b"(", b")", b";", b"/", b"%",
    b"o1", b"sub", b"X1e-5", b"--", b"..", b",", b"\x00", b"\xff", b"\t", b" ", b"\r", b"99999999999999999999",
)  # fmt: skip


def _mutated(line: bytes, rng: random.Random) -> bytes:
    """Mostly as it is; else one to three small accidents."""
    for _ in range(rng.choice((0, 0, 0, 1, 1, 2, 3))):
        at = rng.randint(0, len(line))
        match rng.randrange(5):
            case 0:
                line = line[:at] + rng.choice(PIECES) + line[at:]
            case 1:
                line = line[:at] + line[at + rng.randint(1, 3) :]
            case 2:
                line = line[:at] + bytes([rng.randrange(32, 127)]) + line[at + 1 :]
            case 3:
                line = line[:at] + line[at:] + line[at:]
            case _:
                line = line.swapcase()
    return line


def _programs(folder: Path, count: int, rng: random.Random) -> list[bytes]:
    sources = [entry.path for entry in corpus.entries(folder) if entry.accepted and entry.motions]
    lines = [line for path in rng.sample(sources, 60) for line in path.read_bytes().splitlines()[:200]]
    return [
        HEAD + b"\n".join(_mutated(rng.choice(lines), rng) for _ in range(rng.randint(1, 6))) + b"\nM2\n"
        for _ in range(count)
    ]


def test_mutated_programs(
    shared: Callable[[str], Path],
    rs274: Callable[..., Canon],
    machine: Callable[[str], Machine],
    machine_file: Callable[[str], Path],
    tmp_path: Path,
    figures: Callable[[str], None],
) -> None:
    rng, codes, judged, wrong = random.Random(20261121), Counter[int](), Counter[str](), []
    for number, source in enumerate(_programs(shared("corpus"), CASES, rng)):
        outcome = product.fix_text(source, machine_file("three"), tmp_path, "--assume-zero", "--allow-refused")
        codes[outcome.code] += 1
        if outcome.code not in (product.DONE, product.USAGE, product.UNREADABLE, product.REFUSED):
            wrong.append(f"{source!r}\n{outcome.errors}")
        elif outcome.text is not None and judged["asked"] < JUDGED and number % 2 == 0:
            judged["asked"] += 1
            wrong += _judged(source, outcome, rs274, machine("three"), judged)
    figures(f"fuzz: {sum(codes.values())} programs, exit codes {dict(codes)}, judged {dict(judged)}")
    assert not wrong, "\n\n".join(wrong[:5])
    assert sum(codes.values()) == CASES


def _judged(
    source: bytes, outcome: product.Outcome, rs274: Callable[..., Canon], model: Machine, judged: Counter[str]
) -> list[str]:
    assert outcome.text is not None
    original = rs274(source)
    if not original.accepted:
        judged["not for the control"] += 1
        return []
    judged["compared"] += 1
    terms = Terms(refused=outcome.refused, left=outcome.left, passed=corpus.passed_by_rule(source))
    verdict = judge(original, rs274(outcome.text), model, terms)
    return [] if verdict.right else [f"{source!r}\n{outcome.text!r}\n{verdict}"]
