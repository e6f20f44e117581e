"""A picture of a corrected program for publications (matplotlib): error along the path, its distribution, the path."""

from __future__ import annotations

from importlib.util import find_spec
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from ncfix.compensate.figures.path_record import CUT, EDGES, RAPID, selection
from ncfix.diagnostics import UsageError

if TYPE_CHECKING:
    from ncfix.arrays import Array
    from ncfix.reports.program_page import ProgramPage

FORMS = ("svg", "png", "pdf")
STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "svg.hashsalt": "ncfix",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
    "lines.linewidth": 0.9,
}
ERROR = ("#a9c6e6", "#6f9bd1", "#7a62b8", "#a8286f", "#5c0620")
"""Colour scale of errors, as on the page; its lightness is monotonic."""
COLOURS = {"before": "#c2510a", "after": "#0b62a8"}
DRAWN = 4000
"""Approximate largest number of points that are drawn."""
STRETCHES = 1500
"""Largest number of points of a curve; each is the maximum of its stretch."""
UNDATED: dict[str, dict[str, None]] = {
    "svg": {"Date": None},
    "pdf": {"CreationDate": None, "ModDate": None},
    "png": {"Software": None},
}
"""Metadata settings that leave dates out, so that equal input gives equal bytes."""


def require_matplotlib() -> None:
    """Raise `UsageError` NCF031 if matplotlib is not installed."""
    if find_spec("matplotlib") is None:
        text = "a picture is drawn by matplotlib, which is not installed"
        raise UsageError.of("NCF031", text, hint="pip install 'ncfix[plot]'")


def picture(page: ProgramPage, form: str) -> bytes:
    """The picture as a file: the path coloured by its error before and after on one scale, and two curves."""
    require_matplotlib()
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns, _, _ = page.record.columns()
    if len(columns["way"]) > DRAWN:
        rows = selection(columns, DRAWN)
        columns = {name: values[rows] for name, values in columns.items()}
    cut = columns["kind"] == CUT
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 5.6), layout="constrained")
        FigureCanvasAgg(figure)
        upper, lower = np.asarray(figure.subfigures(2, 1, height_ratios=(1.2, 1)))
        most = max((float(columns[side][cut].max(initial=0.0)) for side in COLOURS), default=0.0) or 1.0
        drawn = None
        for number, side in enumerate(COLOURS):
            axes = upper.add_subplot(1, 2, number + 1, projection="3d")
            drawn = _path(axes, columns, columns[side], most, side)
        upper.colorbar(drawn, ax=upper.axes, shrink=0.7, pad=0.1, label="tip error, µm")
        along, spread = lower.subplots(1, 2, width_ratios=(1.6, 1))
        _along(along, columns)
        _spread(spread, page.record.share)
        picture = BytesIO()
        figure.savefig(picture, format=form, dpi=200, metadata=UNDATED[form])
    return picture.getvalue()


def _path(axes: Any, columns: dict[str, Array], error: Array, most: float, side: str) -> Any:
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.ticker import MaxNLocator
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    tips = np.stack([columns[name] for name in "xyz"], axis=1).astype(float)
    pieces = np.stack([tips[:-1], tips[1:]], axis=1) if len(tips) > 1 else np.zeros((0, 2, 3))
    led = columns["kind"][1:]
    if (led == RAPID).any():
        axes.add_collection3d(Line3DCollection(pieces[led == RAPID], colors="#9aa4b1", linewidths=0.3))
    cuts = Line3DCollection(pieces[led == CUT], cmap=LinearSegmentedColormap.from_list("error", ERROR), linewidths=0.9)
    cuts.set_array(error[1:][led == CUT])
    cuts.set_clim(0, most)
    if (led == CUT).any():
        axes.add_collection3d(cuts)
    seen = tips[columns["kind"] == CUT] if (columns["kind"] == CUT).any() else np.zeros((1, 3))
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = np.maximum(high - low, 0.15 * max(float((high - low).max()), 1e-3))
    middle = (low + high) / 2
    for name, at, width in zip("xyz", middle, room, strict=True):
        getattr(axes, f"set_{name}lim")(at - width / 2, at + width / 2)
        getattr(axes, f"set_{name}label")(f"{name.upper()}, mm")
        most_ticks = max(int(6 * width / room.max()), 2)
        getattr(axes, f"{name}axis").set_major_locator(MaxNLocator(most_ticks))
        axes.tick_params(name, pad=-1)
    axes.set_box_aspect(room, zoom=0.92)
    axes.set_title(f"error {side}", fontsize=9)
    axes.view_init(28, -55)
    return cuts


def _along(axes: Any, columns: dict[str, Array]) -> None:
    rows = np.flatnonzero(columns["kind"] != RAPID)
    axes.set(xlabel="length of path, mm", ylabel="tip error, µm", yscale="log", title="error along the path")
    if not len(rows):
        return
    first = np.unique(np.linspace(0, len(rows), min(STRETCHES, len(rows)), endpoint=False).astype(int))
    for side, colour in COLOURS.items():
        most = np.maximum.reduceat(columns[side][rows], first)
        axes.plot(columns["way"][rows[first]], np.maximum(most, 1e-3), color=colour, label=side)
    axes.legend(loc="lower right", ncols=2)


def _spread(axes: Any, share: Array) -> None:
    total = np.maximum(share.sum(axis=1), 1e-12)
    for way, whole, (side, colour) in zip(share, total, COLOURS.items(), strict=True):
        axes.stairs(100 * way / whole, EDGES, color=colour, fill=True, alpha=0.25)
        axes.stairs(100 * way / whole, EDGES, color=colour, label=side)
    filled = np.flatnonzero(share.sum(axis=0))
    if len(filled):
        axes.set_xlim(EDGES[max(filled[0] - 2, 0)], EDGES[min(filled[-1] + 3, len(EDGES) - 1)])
    axes.set(xscale="log", xlabel="tip error, µm", ylabel="share of the path, %", title="distribution")
    axes.legend()
