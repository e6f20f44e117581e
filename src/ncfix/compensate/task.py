"""What all parts of a program that is corrected while it is read have in common."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ncfix.compensate.following import Resolve, kinematics_of, rotary_names
from ncfix.compensate.options import FixOptions
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.control.parts import Follower, NotInPartsError
from ncfix.control.setup import Setup
from ncfix.machine import Machine
from ncfix.text.dialect import Dialect
from ncfix.text.language import Run, language_of

PART_BYTES = 3 << 20
"""How much text is a part: the columns of a part take about thirty times as much memory."""


@dataclass(frozen=True, slots=True)
class Task:
    """What all parts of a program have in common.

    resolve  gives the text of a subprogram file by its name
    size     bytes of a part
    head     the first bytes of the text, by which it is told what it is; those of the first part, if not given
    """

    machine: Machine
    setup: Setup
    options: FixOptions
    resolve: Resolve | None
    path: str
    dialect: Dialect
    size: int = PART_BYTES
    head: bytes = b""

    def __post_init__(self) -> None:
        numbered = replace(self.dialect, block_numbers=self.options.block_numbers)
        object.__setattr__(self, "dialect", numbered)

    def follower(self) -> Follower:
        """What follows the program; raises `NotInPartsError` if its language is followed as a whole."""
        axes, rotary = self.machine.axis_names, rotary_names(self.machine)
        kinematics = kinematics_of(self.machine)
        return follower_of(self.dialect, Run(self.setup, axes, rotary, self.resolve, kinematics=kinematics))

    def check(self) -> None:
        """Raise `NotInPartsError` for what has to be looked at as a whole."""
        strategy = get_strategy(self.options.strategy)
        if strategy.corrects_orientation or not strategy.follows_path or self.machine.is_perfect:
            raise NotInPartsError(f"the strategy {strategy.name} looks at the whole path at once")
        if self.options.block_numbers == "renumber" and language_of(self.dialect).renumber is not None:
            raise NotInPartsError("all blocks get new numbers")


def follower_of(dialect: Dialect, run: Run) -> Follower:
    """What follows a program part by part; raises `NotInPartsError` if its language is followed as a whole."""
    make = language_of(dialect).follower
    if make is None:
        raise NotInPartsError(f"{dialect.title} is followed as a whole")
    found: Follower = make(dialect, run)
    return found
