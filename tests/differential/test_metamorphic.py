"""One program written in many ways: the corrected path is the same, whatever the text looks like."""

from __future__ import annotations

import re
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from differential import paths, product
from differential.canon import Canon
from differential.errors import Machine
from differential.judge import Terms, judge

BASE = """\
G21 G90 G17 G94 G54
G0 X10.5 Y5 Z20
G1 Z-1.25 F300
X60 Y12
G2 X70 Y22 I10 J0
G2 X90 Y2 I0 J-20
G1 X90 Y-140
X-31.007 Y-139.125 Z-2
G2 X-61.007 Y-139.125 I-15 J0
G0 Z30
M2
"""
EXACT = {
    "packed": lambda text: text.replace(" ", ""),
    "spaced": lambda text: re.sub(r"(?<=\d)(?=[.\d])|(?<=[A-Z-])(?=\d)", " ", text),
    "lower case": str.lower,
    "N words": lambda text: "".join(f"N{10 * n} {line}\n" for n, line in enumerate(text.splitlines(), 1)),
    "comments": lambda text: "".join(f"{line} (X{n} then Y9)\n" for n, line in enumerate(text.splitlines())),
    "words in another order": lambda text: "".join(" ".join(line.split()[::-1]) + "\n" for line in text.splitlines()),
    "carriage returns": lambda text: text.replace("\n", "\r\n"),
    "all words on every line": lambda text: _every_motion(text),
}


def _every_motion(text: str) -> str:
    """The motion word repeated on every block."""
    lines, motion = [], ""
    for line in text.splitlines():
        found = re.match(r"G[0-3]\b", line)
        motion = found[0] if found else motion
        lines.append(line if found or line[0] not in "XYZ" else f"{motion} {line}")
    return "\n".join(lines) + "\n"


def _increments(text: str) -> str:
    """G91: every axis word minus the position before; the first move still absolute."""
    at: dict[str, Decimal] = {}

    def word(found: re.Match[str]) -> str:
        axis, value = found[1], Decimal(found[2])
        change, at[axis] = value - at.get(axis, Decimal(0)), value
        return f"{axis}{change}"

    lines = text.splitlines()
    head, rest = lines[:2], lines[2:]
    [re.sub(r"([XYZ])(-?[\d.]+)", word, line) for line in head]
    return "\n".join([*head, "G91", *(re.sub(r"([XYZ])(-?[\d.]+)", word, line) for line in rest)]) + "\n"


def _inches(text: str) -> str:
    def word(found: re.Match[str]) -> str:
        return f"{found[1]}{float(found[2]) / 25.4:.8f}"

    return re.sub(r"([XYZIJF])(-?[\d.]+)", word, text).replace("G21", "G20")


def _radii(text: str) -> str:
    def word(found: re.Match[str]) -> str:
        return f"R{np.hypot(float(found[1]), float(found[2])):g}"

    return re.sub(r"I(-?[\d.]+) J(-?[\d.]+)", word, text)


NEAR = {
    "G91": _increments,
    "G20": _inches,
    "R instead of I J": _radii,
    "G90.1": lambda text: text.replace("G54", "G54 G90.1").replace("I10 J0", "I70 J12").replace("I0 J-20", "I70 J2")
    .replace("I-15 J0", "I-46.007 J-139.125"),
    "full words": lambda text: text.replace("X60 Y12", "X60 Y12 Z-1.25 F300"),
}  # fmt: skip


@pytest.fixture
def fixed(rs274: Callable[..., Canon], machine_file: Callable[[str], Path], tmp_path: Path) -> Callable[[str], Canon]:
    """The corrected program as the control runs it, on the machine with the fine step."""

    def run(text: str) -> Canon:
        outcome = product.fix_text(text, machine_file("table"), tmp_path, "--assume-zero")
        assert outcome.code == product.DONE, outcome.errors
        assert outcome.text is not None
        result = rs274(outcome.text)
        assert result.accepted, result.error
        return result

    return run


@pytest.mark.parametrize("name", EXACT)
def test_the_same_numbers_whatever_the_layout(fixed: Callable[[str], Canon], name: str) -> None:
    one, other = fixed(BASE), fixed(EXACT[name](BASE))
    assert one.kind.tolist() == other.kind.tolist()
    np.testing.assert_allclose(other.end, one.end, atol=1e-9)


@pytest.mark.parametrize("name", NEAR)
def test_the_same_path_in_other_words(
    fixed: Callable[[str], Canon], rs274: Callable[..., Canon], machine: Callable[[str], Machine], name: str
) -> None:
    model, original = machine("table"), rs274(BASE.encode())
    terms = Terms(step=model.linear_step, rapids=False, calls=False)
    verdict = judge(original, fixed(NEAR[name](BASE)), model, terms)
    assert verdict.right, str(verdict)
    assert verdict.compensated == len(original)


def test_the_variants_are_the_same_program(rs274: Callable[..., Canon]) -> None:
    base = rs274(BASE.encode())
    for name, change in (EXACT | NEAR).items():
        variant = rs274(change(BASE).encode())
        assert variant.accepted, f"{name}: {variant.error}"
        for half in (0.5, 1.0):
            rows, fraction = np.arange(len(base)), np.full(len(base), half)
            there, wanted = paths.at(variant, rows, fraction), paths.at(base, rows, fraction)
            np.testing.assert_allclose(there, wanted, atol=1e-6, err_msg=name)


def test_correcting_twice_is_refused(machine_file: Callable[[str], Path], tmp_path: Path) -> None:
    once = product.fix_text(BASE, machine_file("three"), tmp_path, "--assume-zero")
    assert once.text is not None
    twice = product.fix_text(once.text, machine_file("three"), tmp_path, "--assume-zero", name="again.ngc")
    assert (twice.code, twice.text) == (product.REFUSED, None), twice.errors
    assert twice.codes
    forced = product.fix_text(once.text, machine_file("three"), tmp_path, "--assume-zero", "--force", name="again.ngc")
    assert forced.code == product.DONE, forced.errors


def test_the_inverse_machine_brings_the_program_back(
    rs274: Callable[..., Canon], machine_file: Callable[[str], Path], machine: Callable[[str], Machine], tmp_path: Path
) -> None:
    inverse = tmp_path / "inverse.toml"
    text = machine_file("three").read_text()
    negated = re.sub(r"coefficients = \[(.*)\]", lambda m: f"coefficients = [{_negated(m[1])}]", text)
    inverse.write_text(negated)
    once = product.fix_text(BASE, machine_file("three"), tmp_path, "--assume-zero")
    assert once.text is not None
    back = product.fix_text(once.text, inverse, tmp_path, "--assume-zero", "--force", name="back.ngc")
    assert back.text is not None, back.errors
    perfect = machine("perfect_xyz")
    terms = Terms(tolerance=2.5e-3, step=2e-3, calls=False)
    verdict = judge(rs274(BASE.encode()), rs274(back.text), perfect, terms)
    assert verdict.right, str(verdict)


def _negated(values: str) -> str:
    return ", ".join(repr(-float(value)) for value in values.split(","))
