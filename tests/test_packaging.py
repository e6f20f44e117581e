"""Wheel, sdist and editable install work from a foreign folder; the example of a third party's plugin installs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest
import release

from conftest import require_core, require_module
from ncfix import __version__

PIP = [sys.executable, "-m", "pip", "--disable-pip-version-check"]

PROGRAM = "G21 G90 G94\nG1 X1 Y2 F100\nM2\n"


def packages() -> set[str]:
    """The import packages that the project says that it brings."""
    project = tomllib.loads((Path(__file__).resolve().parents[1] / "pyproject.toml").read_text())
    return {path.split("/")[-1] for path in project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]}


def build(source: Path, folder: Path, form: str = "plain") -> Path:
    """The wheel of a source tree or sdist, with the compiled core if `form` is "require"."""
    command = [*PIP, "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", str(folder), str(source)]
    subprocess.run(command, check=True, env={**os.environ, "NCFIX_BUILD": form})
    (wheel,) = folder.glob("*.whl")
    return wheel


def install(source: Path, folder: Path) -> Path:
    """A folder with the package in it, without what it depends on."""
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--target", str(folder)]
    subprocess.run([*PIP, "install", "-q", *options, str(source)], check=True)
    return folder


def run(arguments: list[str], cwd: Path, *path: Path) -> Any:
    """What `ncfix ... --json` prints in a folder that has nothing to do with the project."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, path)), "NCFIX_CORE": ""}
    command = [sys.executable, "-m", "ncfix", *arguments, "--json"]
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, check=False, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def origin(cwd: Path, *path: Path) -> list[Path]:
    """Where ncfix and its built-in plugins come from."""
    names = sorted(packages())
    script = "import sys, importlib; print(*(importlib.import_module(name).__file__ for name in sys.argv[1:]))"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, path))}
    command = [sys.executable, "-c", script, *names]
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, check=True, text=True)
    return [Path(path) for path in done.stdout.split()]


@pytest.fixture(scope="module")
def wheel(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(root, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install(wheel, tmp_path_factory.mktemp("installed"))


def test_the_wheel_holds_the_packages_and_the_grammars_and_nothing_else(root: Path, wheel: Path) -> None:
    assert wheel.name == f"ncfix-{__version__}-py3-none-any.whl"
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.split("/")[0] for name in names}
    assert tops == packages() | {f"ncfix-{__version__}.{kind}" for kind in ("dist-info", "data")}
    shared = {str(path.relative_to(root)) for path in (root / "share").rglob("*") if path.is_file()}
    assert {name.split("/data/", 1)[1] for name in names if "/data/" in name} == shared
    grammars = {f"ncfix/grammars/{path.name}" for path in (root / "grammars").glob("*.lark")}
    assert grammars
    assert {name for name in names if "/grammars/" in name} == grammars
    sources = {str(path.relative_to(root / "src")) for path in (root / "src").rglob("*.py")}
    assert sources <= set(names)
    assert "ncfix/py.typed" in names
    assert not [name for name in names if name.endswith(".pyc")]


def test_the_sdist_makes_the_same_wheel(root: Path, wheel: Path, tmp_path: Path) -> None:
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path)], cwd=root, check=True
    )
    (sdist,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.split("/", 1)[1] for name in archive.getnames()}
    assert {"README.md", "LICENSE", "pyproject.toml", "docs/plugins.md", "tests/conftest.py"} <= names
    again = build(sdist, tmp_path / "again")
    contents = [{entry.filename: entry.CRC for entry in zipfile.ZipFile(path).infolist()} for path in (wheel, again)]
    assert contents[0] == contents[1]


def test_the_wheel_works_from_a_foreign_folder(installed: Path, tmp_path: Path) -> None:
    assert all(path.is_relative_to(installed) for path in origin(tmp_path, installed))
    dialects = run(["dialects"], tmp_path, installed)["dialects"]
    assert {"iso", "linuxcnc"} <= {entry["name"] for entry in dialects}
    (tmp_path / "part.ngc").write_text(PROGRAM)
    checked = run(["check", "part.ngc", "--assume-zero"], tmp_path, installed)
    assert checked["files"][0]["blocks"] == 3


def test_a_wheel_with_the_compiled_core(root: Path, tmp_path: Path, installed: Path) -> None:
    assert run(["plugins"], tmp_path, installed)["core"].startswith("not compiled")
    require_core()
    wheel = build(root, tmp_path / "wheel", "require")
    assert "none-any" not in wheel.name
    names = zipfile.ZipFile(wheel).namelist()
    assert not [name for name in names if name.endswith(".c")]
    folder = install(wheel, tmp_path / "site")
    assert run(["plugins"], tmp_path, folder)["core"] == "compiled"


def test_this_installation_works_from_a_foreign_folder(root: Path, tmp_path: Path) -> None:
    dialects = run(["dialects"], tmp_path)["dialects"]
    assert {"iso", "linuxcnc"} <= {entry["name"] for entry in dialects}
    (tmp_path / "part.ngc").write_text(PROGRAM)
    assert run(["check", "part.ngc", "--assume-zero"], tmp_path)["files"][0]["blocks"] == 3


def test_the_example_plugin_installs_and_works(root: Path, tmp_path: Path) -> None:
    folder = install(root / "examples" / "third_party_plugin", tmp_path / "site")
    plugins = {plugin["name"]: plugin for plugin in run(["plugins"], tmp_path, folder)["plugins"]}
    assert plugins["nakano"]["distribution"] == "ncfix-nakano"
    assert plugins["nakano"]["things"] == {"controls": ["nakano-pitch"], "dialects": ["nakano"]}
    dialects = {entry["name"]: entry for entry in run(["dialects"], tmp_path, folder)["dialects"]}
    assert dialects["nakano"]["suffixes"] == [".nak"]
    (tmp_path / "part.nak").write_text(PROGRAM)
    checked = run(["check", "part.nak", "--assume-zero", "--no-point", "calculator"], tmp_path, folder)
    assert checked["files"][0]["dialect"] == "nakano"


def test_the_example_with_tables_installs_and_works(root: Path, tmp_path: Path) -> None:
    folder = install(root / "examples" / "third_party_tables", tmp_path / "site")
    machine = str(root / "examples" / "machines" / "three_axis.toml")
    found = run(["export", "weihong", "-m", machine, "-o", "tables"], tmp_path, folder)
    assert found["class"] == "L-POS"
    assert found["residual_um"]["after"]["rms"] < found["residual_um"]["before"]["rms"]
    assert (tmp_path / "tables" / "axeserr.dat").exists()


def test_the_bill_of_materials_of_a_release(wheel: Path) -> None:
    require_module("cyclonedx_py")
    bill = json.loads(release.bill_of_materials(sys.executable, __version__, [wheel]))
    subject = bill["metadata"]["component"]
    assert (bill["bomFormat"], subject["name"], subject["version"]) == ("CycloneDX", "ncfix", __version__)
    (file,) = subject["externalReferences"]
    assert file["url"] == wheel.name
    assert file["hashes"][0]["content"] == release.digest(wheel)
    needs = next(each["dependsOn"] for each in bill["dependencies"] if each["ref"] == subject["bom-ref"])
    assert {name.split("=")[0].lower() for name in needs} >= {"numpy", "scipy", "pluggy", "lark", "click", "rich"}
    licences = {each["name"]: each.get("licenses") for each in bill["components"]}
    assert licences["lark"]


def test_the_core_depends_on_little(root: Path) -> None:
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    names = {requirement.split(">")[0] for requirement in project["dependencies"]}
    assert names == {"numpy", "scipy", "pluggy", "lark", "click", "rich"}
