"""The correction of programs for a machine's errors: planning, writing, and proof by simulation."""

from __future__ import annotations

from ncfix.arguments import BLOCK_NUMBERS, TOLERANCE_UM, check_choice
from ncfix.values import frozen


@frozen
class FixOptions:
    """Options of `fix`.

    strategy       name of the strategy (`ncfix.compensate.plan.strategies`)
    tolerance_um   how far the tool tip may leave the intended path, along the whole path
    allow_refused  write the program even if motions had to be left uncorrected
    force          correct a program that carries a stamp
    split_rapids   hold the tolerance along rapids too, not only at their ends
    flatten        write the program out flat where blocks are executed from several states (`driver.fix_flat`)
    block_numbers  numbers of inserted blocks, in languages that number every block: "same" as the block that is split,
                   "none", or "renumber" all blocks
    figures        simulate the written program along the whole path (before and after figures)

    Raises `UsageError` NCF025.
    """

    strategy: str = "rotary-then-linear"
    tolerance_um: float = 1.0
    allow_refused: bool = False
    force: bool = False
    split_rapids: bool = False
    flatten: bool = False
    block_numbers: str = "same"
    figures: bool = True

    def __post_init__(self) -> None:
        TOLERANCE_UM.check("tolerance_um", self.tolerance_um)
        check_choice("block_numbers", self.block_numbers, BLOCK_NUMBERS)

    @property
    def tolerance_mm(self) -> float:
        """The tolerance, mm."""
        return self.tolerance_um * 1e-3
