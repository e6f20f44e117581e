"""Every feature on its own: corrected right, or left alone with its line named; never anything else."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from differential import corpus, product, setups
from differential.canon import Canon
from differential.cases import CASES, Case
from differential.errors import LETTERS, Machine
from differential.judge import Terms, Verdict, judge

Try = Callable[..., tuple[product.Outcome, Verdict | None]]
DEFAULT = "rotary-then-linear"
ROTARY = [name for name, case in CASES.items() if case.machine in ("four_a", "five_ac", "five_bc")]
TRIED = [(name, DEFAULT) for name in CASES] + [(name, "position") for name in ROTARY]


@pytest.fixture(scope="module")
def tried(
    rs274: Callable[..., Canon],
    machine: Callable[[str], Machine],
    machine_file: Callable[[str], Path],
    tmp_path_factory: pytest.TempPathFactory,
) -> Try:
    """Correct a case and judge it, once; None for the verdict where nothing was written."""
    folder = tmp_path_factory.mktemp("features")

    @cache
    def run(name: str, strategy: str, *options: str) -> tuple[product.Outcome, Verdict | None]:
        case = CASES[name]
        model = machine(case.machine)
        axes = "".join(LETTERS[column] for column in (*model.linear, *model.rotary))
        setup = setups.write(folder, case.controls, axes, case.start)
        chosen = ("--setup", setup, "--strategy", strategy, *options)
        outcome = product.fix_text(case.source, machine_file(case.machine), folder, *chosen)
        if outcome.text is None:
            return outcome, None
        original, fixed = rs274(case.source.encode(), case.controls), rs274(outcome.text, case.controls)
        assert original.accepted, original.error
        return outcome, judge(original, fixed, model, _terms(case, outcome, model))

    return run


@pytest.mark.parametrize(("name", "strategy"), TRIED)
def test_right_or_refused_with_the_line(tried: Try, name: str, strategy: str) -> None:
    case = CASES[name]
    outcome, verdict = tried(name, strategy, "--allow-refused")
    allowed = (product.DONE, product.REFUSED) if case.start else (product.USAGE,)
    assert outcome.code in allowed, outcome.errors
    if verdict is None:
        assert case.expect != "right", outcome.errors
        assert any(outcome.places), outcome.errors
        return
    assert verdict.right, f"{verdict}\n{outcome.errors}"
    assert case.expect != "right" or not outcome.refused, outcome.errors
    assert case.expect != "refused" or outcome.refused


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.expect != "right"])
def test_a_refusal_writes_nothing_unless_allowed(tried: Try, name: str) -> None:
    allowed, _ = tried(name, DEFAULT, "--allow-refused")
    strict, _ = tried(name, DEFAULT)
    refused = bool(allowed.refused) or allowed.text is None
    assert strict.code == (product.REFUSED if allowed.refused else allowed.code), strict.errors
    assert (strict.text is None) == refused


@pytest.mark.parametrize("name", CASES)
def test_every_refused_block_stays_as_it_was(tried: Try, name: str) -> None:
    outcome, _ = tried(name, DEFAULT, "--allow-refused")
    before = CASES[name].source.split("\n")
    after = (outcome.text or b"").decode("latin-1").split("\n")
    assert [line for line in outcome.refused if outcome.text and before[line - 1] not in after] == []


def _terms(case: Case, outcome: product.Outcome, model: Machine) -> Terms:
    return Terms(
        step=model.linear_step,
        rotary_step=model.rotary_step,
        refused=outcome.refused,
        left=outcome.left,
        whole=outcome.whole,
        passed=corpus.passed_by_rule(case.source.encode()),
        tool_length={number: length for number, (length, _) in case.controls.tools.items()},
    )
