"""What a release consists of, in a folder: wheel, sdist, a bill of materials (CycloneDX), and the hashes of all three.

    python release.py dist      (needs: pip install -e '.[release]')

The bill lists what the wheel installs into an empty environment, with versions and licences.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent
SUMS = "SHA256SUMS"


def bill_of_materials(python: str, version: str, files: list[Path]) -> str:
    """The bill of what an environment has, in CycloneDX JSON; its subject is ncfix, in these files.

    python  the interpreter of the environment
    """
    command = [sys.executable, "-m", "cyclonedx_py", "environment", "--output-reproducible", "--mc-type", "application"]
    command += ["--pyproject", str(ROOT / "pyproject.toml"), python]
    found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    subject = found["metadata"]["component"]
    subject |= {"version": version, "purl": f"pkg:pypi/ncfix@{version}"}
    subject["externalReferences"] = [
        {"type": "distribution", "url": path.name, "hashes": [{"alg": "SHA-256", "content": digest(path)}]}
        for path in files
    ]
    return json.dumps(found, indent=1, sort_keys=True) + "\n"


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def release(folder: Path) -> list[Path]:
    """Make all files of a release in an empty folder."""
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-d", str(folder.resolve())], cwd=ROOT, check=True)
    files = sorted(folder.glob("ncfix-*"))
    (wheel,) = (path for path in files if path.suffix == ".whl")
    version = wheel.name.split("-")[1]
    with tempfile.TemporaryDirectory() as empty:
        venv.create(empty, with_pip=True)
        python = next(
            str(path) for path in (Path(empty, "bin/python"), Path(empty, "Scripts/python.exe")) if path.exists()
        )
        pip = [python, "-m", "pip", "--disable-pip-version-check", "-q"]
        subprocess.run([*pip, "install", str(wheel)], check=True)
        subprocess.run([*pip, "uninstall", "-y", "setuptools", "pip"], check=True)
        bill = folder / f"ncfix-{version}.cdx.json"
        bill.write_text(bill_of_materials(python, version, files))
    files.append(bill)
    (folder / SUMS).write_text("".join(f"{digest(path)}  {path.name}\n" for path in files))
    return [*files, folder / SUMS]


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "dist")
    target.mkdir(exist_ok=True)
    if any(target.iterdir()):
        sys.exit(f"{target} is not empty")
    print(*release(target), sep="\n")
