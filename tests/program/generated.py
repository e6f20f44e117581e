"""Random short programs that exercise everything that has a meaning for positions, most of them valid."""

from __future__ import annotations

from random import Random

OFFSETS = ("G92.1", "G92.2", "G92.3", "G54", "G55", "G56", "G59.3", "G49", "G43 H1", "T1 M6", "T2 M6 G43", "G43.2 H2")
MODES = (
    "G20",
    "G21",
    "G90",
    "G91",
    "G98",
    "G99",
    "G80",
    "S5 M4",
    "G64 P0.1",
    "G4 P.1",
    "(note)",
    "N10",
    "G28",
    "G28.1",
)
EXPRESSIONS = ("#{}", "[{}-#2]", "[sin[#1]*7]", "[#5220-#2]", "[fix[#3]+0.5]", "[#1 mod 3]", "[[#1 gt 2]*3]", "##2")
ACROSS = {"XY": "Z", "XZ": "Y", "YZ": "X"}
CENTRE = {"XY": "IJ", "XZ": "IK", "YZ": "JK"}
PLANES = {"G17": "XY", "G18": "XZ", "G19": "YZ"}


class Generator:
    """One random program; it keeps track of the plane so that most arcs are valid."""

    def __init__(self, seed: int) -> None:
        self.random = Random(seed)
        self.plane = "XY"
        self.label = 100
        self.after: list[str] = []

    def number(self, low: float = -20, high: float = 20) -> str:
        return f"{self.random.uniform(low, high):.{self.random.choice([0, 1, 2, 3])}f}"

    def value(self) -> str:
        if self.random.random() < 0.8:
            return self.number()
        return self.random.choice(EXPRESSIONS).format(self.random.randint(1, 5))

    def words(self, letters: str, share: float = 0.6) -> str:
        chosen = [letter + self.value() for letter in letters if self.random.random() < share]
        return " ".join(chosen) or letters[0] + self.number()

    def line(self) -> str:
        extra = f" {self.random.choice('ABC')}{self.number()}" if self.random.random() < 0.2 else ""
        return self.random.choice(["G0 ", "G1 "]) + self.words("XYZ") + extra

    def arc(self) -> str:
        code = self.random.choice(["G2", "G3"])
        across = f" {ACROSS[self.plane]}{self.number()}" if self.random.random() < 0.3 else ""
        turns = self.random.choice(["", "", " P3"])
        if self.random.random() < 0.5:
            ends = " ".join(letter + self.number(-9, 9) for letter in self.plane)
            return f"{code} {ends}{across} R{self.random.choice(['', '-'])}{self.number(60, 90)}{turns}"
        return f"{code} {' '.join(letter + self.number(1, 5) for letter in CENTRE[self.plane])}{across}{turns}"

    def select_plane(self) -> str:
        code = self.random.choice(list(PLANES))
        self.plane = PLANES[code]
        return code

    def setting(self) -> str:
        kind = self.random.randrange(4)
        if kind == 0:
            return f"G10 L2 P{self.random.randint(0, 3)} {self.words('XYZ', 0.4)}"
        if kind == 1:
            return f"G10 L20 P{self.random.randint(0, 3)} {self.words('XYZAB', 0.4)}"
        if kind == 2:
            return self.random.choice(["G92 ", "G52 "]) + self.words("XYZA", 0.4)
        return self.random.choice(["G43.1 Z", "G10 L1 P2 Z", "G10 L10 P1 Z"]) + self.number()

    def cycle(self) -> str:
        if self.plane != "XY":
            return "G80"
        code = self.random.choice(["G81", "G82 P1", "G83 Q20", "G85", "G73 Q15", "G89 P.5"])
        repeats = self.random.choice(["", " L2"])
        return f"{code} {self.words('XY', 0.5)} Z{self.number(-20, -1)} R{self.number(0, 20)}{repeats}"

    def block(self) -> str:
        makers = [
            (30, self.line),
            (16, self.arc),
            (4, self.select_plane),
            (12, self.setting),
            (6, lambda: self.random.choice(OFFSETS)),
            (8, lambda: self.random.choice(MODES)),
            (4, lambda: "G90 G53 G0 " + self.words("XYZ", 0.4)),
            (3, lambda: self.random.choice(["G28", "G30"]) + " " + self.words("XYZ", 0.4)),
            (3, lambda: f"G17 G0 @{self.number(1, 20)} ^{self.number(0, 360)}"),
            (5, self.cycle),
            (5, lambda: f"#{self.random.randint(1, 5)}={self.value()} #{self.random.randint(1, 5)}=#2"),
        ]
        weights, functions = zip(*makers, strict=True)
        text: str = self.random.choices(functions, weights)[0]()
        if text.startswith("G17"):
            self.plane = "XY"
        return text

    def flow(self) -> list[str]:
        self.label += 2
        n, block = self.label, self.block
        kind = self.random.randrange(6)
        if kind == 0:
            condition = f"[#{self.random.randint(1, 5)} gt {self.number()}]"
            return [
                f"o{n} if {condition}",
                block(),
                f"o{n} elseif [#1 lt 3]",
                block(),
                f"o{n} else",
                block(),
                f"o{n} endif",
            ]
        if kind == 1:
            return [f"o{n} repeat [{self.random.randint(0, 3)}]", block(), f"o{n} endrepeat"]
        if kind == 2:
            leave = [f"o{n + 1} if [#9 eq 2]", f"o{n} {self.random.choice(['break', 'continue'])}", f"o{n + 1} endif"]
            return ["#9=0", f"o{n} while [#9 lt 4]", "#9=[#9+1]", block(), *leave, block(), f"o{n} endwhile"]
        if kind == 3:
            return ["#8=0", f"o{n} do", "#8=[#8+1]", block(), f"o{n} while [#8 lt {self.random.randint(1, 3)}]"]
        if kind == 4:
            self.after += [f"O{n}", block(), "#4=[#4+1]", "M99"]
            return [f"M98 P{n} L{self.random.randint(1, 2)}"]
        self.after += [f"o{n} sub", block(), "#2=[#1+1]", f"o{n} return [#2]", block(), f"o{n} endsub"]
        return [f"o{n} call [{self.number()}] [#1]", "#3=#<_value>"]

    def program(self) -> str:
        lines = ["F100 S100 M3", "#2=3 #1=7"]
        for _ in range(self.random.randint(3, 12)):
            lines += self.flow() if self.random.random() < 0.2 else [self.block()]
        return "\n".join([*lines, "M2", *self.after, ""])
