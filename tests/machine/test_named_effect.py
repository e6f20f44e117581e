"""Physical effects by name in a machine file, those of plugins too."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.diagnostics import ConfigError
from ncfix.machine import Effect, Machine, State, dumps, loads
from ncfix.machine.basis import Backlash, Polynomial
from ncfix.machine.effects import library

HEAD = """
ncfix = 1
topology = "w F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [0, 500] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [0, 400] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
"""


def one(name: str, rest: str) -> str:
    return f'{HEAD}\n[[effect]]\nname = "{name}"\n{rest}\n'


def codes(text: str) -> dict[str, str]:
    with pytest.raises(ConfigError) as caught:
        loads(text)
    return {message.code: f"{message} {message.hint}" for message in caught.value.messages}


def test_a_name_stands_for_component_and_basis() -> None:
    known = loads(one("backlash-X", "coefficients = [0.006]"))
    assert known.effects == (Effect("EXX", (0.006,), Backlash()),)
    error = known.error(np.zeros((2, 3)), State(0.0, np.array([[1.0, 0, 0], [-1.0, 0, 0]])))
    np.testing.assert_allclose(error[:, 0], [0.003, -0.003], atol=1e-15)
    assert loads(dumps(known)).effects == known.effects


def test_several_components_take_their_coefficients_in_turn() -> None:
    known = loads(one("load-X", "coefficients = [1, 2, 3, 4, 5, 6]").replace("w F X", "w X F"))
    assert [(each.name, each.coefficients) for each in known.effects] == [
        ("EAX", (1, 2)),
        ("EBX", (3, 4)),
        ("ECX", (5, 6)),
    ]
    assert known.inputs == {"load_kg"}


def test_a_lag_may_be_given() -> None:
    text = "coefficients = [0.002]\ntime_constant_s = 2400"
    assert loads(one("spindle-growth-late", text)).effects[0].time_constant_s == 2400
    assert "does not follow an input" in codes(one("backlash-X", text))["NCF315"]
    assert "several time constants" in codes(one("warming-X", text.replace("[0.002]", "[1e-3, 1e-3]")))["NCF315"]
    assert "NCF305" in codes(one("spindle-growth-late", "coefficients = [1]\ntime_constant_s = 0"))


def test_what_is_wrong_is_named() -> None:
    assert "2 coefficients, but backlash-X has 1" in codes(one("backlash-X", "coefficients = [1, 2]"))["NCF311"]
    assert "NCF303" in codes(one("backlash-X", ""))
    assert "NCF302" in codes(one("backlash-X", "coefficients = [1]\nbasis = 'table'"))
    assert "did you mean 'backlash-X'" in codes(one("backlsh-X", "coefficients = [1]"))["NCF309"]
    # no pitch, no screw
    assert "NCF309" in codes(one("screw-X", "coefficients = [1, 1, 1, 1]"))


class RamSag:
    """What a plugin registers."""

    name = "ram-sag"
    title = "ram that bends as it comes out"

    def effects(self, machine: Machine) -> tuple[Effect, ...]:
        return (Effect("EAZ", (0.0,), Polynomial(degree=(2,))),) if "Z" in machine.axis_names else ()


def test_effects_of_plugins_have_names_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ncfix.machine.effects.registry", lambda kind: {"ram-sag": RamSag()})
    known = loads(one("ram-sag", "coefficients = [1e-9]"))
    assert known.effects == (Effect("EAZ", (1e-9,), Polynomial(degree=(2,))),)
    assert library(known)["ram-sag"].title == RamSag.title
