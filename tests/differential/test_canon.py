"""The harness around LinuxCNC's interpreter: machine positions that can be worked out by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from differential import canon, canon_text, paths
from differential.canon import ARC, Canon, Controls

CONTROLS = Controls(
    offsets={"G54": (10.0, 20.0, 30.0, 4.0), "G55": (100.0, 200.0, 300.0)},
    references={"G30": (7.0,)},
    tools={1: (50.0, 6.0), 2: (20.0, 3.0)},
)
HEAD = "G21 G90 G17 G54\n"


def ends(result: Canon) -> list[list[float]]:
    assert result.accepted, result.error
    assert result.exact.all()
    return result.end[:, :4].round(9).tolist()


def test_offsets_tools_and_rotation_give_machine_positions(rs274: Callable[..., Canon]) -> None:
    source = HEAD + "T1 M6\nG43 G0 X1 Y2 Z3\nG10 L2 P1 R90\nX1 Y2\nG55 X0 Y0 Z0 A3\nG92 X5\nX6\nG92.1\nG43 H2 Z0\nM2\n"
    machine = ends(rs274(source.encode(), CONTROLS))
    assert machine == [
        [11, 22, 83, 0],  # G54 and 50 mm of tool; A has not moved from machine zero
        [8, 21, 83, 0],  # turned by 90 degrees about the origin of G54
        [100, 200, 350, 3],
        [101, 200, 350, 3],  # G92 X5 calls where it is 5
        [101, 200, 320, 3],
    ]


def test_references_and_machine_coordinates(rs274: Callable[..., Canon]) -> None:
    source = HEAD + "G0 X1 Y1 Z1 A1\nG53 G0 X3\nG30\nM2\n"
    machine = ends(rs274(source.encode(), CONTROLS))
    assert machine[1:] == [[3, 21, 31, 5], [3, 21, 31, 5], [7, 0, 0, 0]]


def test_the_start_position_can_be_given(rs274: Callable[..., Canon]) -> None:
    result = rs274(b"G21 G91 G0 X1\nM2\n", Controls(initial=(5.0, 6.0, 7.0, 0.0, 0.0, 0.0)))
    assert result.start[0, :3].tolist() == [5.0, 6.0, 7.0]


def test_inch_programs_are_told_in_mm(rs274: Callable[..., Canon]) -> None:
    assert ends(rs274(b"G20 G90 G54\nG0 X1 Y0 Z0 A2\nM2\n", CONTROLS)) == [[35.4, 20, 30, 6]]


@pytest.mark.parametrize(
    ("plane", "block", "middle"),
    [
        ("G17", "G2 X10 Y10 I10", (2.9289, 7.0711, 0.0)),
        ("G18", "G3 X10 Z10 I10", (2.9289, 0.0, 7.0711)),
        ("G18", "G2 X10 Z10 K10", (7.0711, 0.0, 2.9289)),
        ("G19", "G3 Y10 Z10 K10", (0.0, 7.0711, 2.9289)),
        ("G17", "G3 X10 Y0 I5", (5.0, -5.0, 0.0)),
        ("G17", "G2 X0 Y0 I5", (10.0, 0.0, 0.0)),
        ("G17", "G2 X0 Y0 Z8 I5 P2", (0.0, 0.0, 4.0)),
    ],
)
def test_arcs_run_the_right_way_in_all_planes(
    rs274: Callable[..., Canon], plane: str, block: str, middle: tuple[float, ...]
) -> None:
    result = rs274(f"G21 G90 {plane} F100\nG0 X0 Y0 Z0\n{block}\nM2\n".encode())
    row = np.flatnonzero(result.kind == ARC)
    np.testing.assert_allclose(paths.at(result, row, np.array([0.5]))[0, :3], middle, atol=1e-4)
    back = paths.fraction_of(result, row, paths.at(result, row, np.array([0.3])), np.zeros(1))
    assert back[0] == pytest.approx(0.3)


def test_lines_of_an_arc_in_turned_coordinates(rs274: Callable[..., Canon]) -> None:
    source = b"G21 G90 G17 F100\nG10 L2 P1 X5 R90\nG54 G0 X0 Y0 Z0\nG2 X10 Y10 I10\nM2\n"
    result = rs274(source)
    half = paths.at(result, np.array([1]), np.array([0.5]))[0, :3]
    np.testing.assert_allclose(half, (5 - 7.0711, 2.9289, 0.0), atol=1e-4)


def test_other_calls_come_with_their_place(rs274: Callable[..., Canon]) -> None:
    result = rs274(b"G21 G90 G94\nM3 S100\nG0 X1\n(hello X3)\nG1 X2 F50\nM8\nG4 P1\nM2\n")
    told = {(call.name, call.after) for call in result.calls}
    assert {("START_SPINDLE_CLOCKWISE", 0), ("SET_SPINDLE_SPEED", 0), ("FLOOD_ON", 2), ("DWELL", 2)} <= told
    assert next(call.arguments for call in result.calls if "hello" in call.arguments) == '"hello X3"'


def test_cycles_cutter_compensation_and_splines_are_known(rs274: Callable[..., Canon]) -> None:
    source = b"G21 G90 G17 F100\nG0 X0 Y0 Z5\nG81 X1 Y1 Z-2 R1\nX2\nG80\nG0 Z9\nM2\n"
    result = rs274(source, CONTROLS)
    assert set(result.mode[result.line == 4].tolist()) == {810}
    assert result.mode[-1] == 0
    contour = rs274(b"G21 G90 G17 F100\nT2 M6\nG0 X-9 Y0\nG41 G1 X0\nY10\nG40 G0 X-9\nM2\n", CONTROLS)
    assert contour.exact.all()
    assert contour.side.tolist()[1:3] == [410, 410]
    spline = rs274(b"G21 G90 G17 F100\nG0 X0 Y0\nG5.1 X10 I5 J3\nG1 X20\nM2\n")
    assert spline.exact.all()
    assert len(spline) >= 3


def test_block_skip_and_refusals(rs274: Callable[..., Canon]) -> None:
    source = b"G21 G90\nG0 X1\n/ X2\nX3\nM2\n"
    assert len(rs274(source)) == 3
    assert len(rs274(source, Controls(block_skip=True))) == 2
    bad = rs274(b"G21 G90\nG0 X1\nX1 X2\nM2\n")
    assert not bad.accepted
    assert "X1 X2" in bad.error


def test_subprograms_are_found_beside_the_program(rs274: Callable[..., Canon], tmp_path: object) -> None:
    folder = tmp_path
    (folder / "hole.ngc").write_text("o<hole> sub\nG0 X[#1]\no<hole> endsub\nM2\n")  # type: ignore[operator]
    assert ends(rs274(b"G21 G90\no<hole> call [7]\nM2\n", None, folder))[0][0] == 7.0


def test_printed_numbers_alone_give_the_same_positions(
    rs274: Callable[..., Canon], monkeypatch: pytest.MonkeyPatch
) -> None:
    source = (HEAD + "T1 M6\nG43 G0 X1 Y2 Z3\nG10 L2 P1 R30\nG18 F9\nG2 X3 Z5 I1 K1\nG20\nG92 Y2\nG1 Y1\nM2\n").encode()
    exact = rs274(source, CONTROLS)
    monkeypatch.setattr(canon, "_run_extension", lambda *arguments: None)
    printed = rs274(source, CONTROLS)
    assert exact.exact.all()
    assert not printed.exact.any()
    np.testing.assert_allclose(printed.end, exact.end, atol=2 * canon_text.LAST_DIGIT * canon_text.MM)
    np.testing.assert_allclose(printed.centre, exact.centre, atol=2e-4)
    np.testing.assert_allclose(printed.normal, exact.normal, atol=1e-12)
