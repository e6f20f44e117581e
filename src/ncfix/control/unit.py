"""A text while it is executed: a program, one of several that stand in a file, or the file of a subprogram."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Sequence
from copy import copy
from typing import Any, Generic, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from ncfix.control.lane_tables import LaneTables
from ncfix.control.stage import Lookahead
from ncfix.text.tree import Program, Template, view

P = TypeVar("P")
"""What a language works out of a shape: its plan, with `skip` (which switches of block delete) and `lane`."""


class TextUnit(ABC, Generic[P]):
    """Blocks from `begin` up to `stop` of a program, with the plans of their shapes.

    external  the file that it comes from; empty for what stands in the main program's own text
    plans     by shape, made when first asked for; units of one program share them
    template  index of each block's shape; `first`: where its numbers begin among `numbers`
    operations  what the control structures of blocks come down to, see `flow`; made when a block is first executed
    ahead     what the fast lane has seen of the blocks to come
    """

    def __init__(
        self,
        program: Program,
        plan_of: Callable[[Template], P],
        external: str = "",
        blocks: tuple[int, int] | None = None,
        plans: list[P | None] | None = None,
    ) -> None:
        self.plan_of = plan_of
        self.external = external
        self.plans: list[P | None] = [] if plans is None else plans
        self.take(program, *(blocks or (0, len(program))))

    def take(self, program: Program, begin: int, stop: int) -> None:
        """Become a text of these blocks."""
        self.program, self.begin, self.stop = program, begin, stop
        self.plans += [None] * (len(program.templates) - len(self.plans))
        self.template: Sequence[int] = view(program.template)
        self.first: Sequence[int] = view(program.first_number)
        self.numbers: Sequence[float] = view(program.numbers)
        self.operations: dict[int, Any] = {}
        self.ahead = Lookahead()
        self._lanes: Any = None
        self._stops: NDArray[np.int64] | None = None

    def followed_by(self, program: Program) -> Self:
        """The next part of the same program: its templates are those of this one, and more."""
        part = copy(self)
        part.take(program, 0, len(program))
        return part

    def plan(self, block: int) -> P:
        """What a block does."""
        shape = self.template[block]
        return self.plans[shape] or self.plan_of_shape(shape)

    def plan_of_shape(self, shape: int) -> P:
        """What blocks of a shape do."""
        plan = self.plans[shape]
        if plan is None:
            plan = self.plans[shape] = self.plan_of(self.program.templates[shape])
        return plan

    def all_plans(self) -> list[P]:
        """The plans of all shapes."""
        return [self.plan_of_shape(shape) for shape in range(len(self.plans))]

    def blocks_of(self, shapes: Collection[int]) -> list[int]:
        """The blocks of some shapes, in order."""
        if not shapes:
            return []
        found = np.flatnonzero(np.isin(self.program.template[self.begin : self.stop], list(shapes))) + self.begin
        return found.tolist()

    # -- for the fast lane --------------------------------------------------------------------------------------------

    @property
    def lanes(self) -> Any:
        """The lanes of all shapes as columns."""
        if self._lanes is None:
            self._lanes = self.tables()
        return self._lanes

    @abstractmethod
    def closed(self) -> NDArray[np.bool_]:
        """(s,) shapes that cannot go through the fast lane."""

    def tables(self) -> Any:
        """The lanes of all shapes as columns, made once."""
        plans: list[Any] = self.all_plans()
        return LaneTables.of([plan.lane for plan in plans])

    def lane_end(self, block: int) -> int:
        """The first block from `block` on that cannot go through the fast lane."""
        if self._stops is None:
            shapes = self.program.template[self.begin : self.stop]
            self._stops = np.append(np.flatnonzero(self.closed().take(shapes)) + self.begin, self.stop)
        return int(self._stops[np.searchsorted(self._stops, block)])
