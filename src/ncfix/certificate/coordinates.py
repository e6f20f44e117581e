"""The second reader: the positions of the axes, the coordinates in force, and what is not known of both."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import NamedTuple

import numpy as np

from ncfix.arrays import Array
from ncfix.certificate.model import TipModel
from ncfix.certificate.reading import Family, TextWord
from ncfix.certificate.steps import NAN
from ncfix.certificate.turning import TurnedFrame
from ncfix.values import frozen

SQUARE = 2e-4
"""Largest angle, rad, of a tool that is square to a plane: rotary words have three decimals of a degree."""
CYCLES = re.compile("CYCLE|HOLES|POCKET|SLOT|LONGHOLE")
"""Cycles of SINUMERIK, which may be modal."""
REWRITTEN = re.compile("G11[012]|G16|CT|CIP|RND|CHF|AP|RP")
"""Other words that a correction may rewrite in another form, or after which it may rewrite lines so."""


@frozen
class Given:
    """Values outside the program: offsets, tool lengths, start and reference points by axis letter, mm and degree.

    tools  tool lengths by number, or by name in upper case
    skip   the switches of block delete that are on, or True: all, False: none; None: `prove` examines every position
    """

    offsets: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    tools: Mapping[int | str, float | None] = field(default_factory=dict)
    initial: Mapping[str, float] = field(default_factory=dict)
    references: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    tcp: bool = False
    assume_zero: bool = False
    skip: bool | frozenset[int] | None = None
    workpiece_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inputs: Mapping[str, float] = field(default_factory=dict)
    """Inputs of the error model, by name."""
    pointless: bool = False
    """Numbers without a decimal point count least increments: such programs are not followed."""
    decimal_inches: bool = False
    """A least increment of 0.001 mm becomes 0.0001 inch in blocks in inches."""
    reference_ends_length: bool = False
    """G28 takes the tool length offset away, as on Haas."""


class Loss(NamedTuple):
    """The reason why a program is not followed any further.

    rewritten  a correction may rewrite further lines in another form
    modal      MCALL alone ends the reason
    """

    why: str
    rewritten: bool = False
    modal: bool = False


class FollowedAxes:
    """The positions of the axes, and all that a program has put in force for the meaning of their numbers."""

    def __init__(self, axes: Sequence[str], family: Family, given: Given, model: TipModel | None) -> None:
        self.axes, self.family, self.given, self.model = tuple(axes), family, given, model
        start = 0.0 if given.assume_zero else NAN
        self.at = {axis: given.initial.get(axis, start) for axis in axes}
        self.said = {axis: axis in given.initial and not given.assume_zero for axis in axes}
        self.unit, self.counting = 1.0, False
        self.system = {Family.WORDS: "G54", Family.SINUMERIK: "G500", Family.KLARTEXT: "PRESET"}[family]
        if family is Family.KLARTEXT and "PRESET" not in given.offsets:
            self.system = "G54"
        self.tool: int | str = 0
        self.length: float | None = 0.0 if family is Family.WORDS else self.length_of(self.tool)
        """The tool length in force in coordinates; SINUMERIK and Klartext begin with that of the tool in place."""
        self.between = False
        """The length offset in force is not that of the tool in the spindle, so the length of the tool is not sure."""
        self.tcp = self.asks_tip = given.tcp
        self.turn: TurnedFrame | None = None
        """The turned coordinates in force; then `at` holds numbers of the program, not commands."""
        self.shifts: dict[str, float] = {}
        """Shifts of axes by the program (G92, TRANS), mm or degree."""
        self.local: dict[str, float] = {}
        """Shifts of axes by G52, mm or degree."""
        self.lost: dict[Loss, None] = {}
        """The losses in their order; the first is the reason why the program is not followed."""

    def lose(self, why: str, *, rewritten: bool = False, modal: bool = False) -> None:
        """Follow no further, for a reason; see `Loss`."""
        self.lost.setdefault(Loss(why, rewritten, modal))

    def lose_by(self, name: str) -> None:
        """Follow no further because of a word or code."""
        modal = CYCLES.match(name) is not None
        self.lose(
            f"{name} is not known to the second reader", rewritten=modal or bool(REWRITTEN.match(name)), modal=modal
        )

    @property
    def is_rewritten(self) -> bool:
        """Whether a correction may rewrite lines from here on in another form."""
        return any(loss.rewritten for loss in self.lost)

    def forget(self) -> None:
        """Mark the positions of all axes as not known."""
        for axis in self.axes:
            self.at[axis], self.said[axis] = NAN, False

    def unsay(self, axes: str | tuple[str, ...] = ()) -> None:
        """Mark the positions of these axes, or of all, as not set by the program."""
        for axis in axes or self.axes:
            if axis in self.said:
                self.said[axis] = False

    def offset(self, axis: str) -> float:
        """The sum of all offsets that are added to the numbers of an axis, mm or degree; NaN if not known."""
        system = self.given.offsets.get(self.system)
        if system is None:
            shift = 0.0 if self.given.assume_zero or self.system == "G500" else NAN
        else:
            shift = system.get(axis, 0.0)
        if axis == "Z" and not self.tcp:
            shift += NAN if self.length is None else self.length
        if self.shifts or self.local:
            shift += self.shifts.get(axis, 0.0) + self.local.get(axis, 0.0)
        return shift

    def length_of(self, tool: int | str) -> float | None:
        """The length of a tool, mm; None if it is not given."""
        found = self.given.tools.get(tool)
        return 0.0 if found is None and self.given.assume_zero else found

    def tip_length(self) -> float:
        """The length of the tool in the spindle, mm; NaN if not known."""
        length = None if self.between else self.length_of(self.tool)
        return NAN if length is None else length

    def lead(self, on: bool) -> None:
        """Switch tool-centre-point control on or off, and convert the position to the new coordinates.

        If the setup says that X Y Z are those of the tip, only Klartext can switch it off.
        """
        self.asks_tip = on
        on = on or (self.turn is not None and self.turn.tilted)
        if on == self.tcp or (self.given.tcp and self.family is not Family.KLARTEXT):
            return
        if self.turn is not None:
            self.lose("tool-centre-point control in rotated coordinates")
        if self.family is not Family.KLARTEXT and (any(self.shifts.values()) or any(self.local.values())):
            self.lose("a shift under tool-centre-point control")
        self.tcp = on
        known = [self.at[axis] for axis in self.axes]
        numbers = self.model.turned(known, self.tip_length(), on) if self.model else [NAN] * len(known)
        self.at.update((axis, number) for axis, number in zip(self.axes, numbers, strict=True) if axis in "XYZ")
        self.unsay("XYZ")

    def begin_turn(self, rotation: Array, origin: Sequence[float] = (0.0, 0.0, 0.0), *, tilted: bool) -> None:
        """Turn the coordinates about the zero point, and move it by `origin` (3,), mm.

        tilted  they are fixed to the workpiece, so that X Y Z are those of the tip
        """
        self.end_turn()
        if self.model is None or (tilted and not self.model.leads):
            self.lose("rotated coordinates on a machine whose linear axes cannot move the tip in all directions")
            return
        if tilted:
            asked = self.asks_tip
            self.lead(True)
            self.asks_tip = asked
        zero = np.array([self.offset(axis) for axis in "XYZ"])
        self._enter(TurnedFrame(self.model.columns, rotation, zero, zero + np.array(origin), tilted))

    def begin_turn_about(self, rotation: Array, centre: Mapping[str, float]) -> None:
        """Turn the coordinates about a centre, mm, whose numbers stay the same."""
        self.end_turn()
        middle = np.array([centre.get(axis, 0.0) for axis in "XYZ"])
        if self.model is None or self.tcp:
            self.lose("rotated coordinates under tool-centre-point control")
        else:
            self._enter(TurnedFrame(self.model.columns, rotation, middle, middle, False))

    def end_turn(self) -> None:
        """End the turn of the coordinates."""
        before, self.turn = self.turn, None
        if before is not None:
            self._stand_at(before.commands(np.array([[*self.at.values()]]))[0], before)
            self.lead(self.asks_tip)

    def _enter(self, turn: TurnedFrame) -> None:
        self.turn = turn
        self._stand_at(turn.numbers(np.array([*self.at.values()])), turn)

    def _stand_at(self, place: Array, turn: TurnedFrame) -> None:
        """Set the position (n_axes,) in new coordinates; numbers that change count as not set by the program."""
        for k, axis in enumerate("XYZ"):
            number = float(place[turn.columns[k]])
            if number != self.at[axis]:
                self.at[axis], self.said[axis] = number, False

    def forget_place(self, but: str = "") -> None:
        """Mark the positions of X, Y and Z, except those in `but`, as not known."""
        for axis in "XYZ":
            if axis not in but:
                self.at[axis], self.said[axis] = NAN, False

    def is_square(self) -> bool:
        """Whether the tool is square to the tilted plane in force."""
        way, here = None if self.model is None else self.model.rotary_way, self._turns()
        if way is None or self.turn is None or not np.isfinite(here).all():
            return False
        return bool(np.abs(way.directions(here[None])[0] - self.turn.rotation[:, 2]).max() < SQUARE)

    def _turns(self) -> Array:
        """Positions of the rotary axes, rad."""
        return np.radians([self.at[axis] for axis in self.axes if axis in "ABC"])

    def square_to(
        self, rotation: Array, *, sense: int = 0, sign: int = 0, inside: bool = False, stays: bool = True
    ) -> dict[str, float]:
        """Rotary positions, degrees, with the tool square to a plane, see `RotaryWay.to`; NaN if not known."""
        turning = [axis for axis in self.axes if axis in "ABC"]
        way, here = None if self.model is None else self.model.rotary_way, self._turns()
        if way is None or not np.isfinite(here).all():
            return dict.fromkeys(turning, NAN)
        found = way.to(rotation[:, 2], here, sense=sense, sign=sign, inside=inside, stays=stays)
        return dict(zip(turning, [NAN, NAN] if found is None else np.degrees(found).tolist(), strict=True))

    def scale(self, axis: str) -> float:
        """The unit of the words of an axis, mm or degree."""
        return self.unit if axis in "XYZUVW" else 1.0

    def target(self, words: Mapping[str, TextWord], machine: bool = False) -> dict[str, float]:
        """The positions to which words lead, `machine`: in machine coordinates; marks axes that the program sets."""
        end = dict(self.at)
        for axis, word in words.items():
            value = NAN if word.value is None else word.value * self.scale(axis)
            counted = word.counted == "+" or (word.counted == "" and self.counting)
            if machine:
                end[axis] = value
            elif counted:
                end[axis] = self.at[axis] + value
            else:
                end[axis] = self.offset(axis) + value
                self.said[axis] = True
        return end

    def choose_edge(self, number: float | None) -> None:
        """D of SINUMERIK: puts the length of the tool in force; with T0 or D0, none."""
        self.new_length(self.length_of(self.tool) if number and self.tool else 0.0)

    def new_length(self, length: float | None) -> None:
        """Put a tool length in force in coordinates; it lies along Z of the machine, however they are turned."""
        before, self.length, self.between = self.length, length, False
        if self.turn is not None and not self.tcp and self.turn.rotation[2, 2] != 1.0:
            place = self.turn.commands(np.array([[*self.at.values()]]))[0]
            longer = np.array([0.0, 0.0, NAN if before is None or length is None else length - before])
            self.turn = replace(self.turn, zero=self.turn.zero + longer, origin=self.turn.origin + longer)
            self._stand_at(self.turn.numbers(place), self.turn)
        self.unsay("Z" if not self.tcp or (self.turn is not None and self.is_square()) else "XYZ")
