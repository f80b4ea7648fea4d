"""Programs of the whole language, made at random, for the reader and LinuxCNC's interpreter to
agree on.

    text = Maker(random.Random(7)).program()

Most of them are right, some have a fault. They leave out what `rs274` does otherwise than the
machine, with the reason (`LEFT_OUT`).
"""

from __future__ import annotations

import random

LEFT_OUT = (
    "T and M6: behind a tool change rs274 takes up a position without rotation and tool length",
    "G20 or G21 while a tool length is in force: rs274 does not convert the length",
    "a feed behind M72: rs274 forgets that G20 and G21 convert it",
    "#<_task>, #<_vmajor>, #<_metric_machine>: rs274 says that it is no machine",
    "G4 with a P below 0, which rs274 takes for a time",
    "round[] of 2^31 and more, which C leaves undefined",
    "U, V and W, which neither knows",
    "straight splines, of which LinuxCNC makes moves to no number",
)

FUNCTIONS = ("abs", "cos", "sin", "fix", "fup", "round", "tan")
BINARY = (
    "+",
    "-",
    "*",
    "+",
    "-",
    " mod ",
    " lt ",
    " gt ",
    " le ",
    " eq ",
    " and ",
    " or ",
    " xor ",
)


class Maker:
    """Makes one program."""

    def __init__(self, chance: random.Random) -> None:
        self.chance = chance
        self.labels = 100
        self.subs: list[tuple[str, int]] = []
        self.depth = 0
        self.in_sub = False

    def program(self) -> str:
        """Its text."""
        chance = self.chance
        lines = [chance.choice(("G21", "G21 G90", "G20", "g 2 1 (mm)")), "F300 S1000 M3"]
        lines += [f"#{k}={chance.uniform(-5, 5):.3f}" for k in range(1, 6)]
        lines.append("#<_size>=4.5")
        for _ in range(chance.randint(0, 2)):
            lines += self.sub()
        lines += self.body(chance.randint(4, 14))
        lines.append(chance.choice(("M2", "M30", "m2 (end)", "N999 M2")))
        if chance.random() < 0.06:
            lines.insert(chance.randrange(len(lines)), self.fault())
        return "\n".join(lines) + "\n"

    # Numbers

    def number(self, low: float = -20.0, high: float = 20.0) -> str:
        value = self.chance.uniform(low, high)
        return f"{value:.{self.chance.choice((0, 1, 3, 3))}f}"

    def value(self, depth: int = 0) -> str:
        """A number, a parameter or an expression."""
        pick = self.chance.random()
        if pick < 0.55 or depth > 2:
            return self.number()
        if pick < 0.7:
            return f"#{self.chance.randint(1, 6)}"
        if pick < 0.75:
            return "#<_size>"
        if pick < 0.8:
            return f"-#{self.chance.randint(1, 5)}"
        if pick < 0.88:
            name = self.chance.choice(FUNCTIONS)
            return f"{name}[{self.value(depth + 1)}]"
        if pick < 0.9:
            return f"atan[{self.value(depth + 1)}]/[{self.value(depth + 1)}]"
        if pick < 0.92:
            return f"sqrt[abs[{self.value(depth + 1)}]]"
        parts = [self.value(depth + 1) for _ in range(self.chance.randint(2, 4))]
        text = parts[0]
        for part in parts[1:]:
            text += self.chance.choice(BINARY) + part
        return f"[{text}]"

    def small(self) -> str:
        """A value that stays small, for coordinates."""
        if self.chance.random() < 0.6:
            return self.number()
        return f"[[{self.value()}] mod 20]"

    def axes(self, letters: str = "XYZ") -> str:
        some = [letter for letter in letters if self.chance.random() < 0.6] or [letters[0]]
        return " ".join(f"{letter}{self.small()}" for letter in some)

    # Lines

    def body(self, count: int) -> list[str]:
        lines: list[str] = []
        for _ in range(count):
            lines += self.statement()
        return lines

    def statement(self) -> list[str]:
        kinds = [
            (6, self.straight),
            (4, self.arc),
            (3, self.modal),
            (2, self.setting),
            (2, self.cycle),
            (2, self.frame),
            (1, self.spline),
            (1, self.compensated),
            (1, self.home),
            (1, self.saved),
            (1, self.comment),
            (1, self.polar),
        ]
        if self.depth < 3:
            kinds += [(2, self.branch), (2, self.loop), (1, self.call)]
        weights = [weight for weight, _ in kinds]
        return self.chance.choices([make for _, make in kinds], weights)[0]()

    def straight(self) -> list[str]:
        return [f"{self.chance.choice(('G0', 'G1', 'G1', 'g01'))} {self.axes()}"]

    def arc(self) -> list[str]:
        code = self.chance.choice(("G2", "G3"))
        plane = self.chance.choice(("G17", "G17", "G18", "G19"))
        first, second, normal = {"G17": "XYZ", "G18": "ZXY", "G19": "YZX"}[plane]
        centre = {"X": "I", "Y": "J", "Z": "K"}
        turns = f" P{self.chance.randint(1, 3)}" if self.chance.random() < 0.2 else ""
        rise = f" {normal}{self.small()}" if self.chance.random() < 0.3 else ""
        pick = self.chance.random()
        if pick < 0.4:
            words = f"{centre[first]}{self.number(1, 9)} {centre[second]}{self.number(1, 9)}"
            return [f"{plane} {code} {words}{rise}{turns}", "G17"]
        if pick < 0.7:
            radius = self.chance.choice((80, -80, 100.5))
            ends = f"{first}{self.small()} {second}{self.small()}"
            return [f"G90 {plane} {code} {ends} R{radius}{rise}{turns}", "G17"]
        r = self.chance.randint(1, 8)
        return [
            f"G90 {plane} G1 {first}1 {second}2",
            f"{code} {first}[1+2*{r}] {second}2 {centre[first]}{r}{rise}{turns} G91.1",
            "G17",
        ]

    def modal(self) -> list[str]:
        return [
            self.chance.choice(
                (
                    *("G90", "G91", "G90", "G20", "G21", "G98", "G99", "G61", "G61.1", "G64"),
                    *("G64 P0.02", "G64 P0.02 Q0.01", "F250", "F[100+20]", "G94 F200", "G97 S500"),
                    *("G80", "M5", "M4", "M3 S600", "M8", "M9", "M7", "G4 P0.5", "G40", "G49"),
                    *("M48", "M49", "M52 P0", "G7", "G8", "G93 G1 X1 F2", "G94 F120"),
                    *("G91.1", "/G0 X1", "N10 G0 Y1", "(a) G0 (b) Z1 ; c", "M1", "M0", "A5 G0"),
                )
            )
        ]

    def setting(self) -> list[str]:
        name = self.chance.choice(("local", "_size", "other"))
        return [
            self.chance.choice(
                (
                    f"#{self.chance.randint(1, 8)}={self.value()}",
                    f"#<{name}>=[{self.value()}]",
                    f"#[{self.chance.randint(1, 3)}+1]=#{self.chance.randint(1, 4)} #9=1",
                    "#<other>=[#<other>+1]",
                    f"G0 X#9 #9={self.number()}",
                    "#10=exists[#<nobody>] G0 Z#10",
                    "G0 X[#5420/2] Y#5421",
                    "G0 X#<_x> Z#<_abs_z>",
                    "G0 Y[#<_line>/10] Z[#<_metric>+#<_absolute>]",
                )
            )
        ]

    def cycle(self) -> list[str]:
        chance = self.chance
        code = chance.choice(
            ("G81", "G82", "G83", "G73", "G85", "G86", "G89", "G84", "G74", "G88")
        )
        words = {"G82": " P0.2", "G86": " P0.1", "G88": " P0.1", "G89": " P0.3"}.get(code, "")
        words = words or {"G83": " Q1.5", "G73": " Q0.7"}.get(code, "")
        repeat = (
            f" L{chance.randint(1, 3)}" if code not in ("G74",) and chance.random() < 0.2 else ""
        )
        mode = chance.choice(("G90", "G91", "G90 G98", "G99"))
        spin = {"G74": "M4", "G84": "M3"}.get(code, "M3")
        lines = [f"{spin} {mode} {code} X{self.number()} Z-3 R2{words}{repeat}"]
        lines += [f"{self.axes('XY')}" for _ in range(chance.randint(0, 2))]
        if chance.random() < 0.2:
            lines = [f"{mode} G87 X1 Y2 Z-3 R2 I0.5 J0 K-1", "X5"]
        return [*lines, chance.choice(("G80", "G0 Z5", "G80 G90"))]

    def frame(self) -> list[str]:
        chance = self.chance
        return [
            chance.choice(
                (
                    f"G92 {self.axes()}",
                    f"G52 {self.axes()}",
                    *("G92.1", "G92.2", "G92.3", "G54", "G55", "G59.3"),
                    f"G10 L2 P{chance.randint(0, 9)} {self.axes()}",
                    f"G10 L2 P{chance.randint(0, 3)} R{self.number(0, 90)}",
                    f"G10 L20 P{chance.randint(0, 3)} {self.axes()}",
                    f"G53 G0 {self.axes()}",
                    f"G43.1 Z{self.number()}",
                    "G90",
                )
            )
        ]

    def spline(self) -> list[str]:
        chance = self.chance
        head = ["G17 G40 G90 G94 F200 G80"]
        if chance.random() < 0.4:
            return [*head, "G0 X0 Y0", "G5 X4 Y5 I0 J3 P0 Q-3", "G5 X8 Y1 I0 J3 P1 Q-3", "G1 X2"]
        if chance.random() < 0.5:
            return [*head, "G0 X-2 Y4", "G5.1 X2 Y4 I2 J-8", "G0 X0"]
        points = [f"G5.2 X{k} Y{chance.randint(-4, 4)} P1" for k in range(1, 6)]
        return [*head, "G0 X0 Y0", *points, "G5.3", "G0 X1"]

    def compensated(self) -> list[str]:
        """A path beside which the cutter goes, with corners, arcs and heights."""
        chance = self.chance
        side = chance.choice(("G41.1", "G42.1"))
        lines = ["G90 G17 G40 G80 G94 F300", "G0 X-30 Y-30", f"{side} D{self.number(0.5, 6)}"]
        lines.append(f"G1 X{chance.randint(-10, 0)} Y{chance.randint(-10, 0)}")
        for _ in range(chance.randint(1, 5)):
            pick = chance.random()
            x, y = chance.randint(-40, 40), chance.randint(-40, 40)
            if pick < 0.6:
                height = f" Z{self.number()}" if chance.random() < 0.3 else ""
                lines.append(f"{chance.choice(('G1', 'G1', 'G0'))} X{x} Y{y}{height}")
            elif pick < 0.9:
                radius = chance.choice((60, 80, -60))
                lines.append(f"{chance.choice(('G2', 'G3'))} X{x} Y{y} R{radius}")
            else:
                lines.append(chance.choice(("F200", "M8", "G4 P1", "G1 Z1", "S100", "(text)")))
        return [*lines, "G40", f"G1 X{chance.randint(-50, 50)} Y-50"]

    def home(self) -> list[str]:
        code = self.chance.choice(("G28", "G30"))
        return [self.chance.choice((f"{code}.1", code, f"{code} {self.axes()}", f"G91 {code} Z0"))]

    def saved(self) -> list[str]:
        return ["M70", *self.modal(), "M72", "G94 F300"]

    def comment(self) -> list[str]:
        return [
            self.chance.choice(("(msg, hello)", "(debug, #1 is #2)", "; text", "(print,#<_size>)"))
        ]

    def polar(self) -> list[str]:
        word = self.chance.choice((f"@{self.number(1, 9)}", f"^{self.number(0, 360)}", "@5 ^30"))
        return ["G90 G17 G0 X3 Y4", f"{self.chance.choice(('G0', 'G1'))} {word}"]

    # Structures

    def label(self) -> int:
        self.labels += 1
        return self.labels

    def condition(self) -> str:
        sign = self.chance.choice(("lt", "gt", "le", "ge", "ne", "eq"))
        return f"[{self.value()} {sign} {self.value()}]"

    def inner(self) -> list[str]:
        self.depth += 1
        lines = self.body(self.chance.randint(1, 3))
        self.depth -= 1
        return lines

    def branch(self) -> list[str]:
        n = self.label()
        lines = [f"o{n} if {self.condition()}", *self.inner()]
        if self.chance.random() < 0.4:
            lines += [f"o{n} elseif {self.condition()}", *self.inner()]
        if self.chance.random() < 0.5:
            lines += [f"o{n} else", *self.inner()]
        return [*lines, f"o{n} endif (done)"]

    def loop(self) -> list[str]:
        n, chance = self.label(), self.chance
        counter = f"#{30 + n % 40}"
        pick = chance.random()
        if pick < 0.4:
            return [f"o{n} repeat [{chance.randint(0, 3)}]", *self.inner(), f"o{n} endrepeat"]
        leaving = []
        if chance.random() < 0.3:
            k = self.label()
            word = chance.choice(("break", "continue"))
            leaving = [f"o{k} if [{counter} eq 1]", f"o{n} {word}", f"o{k} endif"]
        step = [f"{counter}=[{counter}+1]"]
        until = f"[{counter} lt {chance.randint(1, 4)}]"
        if pick < 0.75:
            lines = [f"o{n} while {until}", *step, *leaving, *self.inner(), f"o{n} endwhile"]
        else:
            lines = [f"o{n} do", *step, *leaving, *self.inner(), f"o{n} while {until}"]
        return [f"{counter}=0", *lines]

    def sub(self) -> list[str]:
        n = self.label()
        name = self.chance.choice((f"{n}", f"<sub {n}>"))
        self.depth += 1
        lines = [f"o{name} sub", "#<local>=#1", *self.inner()]
        if self.chance.random() < 0.4:
            k = self.label()
            lines += [f"o{k} if [#2 gt 1]", f"o{name} return [#1+1]", f"o{k} endif"]
        self.depth -= 1
        self.subs.append((name, n))
        return [*lines, f"o{name} endsub [#1*2]"]

    def call(self) -> list[str]:
        if not self.subs:
            return self.straight()
        name, _ = self.chance.choice(self.subs)
        arguments = " ".join(f"[{self.value()}]" for _ in range(self.chance.randint(0, 3)))
        return [f"o{name} call {arguments}", "G0 X[#<_value> mod 20]"]

    def fault(self) -> str:
        return self.chance.choice(
            (
                *("G1 X", "G0 X1 X2", "G0 G1 X1", "G2 X1 Y1", "G77", "M77", "G0 X[1/0]", "G0 X[2"),
                *("G81 X1 Z-1 R1 A2", "P5", "o1 endif", "G0 X#<nobody>", "#5400=1", "G10 L9 P1"),
                *("G53 G0 G91 X1", "G41 G41.1", "G0 (a (b) X1", "o5 call [", "G1 X1 F-1", "T-1"),
                *("G92", "G5 X1 Y1", "G64 P0.1 M19 R1", "G33 Z1 K1 F1", "%", "G0 X1e", "G20 G21"),
            )
        )
