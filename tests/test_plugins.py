"""Plugins load one by one, each whole or not at all, and one that is broken is named."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace

import pytest

from ncfix import hookspecs, plugins
from ncfix.diagnostics import ExitCode, PluginError
from ncfix.plugins import PluginWarning, collect

GOOD = """
from ncfix.hookspecs import hookimpl
from ncfix.text.dialect import Dialect

@hookimpl
def register_dialects(register):
    register(Dialect("{0}", "Good", "iso.lark", (), language="mine:LANGUAGE"))
    register(Dialect("other", "Good", "iso.lark", (), language="mine:LANGUAGE"), name="{0}-too")
"""

BROKEN = {
    "NCF501": "import a_module_that_is_not_there",
    "NCF502": GOOD + "@hookimpl\ndef register_dialect(register): pass\n",
    "NCF503": GOOD.replace("{0}-too", "good"),
    "NCF504": GOOD + "@hookimpl\ndef register_bases(register): 1 / 0\n",
    "NCF505": GOOD + "@hookimpl\ndef register_bases(register): register(object())\n",
    "NCF506": "def helper(): pass\n",
}
"""By the code of the message: a plugin that is broken in that way."""

Install = Callable[[str, str], EntryPoint]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """`install(name, source)`: a module of this name as an entry point; it is forgotten after the test."""
    monkeypatch.syspath_prepend(tmp_path)

    def write(name: str, source: str) -> EntryPoint:
        module = f"third_party_{name}"
        (tmp_path / f"{module}.py").write_text(source.replace("{0}", name))
        monkeypatch.delitem(sys.modules, module, raising=False)
        return EntryPoint(name, module, hookspecs.GROUP)

    return write


def test_every_hook_is_a_documented_kind() -> None:
    assert set(plugins.KINDS) == {
        "bases", "codes", "commands", "controls", "dialects", "effects", "executors", "readers", "reporters",
    }  # fmt: skip
    for kind in plugins.KINDS:
        hook = getattr(hookspecs, f"register_{kind}")
        assert hook.__doc__
        assert list(hook.__annotations__) == ["register", "return"]


def test_a_plugin_registers_by_name(install: Install) -> None:
    found = collect([install("good", GOOD)])
    assert [plugin.name for plugin in found.loaded] == ["good"]
    assert list(found.loaded[0].things["dialects"]) == ["good", "good-too"]
    assert found.loaded[0].hooks == ("register_dialects",)
    assert not found.problems
    assert found.owner("dialects", "good-too") == found.loaded[0]
    assert found.owner("bases", "good-too") is None


@pytest.mark.parametrize("code", BROKEN)
def test_a_broken_plugin_is_named_and_left_out_whole(install: Install, code: str) -> None:
    points = [install("good", GOOD), install("bad", BROKEN[code]), install("later", GOOD)]
    with pytest.warns(PluginWarning, match=rf"{code}: plugin 'bad' left out") as caught:
        found = collect(points)
    assert [plugin.name for plugin in found.loaded] == ["good", "later"]
    assert [problem.code for problem in found.problems] == [code]
    assert len(caught) == 1
    assert not any("bad" in name for plugin in found.loaded for name in plugin.things["dialects"])


@pytest.mark.parametrize("code", BROKEN)
def test_in_strict_mode_a_broken_plugin_is_an_error(
    install: Install, code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NCFIX_STRICT_PLUGINS", "1")
    points = [install("good", GOOD), install("bad", BROKEN[code])]
    with pytest.raises(PluginError, match="plugin 'bad' left out") as caught:
        collect(points)
    assert caught.value.code == code
    assert caught.value.exit_code == ExitCode.FAULT


@pytest.mark.parametrize(
    ("source", "hint"),
    [
        (GOOD + "@hookimpl\ndef regster_bases(register): pass\n", "did you mean register_bases"),
        (GOOD + "@hookimpl\ndef register_bases(registrar): pass\n", "another argument than `register`"),
        (GOOD.replace("@hookimpl", ""), "hookimpl"),
        (GOOD + "def register_bases(register): pass\n", "hookimpl"),
    ],
    ids=["misspelled", "wrong argument", "nothing marked", "one not marked"],
)
def test_a_hook_that_would_never_be_called_fails_loudly(install: Install, source: str, hint: str) -> None:
    with pytest.warns(PluginWarning, match=hint):
        found = collect([install("bad", source)])
    assert not found.loaded


FAULTS = {
    "a name that is misspelt": ("from ncfix.plugin import CycelTable\n", "cannot import name 'CycelTable'",
                                "did you mean CycleTable?"),
    "what derive objects to": ("from ncfix.plugin import family\nfamily('iso').derive('x', title='X', suffix='.x')\n",
                               r"ValueError: x: .* no suffix: did you mean suffixes\? \(third_party_bad.py:2\)",
                               "report it to its author"),
    "while it registers": (GOOD + "@hookimpl\ndef register_bases(register): 1 / 0\n",
                           r"failed in register_bases: ZeroDivisionError: .* \(third_party_bad.py:\d+\)",
                           "report it to its author"),
}  # fmt: skip
"""Plugins that are left out, what is said of them, and the hint."""


@pytest.mark.parametrize("name", FAULTS)
def test_what_is_said_names_the_place_and_what_helps(install: Install, name: str) -> None:
    source, said, hint = FAULTS[name]
    with pytest.warns(PluginWarning, match=said) as told:
        collect([install("bad", source)])
    (warning,) = [each.message for each in told if isinstance(each.message, PluginWarning)]
    assert hint in warning.message.hint


def test_a_plugin_that_exits_while_it_loads_does_not_end_ncfix(install: Install) -> None:
    with pytest.warns(PluginWarning, match="NCF501"):
        collect([install("bad", "raise SystemExit(0)")])


def test_the_same_module_twice_is_one_too_many(install: Install) -> None:
    good = install("good", GOOD)
    with pytest.warns(PluginWarning, match="NCF503: plugin 'again' left out.*plugin 'good' has registered"):
        found = collect([good, EntryPoint("again", good.value, hookspecs.GROUP)])
    assert [plugin.name for plugin in found.loaded] == ["good"]


def test_a_built_in_name_cannot_be_taken(install: Install, monkeypatch: pytest.MonkeyPatch) -> None:
    found = collect([install("good", GOOD)])
    monkeypatch.setattr(plugins, "load_plugins", lambda: found)
    builtin = SimpleNamespace(name="good")
    with pytest.warns(PluginWarning, match="NCF503"):
        things = plugins.registry("dialects", {"good": builtin})
    assert things["good"] is builtin
    assert list(things) == ["good", "good-too"]
    monkeypatch.setenv("NCFIX_STRICT_PLUGINS", "1")
    with pytest.raises(PluginError, match="NCF503"):
        plugins.registry("dialects", {"good": builtin})


@pytest.mark.parametrize("disabled", ["linuxcnc", "gcode, linuxcnc", "ncfix"])
def test_plugins_can_be_disabled_by_name_or_distribution(disabled: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert {"gcode", "linuxcnc"} <= {point.name for point in plugins.installed()}
    monkeypatch.setenv("NCFIX_DISABLE_PLUGINS", disabled)
    left = {point.name for point in plugins.installed()}
    assert "linuxcnc" not in left
    assert ("gcode" in left) == (disabled == "linuxcnc")


def test_the_built_in_controllers_are_ordinary_plugins() -> None:
    found = plugins.load_plugins()
    assert not found.problems
    assert {"iso", "linuxcnc"} <= set(plugins.registry("dialects"))
    assert {plugin.distribution for plugin in found.loaded if plugin.name in ("gcode", "linuxcnc")} == {"ncfix"}


def test_a_dialect_that_cannot_be_is_told_with_its_plugin(install: Install, monkeypatch: pytest.MonkeyPatch) -> None:
    derived = "from ncfix.plugin import SetTool, family, like\n" + (
        'family("fanuc").derive("bad", title="Bad", codes={"G150": [SetTool("T"), like("G69")]})\n'
    )
    with pytest.warns(PluginWarning, match=r"NCF501: plugin 'bad' left out.*G150: like.* stands alone"):
        collect([install("bad", derived)])
    found = collect([install("suffixed", GOOD.replace('"iso.lark", ()', '"iso.lark", ("nak",)', 1))])
    monkeypatch.setattr(plugins, "load_plugins", lambda: found)
    plugins.leave.cache_clear()
    with pytest.warns(
        PluginWarning, match="NCF508: 'suffixed' of plugin 'suffixed' left out.*'nak' cannot be a suffix"
    ):
        things = plugins.registry("dialects")
    assert list(things) == ["suffixed-too"]
