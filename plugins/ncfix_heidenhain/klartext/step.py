"""One motion block while it is executed, and what all path functions do with it."""

from __future__ import annotations

from dataclasses import dataclass

from ncfix.control.coordinates import Vector, X, Y
from ncfix.control.moves import Arc, Motion, MotionKind, UnknownAxes
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.targets import MotionWords

IN_PLANE = 1 << X | 1 << Y


@dataclass(frozen=True, slots=True)
class Step:
    """One motion block while it is executed.

    name    its path function
    words   its words
    flags   `fmax`, `dr+`, ...
    codes   its M codes
    """

    name: str
    words: MotionWords
    flags: frozenset[str]
    codes: frozenset[int]

    @property
    def kind(self) -> MotionKind:
        """At FMAX a rapid."""
        return MotionKind.RAPID if "fmax" in self.flags else MotionKind.FEED


def with_increments(control: KlartextControl, on: bool) -> None:
    """Whether the words of the next motion count from where it begins."""
    control.modal.incremental = on


def somewhere(control: KlartextControl, axes: int, target: Vector, unknown: UnknownAxes, reason: str) -> None:
    """A refused curve that ends nobody knows where: the motion before it must still end where it did."""
    normal = control.rotation[0][2], control.rotation[1][2], control.rotation[2][2]
    control.modal.arc_absolute = True
    control.make(
        Motion(
            MotionKind.ARC, axes | IN_PLANE, target, unknown, 10, refusal=reason, arc=Arc((0.0, 0.0, 0.0), normal, 0.0)
        )
    )
    control.modal.arc_absolute = False
    control.path.tangent = None


def refuse(control: KlartextControl, reason: str) -> None:
    """A motion that is not followed."""
    control.refuse_here(reason)
