"""Programs made up at random, every mode switched in every state: corrected right, or refused with the line."""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from pathlib import Path

from conftest import some
from differential.canon import Canon
from differential.errors import Machine
from differential.generated import Study
from differential.generator import Generator

CASES = int(os.environ.get("NCFIX_GENERATED") or some(12))
REFUSED_SHARE = 0.02


def source_of(seed: int, rotary: str) -> str:
    """A program."""
    return Generator(random.Random(seed), rotary).program(25)


def test_programs_made_up_at_random(
    rs274: Callable[..., Canon],
    machine: Callable[[str], Machine],
    machine_file: Callable[[str], Path],
    tmp_path: Path,
    figures: Callable[[str], None],
) -> None:
    study = Study(rs274, machine, machine_file, tmp_path, source_of)
    study.run(range(int(os.environ.get("NCFIX_SEED", "0")), CASES))
    found = study.found
    figures(f"generated: {dict(found)}, {len(study.wrong)} wrong")
    assert not study.wrong, "\n".join(study.wrong[:12])
    assert found["not for the control"] < found["programs"] / 4
    assert found["refused"] < REFUSED_SHARE * found["motions"]
