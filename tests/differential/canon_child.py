"""Runs LinuxCNC's `gcode` extension over programs, under the system's Python: a request on each line of standard input
is answered by an exit code on a line of standard output.

A request is JSON: home (the folder to be in), ini, program, rows, parameter_file, tools [[number, offset x, offset z,
diameter], ...], block_delete, initial (a machine position), timeout in s, output_limit in bytes. The file `rows` gets
one row of `WIDTH` doubles for every canonical motion: full precision where the `rs274` program prints four decimals.
Lengths leave in mm, angles in degrees. The exit code is 1 where the interpreter refuses the program, negative where a
signal has ended it. Each program is run by a copy of this process: the extension keeps much between programs.
"""

import array
import ctypes
import json
import math
import os
import resource
import signal
import sys

MM = 25.4  # the extension reports inches whatever the program's unit is
WIDTH = 36
MODE, SIDE = 2, 3  # columns of a row
RAPID, FEED, ARC, PROBE, TAP = range(5)
PLANES = {1: (0, 1, 2), 2: (1, 2, 0), 3: (2, 0, 1)}  # CANON_PLANE_XY, YZ, XZ: first, second and normal axis
EMPTY = [0.0] * 9


def scaled(values):
    """Lengths of an XYZABCUVW tuple from inch to mm; angles stay."""
    return [value if 3 <= index < 6 else value * MM for index, value in enumerate(values)]


class Canon:
    """The callbacks of the extension; whatever is not named here is accepted and ignored."""

    def __init__(self, request):
        self.parameter_file = request["parameter_file"]
        self.block_delete = bool(request["block_delete"])
        self.tools = [[0, 0.0, 0.0, 0.0], *request["tools"]]
        self.rows = array.array("d")
        self.started = False
        self.line = 0
        self.pending = 0
        self.plane = 1
        self.rotation = 0.0
        self.g5x, self.g92, self.tool = EMPTY, EMPTY, EMPTY
        self.program = EMPTY

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *arguments: None

    # what the interpreter asks
    def get_external_length_units(self):
        return 1.0

    def get_external_angular_units(self):
        return 1.0

    def get_axis_mask(self):
        return 0x1FF

    def get_block_delete(self):
        return self.block_delete

    def check_abort(self):
        return False

    def get_tool(self, index):
        number, x, z, diameter = self.tools[index] if 0 <= index < len(self.tools) else [-1, 0.0, 0.0, 0.0]
        return (number, x, 0.0, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, diameter, 0.0, 0.0, 0)

    # the state that it tells
    def next_line(self, state):
        """The modes are told before a block runs, so they are those that the blocks before it have left."""
        for row in range(self.pending, len(self.rows), WIDTH):
            self.rows[row + MODE], self.rows[row + SIDE] = state.motion_mode, state.cutter_side
        self.pending, self.line = len(self.rows), state.sequence_number

    def change_tool(self, index):
        self.tools[0] = self.tools[index] if 0 < index < len(self.tools) else [0, 0.0, 0.0, 0.0]

    def set_plane(self, plane):
        self.plane = plane

    def set_xy_rotation(self, degrees):
        self.rotation = degrees

    def set_g5x_offset(self, index, *values):
        self.g5x = scaled(values)

    def set_g92_offset(self, *values):
        self.g92 = scaled(values)

    def tool_offset(self, *values):
        self.tool = scaled(values)

    # the motions
    def straight_traverse(self, *values):
        self.motion(RAPID, scaled(values))

    def straight_feed(self, *values):
        self.motion(FEED, scaled(values))

    def straight_probe(self, *values):
        self.motion(PROBE, scaled(values))

    def rigid_tap(self, *values):
        self.motion(TAP, [value * MM for value in values] + self.program[3:])

    def arc_feed(self, first, second, centre_first, centre_second, turns, height, *rest):
        one, two, up = PLANES[self.plane]
        end = [0.0, 0.0, 0.0, *rest[:3], *(value * MM for value in rest[3:])]
        centre, normal = [0.0] * 3, [0.0] * 3
        end[one], end[two], end[up] = first * MM, second * MM, height * MM
        centre[one], centre[two], centre[up] = centre_first * MM, centre_second * MM, height * MM
        normal[up] = 1.0
        self.motion(ARC, end, centre, normal, turns)

    def motion(self, kind, end, centre=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 0.0), turns=0):
        self.program = end
        if not self.started:
            self.started = True  # the move to the initial position, which is not the program's
            return
        machine = self.machine(end)
        middle = self.machine([*centre, *EMPTY[3:]])[:3] if turns else centre
        head = (self.line, kind, 0, 0, self.rotation, self.plane, self.tools[0][0])
        self.rows.extend((*head, *end, *machine, *middle, *self.turned(normal), turns, *self.tool[:3], 0.0))

    def machine(self, position):
        """Program coordinates to machine coordinates: G92, then the rotation, then work offset and tool offset."""
        shifted = [value + offset for value, offset in zip(position, self.g92, strict=True)]
        shifted[:3] = self.turned(shifted[:3])
        return [value + work + tool for value, work, tool in zip(shifted, self.g5x, self.tool, strict=True)]

    def turned(self, vector):
        cosine, sine = math.cos(math.radians(self.rotation)), math.sin(math.radians(self.rotation))
        x, y, z = vector
        return [x * cosine - y * sine, x * sine + y * cosine, z]


def attach_tool_table(library):
    """Without this the extension dies at M6 and G41: nobody has opened the tool table that `rs274` left in $HOME."""
    if library._Z14tool_mmap_userv() != 0:
        raise OSError("no tool table in $HOME/.tool.mmap")


def run(wanted, library, gcode):
    """Run one program; the exit code."""
    os.chdir(wanted["home"])
    os.environ.update(HOME=wanted["home"], INI_FILE_NAME=wanted["ini"])
    resource.setrlimit(resource.RLIMIT_FSIZE, (wanted["output_limit"],) * 2)
    signal.alarm(math.ceil(wanted["timeout"]))
    attach_tool_table(library)
    canon = Canon(wanted)
    start = " ".join(f"{axis}{value:.9f}" for axis, value in zip("XYZABC", wanted["initial"], strict=True))
    result, _ = gcode.parse(wanted["program"], canon, "G21 G90 G53 G0 " + start, "G90 G17 G40 G49 G80 G94")
    with open(wanted["rows"], "wb") as out:
        canon.rows.tofile(out)
    return int(result > gcode.MIN_ERROR)


def serve():
    """Answer requests until there are no more."""
    library = ctypes.CDLL("libtooldata.so.0", mode=ctypes.RTLD_GLOBAL)
    import gcode

    answers = os.dup(1)
    os.dup2(2, 1)  # what the extension prints is no answer
    for request in sys.stdin:
        child = os.fork()
        if child == 0:
            code = 2
            try:
                code = run(json.loads(request), library, gcode)
            finally:
                os._exit(code)
        os.write(answers, b"%d\n" % os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))


if __name__ == "__main__":
    serve()
