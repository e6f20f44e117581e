"""A calibration that ran and is none: it leaves what no machine with such an instrument can leave."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ncfix.diagnostics import Message
from ncfix.machine.plausible import Doubt
from ncfix.measure.calibrate import Calibration
from ncfix.measure.contradictions import contradictions
from ncfix.measure.residuals import place, residuals

BEYOND = 1000.0
"""Times the noise: missing effects leave some tens of it; this is a wrong unit, a wrong file or a wrong noise."""
MUCH_UM = 100.0
"""What is less may be an effect that is missing, however small the noise is that the file states."""
UM = 1e3
HINT = (
    "look at that row, at units (mm, rad, degree), signs and columns, and whether it is this machine; noise_um is in um"
)


def refusals(calibration: Calibration, odd: Sequence[Doubt]) -> tuple[Message, ...]:
    """Why no machine file may be written: data that contradict each other, a misfit, or a machine that cannot be."""
    found = misfit(calibration)
    impossible = tuple(doubt.message for doubt in odd if doubt.impossible)
    return (*contradictions(calibration), *(() if found is None else (found,)), *impossible)


def misfit(calibration: Calibration) -> Message | None:
    """NCF642 if the residuals are more than the machine may be corrected by, or many and `BEYOND` times the noise."""
    factor = float(np.sqrt(calibration.chi_square)) if calibration.problem.noise_known else 0.0
    most_um = UM * float(calibration.machine.max_correction[0])
    beyond = factor > BEYOND and calibration.after_um > MUCH_UM
    if not beyond and not calibration.after_um > most_um:
        return None
    times = f", {factor:.0f} times the noise" if factor > 1 else ""
    rms = f" ({calibration.after_um:.4g} um rms of {calibration.before_um:.4g} um before)"
    text = f"the calibrated model does not describe these measurements: what it leaves{rms} is "
    text += f"{factor:.0f} times the noise" if beyond else f"beyond max_correction, {most_um:g} um{times}"
    rest = residuals(calibration.problem, calibration.estimate)
    worst = int(
        np.argmax(np.abs(calibration.estimate.residual / calibration.problem.sigma) * (calibration.estimate.weight > 0))
    )
    return Message("NCF642", f"{text}; most in {rest.component[worst]}", place(calibration.problem, rest, worst), HINT)
