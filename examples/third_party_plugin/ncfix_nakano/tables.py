"""The stored pitch errors of Nakano: a text file with the error of each axis over itself, both ways, in micrometres."""

from typing import ClassVar

import numpy as np

from ncfix.plugin import (
    Compensation,
    Control,
    FileForm,
    Option,
    Properties,
    Written,
    own_terms,
    positioning,
    read_form,
    whole,
)

FILE = "pitch.dat"
NUMBER = r"([-+]?\d+\.?\d*)"
FORM = FileForm(
    "nakano",
    "Nakano's pitch.dat",
    {
        "axis": r"\[[XYZ]\]",
        "row": rf" *{NUMBER} +{NUMBER} +{NUMBER}",
        "remark": r"'.*",
        "end": r"END",
    },
    needs=("end",),
)
MOST_POINTS = 128


class NakanoPitch(Control):
    name = "nakano-pitch"
    title = "Nakano stored pitch errors"
    reaches = "L-POS"
    properties = Properties(
        value_sign="error",
        input_signal="setpoint",
        position_frame="machine zero",
        unit="mm, values in um",
        quantum=(1e-4, 0.0),
        extrapolation="end values",
        bidirectional=True,
        max_points=MOST_POINTS,
        max_tables=3,
        combine="one",
    )
    options: ClassVar = {"points": Option(str(MOST_POINTS), "points of a table at most", whole(2, MOST_POINTS))}
    steps = (f"Load {FILE} by SERVICE, PITCH, IN.", "Restart, home all axes.")
    switch_off = "SERVICE, PITCH, CLEAR."

    def write(self, request):
        most = int(request.settings["points"])
        terms = positioning(request.machine, request.space, request.tool_length, most, request.target).terms
        lines = ["' error of each axis over itself: position (mm), towards plus, towards minus (um)"]
        for ahead, back in zip(terms[::2], terms[1::2], strict=True):
            (axis,), nodes = ahead.outputs, ahead.factors[0].nodes[0]
            if axis in "XYZ":
                errors = (-1000 * term.factors[0].values[:, 0] for term in (ahead, back))
                lines += [f"[{axis}]", *map("{:12.4f} {:+9.1f} {:+9.1f}".format, nodes, *errors)]
        return Written({FILE: "\n".join([*lines, "END", ""]).encode()})

    def read(self, files):
        document, remarks = read_form(FORM, FILE, files[FILE])
        remarks.check()
        terms = []
        for axis, rows in document.sections("axis").items():
            place, ahead, back = np.array(rows).T
            terms += own_terms(axis, place, -ahead / 1000, -back / 1000)
        return Compensation(tuple(terms))

    def lint(self, files):
        return read_form(FORM, FILE, files[FILE])[1].messages
