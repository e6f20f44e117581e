"""Setup files and tool tables: what they say, and everything that is wrong with them at once."""

from __future__ import annotations

from pathlib import Path

import pytest

from ncfix.control.setup import Setup, Tool
from ncfix.control.setup_file import load, loads
from ncfix.control.tool_files.tables import load_tool_table, may_be_in_inches
from ncfix.diagnostics import ConfigError, ExitCode, SourceError

FULL = """
ncfix = 1
work_offsets.G54 = [1, 2, 3, 10, 20, 30]
work_offsets.G59.1 = { X = 7.5 }
tools.12 = { length = 120.0, radius = 5 }
tools.3 = 80.5
workpiece_offset = [0.0, 0.0, 150]
initial = { X = 0, z = 300.0 }
references.G28 = { Z = 0 }
variables."#100" = 3.0
variables."#<depth>" = -4
tcp = true
assume_zero = false
block_skip = true
most_blocks = 20_000_000
"""


def test_every_key_is_read() -> None:
    assert loads(FULL) == Setup(
        work_offsets={"G54": {"X": 1, "Y": 2, "Z": 3, "A": 10, "B": 20, "C": 30}, "G59.1": {"X": 7.5}},
        tools={12: Tool(120.0, 5.0), 3: Tool(80.5, None)},
        initial={"X": 0.0, "Z": 300.0},
        references={"G28": {"Z": 0.0}},
        variables={"#100": 3.0, "#<depth>": -4.0},
        workpiece_offset=(0.0, 0.0, 150.0),
        tcp=True,
        assume_zero=False,
        block_skip=True,
        most_blocks=20_000_000,
    )


def test_an_empty_file_is_an_empty_setup() -> None:
    assert loads("") == Setup()


def test_all_faults_are_named_at_once() -> None:
    text = """
ncfix = 2
work_ofsets.G54 = [0]
work_offsets.G53 = [0]
work_offsets.G55 = "X0"
tools.a = 5
tools.4 = { lenght = 1.0 }
initial = { Q = 1 }
workpiece_offset = [1, 2]
references.G29 = { X = inf }
variables.depth = 1
tcp = 1
most_blocks = 0
"""
    with pytest.raises(ConfigError) as caught:
        loads(text, "part.toml")
    found = [
        (message.place.line if message.place else 0, message.code, message.text, message.hint)
        for message in caught.value.messages
    ]
    assert found == [
        (2, "NCF383", "ncfix: schema version 2, this ncfix reads 1", ""),
        (3, "NCF382", "work_ofsets: unknown key 'work_ofsets'", "did you mean 'work_offsets'?"),
        (4, "NCF382", "work_offsets.G53: not a work offset", "they are G54 ... G59.3, and G54.1P1 ..."),
        (5, "NCF383", "work_offsets.G55: expected a table [work_offsets.G55], found 'X0'", ""),
        (6, "NCF382", "tools.a: not a tool number", ""),
        (7, "NCF382", "tools.4.lenght: unknown key 'lenght'", "did you mean 'length'?"),
        (8, "NCF382", "initial.Q: not an axis letter", "they are X Y Z A B C U V W"),
        (9, "NCF383", "workpiece_offset: expected a list of 3 numbers, found a list of 2", ""),
        (10, "NCF382", "references.G29: not a reference point", "they are G28, G30 and M92"),
        (10, "NCF383", "references.G29.X: inf is not a finite number", ""),
        (11, "NCF382", "variables.depth: not a parameter", 'they are written "#100" or "#<name>"'),
        (12, "NCF383", "tcp: expected true or false, found 1", ""),
        (13, "NCF383", "most_blocks: expected a whole number above zero, found 0", ""),
    ]
    assert str(caught.value).splitlines()[:3] == [
        "part.toml:2:1: NCF383: ncfix: schema version 2, this ncfix reads 1",
        "    ncfix = 2",
        "    ^",
    ]
    assert caught.value.exit_code == ExitCode.UNREADABLE


def test_a_text_that_is_no_toml() -> None:
    with pytest.raises(ConfigError) as caught:
        loads("work_offsets = [")
    assert caught.value.code == "NCF381"
    with pytest.raises(ConfigError, match=r"^s.toml:2:7: NCF381: not TOML: Invalid value\n    tcp = \n"):
        loads("# one\ntcp = \n", "s.toml")


def test_names_with_dots_are_found() -> None:
    with pytest.raises(ConfigError) as caught:
        loads('[work_offsets]\n"G59.1" = 3\n[tools]\n"DRILL 8.5" = { lenght = 3 }\n')
    assert [message.place.line for message in caught.value.messages if message.place] == [2, 4]


@pytest.mark.parametrize("key", ['"G54.1P5"', '"G54.1 P5"', "G54.1P5"])
def test_a_work_offset_is_named_as_in_a_program(key: str) -> None:
    assert loads(f"[work_offsets]\n{key} = [1]\n").work_offsets == {"G54.1P5": {"X": 1.0}}


def test_the_same_work_offset_with_and_without_a_blank_is_there_twice() -> None:
    with pytest.raises(ConfigError, match=r"G54\.1P5 appears twice"):
        loads('[work_offsets]\n"G54.1 P5" = [1]\n"G54.1P5" = [1]\n')


def test_files_are_utf_8_with_or_without_its_mark(tmp_path: Path) -> None:
    path = tmp_path / "setup.toml"
    path.write_text(FULL, encoding="utf-8")
    assert load(str(path)) == loads(FULL)
    path.write_text(FULL, encoding="utf-8-sig")
    assert load(str(path)) == loads(FULL)
    path.write_bytes(FULL.encode("utf-16"))
    with pytest.raises(ConfigError, match="not a text in UTF-8"):
        load(str(path))
    with pytest.raises(SourceError):
        load(str(tmp_path / "none.toml"))


# -- tool tables ------------------------------------------------------------------------------------------------------


def table(tmp_path: Path, name: str, text: str) -> dict[int | str, Tool]:
    """The tools of a table."""
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return load_tool_table(str(path))


def test_linuxcnc_tables(tmp_path: Path) -> None:
    text = "; my tools\nT1 P1 X0 Z+120.5 D10 ;end mill\n\nT2 P2 Z.5\nt3p3z-1.25d+0.5Q0\nT4 P9\nT5 Z1.2e2 D1E+1\n"
    assert table(tmp_path, "tool.tbl", text) == {
        1: Tool(120.5, 5.0),
        2: Tool(0.5, None),
        3: Tool(-1.25, 0.25),
        4: Tool(0.0, None),
        5: Tool(120.0, 5.0),
    }


def test_linuxcnc_tables_of_other_programs_begin_with_lines_for_people(tmp_path: Path) -> None:
    text = "Tool Table\n----\n(of a screen)\nGenerated on: 01/29/2029\n\n;Tool Pocket\nT1 P1 Z100 ; MILL\n"
    assert table(tmp_path, "tool.tbl", text) == {1: Tool(100.0)}


def test_a_tool_that_is_offset_along_another_axis_has_no_known_length(tmp_path: Path) -> None:
    path = tmp_path / "t.tbl"
    path.write_text("T1 X0.5 Z100\nT2 Z100 U1 B45\nT3 X0 Z100\n")
    assert load_tool_table(str(path), "XYZ") == {1: Tool(None, None, "X0.5"), 2: Tool(100.0), 3: Tool(100.0)}
    assert load_tool_table(str(path))[2] == Tool(None, None, "B45 U1")


@pytest.mark.parametrize(
    ("lengths", "inches"),
    [([3.9, 8.3], True), ([3.9, 98.0], False), ([0.5], False), ([0.0, 0.0], False), ([-3.0, -5.0], False)],
)
def test_a_table_without_any_tool_of_a_length_may_be_in_inches(lengths: list[float], inches: bool) -> None:
    assert bool(may_be_in_inches({n: Tool(length) for n, length in enumerate(lengths)})) == inches


def test_csv_tables(tmp_path: Path) -> None:
    assert table(tmp_path, "tools.csv", "tool,length,radius\n1,100.5,5\n\n2, 80 ,2.5\n") == {
        1: Tool(100.5, 5.0),
        2: Tool(80.0, 2.5),
    }
    assert table(tmp_path, "tools.csv", "\ufeffLength,Tool,Diameter\n100.5,1,5\n") == {1: Tool(100.5, 2.5)}
    assert table(tmp_path, "tools.csv", "tool,length\n1,100.5\n") == {1: Tool(100.5, None)}
    named = 'Tool,Name,Length,Comment\n1,"MILL D10",100.5,\n'
    assert table(tmp_path, "tools.csv", named) == {1: Tool(100.5, None)}


@pytest.mark.parametrize("mark", [";", "\t"])
@pytest.mark.parametrize("decimal", [",", "."])
@pytest.mark.parametrize("coding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_csv_tables_of_spreadsheets(tmp_path: Path, mark: str, decimal: str, coding: str) -> None:
    text = "tool|length|radius\r\n1|100.5|5\r\n2|80.25|2.5\r\n".replace(".", decimal).replace("|", mark)
    (tmp_path / "tools.csv").write_bytes(text.encode(coding))
    assert load_tool_table(str(tmp_path / "tools.csv")) == {1: Tool(100.5, 5.0), 2: Tool(80.25, 2.5)}


@pytest.mark.parametrize(
    ("name", "text", "faults"),
    [
        ("t.tbl", "T1 Z1\nnonsense\nP2 Z1\nT1 Z2\n", [2, 3, 4]),
        ("t.tbl", "; nothing\n", [0]),
        ("t.tbl", "T3 Z1 Z2\nT4 Z1.2.3\nT5 Z1,2\nT6 R5 Z1\n", [1, 2, 3, 4]),
        ("t.tbl", "POC FMS LEN DIAM\n1 1 100.0 6.0\n", [2]),
        ("t.csv", "tool,length\n1,2,3\n2,1.5x\n-1,1\n1.5,2\n", [2, 3, 4, 5]),
        ("t.csv", "tool;length\n1;1.234,5\n2;100,5\n3;100.5\n", [2, 4]),
        ("t.csv", "tool|length\n1|2\n", [1]),
        ("t.csv", "tool,length,colour\n1,2,red\n", [1]),
        ("t.csv", 'tool,length\n1,"2,5"\n', [2]),
        ("t.csv", "tool,length\n1,\n", [2]),
        ("t.csv", "tool,length,length\n1,100,50\n", [1]),
        ("t.csv", "tool,length,radius,diameter\n1,100,5,10\n2,100,5,12\n", [3]),
        ("t.csv", "tool,length\n1,nan\n", [2]),
        ("t.toa", "$TC_DP3[1,1]=1O0\n$TC_DP3[2,1]=100\n$TC_ADP1[3]=50.0\n", [1, 3]),
        ("t.toa", "$TC_DP3[1,1]=100\n$TC_SCP13[1,1]=0.5\n$TC_ECP13[1,1]=0\n$TC_ECP13[1,2]=-1\n", [2, 4]),
        ("t.toa", "CHANDATA(1)\n$TC_DP3[1,1]=100\nCHANDATA(2)\n$TC_DP3[1,1]=90\n", [0]),
        ("t.nc", "G20\nG10 L10 P1 R4.5\nG21\nG10 L10 P2 R90.\n", [0]),
        ("t.nc", "G10 L10 P1 R100.\nG10 L10 P1 R90.\nG10 L10 P2 R90000\nG91 G10 L10 P3 R1.\nG1 X5.\n", [2, 3, 4, 5]),
    ],
)
def test_wrong_lines_are_named_all_at_once(tmp_path: Path, name: str, text: str, faults: list[int]) -> None:
    with pytest.raises(ConfigError) as caught:
        table(tmp_path, name, text)
    assert [message.place.line for message in caught.value.messages if message.place] == faults
    assert {message.code for message in caught.value.messages} == {"NCF385"}


TOOL_DATA = """\
%_N_TO1_TOA
;$PATH=/_N_TOA_DIR
CHANDATA(1)
$TC_DP1[1,1]=120
$TC_DP3[1,1]=120.5
$TC_DP6[1,1]=5 $TC_DP12[1,1]=-0.02 $TC_DP15[1,1]=0.01
$TC_DP3[1,2]=90 ; the shoulder
$TC_TP2[2]="Drill 8.5"
$TC_DP1[2,1]=200
$TC_DP3[2,1]=85
$TC_DP21[2,1]=50.0
$TC_DP3[2,2]=80.0
$TC_DP3[3,1]=70.0
$TC_DP5[3,1]=2.5
$TC_DP1[4,1]=500
$TC_DP3[4,1]=40.0
$TC_TP2[5]="MILL"
$TC_TP2[6]="MILL"
$TC_DP3[5,1]=100.0
$TC_DP3[6,1]=101.0
M17
"""


def test_tool_data_of_sinumerik(tmp_path: Path) -> None:
    """Wear and base count; edges, names and lengths aside; no turning tools, and none of two of the same name."""
    found = table(tmp_path, "TO.INI", TOOL_DATA)
    assert found == {
        1: Tool(pytest.approx(120.48), pytest.approx(5.01)),
        "1 D2": Tool(90.0, 0.0),
        "DRILL 8.5": Tool(135.0, 0.0),
        "DRILL 8.5 D2": Tool(80.0, 0.0),
        3: Tool(None, 0.0, "X2.5"),
    }


def test_offsets_of_fanuc_as_a_program(tmp_path: Path) -> None:
    """A wear of zero alone gives no length."""
    text = "%\nO9000(OFFSETS)\nG90G10L10P1R120.5\nG10 L11 P1 R-.02\nG10 L12 P1 R5.\nG10 L11 P2 R0\nM30\n%\n"
    assert table(tmp_path, "OFFSET.TXT", text) == {1: Tool(pytest.approx(120.48))}


@pytest.mark.parametrize("block", ["G10 G90 L10 P1 R120.5", "g10p1l10r120.5", "N7 G90 G10 L10 R120.5 P001;"])
def test_offsets_of_fanuc_in_any_order_of_words(tmp_path: Path, block: str) -> None:
    assert table(tmp_path, "OFFSET.TXT", f"%\nG10 G90 L2 P1 X-310.5\n{block}\n%\n") == {1: Tool(120.5)}
    with pytest.raises(ConfigError, match=r":4: NCF385: G91: adds"):
        table(tmp_path, "OFFSET.TXT", f"%\n{block}\n%\nG10 G91 L10 P2 R1.\n")


@pytest.mark.parametrize(("unit", "scale"), [("", 1.0), ("G21\n", 1.0), ("G20 G90\n", 25.4)])
def test_offsets_of_fanuc_among_settings_and_notes(tmp_path: Path, unit: str, scale: float) -> None:
    text = f"%\nO9999 (OFFSETS)\n{unit}G90\nG10 L2 P1 X-310.5 Y-94. Z0 (G54)\nG10 L10 P1 R4.5 (T1 - DRILL)\n"
    assert table(tmp_path, "OFFSET.NC", f"{text}N5 G10 L12 P1 R.5 (D);\nM30\n%\n") == {
        1: Tool(pytest.approx(4.5 * scale))
    }


@pytest.mark.parametrize("kind", ["", "L1", "L11"])
def test_offsets_of_fanuc_without_a_wear(tmp_path: Path, kind: str) -> None:
    """The whole on a control without L10, and a wear beside it."""
    assert table(tmp_path, "OFFSET.TXT", f"%\nG10 {kind} P3 R80.\n%\n") == {3: Tool(80.0)}
    with pytest.raises(ConfigError, match=r":3: NCF385: offset 3 has a wear \(L11\) but no length"):
        table(tmp_path, "OFFSET.TXT", f"%\nG10 L10 P1 R120.5\nG10 {kind} P3 R80.\n%\n")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("tool.tbl", "T1 P1 Z4.5 D0.5\n"),
        ("tools.csv", "tool,length,diameter\n1,4.5,0.5\n"),
        ("to.ini", "$TC_DP3[1,1]=4.5\n$TC_DP6[1,1]=0.25\n"),
        ("BEGIN.T", "BEGIN TOOL .T INCH\nT   L    R\n1   4.5  0.25\n[END]\n"),
    ],
)
def test_tables_in_inches(tmp_path: Path, name: str, text: str) -> None:
    """A TOOL.T says its unit itself."""
    (tmp_path / name).write_text(text)
    found = load_tool_table(str(tmp_path / name), unit="inch")
    assert found == {1: Tool(pytest.approx(114.3), pytest.approx(6.35))}


def test_a_machine_file_is_known_for_one(root: Path) -> None:
    with pytest.raises(ConfigError, match="this is a machine file, not a setup file") as raised:
        load(str(root / "examples/machines/dmu50.toml"))
    assert len(raised.value.messages) == 1
