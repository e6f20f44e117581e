"""A basis that ncfix has never heard of, as a plugin brings it: read, evaluated, written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from ncfix.diagnostics import ConfigError
from ncfix.machine import dumps, loads
from ncfix.machine.basis import Array, Basis, key
from ncfix.machine.effects import kinds


@dataclass(frozen=True, slots=True)
class Decay(Basis):
    """A bump that dies away from a place: wear of a guide."""

    place: float = key("number", "where it is, mm")
    widths: tuple[float, ...] = key("numbers", "how far it reaches, mm", (10.0,))
    name: ClassVar[str] = "decay"
    title: ClassVar[str] = "exp(-|u - place| / width)"

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f"width {width}" for width in self.widths)

    def rows(self, u: Array, direction: Array) -> Array:
        return np.stack([np.exp(-np.abs(u - self.place) / width) for width in self.widths])

    def slopes(self, u: Array, direction: Array) -> Array:
        rates = -np.sign(u - self.place) / np.reshape(self.widths, (-1, *np.ones(np.ndim(u), dtype=int)))
        return np.asarray(rates * self.rows(u, direction))

    def feature(self, span: float) -> float:
        return min(self.widths) / 4


@pytest.fixture
def _decay(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if a plugin had registered it."""
    builtin = kinds()
    monkeypatch.setattr("ncfix.machine.file.kinds", lambda: {**builtin, "decay": Decay})


TEXT = """\
topology = "w F X t"
[axis.X]
type = "linear"
direction = [1, 0, 0]
range = [0, 500]
[[effect]]
name = "EYX"
basis = "decay"
place = 120.0
coefficients = [0.004]
"""


@pytest.mark.usefixtures("_decay")
def test_a_foreign_basis_is_as_good_as_a_native_one() -> None:
    machine = loads(TEXT)
    assert loads(dumps(machine)) == machine
    np.testing.assert_allclose(machine.error([[120.0], [130.0]])[:, 1], [0.004, 0.004 / np.e])
    assert machine.feature_lengths == [2.5]
    assert machine.design([130.0]).shape == (6, 1)


@pytest.mark.usefixtures("_decay")
def test_its_keys_are_checked_by_their_declaration() -> None:
    with pytest.raises(ConfigError) as caught:
        loads(TEXT.replace("place = 120.0", "plac = 120.0"))
    assert [(m.code, m.hint) for m in caught.value.messages] == [
        ("NCF303", "did you mean 'plac'?"),
        ("NCF302", "did you mean 'place'?"),
    ]
    with pytest.raises(ConfigError, match="expected a list of numbers, found 5"):
        loads(TEXT.replace("coefficients", "widths = 5\ncoefficients"))


def test_without_the_plugin_the_message_lists_what_there_is() -> None:
    with pytest.raises(ConfigError, match=r"there is no basis 'decay'(.|\n)*`ncfix effects --bases` lists them"):
        loads(TEXT)


def test_bases_come_through_the_plugin_hook(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ncfix.machine.effects.registry", lambda kind, builtin: {**builtin, kind: Decay})
    kinds.cache_clear()
    try:
        assert kinds()["bases"] is Decay
        assert "polynomial" in kinds()
    finally:
        kinds.cache_clear()
