"""Numbers as Klartext writes them: with their sign, with a point or a comma."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ncfix.text.number_text import NumberStyle


@dataclass(frozen=True, slots=True)
class Style:
    """How a program writes numbers; `comma`: with a decimal comma."""

    comma: bool = False

    def number(self, value: float, decimals: int) -> str:
        """A new number: `+12.340`."""
        text = f"{value:+.{decimals}f}"
        if not text.strip("+-0."):
            text = text.replace("-", "+")
        return text.replace(".", ",") if self.comma else text

    def like(self, was: str, value: float, decimals: int) -> str:
        """A number in place of another one, in its manner; what had a sign keeps one."""
        style = NumberStyle.of(was.replace(",", "."))
        if was.strip()[:1] == "-":
            style = replace(style, plus=True)
        text = style.write(value, decimals)
        comma = "," in was or (self.comma and "." not in was)
        return text.replace(".", ",") if comma else text


def value_of(text: str) -> float:
    """The value of a number as written."""
    return float(text.replace(",", "."))
