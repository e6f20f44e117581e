"""Milling cycles of SINUMERIK are corrected at their place and bottom, or refused; judged as holes are.

A usual run takes an eighth of the kinds for each strategy.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from conftest import FULL
from differential import errors
from differential.sinumerik_milling import KINDS, program
from differential.test_siemens import MACHINE
from differential.test_siemens_holes import Tally, judged
from ncfix.machine import load


def test_every_pocket_is_corrected_or_refused(root: Path, figures: Callable[[str], None]) -> None:
    model, machine = errors.load(root / MACHINE), load(str(root / MACHINE))
    for shift, strategy in enumerate(("rotary-then-linear", "full")):
        tally = Tally()
        for number, kind in enumerate(KINDS):
            if FULL or (number + number // 8) % 8 == shift:  # of each cycle another frame and way
                text = program(0, *kind)
                judged(text, strategy, model, machine, tally)
                tally.wrong = [fault if "\n" in fault else f"{kind}: {fault}\n{text}" for fault in tally.wrong]
        assert not tally.wrong, "\n".join(tally.wrong)
        assert tally.holes["corrected"] > 5 * tally.holes["refused"], tally.reasons
        figures(
            f"siemens milling cycles, {strategy}: {dict(tally.holes)}, silently wrong 0; "
            f"worst {tally.worst * 1e3:.3f} um, before {tally.before * 1e3:.1f} um"
        )
