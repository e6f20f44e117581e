"""Programs cut off after every line, every third in a usual run: never a fault, never a guess."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import FULL
from differential import corpus, product, setups
from differential.canon import Canon
from differential.cases import CASES, Case
from differential.errors import LETTERS, Machine
from differential.judge import Terms, judge

EVERY = 4  # one in so many is also judged by the control


@pytest.mark.parametrize("name", CASES)
def test_cut_after_every_line(
    name: str,
    rs274: Callable[..., Canon],
    machine: Callable[[str], Machine],
    machine_file: Callable[[str], Path],
    tmp_path: Path,
) -> None:
    case = CASES[name]
    model = machine(case.machine)
    axes = "".join(LETTERS[column] for column in (*model.linear, *model.rotary))
    setup = setups.write(tmp_path, case.controls, axes, case.start)
    lines = case.source.splitlines(keepends=True)
    for count in range(1 if FULL else 3 - len(name) % 3, min(len(lines), 16), 1 if FULL else 3):
        source = "".join(lines[:count]).encode()
        outcome = product.fix_text(source, machine_file(case.machine), tmp_path, "--setup", setup, "--allow-refused")
        assert outcome.code in (product.DONE, product.USAGE, product.UNREADABLE, product.REFUSED), outcome.errors
        assert (outcome.text is None) == (outcome.code != product.DONE)
        if outcome.text is not None and (count + len(name)) % EVERY == 0:
            _judge(case, source, outcome, rs274, model)


def test_cut_at_the_start_nothing_is_assumed(machine_file: Callable[[str], Path], tmp_path: Path) -> None:
    """The first lines lost, and with them the start: an axis that is not known yet is not corrected."""
    lines = CASES["straight lines, words absent"].source.splitlines(keepends=True)
    for first in range(1, 5):
        source = "".join(lines[first:])
        outcome = product.fix_text(source, machine_file("three"), tmp_path)
        assert outcome.code in (product.USAGE, product.REFUSED, product.UNREADABLE), outcome.errors
        assert outcome.text is None
        assert outcome.errors


def _judge(case: Case, source: bytes, outcome: product.Outcome, rs274: Callable[..., Canon], model: Machine) -> None:
    """With the missing end put on both, for the control wants one."""
    assert outcome.text is not None
    original, fixed = rs274(source + b"\nM2\n", case.controls), rs274(outcome.text + b"\nM2\n", case.controls)
    if not original.accepted:
        return
    terms = Terms(
        step=model.linear_step,
        rotary_step=model.rotary_step,
        refused=outcome.refused,
        left=outcome.left,
        passed=corpus.passed_by_rule(source),
        tool_length={number: length for number, (length, _) in case.controls.tools.items()},
    )
    verdict = judge(original, fixed, model, terms)
    assert verdict.right, f"{source.decode()}\n{verdict}\n{outcome.errors}"
