"""Fanuc programs made up at random, of words that LinuxCNC's interpreter takes alike: corrected right, or refused."""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from pathlib import Path

import pytest

from differential.canon import Canon
from differential.errors import Machine
from differential.generated import Study
from differential.generator import Generator

CASES = int(os.environ.get("NCFIX_GENERATED", "4"))


class Fanuc(Generator):
    """Leaves out what only LinuxCNC knows, or takes another way, and drills more."""

    def weights(self) -> list[int]:
        return [50, 22, 10, 6, 4, 2, 14]

    def straight(self) -> None:
        """No turns of rotary axes alone: on these controls they get G93, which is another feed mode."""
        axes = self.rng.sample("XYZ", self.rng.randint(1, 3)) + [
            axis for axis in self.rotary if self.rng.random() < 0.5
        ]
        self.block(self.rng.choice(("G0", "G1", "G1")), {axis: self.place() for axis in axes})

    def switch(self) -> None:
        """No centres that are absolute."""
        before = self.rng.getstate()
        if self.rng.randrange(5) != 3:
            self.rng.setstate(before)
            super().switch()

    def offset(self) -> None:
        """No turned offsets and no G92.1; G92 is on until another G92."""
        if self.incremental:
            self.incremental = False
            self.lines.append("G90")
        axis = self.rng.choice("XYZ")
        table = f"G10 L2 P{self.rng.randint(1, 3)} X{self.number(self.place())} Y{self.number(3.5)}"
        self.lines.append(self.rng.choice(("G54", "G55", "G56", table, f"G92 {axis}{self.number(self.place())}")))
        self.block("G0", {axis: self.place() for axis in "XYZ"})

    def cycle(self) -> None:
        """Holes with levels of their own, and other motions right behind them."""
        if self.incremental or self.inverse or self.plane != "G17":
            return
        at_level = self.rng.random() < 0.5 and not self.inch  # in inches R and Z would be rounded apart
        self.block("G0", {"Z": 4.0 if at_level else 30.0})
        retract = self.rng.choice(("G98", "G99"))
        kind = self.rng.choice(("G81", "G82 P1", f"G83 Q{self.number(3.0)}", "G85"))
        words = f"X{self.number(self.place())} Y{self.number(self.place())} Z{self.number(-7.5)} R{self.number(4.0)}"
        self.lines.append(f"{retract} {kind} {words}")
        for _ in range(self.rng.randrange(4)):
            level = self.rng.choice(("", "", f" R{self.number(6.0)}", f" Z{self.number(-9.0)}"))
            self.lines.append(f"{self.rng.choice('XY')}{self.number(self.place())}{level}")
        self.lines.append("G80")
        self.motion = ""
        self.block(self.rng.choice(("G0", "G1")), {axis: self.place() for axis in "XYZ"})


def source_of(seed: int, rotary: str) -> str:
    """A program; centres are relative to the start on these controls without saying so."""
    return Fanuc(random.Random(seed), rotary).program(25).replace(" G91.1", "")


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "mitsubishi", "iso"])
def test_programs_made_up_at_random(
    dialect: str,
    rs274: Callable[..., Canon],
    machine: Callable[[str], Machine],
    machine_file: Callable[[str], Path],
    tmp_path: Path,
    figures: Callable[[str], None],
) -> None:
    options = ("--dialect", dialect, "--no-point", "calculator")
    study = Study(rs274, machine, machine_file, tmp_path, source_of, options)
    study.run(range(int(os.environ.get("NCFIX_SEED", "0")), CASES))
    found = study.found
    figures(f"generated, {dialect}: {dict(found)}, {len(study.wrong)} wrong")
    assert not study.wrong, "\n".join(study.wrong[:12])
    assert found["not for the control"] < found["programs"] / 3
    assert found["refused"] < 0.05 * found["motions"]
