"""Where statements lead when they are corrected: every statement with subsets of its words, judged by other controls.

The programs are those of `classes.statements`. Those of LinuxCNC and plain ISO code are judged by LinuxCNC's
interpreter, the others by the second controls; what these do not take or do not know is not judged.
`NCFIX_STATEMENTS=2000 pytest tests/differential/test_statement_paths.py` tries as many of each language.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from classes.statements import FAMILIES, Family
from conftest import FULL
from differential import product, setups, unsaid
from differential.canon import Canon
from differential.errors import LETTERS, Machine
from differential.generated import MACHINES, SETUP, terms_of
from differential.judge import judge
from differential.tnc import UnknownError

COUNT = int(os.environ.get("NCFIX_STATEMENTS", "8" if FULL else "4"))
SEED = int(os.environ.get("NCFIX_STATEMENTS_SEED", "1"))
NO_SUCH_ARC = (ArithmeticError, MemoryError, RuntimeWarning, ValueError)
UNKNOWN = (*NO_SUCH_ARC, LookupError, NotImplementedError, SyntaxError, UnknownError)
"""What a second control raises at what it does not know, or stops at. Whatever else it raises is its own fault."""
BY_LINUXCNC = [family for family in FAMILIES if family.dialect in ("linuxcnc", "iso")]
BY_SECOND_CONTROLS = [family for family in FAMILIES if family not in BY_LINUXCNC]


@pytest.mark.parametrize("strategy", unsaid.STRATEGIES)
@pytest.mark.parametrize("family", BY_LINUXCNC, ids=lambda family: family.dialect)
def test_judged_by_linuxcnc(
    family: Family,
    strategy: str,
    rs274: Callable[..., Canon],
    machine: Callable[[str], Machine],
    machine_file: Callable[[str], Path],
    tmp_path: Path,
    figures: Callable[[str], None],
) -> None:
    found, more, wrong = Counter[str](), Counter[str](), []
    for number, case in enumerate(family.some(COUNT, SEED)):
        name = "three" if strategy == "full" else MACHINES[number % len(MACHINES)]
        model, original = machine(name), rs274(case.text.encode(), SETUP)
        axes = "".join(LETTERS[column] for column in (*model.linear, *model.rotary))
        options = ("--setup", setups.write(tmp_path, SETUP, axes), "--allow-refused", "--strategy", strategy)
        dialect = ("--dialect", family.dialect, "--no-point", "calculator")
        outcome = product.fix_text(case.text, machine_file(name), tmp_path, *options, *dialect)
        taken = ("stopped by LinuxCNC", "taken by LinuxCNC")[original.accepted]
        found[f"{taken}, {'stopped by ncfix' if outcome.text is None else 'corrected'}"] += 1
        if outcome.code == product.FAULT:
            wrong.append(f"{case.block!r}, mode {case.mode}: {outcome.errors}")
        if outcome.text is None or not original.accepted:
            more[outcome.errors.partition(": ")[2].splitlines()[0]] += bool(original.accepted and outcome.errors)
            continue
        verdict = judge(original, rs274(outcome.text, SETUP), model, terms_of(case.text, outcome, model))
        found.update(motions=verdict.motions, compensated=verdict.compensated)
        found.update(passed=verdict.passed, refused=verdict.refused)
        if not verdict.right:
            wrong.append(f"{case.block!r}, mode {case.mode}, {name}: {verdict}")
    figures(f"statements, {family.dialect}, {strategy}: {COUNT}, {dict(found)}, {len(wrong)} silent faults")
    assert not wrong, "\n".join(wrong[:12])
    assert not +more or family.dialect != "linuxcnc", more


@pytest.mark.parametrize("strategy", unsaid.STRATEGIES)
@pytest.mark.parametrize("family", BY_SECOND_CONTROLS, ids=lambda family: family.dialect)
def test_judged_by_second_controls(family: Family, strategy: str, figures: Callable[[str], None]) -> None:
    language, found, unknown = unsaid.LANGUAGES[family.dialect], unsaid.Found(), 0
    for case in family.some(COUNT, SEED):
        text = language.marked(case.text)
        try:
            language.steps(text, False)
        except UNKNOWN:
            unknown += 1
            continue
        try:
            unsaid.judge(family.dialect, strategy, f"{case.block!r}, mode {case.mode}", text, found)
        except Exception as error:
            found.faults.append(f"{case.block!r}, mode {case.mode}: {type(error).__name__} {error}")
    counts = ", ".join(f"{count} {fate}" for fate, count in sorted(found.motions.items()))
    figures(
        f"statements, {family.dialect}, {strategy}: {COUNT}, {unknown} not for the second control, {counts}, "
        f"{sum(found.stopped.values())} stopped by ncfix, worst {found.worst * 1e3:.2f} um, "
        f"{len(found.faults)} silent faults"
    )
    assert not found.faults, "\n".join(found.faults[:20])
    assert found.motions["corrected"], f"nothing was judged: {unknown} of {COUNT} not for the second control"
