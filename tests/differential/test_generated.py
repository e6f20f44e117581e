"""Programs made up at random, every mode switched in every state: corrected right, or refused with the line."""

from __future__ import annotations

import os
import random
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from differential import corpus, locality, product, setups
from differential.canon import Canon, Controls
from differential.errors import LETTERS, Machine
from differential.generator import Generator
from differential.judge import Terms, judge

CASES = int(os.environ.get("NCFIX_GENERATED", "24"))
SETUP = Controls(
    offsets={"G54": (12.0, -7.5, 20.0), "G55": (-30.0, 4.0, 11.0), "G56": (5.0, 5.0, 5.0)},
    references={"G28": (0.0, 0.0, 100.0), "G30": (10.0, 20.0, 120.0)},
    tools={1: (64.0, 8.0)},
)
MACHINES = ("three", "table", "four_a", "five_ac", "five_bc")
REFUSED_SHARE = 0.02


def test_programs_made_up_at_random(
    rs274: Callable[..., Canon],
    machine: Callable[[str], Machine],
    machine_file: Callable[[str], Path],
    tmp_path: Path,
    figures: Callable[[str], None],
) -> None:
    found: Counter[str] = Counter()
    wrong: list[str] = []
    for seed in range(int(os.environ.get("NCFIX_SEED", "0")), CASES):
        name = MACHINES[seed % len(MACHINES)]
        model = machine(name)
        axes = "".join(LETTERS[column] for column in (*model.linear, *model.rotary))
        rotary = "".join(axis for axis in axes if axis in "ABC")
        source = Generator(random.Random(seed), rotary).program(25)
        original = rs274(source.encode(), SETUP)
        found["programs"] += 1
        if not original.accepted:
            found["not for the control"] += 1
            continue
        setup = setups.write(tmp_path, SETUP, axes)
        outcome = product.fix_text(source, machine_file(name), tmp_path, "--setup", setup, "--allow-refused")
        if outcome.text is None:
            wrong.append(f"seed {seed} {name}: {outcome.errors}")
            continue
        terms = _terms(source, outcome, model)
        verdict = judge(original, rs274(outcome.text, SETUP), model, terms)
        found["motions"] += verdict.motions
        found["refused"] += verdict.refused
        wrong += [f"seed {seed} {name}: {verdict}"] if not verdict.right else []
        wrong += [f"seed {seed} {name}: {text}" for text in locality.complaints(source.encode(), outcome.text)[:2]]
    figures(f"generated: {dict(found)}, {len(wrong)} wrong")
    assert not wrong, "\n".join(wrong[:12])
    assert found["not for the control"] < found["programs"] / 4
    assert found["refused"] < REFUSED_SHARE * found["motions"]


def _terms(source: str, outcome: product.Outcome, model: Machine) -> Terms:
    return Terms(
        step=model.linear_step,
        rotary_step=model.rotary_step,
        refused=outcome.refused,
        passed=corpus.passed_by_rule(source.encode()),
        tool_length={number: length for number, (length, _) in SETUP.tools.items()},
    )
