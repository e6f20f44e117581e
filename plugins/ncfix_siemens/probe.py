"""Two small files that settle on the machine what no public text does: the sign of values, and what a product adds."""

from __future__ import annotations

import numpy as np

from ncfix.diagnostics import RefusedError
from ncfix_siemens.cec import Style, cec_text
from ncfix_siemens.table import PLACES, Table

SIGN, PRODUCT, SHEET = "PROBE_SIGN_CEC.INI", "PROBE_PRODUCT_CEC.INI", "probe.md"
SHIFT = 0.01
BASE, MULTIPLIER = 0.1, 0.2
READINGS = {"only": 0.02, "plus_multiplier": 0.22, "plus_base": 0.12, "plus_both": 0.32}
"""What X moves by in the second probe, mm."""


def probe_files(axes: dict[str, str], ranges: dict[str, tuple[float, float]], style: Style) -> dict[str, bytes]:
    """The files, and what to do with them. X is moved by a constant, whatever the axes do."""
    if not {"X", "Z"} <= set(axes):
        raise RefusedError.of("NCF484", f"the probe moves X and looks up Z; the machine has {' '.join(axes)}")
    x, z = (_whole(axis, ranges) for axis in "XZ")
    sign = _constant(0, axes["X"], axes["X"], x, SHIFT)
    base = _constant(0, axes["X"], axes["X"], x, BASE, multiply=2)
    multiplier = _constant(1, axes["Z"], axes["X"], z, MULTIPLIER)
    return {
        SIGN: cec_text([sign], ["ncfix probe of the sign: X moves by 0.01 mm"], {}, style),
        PRODUCT: cec_text([base, multiplier], ["ncfix probe of products: 0.1 times 0.2"], {}, style),
        SHEET: _sheet(axes["X"]).encode(),
    }


def _whole(axis: str, ranges: dict[str, tuple[float, float]]) -> tuple[float, float]:
    """The range in whole millimetres, so that no step is odd."""
    low, high = ranges[axis]
    return float(np.floor(low)), float(np.ceil(high))


def _constant(
    index: int, source: str, output: str, ends: tuple[float, float], value: float, multiply: int = 0
) -> Table:
    step = round(ends[1] - ends[0], PLACES)
    return Table(index, source, output, ends[0], step, np.array([value, value]), multiply=multiply)


def _sheet(axis: str) -> str:
    rows = "\n".join(f"| {value:.2f} mm | `product_terms={terms}` |" for terms, value in READINGS.items())
    return f"""# Two probes for the compensation of this control

They move {axis} (X) by a constant of at most 0.32 mm; the display of the machine coordinates does not show it. Put a
dial gauge against the spindle in X, with all other compensation tables off. Back up the control first: raising
MD18342 formats memory.

1. MD18342 $MN_MM_CEC_MAX_POINTS[0] and [1] at least 2; NCK reset.
2. MD32710 $MA_CEC_ENABLE[{axis}] = 0; run `{SIGN}`; SD41300 $SN_CEC_TABLE_ENABLE[0] = 1; the gauge to zero.
3. MD32710 = 1, reset, reference {axis}. The gauge shows 0.01 mm:

| X moves towards | setting |
|---|---|
| minus | `value_sign=error` |
| plus | `value_sign=correction` |

4. MD32710 = 0; the gauge to zero; run `{PRODUCT}`; SD41300 = 1 for tables 0 and 1; MD32710 = 1, reset, reference.

| X moves by | setting |
|---|---|
{rows}
| 0.30 mm, or an alarm | the control multiplies by another rule: do not load products, `--set scheme=poly25` |

5. MD32710 = 0, and take the tables out again.
"""
