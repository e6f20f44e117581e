"""Random Fanuc programs for a machine with a cradle: frames of all kinds, one in another where that is certain."""

from __future__ import annotations

import math
import random
from collections.abc import Callable

HEAD = ["%", "O1", "G17 G21 G40 G49 G80 G90 G94", "T1 M6", "G54", "G43 H1", "G0 X0. Y0. Z60. A5. C10. F1000."]
PLANES = {"G17": "XYZ", "G18": "ZXY", "G19": "YZX"}
CENTRES = {"X": "I", "Y": "J", "Z": "K"}
SYSTEMS = ("G54", "G55", "G54.1 P1", "G54.1 P2")


class Author:
    """Writes one program; coordinates stay where the machine can follow."""

    def __init__(self, seed: int, flat: bool = False) -> None:
        self.chance = random.Random(seed)
        self.lines = list(HEAD)
        self.macros: list[str] = []
        self.flat = flat
        self.unit = 1.0

    def program(self) -> str:
        """A program of some length."""
        for _ in range(self.chance.randint(6, 14)):
            self.part()
        return "\n".join([*self.lines, "M30", *self.macros, "%"]) + "\n"

    def part(self) -> None:
        """A few blocks of one kind."""
        kinds: list[tuple[float, Callable[[], None]]] = [
            (6, self.straight),
            (4, self.arc),
            (3, self.increments),
            (3, self.shifted),
            (3, self.turned),
            (2, self.mirrored),
            (2, self.table),
            (3, self.holes),
            (2, self.tip),
            (2, self.vectors),
            (4, self.tilted),
            (1, self.inches),
            (2, self.macro),
        ]
        if self.flat:
            kinds += [(6, self.polar), (6, self.loop), (6, self.stepped_holes), (6, self.magnified)]
        self.chance.choices([kind for _, kind in kinds], [weight for weight, _ in kinds])[0]()

    # -- numbers ------------------------------------------------------------------------------------------------------

    def number(self, low: float = -35.0, high: float = 35.0) -> str:
        """A number with a point, in the unit in force."""
        digits = self.chance.randint(0, 3)
        text = f"{self.chance.uniform(low, high) / self.unit:.{digits if self.unit == 1.0 else digits + 3}f}"
        return text if "." in text else text + "."

    def exact(self, mm: float) -> str:
        """A length with digits enough to close an arc."""
        return f"{mm / self.unit:.{4 if self.unit == 1.0 else 6}f}"

    def everywhere(self, rotary: bool = True) -> str:
        """A word for every axis."""
        words = f"X{self.number()} Y{self.number()} Z{self.number(10, 45)}"
        return words + (f" A{self.angle(-40, 40)} C{self.angle(-80, 80)}" if rotary else "")

    def angle(self, low: float, high: float) -> str:
        """Degrees."""
        text = f"{self.chance.uniform(low, high):.{self.chance.randint(0, 3)}f}"
        return text if "." in text else text + "."

    def anew(self, rotary: bool = True) -> None:
        """A rapid to a known place, in whatever coordinates are in force."""
        self.lines.append("G90 G0 " + self.everywhere(rotary))

    # -- motions ------------------------------------------------------------------------------------------------------

    def straight(self) -> None:
        """G0 or G1."""
        for _ in range(self.chance.randint(1, 4)):
            words = [f"{x}{self.number(10, 45) if x == 'Z' else self.number()}" for x in "XYZ"]
            chosen = self.chance.sample(words, self.chance.randint(1, 3))
            self.lines.append(f"{self.chance.choice(('G0', 'G1', 'G1'))} {' '.join(chosen)}")

    def arc(self) -> None:
        """To a known place, and arcs from there, by centre or radius, helices and full circles."""
        name = self.chance.choice(tuple(PLANES))
        one, two, up = PLANES[name]
        incremental = self.chance.random() < 0.3
        at = {x: round(self.chance.uniform(-20, 20), 2) + (25.0 if x == "Z" else 0.0) for x in "XYZ"}
        self.lines.append(f"{name} G1 " + " ".join(f"{x}{self.exact(v)}" for x, v in at.items()))
        self.lines += ["G91"] if incremental else []
        for _ in range(self.chance.randint(1, 3)):
            radius, begin = self.chance.uniform(2, 15), self.chance.uniform(0, 2 * math.pi)
            angle, code = self.chance.choice((40, 90, 170, 200, 300, 360)), self.chance.choice((2, 3))
            end = begin + math.radians(angle) * (1 if code == 3 else -1)
            centre = -radius * math.cos(begin), -radius * math.sin(begin)
            step = {one: centre[0] + radius * math.cos(end), two: centre[1] + radius * math.sin(end)}
            step = {} if angle == 360 else step
            if self.chance.random() < 0.3:
                step[up] = self.chance.uniform(-4, 4)
            words = [f"{x}{self.exact(v + (0.0 if incremental else at[x]))}" for x, v in step.items()]
            at |= {x: at[x] + v for x, v in step.items()}
            by_radius = self.chance.random() < 0.4 and angle in (40, 90, 200, 300)
            middle = [f"{CENTRES[x]}{self.exact(v)}" for x, v in zip((one, two), centre, strict=True)]
            sign = "-" if angle > 180 else ""
            self.lines.append(
                f"G{code} {' '.join(words + ([f'R{sign}{self.exact(radius)}'] if by_radius else middle))}"
            )
        self.lines.append("G90 G17")

    def increments(self) -> None:
        """A stretch of G91."""
        self.lines.append("G91")
        for _ in range(self.chance.randint(1, 5)):
            words = [f"{x}{self.number(-4, 4)}" for x in "XYZ" if self.chance.random() < 0.6] or ["X1."]
            self.lines.append(f"G{self.chance.choice((0, 1, 1))} {' '.join(words)}")
        self.lines.append("G90")

    def inside(self, *kinds: Callable[[], None]) -> None:
        """Something in the coordinates in force."""
        self.anew(rotary=False)
        for _ in range(self.chance.randint(1, 3)):
            self.chance.choice(kinds or (self.straight, self.arc, self.increments, self.holes))()

    # -- coordinates --------------------------------------------------------------------------------------------------

    def shifted(self) -> None:
        """G52 or G92, and what undoes it."""
        if self.chance.random() < 0.5:
            self.lines.append(f"G52 X{self.number(-9, 9)} Y{self.number(-9, 9)} Z{self.number(-5, 5)}")
            self.inside(self.straight, self.arc, self.increments, self.holes, self.turned)
            self.lines.append("G52 X0. Y0. Z0.")
        else:
            self.lines.append("G90 G0 X0. Y0. Z30.")
            self.lines.append(f"G92 X{self.number(-5, 5)} Y{self.number(-5, 5)} Z{self.number(25, 35)}")
            self.inside(self.straight, self.arc, self.increments, self.holes, self.turned)
            self.lines += ["G90 G0 X0. Y0. Z30."]
        self.anew()

    def turned(self) -> None:
        """G68 in a plane."""
        plane = self.chance.choice(tuple(PLANES))
        one, two, _ = PLANES[plane]
        angle = self.chance.choice(("30.", "90.", "-45.5", self.number(-90, 90)))
        self.lines.append(f"{plane} G68 {one}{self.number(-9, 9)} {two}{self.number(-9, 9)} R{angle}")
        self.anew(rotary=False)
        self.lines.append("G17")
        self.inside(self.straight, self.arc, self.increments, *([self.holes] if plane == "G17" else []))
        self.lines.append("G69")
        self.anew()

    def mirrored(self) -> None:
        """G51.1 along one or two axes."""
        axes = self.chance.sample("XYZ", self.chance.randint(1, 2))
        self.lines.append("G51.1 " + " ".join(f"{x}{self.number(-5, 5) if x != 'Z' else '27.'}" for x in axes))
        self.inside(self.straight, self.arc, self.increments)
        self.lines.append("G50.1 " + " ".join(f"{x}0." for x in axes))
        self.anew()

    def table(self) -> None:
        """Work offsets, given and set."""
        shift = f"X{self.number(-9, 9)} Y{self.number(-9, 9)} Z{self.number(50, 70)}"
        self.lines.append(self.chance.choice((f"G10 L2 P2 {shift}", f"G10 L20 P2 {shift}", "G4 X0.1")))
        self.lines.append(self.chance.choice(SYSTEMS))
        self.inside()
        self.lines.append("G54")
        self.anew()

    # -- holes --------------------------------------------------------------------------------------------------------

    def holes(self) -> None:
        """A series of holes, with levels of their own now and then."""
        retract, code = self.chance.choice(("G98", "G99")), self.chance.choice((81, 82, 85, 73, 83))
        extra = {82: " P200", 73: f" Q{self.number(2, 4)}", 83: f" Q{self.number(2, 4)}"}.get(code, "")
        self.lines.append("G90 G0 Z" + self.number(30, 40))
        words = f"X{self.number()} Y{self.number()} Z{self.number(-5, 2)} R{self.number(5, 9)}"
        self.lines.append(f"{retract} G{code} {words}{extra}")
        for _ in range(self.chance.randint(0, 3)):
            level = self.chance.choice(("", "", f" R{self.number(6, 9)}", f" Z{self.number(-6, 1)}"))
            self.lines.append(f"{self.chance.choice('XY')}{self.number()}{level}")
        self.lines.append("G80")
        self.anew(rotary=False)

    def stepped_holes(self) -> None:
        """Holes in G91, with repeats."""
        self.lines += ["G90 G0 Z35.", f"G91 G99 G81 X{self.number(1, 4)} Z-8. R-20. K{self.chance.randint(1, 4)}"]
        self.lines += [f"Y{self.number(1, 4)}", "G80 G90"]
        self.anew()

    # -- five axes ----------------------------------------------------------------------------------------------------

    def tip(self) -> None:
        """G43.4."""
        self.lines += ["G0 A0. C0.", "G49", f"G43.4 H1 X{self.number()} Y{self.number()} Z{self.number(30, 45)}"]
        for _ in range(self.chance.randint(1, 5)):
            self.lines.append(f"G1 {self.everywhere()}")
        self.lines += ["G0 X0. Y0. Z60. A0. C0.", "G49", "G43 H1"]
        self.anew()

    def vectors(self) -> None:
        """G43.5."""
        self.lines += ["G0 A10. C5.", "G49", f"G43.5 H1 X{self.number()} Y{self.number()} Z{self.number(30, 45)}"]
        a, c = 10.0, 5.0
        for _ in range(self.chance.randint(1, 5)):
            a, c = self.chance.uniform(5, 40), c + self.chance.uniform(-20, 20)
            tilt, turn = math.radians(a), math.radians(c)
            size = self.chance.choice((1.0, 1.0, 100.0))
            vector = [
                size * v for v in (math.sin(tilt) * math.sin(turn), -math.sin(tilt) * math.cos(turn), math.cos(tilt))
            ]
            words = " ".join(f"{letter}{v:.7f}" for letter, v in zip("IJK", vector, strict=True))
            self.lines.append(f"G1 {self.everywhere(rotary=False)} {words}")
        self.lines += ["G49", "G43 H1", "G0 X0. Y0. Z80. A5. C0."]
        self.anew()

    def tilted(self) -> None:
        """G68.2 in its forms, G53.1, and what there is in a plane."""
        self.lines.append("G0 A5. C10.")
        origin = f"X{self.number(-9, 9)} Y{self.number(-9, 9)} Z{self.number(-5, 5)}"
        x = [round(self.chance.uniform(-0.3, 0.3), 3) for _ in range(3)]
        vector = f"I1. J{x[1]} K{x[2]}"
        across = f"I{-x[2]} J0. K1."
        point = [round(self.chance.uniform(-5, 5), 2) for _ in range(3)]
        points = [point, [point[0] + 30, point[1] + 4.5, point[2] - 3.2], [point[0] + 3, point[1] + 25.5, point[2] + 6]]
        words = [" ".join(f"{a}{v:.3f}" for a, v in zip("XYZ", p, strict=True)) for p in points]
        euler = f"G68.2 {origin} I{self.angle(-40, 40)} J{self.angle(5, 35)} K{self.angle(-40, 40)}"
        order = self.chance.choice(("123", "213", "321"))
        rpy = f"G68.2 P1 Q{order} {origin} I{self.angle(5, 25)} J{self.angle(-20, 20)} K{self.angle(-30, 30)}"
        by_points = ["G68.2 P2 Q0 X0. Y0. Z0. R12.5", *(f"G68.2 P2 Q{n} {p}" for n, p in enumerate(words, 1))]
        by_vectors = [f"G68.2 P3 Q1 {origin} {vector}", f"G68.2 P3 Q2 {across}"]
        self.lines += self.chance.choice(([euler], [rpy], by_points, by_vectors))
        self.lines.append("G53.1")
        self.inside(self.straight, self.arc, self.increments, self.holes)
        self.lines += ["G90 G0 Z50.", "G69", "G53 G0 Z250."]
        self.anew()

    # -- units, variables ---------------------------------------------------------------------------------------------

    def inches(self) -> None:
        """G20."""
        self.lines.append("G20")
        self.unit = 25.4
        self.inside(self.straight, self.arc, self.increments, self.holes, self.turned, self.mirrored)
        self.unit = 1.0
        self.lines.append("G21")
        self.anew()

    def macro(self) -> None:
        """Variables, expressions, and a macro that is called once."""
        number = 9000 + len(self.macros)
        self.lines += [f"#101={self.number(1, 9)}", "#102=[#101*2.-3.5]"]
        self.lines += [f"G1 X#101 Y[#102-{self.number(1, 5)}] Z30.", f"G65 P{number} A{self.number()} B#101 X12.5"]
        self.macros += [f"O{number}", "#3=[#1+#2/2.]", "G1 X#3 Y#24 Z[20.+#2]", "G0 Z40.", "M99"]

    def loop(self) -> None:
        """A loop."""
        self.lines += ["#103=0", "WHILE[#103LT3]DO1", f"G1 X[#103*{self.number(2, 8)}] Y[10.-#103*2.] Z30."]
        self.lines += ["G91 G1 X1.5 Y[#103-2.]", "G90", "#103=[#103+1]", "END1"]

    def polar(self) -> None:
        """G16."""
        self.lines.append("G16")
        for _ in range(self.chance.randint(1, 4)):
            self.lines.append(f"G{self.chance.choice((0, 1))} X{self.number(5, 30)} Y{self.angle(-170, 170)}")
            self.lines.append(f"Y{self.angle(-170, 170)}")
        self.lines.append("G15")
        self.anew()

    def magnified(self) -> None:
        """G51."""
        factor = self.chance.choice(("2.", "0.5", "1.25"))
        self.lines.append(f"G51 X{self.number(-5, 5)} Y{self.number(-5, 5)} Z20. P{factor}")
        self.lines.append("G90 G0 X3. Y-4. Z25.")
        for _ in range(self.chance.randint(1, 3)):
            self.chance.choice((self.arc, self.increments))()
        self.lines.append("G50")
        self.anew()
