"""The state of a control of the RS274 family while it follows a program: rules and parameters."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping
from dataclasses import replace
from typing import Any

from ncfix.control import control as shared
from ncfix.control.coordinates import INCH, LETTERS
from ncfix.control.expressions import Evaluate, Unknown, Value, nominal
from ncfix.control.frames import Affine
from ncfix.control.setup import Run
from ncfix.control.state import Saved
from ncfix.text.dialect import Dialect
from ncfix.values import mutable
from ncfix_iso.rs274.groups import ARCS, RULES, Rules, with_own_codes
from ncfix_iso.rs274.parameters import NumberedParameters, Store

RUNTIME_BRANCH = "which blocks are executed from here on is known only at run time"


PASSING = frozenset(
    {
        *("setup", "kinematics", "posture", "dialect", "rules", "set_length", "builder", "locate"),
        *("knowledge", "modal", "parameters", "position"),
        *("budget", "row_block", "numbers", "first"),
    }
)
"""Attributes left out by `lasting`: constant, included in part, in a checkpoint, or set by each block."""


LENGTH_CODE = 430
"""G43."""

POLAR = frozenset("@^")
"""Addresses that together define X and Y."""

AXES = frozenset(LETTERS) | POLAR


@mutable
class Block:
    """A block being executed.

    index    index of the block in its program
    values   values of its words by address, in program units
    unknown  addresses whose value is known only at run time; `values` has the nominal one
    axes     bit mask of the axis words, by letter
    turn     of a cycle: angle, degrees, by which each hole is rotated about the origin of the plane
    """

    index: int
    values: dict[str, float]
    unknown: frozenset[str]
    axes: int
    turn: float | None = None

    def get(self, letter: str, default: float = 0.0) -> float:
        """The value of a word; `default` without it."""
        return self.values.get(letter, default)

    def value(self, letter: str) -> Value:
        """The value of a word that the block has, as `Unknown` if it is known only at run time."""
        return Unknown(letter, self.values[letter]) if letter in self.unknown else self.values[letter]


POSITION_READ = "NCF241"


class RS274Control(shared.ProgramControl):
    """State of the control that the steps of a block read and change.

    rules      the dialect's meaning of codes
    parameters numbered and named parameters
    extended   additional work offsets (G54.1) set by the program; `extended_name`: the one in force
    locals     shift that G52 has set, by the work offset then in force
    tip_control  whether tool-centre-point control (G43.4) is on, in a tilted plane or not
    unnamed    axes of the plane that the program has not named since a rotation was switched on or off
    set_length the dialect's step for G43
    left_out   whether the block just executed is left out of a flat program
    pattern    code of that block, in tenths, if it drilled a pattern of holes; else 0
    unwritten  why the program cannot be written out flat; empty if it can
    saved      modal states saved by M70, one entry per call level
    """

    frame_order = ("datum", "additive", "local", "plane", "rotation", "mirror")

    def __init__(self, run: Run, dialect: Dialect, rules: Rules | None = None) -> None:
        super().__init__(run, dialect)
        self.rules: Rules = with_own_codes(rules or RULES[dialect.semantics], dialect)
        self.needs_feed = self.modal.retract_to_r = self.rules.strict
        self.parameters = NumberedParameters()
        self.saved: list[Saved | None] = [None]
        self.extended: dict[str, Mapping[str, float]] = {}
        self.extended_name = ""
        self.locals: dict[int | str, Affine] = {}
        self.tip_control = False
        self.unnamed: frozenset[int] = frozenset()
        self.left_out = False
        self.pattern = 0
        self.unwritten = ""
        self.set_length: Callable[[Any, Block, int], None] = lambda _control, _block, _code: None
        if not self.rules.strict:
            self.watch_rolling()
        self.refresh()

    def lasting(self) -> str | None:
        """See `ProgramControl`."""
        modal, parameters, knowledge = self.modal, self.parameters, self.knowledge
        cycle = replace(modal.cycle, initial=None)
        state = [each for name, each in vars(self).items() if name not in PASSING]
        state.append(replace(modal, motion=0, straight=0, feed=0.0, feed_given=False, cycle=cycle))
        state += (parameters.scopes, parameters.returned, knowledge.missing, knowledge.assumed)
        return repr(state)

    def set_variables(self) -> Store:
        """See `ProgramControl`: the numbered parameters."""
        return self.parameters.numbers.copy()

    def take_variables(self, variables: Store) -> None:
        """See `ProgramControl`."""
        self.parameters.numbers = variables.copy()

    def path_word(self, words: Collection[str]) -> str:
        """See `ProgramControl`: axis words; arc words while G2 or G3 is in force; the level in a canned cycle."""
        leading = set(AXES)
        if self.modal.motion in ARCS:
            leading |= {*"IJKR"}
        elif self.modal.motion in self.rules.cycles:
            leading.add(self.dialect.cycle_of(self.modal.motion).level)
        return min(leading.intersection(words), default="")

    @property
    def closure_mm(self) -> float:
        """See `ProgramControl`; while inches are in force, the limit is that in inches."""
        return self.dialect.closure_mm * (1.0 if self.modal.unit == 1.0 else INCH / 10)

    @property
    def takes_zero_across(self) -> bool:
        """See `ProgramControl`; not in LinuxCNC."""
        return not self.rules.strict

    @property
    def probes_nominally(self) -> bool:
        """Whether only probing results are unknown, and the setup says where probing ends."""
        return self.setup.probed is not None and not self.parameters.inputs

    def anchors(self) -> list[Hashable]:
        """See `ControlState`; parameters of the work offset and of G92 do not count as numbers of the program."""
        frames, tool = self.frames, self.tool_shift
        own = [a + b for a, b in zip(frames.datum.shift, frames.additive.shift, strict=True)]
        system = self.modal.system, self.extended_name
        return [
            (system, own[i], tool[i], self.spatial_anchor(i) if i < len(self.rotation) else None)
            for i in range(len(LETTERS))
        ]

    def take_length(self, number: int) -> None:
        """See `ProgramControl`: like G43 with H."""
        self.set_length(self, Block(0, {"H": float(number)}, frozenset(), 0), LENGTH_CODE)

    def deciding(self, function: Evaluate) -> float:
        """A value that decides where execution continues; if it is unknown, everything after it is refused."""
        value = function(self)
        if isinstance(value, Unknown):
            self.refuse_rest(RUNTIME_BRANCH)
        return nominal(value)

    def read_position(self, name: str, index: int) -> Value:
        """A position that the program reads by this name; unknown, because on the machine it is the corrected one."""
        self.position_is_read(name)
        return Unknown(name, nominal(self.coordinate(index)))

    def position_is_read(self, name: str) -> None:
        """Report that the program reads a position."""
        text = f"the program reads the position {name}; in the corrected program this is the corrected position"
        self.warn(POSITION_READ, text, "motions that depend on it are refused")

    def coordinate(self, index: int) -> Value:
        """Position of an axis in program units, X as a radius; `Unknown` if it is known only at run time."""
        self.use_start_positions((index,))
        value = self.program_position()[index] / self.unit_of(index)
        return Unknown(LETTERS[index], value) if index in self.unknown or index in self.composed.unknown else value
