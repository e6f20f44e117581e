"""A picture of a diagnosis for publications (matplotlib): what each rung leaves, and measurement against model."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from ncfix.diagnosis.diagnosis import Diagnosis
from ncfix.diagnosis.ladder import ladder
from ncfix.reports.diagnosis import MeasuredCurve, measured_curves
from ncfix.reports.picture import COLOURS, STYLE, UNDATED, require_matplotlib

if TYPE_CHECKING:
    from ncfix.arrays import Array

PANELS = 7
"""Largest number of curves; those of the first effects are drawn."""
MEASURED, MODEL = COLOURS["before"], COLOURS["after"]


def picture(diagnosis: Diagnosis, form: str) -> bytes:
    """The picture as a file: svg, png or pdf. Raises `UsageError` NCF031 without matplotlib."""
    require_matplotlib()
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    curves = [curve for finding in diagnosis.findings for curve in measured_curves(diagnosis, finding)][:PANELS]
    rows = -(-(1 + len(curves)) // 2)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 2.3 * rows), layout="constrained")
        FigureCanvasAgg(figure)
        panels: Array = np.asarray(figure.subplots(rows, 2)).ravel()
        _rungs(panels[0], diagnosis)
        for axes, curve in zip(panels[1:], curves, strict=False):
            _against(axes, curve)
        for axes in panels[1 + len(curves) :]:
            axes.set_visible(False)
        picture = BytesIO()
        figure.savefig(picture, format=form, dpi=200, metadata=UNDATED[form])
    return picture.getvalue()


def _rungs(axes: Any, diagnosis: Diagnosis) -> None:
    rungs = ladder(diagnosis)
    axes.barh([rung.name for rung in rungs], [rung.left_um for rung in rungs], color=MODEL)
    axes.invert_yaxis()
    axes.set(xlabel="residual below each rung, µm rms", title=diagnosis.data.machine.name)


def _against(axes: Any, curve: MeasuredCurve) -> None:
    axes.fill_between(
        curve.x, curve.measured - curve.spread, curve.measured + curve.spread, color=MEASURED, alpha=0.25, lw=0
    )
    axes.plot(curve.x, curve.measured, color=MEASURED, marker=".", label="measured")
    axes.plot(curve.x, curve.model, color=MODEL, label="model")
    axes.set(xlabel=curve.over, ylabel=f"{curve.component}, µm", title=curve.title)
    axes.legend()
