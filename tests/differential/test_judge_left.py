"""Axes that are left where they stand: the judge excuses what that does to the tip, and nothing else."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from differential import product, setups
from differential.canon import Canon
from differential.errors import Machine
from differential.generated import SETUP, terms_of
from differential.judge import Terms, Verdict, judge

LEFT = """\
G21 G90 G17 G94 F500
G0 X-36 Y-13.1 Z30 A-17 C-14.3
G1 Y0.9 X-9 Z13.683 A-76 C-17.572
T1 M6
Z8.001 X-19.46 A3
Y12
G2 X-15 Y16 I4
M2
"""
THEN_NAMED = """\
G21 G90 G17 G94 F500
G0 X8 Y51.4 Z45
T1 M6
G1 Y1 C10
G0 Z21.699 Y71.382
G19
G3 Y78.18 Z35.351 J5.857 K5.602
G1 Y-53.916 X47 Z-12
M2
"""
Run = tuple[bytes, Canon, Machine, Terms]


@pytest.fixture
def corrected(
    rs274: Callable[..., Canon], machine: Callable[[str], Machine], machine_file: Callable[[str], Path], tmp_path: Path
) -> Callable[[str], Run]:
    """A program corrected on the machine with the axes A and C, and what the judge needs to know."""

    def run(source: str) -> Run:
        options = ("--setup", setups.write(tmp_path, SETUP, "XYZAC"), "--dialect", "iso", "--no-point", "calculator")
        outcome = product.fix_text(source, machine_file("five_ac"), tmp_path, *options)
        assert outcome.text is not None, outcome.errors
        return (
            outcome.text,
            rs274(source.encode(), SETUP),
            machine("five_ac"),
            terms_of(source, outcome, machine("five_ac")),
        )

    return run


@pytest.fixture
def verdict(rs274: Callable[..., Canon], corrected: Callable[[str], Run]) -> Callable[..., Verdict]:
    """The verdict on a corrected program, after `change` of its text."""

    def run(source: str, change: Callable[[str], str] = str, said: bool = True) -> Verdict:
        text, original, model, terms = corrected(source)
        terms = terms if said else replace(terms, left={})
        return judge(original, rs274(change(text.decode()).encode(), SETUP), model, terms)

    return run


@pytest.mark.parametrize("source", [LEFT, THEN_NAMED])
def test_what_is_said_to_be_left_is_excused(verdict: Callable[..., Verdict], source: str) -> None:
    found = verdict(source)
    assert found.right, str(found)


def test_what_is_not_said_is_not(verdict: Callable[..., Verdict]) -> None:
    assert not verdict(LEFT, said=False).right


@pytest.mark.parametrize("axis", ["X", "Z"])
def test_other_axes_are_judged_along_the_way_as_ever(verdict: Callable[..., Verdict], axis: str) -> None:
    """The second piece behind the change of tool, 0.01 mm beside its way."""

    def beside(text: str) -> str:
        head, tail = text.split("M6\n")
        lines = tail.split("\n")
        assert "A3" not in lines[1]
        lines[1] = re.sub(rf"{axis}(-?[\d.]+)", lambda word: f"{axis}{float(word[1]) + 0.01:.3f}", lines[1])
        return head + "M6\n" + "\n".join(lines)

    found = verdict(LEFT, beside)
    assert any("line 5" in each for each in found.complaints), str(found)


def test_an_axis_that_moves_though_it_was_said_to_be_left_is_seen(verdict: Callable[..., Verdict]) -> None:
    found = verdict(LEFT, lambda text: re.sub(r"( A3(\.0*)?)\b", r" Y0.95\1", text, count=1))
    assert any("line 5" in each for each in found.complaints), str(found)
