"""What a diagnosis says: the names, the gap, and everything a report needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnose import addition, gapmap, mistakes, next_poses, noise, plausible
from ncfix.diagnose.catalogue import Candidate
from ncfix.diagnose.evidence import Court
from ncfix.diagnose.groups import Gathered
from ncfix.diagnose.selection import Selected
from ncfix.diagnose.verdict import Rest
from ncfix.diagnose.view import View
from ncfix.machine import Effect, Machine
from ncfix.measure.measurement import Array


@dataclass(frozen=True, repr=False)
class Finding:
    """One named effect.

    candidate   what it is
    odds        log odds against its not being there, given the others; p_value by chance for any name
    aliases     names that explain its part nearly as well
    size_um     rms of what it shows
    effects     as they stand in the machine file; empty for what belongs to the measurement
    shown       (m,) what it shows, um
    judgement   whether its constants are such as machines have; None where there are none
    """

    candidate: Candidate
    odds: float
    p_value: float
    aliases: tuple[str, ...]
    size_um: float
    effects: tuple[Effect, ...]
    shown: Array
    judgement: plausible.Judgement | None = None


@dataclass(frozen=True)
class Gap:
    """Root mean square of residual lengths, um: before, after, the noise floor, and the first two on held-out poses."""

    before: float
    after: float
    floor: float
    holdout_before: float
    holdout_after: float


@dataclass(frozen=True, repr=False)
class Case:
    """What is asked: the data, the candidates, and the court where they are heard.

    considered  all candidates; `unheard_of` names that were refused and do not exist
    gathered    those that the data can show, and those that they cannot
    outlying    (rows,) what was put aside
    """

    view: View
    considered: tuple[Candidate, ...]
    unheard_of: tuple[str, ...]
    gathered: Gathered
    outlying: NDArray[np.bool_]
    court: Court

    @property
    def kept(self) -> NDArray[np.bool_]:
        """(m,) values of rows that were not put aside."""
        kept: NDArray[np.bool_] = ~self.outlying[np.maximum(self.view.row, 0)] & (self.view.row >= 0)
        return kept


@dataclass(frozen=True, repr=False)
class Diagnosis:
    """What was found, and everything a report needs.

    verdict        nothing-missing, found, ambiguous, unknown-effect
    findings       likeliest first
    rest           what has no name
    machine        with the findings added, or None if there is nothing to add
    before, after  (m,) residuals with the constants alone and with the findings, um; p_lack, p_left by chance
    clustering     how much neighbouring residuals are alike, before and after
    moved          constants of the machine file that the data put elsewhere; the gap before is after that
    findable       name -> um rms from which on an effect would be found in these data; inf: never
    """

    case: Case
    verdict: str
    findings: tuple[Finding, ...]
    rest: Rest
    gap: Gap
    floor: noise.Floor
    machine: Machine | None
    selected: Selected
    before: Array
    after: Array
    p_lack: float | None
    patterns: tuple[gapmap.Pattern, ...]
    clustering: tuple[float, float]
    moved: tuple[addition.Moved, ...]
    findable: Mapping[str, float]
    proposal: next_poses.Proposal | None = None
    mistake: mistakes.Mistake | None = None

    @property
    def view(self) -> View:
        """The data."""
        return self.case.view

    @property
    def unknown_um(self) -> float:
        """rms of what has no name."""
        return self.rest.size_um

    @property
    def p_left(self) -> float | None:
        """Probability of the residuals after by chance; None where the noise is not known."""
        return self.rest.p_left
