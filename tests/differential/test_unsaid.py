"""After whatever leaves axes unsaid nothing is wrong without a word, in any frame, language and strategy.

`NCFIX_UNSAID=20 pytest tests/differential/test_unsaid.py` judges as many programs of every kind,
from the seed NCFIX_SEED on.
"""

from __future__ import annotations

import os
from collections.abc import Callable

import pytest

from conftest import FULL
from differential import unsaid
from ncfix.control import tcp
from ncfix.control.control import ProgramControl
from ncfix.control.coordinates import Vector
from ncfix.control.moves import TcpState, UnknownAxes

FIRST = int(os.environ.get("NCFIX_SEED", "0"))
SEEDS = range(FIRST, FIRST + int(os.environ.get("NCFIX_UNSAID", "1")))
KINDS = None if os.environ.get("NCFIX_UNSAID") else 8 if FULL else 4
"""Of the 32 or 40 kinds of programs so many are judged by default, others with each strategy."""


@pytest.mark.parametrize("strategy", unsaid.STRATEGIES)
@pytest.mark.parametrize("dialect", unsaid.LANGUAGES)
def test_nothing_is_wrong_without_a_word(dialect: str, strategy: str, figures: Callable[[str], None]) -> None:
    found = unsaid.Found()
    programs = list(unsaid.texts(dialect, SEEDS))
    if KINDS is not None:
        programs = programs[unsaid.STRATEGIES.index(strategy) :: len(programs) // KINDS]
    for name, text in programs:
        unsaid.judge(dialect, strategy, name, text, found)
    counts = ", ".join(f"{count} {fate}" for fate, count in sorted(found.motions.items()))
    figures(
        f"unsaid axes, {dialect}, {strategy}: {len(programs)} programs, {counts}, worst {found.worst * 1e3:.2f} um, "
        f"{sum(found.stopped.values())} programs not followed, {len(found.faults)} silent faults"
    )
    assert not found.faults
    assert not any(reason.startswith("NCF000") for reason in found.stopped)
    assert found.motions["corrected"] > 0


@pytest.mark.parametrize("dialect", unsaid.LANGUAGES)
def test_the_judge_sees_what_was_not_corrected(dialect: str) -> None:
    language = unsaid.LANGUAGES[dialect]
    _, text = next(unsaid.texts(dialect, range(1)))
    meant, done = language.steps(text, False), language.steps(text, True)
    assert sum(abs(a.tip[-1] - b.tip[-1]).max() > 2e-3 for a, b in zip(meant, done, strict=True)) > 3


@pytest.mark.parametrize("dialect", ["fanuc", "iso", "siemens", "heidenhain"])
def test_the_judge_sees_motions_that_are_believed_to_begin_elsewhere(
    dialect: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fault that was there: axes that machine coordinates (G53, SUPA) do not name had the numbers of the tip."""
    converted = tcp.converted

    def left_as_it_was(control: ProgramControl, position: Vector, unknown: UnknownAxes, *states: TcpState) -> bool:
        return states[1] is tcp.MACHINE or converted(control, position, unknown, *states)

    monkeypatch.setattr(tcp, "converted", left_as_it_was)
    found = unsaid.Found()
    for name, text in unsaid.texts(dialect, range(61000, 61002)):
        if ", machine, " in name and not found.faults:
            unsaid.judge(dialect, "position", name, text, found)
    assert found.faults
