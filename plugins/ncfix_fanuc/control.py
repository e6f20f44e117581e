"""Three-dimensional error compensation of Fanuc Series 30i: a grid of corrections over X, Y and Z.

The interpolation (A-79351E, trilinear in the control's current position), the size (25 x 25 x 25) and the record of
the FOCAS library are public; the control's own text file is not: one is written only if a template is given, and its
name says that it is assumed. What would double the error if guessed wrongly must be said: `--set sign=...`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ncfix.diagnostics import Message
from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.control import (
    Assumption,
    Control,
    Files,
    Option,
    Properties,
    Request,
    SettingForm,
    Written,
    one_of,
    whole,
)
from ncfix.tables.table_files import Remarks
from ncfix_fanuc.backlash import ASSUMPTION, OPTIONS, STEP, Backlash, read_backlash
from ncfix_fanuc.filling import AXES, FITS, SAID, TEMPLATE, GridFilling
from ncfix_fanuc.placing import OPTIONS as PLACES
from ncfix_fanuc.placing import STEP as PLACING
from ncfix_fanuc.placing import assumption
from ncfix_fanuc.records import (
    MOST_NUMBER,
    NAME,
    SIDE,
    TABLE,
    TEXT,
    Volc,
    csv_text,
    json_text,
    read_volc,
    template_text,
)
from ncfix_fanuc.units import UNITS, sign_option

ORDER = SettingForm("XYZ, ZYX, ...: each axis once", lambda text: sorted(text) == list(AXES))


class Fanuc(Control):
    """The control `fanuc`."""

    name = "fanuc"
    title = "Fanuc Series 30i three-dimensional error compensation"
    reaches = "L-VOL"
    properties = Properties(
        value_sign="as --set sign says",
        input_signal="setpoint",
        position_frame="machine coordinates",
        unit="detection unit times magnification; positions mm",
        quantum=(1e-4, 0.0),
        extrapolation="taken as held at the outermost nodes (FANUC-4)",
        bidirectional=True,
        max_points=SIDE**3,
        max_tables=1,
        combine="one grid",
    )
    assumptions = (
        Assumption(
            "FANUC-1",
            "The sign of the values is what --set sign says.",
            "none public; patents speak of an amount that is added",
            "none: it must be given",
            "Load +0.010 mm at all points of X: does X move by 0.010 towards plus (correction) or minus (error)?",
        ),
        Assumption(
            "FANUC-2",
            "Points are numbered from first_number on, the first axis of order fastest.",
            "none public",
            "from 1, X fastest, then Y, then Z",
            "Load a value at point 2 only, and find with cnc_rdvolccomp where it acts.",
        ),
        Assumption(
            "FANUC-3",
            "A value is a whole number from -127 to 127, times magnification, times detection unit.",
            "none public for the grid; so it is with other compensations of these controls",
            "the detection unit is 0.1 um",
            "The parameter manual of the machine; --set detection_unit_um=...",
        ),
        Assumption(
            "FANUC-4",
            "Outside the grid the value of its edge holds.",
            "none public",
            "edge value",
            "Move beyond the grid and read cnc_rdvolccomp.",
        ),
        Assumption(
            "FANUC-5",
            "The text file has a line like the template for every point, between two lines with %.",
            "none public; N..A1P..A2P.. is how parameters of these controls are punched",
            "no text file is written",
            "Punch the grid that is in the control and compare the form; --set template=... follows it.",
        ),
        ASSUMPTION,
        assumption("FANUC-7"),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "sign": sign_option("FANUC-1"),
        "detection_unit_um": UNITS["detection_unit_um"],
        "largest": Option("127", "largest value of a point", whole(1, MOST_NUMBER)),
        "order": Option("XYZ", "the axes from the one whose number runs fastest", ORDER),
        "first_number": Option("1", "number of the first point", whole(0, MOST_NUMBER)),
        "template": Option("", f"a line of the text file, ASSUMED, e.g. {TEMPLATE}"),
        "fit": Option(
            "auto",
            "nodes: exact at the points; area: least squares around them; auto: area if nodes miss more",
            one_of(*FITS),
        ),
        "rotary": Option(
            "zero",
            "zero: exact with the rotary axes at zero; middle: between what all their angles ask for",
            one_of(*SAID),
        ),
        **PLACES,
        **OPTIONS,
    }
    steps = (
        "Settle the assumptions below on the machine, sign first.",
        PLACING,
        "Set the magnification as volume.json has it.",
        "Write the records of volume.json with cnc_wrvolc, or type in volume.csv.",
        STEP,
        "Switch power off and on, home all axes.",
        "Read cnc_rdvolccomp at one pose and compare it with volume.csv.",
        "Measure one line again: the error must have become smaller, not twice as large.",
    )
    switch_off = (
        "Switch the function off by its parameter, or set the magnification to zero; give parameter 1851 its old "
        "values if backlash.txt was there. Power off and on, home all axes."
    )

    def write(self, request: Request) -> Written:
        """`volume.json` with the FOCAS records, the same as `volume.csv`, as text if asked for, and the play."""
        made = GridFilling.of(request, self.settings(request.settings))
        volc, mesh = made.volc()
        files = {NAME: json_text(volc), TABLE: csv_text(volc), **made.backlash.files()}
        if volc.style.template:
            files[TEXT] = template_text(volc)
        return Written(files, tuple(made.notes(volc, mesh)), made.least())

    def read(self, files: Files) -> Compensation:
        """As the control would interpolate them. Raises `ConfigError` NCF491."""
        volc, backlash, remarks = _read(files)
        for each in remarks:
            each.check()
        assert volc is not None
        return Compensation((Term((volc.grid(),)), *backlash.tables(volc.unit).terms))

    def lint(self, files: Files) -> tuple[Message, ...]:
        """Records that do not fit, values beyond the range, and a CSV that says something else."""
        return tuple(message for remarks in _read(files)[2] for message in remarks.messages)

    def knows(self, name: str, content: bytes) -> bool:
        """Records of the grid as ncfix writes them."""
        return name.lower() in (NAME, TABLE) or (content.lstrip()[:1] == b"{" and b'"start_no"' in content)


def _read(files: Files) -> tuple[Volc | None, Backlash, list[Remarks]]:
    volc, remarks = read_volc(files)
    backlash, more = read_backlash(files, volc.style.home_minus if volc else "")
    return volc, backlash, [remarks, *more]
