"""What the public formats allow is read: comments, blanks, line ends, case, block numbers, order, forms of numbers."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from ncfix.tables.control import Files, get_control
from plugins.test_table_fuzz import fresh

Change = Callable[[bytes], bytes]


def each_line(pattern: bytes, change: bytes) -> Change:
    return lambda content: re.sub(pattern, change, content, flags=re.MULTILINE)


def crlf(content: bytes) -> bytes:
    return content.replace(b"\n", b"\r\n")


def numbered(content: bytes) -> bytes:
    rows = content.splitlines()
    return b"".join(b"N%d %s\n" % (10 * n, row) if row.startswith(b"$") else row + b"\n" for n, row in enumerate(rows))


def two_a_line(content: bytes) -> bytes:
    return re.sub(rb"(\$AN_CEC\[\d+,0\]=\S+)\n", rb"\1 ", content)


def last_first(content: bytes) -> bytes:
    """The order of the assignments is free."""
    rows = content.splitlines(keepends=True)
    chosen = [row for row in rows if row.startswith(b"$")]
    return b"".join([row for row in rows if not row.startswith(b"$") and row != b"M17\n"] + chosen[::-1] + [b"M17\n"])


def as_list(content: bytes) -> bytes:
    """$AN_CEC[0,0]=SET(a, b, ...): the NC language fills an array from there on."""
    values = re.findall(rb"^\$AN_CEC\[0,\d+\]=(\S+)\n", content, flags=re.MULTILINE)
    rest = re.sub(rb"^\$AN_CEC\[0,\d+\]=\S+\n", b"", content, flags=re.MULTILINE)
    return rest.replace(
        b"$AN_CEC_INPUT_AXIS[0]", b"$AN_CEC[0,0]=SET(" + b", ".join(values) + b")\n$AN_CEC_INPUT_AXIS[0]", 1
    )


SIEMENS: dict[str, Change] = {
    "CR LF": crlf,
    "CR": lambda content: content.replace(b"\n", b"\r"),
    "small letters": lambda content: re.sub(rb"^\$[A-Z_]+", lambda match: match[0].lower(), content, flags=re.M),
    "block numbers": numbered,
    "blanks": each_line(rb"^\$(\w+)\[(\d+)(,\d+|)\]=", rb"  $\1 [ \2\3 ] = "),
    "comments": each_line(rb"^(\$.*)$", rb"\1 ; as measured"),
    "blank lines": lambda content: content.replace(b"\n", b"\n\n"),
    "comments before the header": lambda content: b"; made on Monday\n\n" + content,
    "another order": last_first,
    "two in a line": two_a_line,
    "axes without brackets": each_line(rb"=\((\w+)\)", rb"=\1"),
    "metric": lambda content: content.replace(b"CHANDATA(1)", b"METRIC\nCHANDATA( 1 )\nSTOPRE"),
    "another end": lambda content: content.replace(b"M17", b"N9999 RET ; end"),
    "exponents": each_line(rb"=(-?\d+\.\d+)$", rb"=\1EX0"),
    "plus": each_line(rb"=(\d+\.\d+)$", rb"=+\1"),
    "a list of values": as_list,
}
ISG: dict[str, Change] = {
    "CR LF": crlf,
    "tabs": lambda content: re.sub(rb" +", b"\t", content),
    "blank lines": lambda content: content.replace(b"\n", b"\n\n"),
    "blanks at the ends": lambda content: re.sub(rb"^(.*)$", rb"  \1  ", content, flags=re.M),
    "comments in the list": lambda content: content.replace(b"GRID\n", b"GRID   # regular\n# more\n"),
    "comments in the grid": each_line(rb"^([XYZABC ]+E.*)$", rb"// positions\n\1 // mm"),
    "small letters in the list": lambda content: content.replace(b"Interpolation", b"interpolation").replace(
        b"FALSE", b"false"
    ),
    "numbers for truth": lambda content: content.replace(b"FALSE", b"0"),
    "exponents": each_line(rb" (-?\d\.\d{6})$", rb" \1e+00"),
}
HEIDENHAIN: dict[str, Change] = {
    "CR LF": crlf,
    "blank lines": lambda content: content + b"\n\n",
}
PITCH: dict[str, Change] = {
    "CR LF": crlf,
    "blank lines": lambda content: content.replace(b"\n", b"\n\n"),
    "blanks": lambda content: content.replace(b"A", b" A").replace(b",", b" , "),
    "small letters": lambda content: re.sub(rb"^N.*$", lambda m: m[0].lower(), content, flags=re.M),
    "no semicolons": lambda content: content.replace(b";", b""),
    "words of 30i": each_line(rb"^(N\d+)A1", rb"\1Q1A1"),
    "comments": each_line(rb"^(\d+,-?\d+)$", rb"\1 # measured"),
}
LINUXCNC: dict[str, Change] = {
    "CR LF": crlf,
    "tabs": lambda content: content.replace(b" ", b"\t"),
    "blanks before": each_line(rb"^(-?\d)", rb"   \1"),
    "signs instead of blanks": each_line(rb" -", rb"-"),
    "plus": each_line(rb" (\d+\.\d+)$", rb" +\1"),
    "comments in the ini file": lambda content: content.replace(b"[TRAJ]", b"# from ncfix\n; and more\n\n[TRAJ]"),
}
CASES = [
    (control, name, change)
    for control, changes in {
        "siemens": SIEMENS,
        "isg": ISG,
        "heidenhain": HEIDENHAIN,
        "heidenhain-kinematics": HEIDENHAIN,
        "fanuc-pitch": PITCH,
        "linuxcnc": LINUXCNC,
    }.items()
    for name, change in changes.items()
]


def at_poses(control: str, files: Files) -> np.ndarray:
    q = np.random.default_rng(3).uniform(-150, 150, (40, 4)) * [0.02, 1, 1, 1]
    ways = np.random.default_rng(4).choice([-1.0, 1.0], (40, 4))
    return get_control(control).read(files).for_tool(50.0).at(("C", "X", "Y", "Z"), q, ways)


@pytest.mark.parametrize(("control", "name", "change"), CASES, ids=[f"{case[0]}: {case[1]}" for case in CASES])
def test_the_same_is_read(control: str, name: str, change: Change) -> None:
    _, files = fresh(control)
    changed = {file: change(content) for file, content in files.items()}
    assert changed != files, name
    assert at_poses(control, changed) == pytest.approx(at_poses(control, files), abs=1e-15)


def test_isg_tables_of_one_file_may_stand_one_after_the_other() -> None:
    """A line that begins with # stands between them."""
    control, files = fresh("isg")
    grids = sorted(name for name in files if name.endswith(".csv"))
    assert len(grids) > 1
    one = {name: content for name, content in files.items() if name not in grids}
    one["volcomp.lis"] = b"".join(
        line for line in files["volcomp.lis"].splitlines(keepends=True) if not re.match(rb"file\w*\[[1-9]", line)
    )
    one[grids[0]] = b"#\n".join(files[name] for name in grids)
    assert not control.lint(one)
    assert (at_poses("isg", one) == at_poses("isg", files)).all()


def test_linuxcnc_takes_actual_positions_if_no_type_is_given() -> None:
    """Its source: comp_file_type = 0 unless the ini file says something else."""
    said = {
        "comp.ini": b"[TRAJ]\nCOORDINATES = X Y Z\nLINEAR_UNITS = mm\n[JOINT_0]\nCOMP_FILE = x\nCOMP_FILE_TYPE = 0\n",
        "x": b"-200 -200.001 -200.003\n300 300.002 299.999\n",
    }
    unsaid = {**said, "comp.ini": re.sub(rb"COMP_FILE_TYPE.*\n", b"", said["comp.ini"])}
    assert at_poses("linuxcnc", said).any()
    assert (at_poses("linuxcnc", said) == at_poses("linuxcnc", unsaid)).all()
    assert any("takes 0" in message.text for message in get_control("linuxcnc").lint(unsaid))


@pytest.mark.parametrize(
    ("name", "file"), [("linuxcnc", "joint_0_X.comp"), ("isg", "volcomp0.csv"), ("heidenhain-kinematics", "AXIS-C.COM")]
)
def test_a_file_of_which_the_end_is_gone_is_remarked_on(name: str, file: str) -> None:
    """Nothing in such a file says that it is whole, and a number of which digits are gone is a number."""
    control, files = fresh(name)
    cut = {**files, file: files[file].rstrip()[:-1]}
    assert any("was the file cut off?" in message.text for message in control.lint(cut))
