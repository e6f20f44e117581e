"""The first lines of a program, each parsed by the grammar, as if there were no memory of shapes: `FILE LINES`."""

import sys
from itertools import islice

from ncfix.text.dialect import get
from ncfix.text.grammar import parse, squeeze

dialect = get("linuxcnc")
with open(sys.argv[1]) as program:
    for line in islice(program, int(sys.argv[2])):
        parse(dialect, squeeze(line.rstrip("\r\n")).code)
