"""Rewritten programs in the role of tables: `ncfix fix` for any control, so that one report compares it with tables.

The folder contains the machine file and the way programs are rewritten; `ncfix emulate gcode DIR --program P` rewrites
P with them. The correction at a pose is that of the strategy, rounded to the control's least increments.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from ncfix.compensate.plan.strategies import Strategy, get_strategy
from ncfix.machine import dumps, loads
from ncfix.plugin import (
    Array,
    FileControl,
    Files,
    Grid,
    Machine,
    NcfixError,
    Option,
    Properties,
    Remarks,
    Request,
    State,
    Tables,
    UsageError,
    Written,
    exact_correction,
)
from ncfix.values import frozen

MACHINE, HOW = "machine.toml", "fix.toml"


@frozen
class Rewriting:
    """The correction of a machine's programs, with the interface of tables."""

    machine: Machine
    strategy: Strategy
    tolerance_um: float
    length: float = 0.0

    def for_tool(self, length: float) -> Rewriting:
        """The same for a tool of this length; a program states which tool it uses."""
        return Rewriting(self.machine, self.strategy, self.tolerance_um, length)

    @property
    def grids(self) -> tuple[Grid, ...]:
        """No grids."""
        return ()

    @property
    def axes(self) -> frozenset[str]:
        """All axes of the machine."""
        return frozenset(self.machine.axis_names)

    @property
    def points(self) -> int:
        """Zero: there are no nodes."""
        return 0

    def at(self, names: Sequence[str], q: Array, direction: Array | None = None) -> Array:
        """See `Tables.at`: the change of the axis words in the rewritten block."""
        columns = [names.index(name) for name in self.machine.axis_names]
        meant = q[:, columns]
        state = State(self.length, 0.0 if direction is None else direction[:, columns])
        linear, turn = self.machine.least_increment
        shift = self.strategy.correct(self.machine, meant, state) - meant
        turned = np.where(self.machine.rotary, turn * np.rint(shift / turn), 0.0)
        if turned.any():
            shift = exact_correction(self.machine, meant, state, turned)
        correction = np.zeros_like(q)
        correction[:, columns] = np.where(self.machine.rotary, turned, linear * np.rint(shift / linear))
        return correction


class Gcode(FileControl):
    """The control `gcode`."""

    name = "gcode"
    title = "Rewritten programs, any control"
    reaches = "L-VOL+, R-VOL+"
    rewrites = True
    any_tool = True
    properties = Properties(
        value_sign="correction",
        input_signal="setpoint",
        position_frame="that of the program",
        unit="that of the program",
        quantum=(0.001, 0.001 * np.pi / 180),
        extrapolation="none: the error model is asked where the program goes",
        bidirectional=True,
        max_points=0,
        max_tables=0,
        combine="one only: no other compensation of the same errors may be active",
    )
    options: ClassVar[Mapping[str, Option]] = {
        "strategy": Option("full", "rotary-then-linear, full, position or thesis, as in ncfix fix"),
        "tolerance_um": Option("1.0", "how far the tool tip may leave the intended path"),
    }
    steps = (
        "Rewrite each program: ncfix fix PROGRAM -m machine.toml --strategy as in fix.toml, for the set-up it runs in.",
        "Switch off every table that corrects the same errors.",
        "Run the rewritten program instead of the original.",
    )
    switch_off = "Run the original program."

    def write(self, request: Request) -> Written:
        """The machine file, and a file on how programs are rewritten."""
        settings = self.settings(request.settings)
        strategy = get_strategy(settings["strategy"])
        tolerance = _tolerance(settings["tolerance_um"])
        how = f'strategy = "{strategy.name}"\ntolerance_um = {tolerance:g}\n'
        return Written({MACHINE: dumps(request.machine).encode(), HOW: how.encode()}, (strategy.leaves,))

    def reached(self, machine: Machine, tables: Tables) -> str:
        """The class reached; R-VOL only if the machine has rotary axes."""
        return self.reaches if machine.rotary.any() else "L-VOL"

    def examined(self, files: Files) -> tuple[Rewriting | None, list[Remarks]]:
        """The rewriting that the files describe."""
        remarks = Remarks.of(HOW, files.get(HOW, b""))
        try:
            how = tomllib.loads(files.get(HOW, b"").decode())
            machine = loads(files.get(MACHINE, b"").decode(), MACHINE)
            return Rewriting(machine, get_strategy(how["strategy"]), _tolerance(str(how["tolerance_um"]))), [remarks]
        except (ValueError, KeyError, TypeError) as error:
            remarks.refuse(0, f"is not what ncfix writes: {type(error).__name__}: {error}")
        except NcfixError as error:
            remarks.refuse(0, error.messages[0].text)
        return None, [remarks]


def _tolerance(text: str) -> float:
    try:
        found = float(text)
    except ValueError:
        found = 0.0
    if not 0.01 <= found <= 1000:
        raise UsageError.of("NCF485", f"tolerance_um={text}", hint="um, from 0.01 to 1000")
    return found
