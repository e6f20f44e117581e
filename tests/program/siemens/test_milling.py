"""Milling cycles: what of a call changes, and which calls are refused.

The machine is off by a constant shift: -12.4, 21.3 and 8.5 um are its corrections.
"""

from __future__ import annotations

import pytest

from differential.sinumerik_milling import NAMES, OLDER
from ncfix.diagnostics import RefusedError
from ncfix.testing.judging import SHIFT
from program.siemens.test_holes import fixed, written

NEAR = 0.00051
"""Half an output step."""
POCKET = "POCKET3(40,0,1,-10,40,30,5,20,30,0,5,0,0,1000,200,0,11)"
STUD = "CYCLE77(40,0,1,{},{},20,5,5,4,0,0,200,100,0,1,25,1,2,{})"
MOVED_STUD = STUD.replace("(40,0,", "(40,0.008,").replace("20,5,5", "20,4.988,5.021")
FULL = "POCKET4(40,{},1,{},20,{},5,0,0,0.1,0.1,0,{},50,9,15,0,2,0,1,2,10100,{},{})"


def arguments(name: str, count: int, **said: str) -> dict[str, str]:
    """Arguments by name, each another number, but for what is said."""
    found = {each: str(place + 100) for place, each in enumerate(NAMES[name][:count])}
    found |= {"RTP": "40", "RFP": "0", "SDIS": "1", "DP": "-10", "PA": "20", "PO": "30", "VARI": "11", "DMODE": "1"}
    return {each: (found | {"DPR": "", "AMODE": "110"} | said)[each] for each in NAMES[name][:count]}


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("older", [True, False])
def test_place_and_heights_move_as_one_and_nothing_else_changes(name: str, older: bool) -> None:
    count = OLDER.get(name, len(NAMES[name])) if older else len(NAMES[name])
    before = arguments(name, count, **({"AMODE": "10"} if name == "CYCLE61" else {}))
    line = written(f"{name}({','.join(before.values())}) ; as it was")
    found, _, behind = line.removeprefix(f"{name}(").partition(")")
    after = dict(zip(before, found.split(","), strict=True))
    assert behind == " ; as it was"
    changed = {each: float(after[each]) - float(before[each]) for each in before if after[each] != before[each]}
    assert changed.keys() == {"RFP", "DP", "PA", "PO"}
    for each, axis in (("PA", "X"), ("PO", "Y"), ("RFP", "Z"), ("DP", "Z")):
        assert abs(changed[each] - SHIFT[axis]) <= NEAR


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (FULL.format("0", "5", "1.,2.50", 21, 1, 111), FULL.format("0.008", "5", "0.988,2.521", 21, 1, 111)),
        (FULL.format("", "-5", "1,2", 25, 1, 110), FULL.format("0.008", "-4.992", "0.988,2.021", 25, 1, 110)),
        (
            "CYCLE61(40,1,1,-7,1,2,50,60,5,5,0,100,31,0,1,1110)",
            "CYCLE61(40,1.008,1,-6.992,0.988,2.021,49.988,60.021,5,5,0,100,31,0,1,1110)",
        ),
        (STUD.format("", "6", "1,1,110"), MOVED_STUD.format("", "6", "1,1,110")),
        ("G18\nPOCKET2(40,0,1,-4,,9,5,6)\nG17", "G18\nPOCKET2(40,0.021,1,-3.979,,9,5.008,5.988)\nG17"),
        ("G91\nPOCKET2(40,0,1,-4,,9,5,6)\nG90", "G91\nPOCKET2(40,0.008,1,-3.992,,9,4.988,6.021)\nG90"),
        ("N5 R1=5\nN6 POCKET2(40,0,1,-4,,R1,R1+1,6,R9)", "N5 R1=5\nN6 POCKET2(40,0.008,1,-3.992,,R1,5.988,6.021,R9)"),
        (
            "MCALL POCKET2(40,0,1,-4,,9)\nX5 Y6\nMCALL",
            "MCALL POCKET2(40,0,1,-4,,9)\nMCALL POCKET2(40,0.008,1,-3.992,,9)\nX4.988 Y6.021\n"
            "MCALL POCKET2(40,0,1,-4,,9)\nMCALL",
        ),
        ("POCKET2(2,1,1,-4,,9,5,6)", "POCKET2(2,1,1,-4,,9,4.988,6.021)"),
    ],
)
def test_how_it_is_written(body: str, expected: str) -> None:
    """A way down, an opposite corner, another plane, formulas, and a cycle that would begin above where it ends."""
    assert written(body) == expected


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (POCKET.replace(",20,30,", ",R9,30,"), "known only at run time"),
        (POCKET.replace("-10", "R9"), "known only at run time"),
        (POCKET.replace(",20,30,", ",,30,"), "does not give its position"),
        ("POCKET3(40,0,1,-10,40,30)", "does not give its position"),
        (POCKET.replace("(40,", "(0,"), "one below the other"),
        (POCKET.replace("-10", "3"), "one below the other"),
        (POCKET.replace("-10", ""), "one below the other"),
        (FULL.format("0", "-5", "1,2", 21, 1, 111), "must be positive"),
        (FULL.format("0", "-5", "1,2", 21, 1, 112), "must be positive"),
        (FULL.format("0", "-5", "1,2", 15, 1, 10), "a chamfer"),
        (FULL.format("0", "-5", "1,2", 21, 2, 110), "another plane"),
        (STUD.format("-5", "6", "1,1,0"), "gives its depth twice"),
        (f"MCALL {POCKET}\nX5 Y6\nMCALL", "its own position"),
        (f"DIAMON\n{POCKET}\nDIAMOF", "a diameter"),
        (f"X5 {POCKET}", "in one block"),
        (f"{POCKET} M8", "not plain words"),
        (f"{POCKET}\nG1 X5 F100", "after a cycle"),
        (f"FOR R1=1 TO 2\n{POCKET.replace(',20,', ',20*R1,')}\nENDFOR", "several states"),
        ('CYCLE63("CONTOUR",1,40,0,1,5,500,,5,3,0,0,0,,,,,,1,2,,,,0,1,101)', "the control generates"),
        ("CYCLE899(40,0,1,-10,50,20,5,6,0,4,2,0,0,500,0,11,0,1,10)", "the control generates"),
    ],
)
def test_what_is_refused(body: str, why: str) -> None:
    reasons = [each.reason for each in fixed(body).report.refused]
    assert any(why in reason for reason in reasons), reasons


def test_what_it_mills_is_said_to_move_as_a_whole() -> None:
    messages = fixed(f"{POCKET}\n{POCKET}").report.warnings
    assert [each.code for each in messages].count("NCF280") == 1


def test_a_subprogram_of_that_name_is_no_cycle() -> None:
    """It is followed, as the control would."""
    body = f"{POCKET}\nM30\n%_N_POCKET3_SPF\nPROC POCKET3(REAL A)\nG1 X5 F100\nM17"
    assert "G1 X4.988 F100" in fixed(body).text.decode()


CONTOUR = 'CYCLE72("{}",40,0,1,-10,5,0,0,1000,200,{},41,1,5,200,1,5)'
SUBPROGRAM = "M30\n%_N_SHAPE_SPF\n{}\nM17"
SHAPE = "G1 G90 X10 Y20\nX30 RND=2\nG2 X40 Y30 CR=10\nG3 X50 Y40 I10 J0\nG1 X10 Y20"
MOVED = "G1 G90 X9.988 Y20.021\nX29.988 RND=2\nG2 X39.988 Y30.021 CR=10\nG3 X49.988 Y40.021 I10 J0\nG1 X9.988 Y20.021"
EDITOR = "M30\nE_LAB_A_ONE: ;#SM Z:2\n;#7__DlgK contour definition begin;*GP*\nG17 G90 DIAMOF;*GP*\n{}\nE_LAB_E_ONE:"
LABELS = "M30\nFIRST:\n{}\nLAST:"


@pytest.mark.parametrize(
    ("calls", "contour"),
    [
        (CONTOUR.format("SHAPE", 11), SUBPROGRAM),
        (CONTOUR.format("shape", 11) + "\n" + CONTOUR.format("SHAPE", 2), SUBPROGRAM),
        (CONTOUR.format("FIRST:LAST", 10011), LABELS),
        (CONTOUR.format("FIRST:LAST", 11).replace("1000", "R9"), LABELS),
        ('CYCLE62("ONE",1,,)\n' + CONTOUR.format("", 111), EDITOR),
        ('CYCLE62("SHAPE",0)\n' + CONTOUR.format("", 111), SUBPROGRAM),
        ('CYCLE62(,2,"FIRST","LAST")\n' + CONTOUR.format("", 111), LABELS),
        ("FOR R1=1 TO 2\n" + CONTOUR.format("SHAPE", 11) + "\nENDFOR", SUBPROGRAM),
    ],
)
def test_a_contour_is_corrected_at_its_points_and_its_cycle_in_depth(calls: str, contour: str) -> None:
    """The height in force, and the code for motions, are those of before behind it."""
    found = fixed(f"{calls}\nX5 Y6\n{contour.format(SHAPE)}")
    assert not found.report.refused
    text = found.text.decode()
    assert calls.replace("40,0,1,-10", "40,0.008,1,-9.992") + "\nX4.988 Y6.021\n" in text
    assert contour.format(MOVED) in text
    assert [each.code for each in found.report.warnings].count("NCF280") == 1


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (CONTOUR.format("OTHER", 11) + "\n", "is not found"),
        (CONTOUR.format("N10:N20", 11) + "\nM30\nN10 G1 X5 Y6\nX7\nN20", "is not found"),
        (CONTOUR.format("LAST:FIRST", 11) + "\n" + LABELS.format(SHAPE), "is not found"),
        (CONTOUR.format("", 11) + "\n" + LABELS.format(SHAPE), "is not found"),
        ('CYCLE62("A",0)\nCYCLE62("SHAPE",0)\n' + CONTOUR.format("", 1) + SUBPROGRAM.format(SHAPE), "is not found"),
        (CONTOUR.format("FIRST:LAST", 15) + "\n" + LABELS.format(SHAPE), "a chamfer"),
        (CONTOUR.format("FIRST:LAST", 11)[:-1] + ",0)\n" + LABELS.format(SHAPE), "this number of arguments"),
        ("G91\n" + CONTOUR.format("FIRST:LAST", 11) + "\nG90\n" + LABELS.format(SHAPE), "in G90 and G40"),
        (
            f"MCALL CYCLE81(40,0,1,-5)\n{CONTOUR.format('FIRST:LAST', 11)}\nMCALL\n{LABELS.format(SHAPE)}",
            "not under MCALL",
        ),
        ("MCALL " + CONTOUR.format("FIRST:LAST", 11) + "\nX5 Y6\nMCALL\n" + LABELS.format(SHAPE), "by MCALL"),
        *(
            (CONTOUR.format("FIRST:LAST", 11) + "\n" + LABELS.format(f"{SHAPE}\n{block}"), "more than a line")
            for block in (
                "G1 Z5",
                "G91 X5",
                "M8",
                "TRANS X5",
                "R1=5",
                "/X5",
                "SHAPE",
                "G42 X5",
                "T2",
                "G18",
                "ANG=5 X3",
            )
        ),
        (CONTOUR.format("FIRST:LAST", 11) + "\n" + LABELS.format("G1 X5\nY6"), "does not begin"),
        (CONTOUR.format("FIRST:LAST", 11) + "\n" + LABELS.format("X5 Y6\nX7"), "does not begin"),
        (CONTOUR.format("FIRST:LAST", 11) + "\n" + LABELS.format("G1 X=R9 Y6\nX7"), "does not begin"),
        (CONTOUR.format("FIRST:LAST", 11) + "\n" + LABELS.format("G1 X=IC(5) Y6\nX7"), "does not begin"),
    ],
)
def test_which_contours_are_refused(body: str, why: str) -> None:
    reasons = [each.reason for each in fixed(body).report.refused]
    assert any(why in reason for reason in reasons), reasons


def test_contours_that_another_cycle_has_used_are_none_of_the_next() -> None:
    before = 'CYCLE62("OTHER",0)\nCYCLE63("P",1,40)\nG0 X5 Y6 Z50\nCYCLE62("SHAPE",0)\n'
    found = fixed(f"{before}{CONTOUR.format('', 11)}\n{SUBPROGRAM.format(SHAPE)}")
    assert [each.line for each in found.report.refused] == [3]


def test_a_contour_is_not_written_out() -> None:
    with pytest.raises(RefusedError, match=r"NCF239.*the contour that CYCLE72 mills"):
        fixed(
            "FOR R1=1 TO 2\nX=R1*5\nENDFOR\n" + CONTOUR.format("FIRST:LAST", 11) + "\n" + LABELS.format(SHAPE),
            flat=True,
        )


def test_a_contour_that_is_milled_in_two_frames_is_refused() -> None:
    """Where its points are corrected otherwise it cannot be one."""
    call = CONTOUR.format("FIRST:LAST", 11)
    body = f"{call}\nROT Z90\n{call}\nROT\n{LABELS.format(SHAPE)}"
    assert any("several states" in each.reason for each in fixed(body).report.refused)
