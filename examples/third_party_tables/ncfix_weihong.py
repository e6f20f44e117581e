import numpy as np

from ncfix.plugin import (
    Compensation,
    Control,
    Grid,
    Properties,
    Term,
    Written,
    form_named,
    hookimpl,
    positioning,
    read_form,
)

FILE, FORM = "axeserr.dat", form_named("weihong")


class Weihong(Control):
    name, title, reaches = "weihong", "Weihong NcStudio axis errors", "L-POS"
    properties = Properties("error", "setpoint", "machine zero", "mm", (1e-6, 0.0), "end values", True, 999, 3, "one")
    steps, switch_off = (f"Copy {FILE} to NcStudio, restart, home.",), f"Delete {FILE}."

    def write(self, request):
        terms, lines = positioning(request.machine, request.space, request.tool_length, 999, request.target).terms, []
        for there, back in zip(terms[::2], terms[1::2], strict=True):
            if there.outputs[0] in "XYZ":
                columns = there.factors[0].nodes[0], *(-term.factors[0].values[:, 0] for term in (there, back))
                lines += [f"[{there.outputs[0]}]", *map("{:.6f}, {:.6f}, {:.6f}".format, *columns)]
        return Written({FILE: "\n".join(["unit = mm", *lines, ""]).encode()})

    def read(self, files):
        terms = []
        for axis, rows in read_form(FORM, FILE, files[FILE])[0].sections("axis").items():
            place, *errors = np.array(rows).T
            grids = [Grid((axis,), (place,), (axis,), -error[:, None]) for error in errors]
            terms += [Term((grid,), (axis, way)) for grid, way in zip(grids, (1, -1), strict=True)]
        return Compensation(tuple(terms))

    def lint(self, files):
        return read_form(FORM, FILE, files[FILE])[1].messages


@hookimpl
def register_controls(register):
    register(Weihong, name="weihong")
