"""Small programs, one for every way in which a rewriter of NC programs can go wrong.

`expect`: "right" must come out corrected; "refused" must be left alone with its line named; "either" may be one or the
other, never anything else. All run from a known start unless `start` says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from differential.canon import Controls

HEAD = "G21 G90 G17 G40 G49 G80 G94 G54\n"
SETUP = Controls(
    offsets={"G54": (12.5, -30.0, 40.0), "G55": (-110.0, 60.0, 25.0), "G56": (0.0, 0.0, 0.0)},
    references={"G28": (1.0, 2.0, 250.0), "G30": (5.0, 0.0, 200.0)},
    tools={1: (80.0, 6.0), 2: (112.5, 4.0)},
)


@dataclass(frozen=True, slots=True)
class Case:
    """A program with what it needs."""

    body: str
    expect: str = "right"
    machine: str = "three"
    controls: Controls = field(default=SETUP)
    head: str = HEAD
    tail: str = "M2\n"
    start: bool = True

    @property
    def source(self) -> str:
        """The whole program."""
        return self.head + self.body + self.tail


def five(**more: tuple[float, ...]) -> Controls:
    """The setup of the five-axis cases: offsets of the rotary axes too."""
    return Controls(offsets={"G54": (10.0, 5.0, -20.0, 2.5, 0.0, -40.0), **more}, tools={1: (95.0, 8.0)})


CASES: dict[str, Case] = {
    "straight lines, words absent": Case("G0 X10 Y5 Z20\nG1 Z-1 F300\nX60\nY-40 Z-3\nX-20.5 (back)\nG0 Z30\n"),
    "a line that must be split": Case("G0 X-150 Y0 Z5\nG1 X150 Y120 F500 M8\nX-150 F600\n"),
    "words of all kinds on a line that is split": Case(
        "G0 X-200 Y0 Z5\nN10 G1 X200 Y10 F500 S2000 M3 (long)\nN20 M5\n"),
    "G91": Case("G0 X0 Y0 Z5\nG91\nG1 X10.003 Y0.5 F200\nX10.003\nY-7 Z-1\nX33.3333\nG90 X0\n"),
    "G91 with many small steps": Case("G0 X0 Y0 Z5\nG91 G1 F200\n" + "X0.1234 Y0.0567\n" * 60 + "G90 X1 Y1\n"),
    "G18 arcs": Case("G0 X10 Y0 Z20\nG18 G1 F200 X10\nG2 X30 Z20 I10 K0\nG3 X50 Z40 K20\nG17\n"),
    "G19 arcs": Case("G0 X10 Y0 Z20\nG19 G1 F200 Y0\nG2 Y30 Z20 J15\nG3 Y50 Z40 K20\nG17\n"),
    "full circles": Case("G0 X20 Y0 Z5\nG1 Z0 F200\nG2 I-20\nG3 X20 Y0 I-10 J0\nG2 I-0.5\n"),
    "R arcs": Case("G0 X20 Y0 Z5\nG1 Z0 F200\nG3 X0 Y20 R20\nG2 X15 Y5 R-15\nG3 X25 Y5 R5\n"),
    "helices": Case("G0 X20 Y0 Z5\nG1 F200 X20\nG3 X-20 Y0 Z-3 I-20\nG3 X20 Y0 Z-9 I20 P3\nG2 X0 Y-20 Z1 R20\n"),
    "a big arc": Case("G0 X200 Y0 Z5\nG1 F900 X200\nG3 X-200 Y0 I-200 J0\nG3 X200 Y0 I200 J0\n"),
    "a tiny arc": Case("G0 X2 Y0 Z5\nG1 F900 X2\nG3 X2.02 Y0.02 J0.02 I0\nG2 X2.03 Y0.01 R0.01\n"),
    "G91 arcs": Case("G0 X20 Y0 Z5\nG91 G1 F200 X1\nG3 X-20 Y20 I-20 J0\nG2 X10 Y-10 R10\nG90 G1 X0\n"),
    "G90.1": Case("G0 X20 Y0 Z5\nG1 F200 X20\nG90.1\nG3 X0 Y20 I0 J0\nG2 X10 Y10 I10 J20\nG91.1\nG3 X20 Y0 J-10\n"),
    "an arc that is not quite closed": Case("G0 X20 Y0 Z5\nG1 F200 X20\nG3 X0.003 Y20.004 I-20 J0\nG1 X5\n"),
    "G53": Case("G0 X10 Y10 Z5\nG53 G0 Z0\nG53 G0 X100 Y50\nG0 X10\nG1 Z-2 F100\n"),
    "G28 and G30": Case("G0 X10 Y10 Z5\nG91 G28 Z0\nG90 G0 X20 Y5\nZ5\nG30 Z30\nG1 X0 F100\nZ2\n"),
    "expressions of constants": Case("G0 X[10+2*3] Y[-1] Z5\nG1 X[sqrt[400]] F200\nY[7/2]\n", "either"),
    "parameters": Case("#1=12.5\n#<depth>=-3\nG0 X#1 Y0 Z5\nG1 Z#<depth> F200\nX[#1*2]\n", "either"),
    "an o-word loop": Case(
        "#1=0\nG0 X0 Y0 Z5\no100 while [#1 lt 4]\nG1 X[#1*10] Y5 F200\n#1=[#1+1]\no100 endwhile\n", "either"),
    "a loop with a fixed body": Case("G0 X0 Y0 Z5\nG1 F200\no1 repeat [3]\nX20\nY5\nX0\nY0\no1 endrepeat\n", "either"),
    "a loop with steps": Case("G0 X0 Y0 Z5\nG91 G1 F200\no1 repeat [3]\nX20\nY5\no1 endrepeat\nG90\n", "either"),
    "a subprogram called twice": Case(
        "o<hole> sub\nG0 X#1 Y#2\nG1 Z-3 F100\nG0 Z5\no<hole> endsub\n"
        "G0 Z5\no<hole> call [10] [20]\no<hole> call [30] [5]\n", "either"),
    "a branch": Case("G0 X0 Y0 Z5\n#1=2\no1 if [#1 gt 1]\nG1 X20 F100\no1 else\nG1 X40 F100\no1 endif\nY5\n", "either"),
    "G92": Case("G0 X10 Y10 Z5\nG92 X0 Y0\nG1 X20 Y5 F200\nG92 Z100\nZ95\nG92.1\nG0 X10 Y0 Z5\n", "either"),
    "G55 and back": Case("G0 X10 Y10 Z5\nG55\nG1 X10 F200\nG0 X0 Y0 Z5\nG54 X1\nG1 Y2 F100\n"),
    "G10 L2": Case("G0 X10 Y10 Z5\nG10 L2 P1 X3 Y4\nG1 X10 F200\nG0 X0 Y0 Z5\nG10 L2 P2 Z1\nG55 X0 Y0 Z9\n"),
    "G10 L20": Case("G0 X10 Y10 Z5\nG10 L20 P1 X0 Y0\nG1 X10 F200\nG0 X0 Y0\n", "either"),
    "a turned work offset": Case(
        "G0 X10 Y10 Z5\nG10 L2 P1 R30\nG1 X10 Y10 F200\nX60\nG3 X40 Y30 I-20\nG10 L2 P1 R0\nG1 X0\n"),
    "inch": Case(
        "G0 X1 Y.5 Z.2\nG1 Z-.1 F10\nX2.5\nG2 X3 Y1 I.5 J0\nG91 G1 X.1234 Y-.0321\nX.1234\n",
        head="G20 G90 G17 G54\n"),
    "inch and mm in one program": Case("G0 X10 Y5 Z5\nG20 G1 X1 F10\nY.5\nG21 X30\nY-5\n"),
    "axis letters in comments": Case("(X1 Y2)\nG0 X10 Y5 Z5 ; to X10 Y5\n(G1 X99) G1 X20 F100 (Z-5)\nX30 (F1)\n"),
    "debug and message comments": Case("G0 X10 Y5 Z5\n(MSG, now X20)\nG1 X20 F100\n(DEBUG, depth #1)\nY3\n"),
    "N words": Case("N10 G0 X10 Y5 Z5\nN20 G1 X20 F100\nn0030 Y7\nN40.5 X-250\nN50 G2 X-240 Y17 I10\n"),
    "lower case": Case("g0 x10 y5 z5\ng1 x20 f100\ny-3.5\ng2 x30 y6.5 i10\n"),
    "blanks inside words": Case("G 0 X 1 2.5 Y- 3 Z 5\nG1X2 0F10 0\n\tY 7\nG 2 X 30 Y 17 I 1 0\n"),
    "packed words": Case("G0X10Y5Z5\nG1X20F100\nY-3.5Z4X-100\nG2X-90Y6.5I10\n"),
    "points and signs": Case("G0 X+10. Y-.5 Z5.\nG1 X20. F100.\nY+3.50\nX-0.0\nX.125\n"),
    "words before their G": Case("X10 Y5 Z5 G0\nF100 X20 G1\nY7\nI10 X30 Y17 G2\n"),
    "tape marks and text after them": Case("G0 X10 Y5 Z5\nG1 X20 F100\n", head="%\n" + HEAD, tail="%\nX99 leftover\n"),
    "G93": Case("G0 X0 Y0 Z5\nG93\nG1 X10 F20\nX-200 F2\nG3 X-180 Y20 I0 J20 F8\nG94 G1 X0 F300\n"),
    "G95": Case("M3 S1000\nG0 X0 Y0 Z5\nG95\nG1 X10 F.2\nX-200\nG94 X0 F300\n"),
    "G81": Case("G0 X0 Y0 Z20\nG81 X10 Y5 Z-4 R2 F100\nX30\nY25\nG80\nG0 X0\n"),
    "G83 with G99": Case("G0 X0 Y0 Z20\nG99 G83 X10 Y5 Z-14 R2 Q3 F100\nX60\nG98 Y45\nG80\nG0 X0\n"),
    "G82 to G89": Case(
        "M3 S500\nG0 X0 Y0 Z20\nG82 X10 Y5 Z-4 R2 P.2 F100\nG73 X20 Z-9 R2 Q4\nG85 X40 Z-4 R2\n"
        "G89 X50 Z-4 R2 P.1\nG80\nG0 X0\n"),
    "a cycle repeated in G91": Case("G0 X0 Y0 Z20\nG91 G81 X10 Y2 Z-6 R-5 L3 F100\nG80 G90\nG0 X0 Y0 Z20\n", "either"),
    "cutter compensation": Case("T1 M6\nG0 X-20 Y-20 Z5\nG41 G1 X0 Y0 F200\nY30\nX30\nG40 G0 X60\nG1 Y0\n", "either"),
    "tool lengths": Case("T1 M6\nG43 G0 X10 Y5 Z20\nG1 Z-1 F100\nX20\nT2 M6\nG43 H2 Z20\nG1 X40\nG49 Z30\n"),
    "a spline": Case("G0 X0 Y0 Z5\nG1 F100 X1\nG5.1 X10 Y3 I5 J3\nG1 X20\n", "either"),
    "a thread": Case("M3 S200\nG0 X10 Y0 Z5\nG33 Z-5 K1\nG0 X12\n", "either"),
    "rigid tapping": Case("M3 S200\nG0 X10 Y0 Z5\nG33.1 Z-5 K1\nG0 X12\n", "either"),
    "probing": Case("G0 X10 Y0 Z5\nG38.2 Z-5 F50\nG0 Z5\nX12\n", "either"),
    "a block that is skipped or not": Case("G0 X10 Y5 Z5\n/G1 X20 F100\nG1 X30 F100\n/ Y9\nX0 Y0\n", "either"),
    "blocks skipped": Case(
        "G0 X10 Y5 Z5\n/G1 X20 F100\nG1 X30 F100\n/ Y9\nX0 Y0\n", "either", controls=Controls(block_skip=True)),
    "a start that nobody knows": Case("G1 X10 F100\nY5\nZ3\nX20 Y7\n", "refused", controls=Controls(), start=False),
    "a four-axis program": Case(
        "G0 X10 Y5 Z20 A0\nG1 A45 F500\nX60 A-30\nY10 Z12\nG0 A0\n", machine="four_a", controls=Controls()),
    "five axes at once": Case(
        "T1 M6\nG43 G0 X10 Y5 Z60 A0 C0\nG1 A25 C40 F800\nX30 Y-12 A30 C75\nC-10\nX-20 Z45 A-40 C120.5\nG0 A0 C0\n",
        machine="five_ac", controls=five()),
    "a skewed axis": Case(
        "T1 M6\nG43 G0 X10 Y5 Z60 B0 C0\nG1 B25 C40 F800\nX30 Y-12 B30 C75\nC-10\nX-20 Z45 B60 C120.5\nG0 B0 C0\n",
        machine="five_bc", controls=five()),
    "five axes with inverse time and increments": Case(
        "T1 M6\nG43 G0 X10 Y5 Z60 A0 C0\nG91 G93\nG1 A5 C4 X3 F50\nX3 A5 C4 F50\nX3 A5 C4 F50\nG90 G94 X0 F100\n",
        machine="five_ac", controls=five()),
    "an arc with a turning table": Case(
        "G0 X10 Y5 Z60 A10 C0\nG1 F500 X10\nG3 X-10 Y5 I-10 C90\nG2 X10 Y5 I10 A-10\n", "either", machine="five_ac",
        controls=five()),
    "a fine machine and a table that moves": Case(
        "G0 X-250 Y100 Z5\nG1 X250 Y-80 F900\nG3 X150 Y20 R100\nX0 Y0 R200\nG1 X-3.25\n", machine="table"),
}  # fmt: skip
