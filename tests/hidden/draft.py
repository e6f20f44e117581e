"""Everything that is decided about a scenario before anything is measured."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .chain import Machine
from .designs import Design
from .mistakes import Mistake
from .model import Model
from .motion import Mask
from .situation import Situation
from .visibility import View
from .world import World


@dataclass(frozen=True, slots=True)
class Draft:
    """The real machine (`world`), what is measured of it, and what is handed over instead of the truth.

    `given` marks the rows that are not held out; `model` is the base model of which the clutter is free;
    `handed_machine` and `handed_model` are what the machine file says; `relatives` the closest kin of the (last)
    hidden effect.
    """

    topology: str
    design: Design
    kind: str
    situation: Situation
    given: Mask
    sight: View
    world: World
    model: Model
    handed_machine: Machine
    handed_model: Model
    relatives: dict[str, float] = field(default_factory=dict)
    mistake: Mistake | None = None
    notes: dict[str, Any] = field(default_factory=dict)
