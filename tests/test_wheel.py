"""A wheel has compiled loops of its own sources, where there is a compiler, and is a wheel where there is none."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from driftwise.engine.compilers import compilers

ROOT = Path(__file__).parents[1]
CODE = """
import driftwise as dw
from driftwise.engine import objects
y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=300, noise_std=0.3, seed=1)
found = dw.identify({"heater": u, "temperature": y})
found.update(found.trace.state, 1.0, 0.5)
print(dw.__file__, *{entry.origin for entry in objects.loaded.values()})
"""
pytestmark = pytest.mark.slow


def built(folder: Path, **env: str) -> Path:
    """Return the wheel that is built from a copy of the sources."""
    setuptools = pytest.importorskip("setuptools", "77", reason="pip install 'setuptools>=77': NO WHEEL WAS BUILT")
    source = folder / "source"
    rubbish = shutil.ignore_patterns("__pycache__", "*.egg-info")
    shutil.copytree(ROOT / "src", source / "src", ignore=rubbish)
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    line = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", str(folder)]
    kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "DRIFTWISE_CC", "CC")}
    done = subprocess.run([*line, str(source)], env={**kept, **env}, capture_output=True, text=True, check=False)
    assert done.returncode == 0, (setuptools.__version__, done.stdout, done.stderr)
    (wheel,) = folder.glob("*.whl")
    return wheel


def used(wheel: Path, folder: Path) -> str:
    """Return what the code above says with an unpacked wheel, where there is no compiler."""
    with zipfile.ZipFile(wheel) as file:
        file.extractall(folder / "site")
    env = {"PYTHONPATH": str(folder / "site"), "DRIFTWISE_CC": "none", "DRIFTWISE_CACHE": str(folder / "cache")}
    line = [sys.executable, "-W", "error::RuntimeWarning", "-c", CODE]
    done = subprocess.run(line, env={**os.environ, **env}, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(str(folder / "site"))
    return done.stdout.split()[1:]


@pytest.mark.skipif(all(c.is_quick for c in compilers()), reason="neither gcc nor clang: NO WHEEL WITH OBJECTS")
def test_the_front_door_needs_no_compiler_where_it_is_installed(tmp_path):
    wheel = built(tmp_path, DRIFTWISE_OBJECTS="front")
    assert "-py3-none-" in wheel.name and not wheel.name.endswith("-any.whl")
    names = zipfile.ZipFile(wheel).namelist()
    objects = [name for name in names if "/engine/objects/" in name]
    assert 6 <= len(objects) <= 15 and all(name.endswith(".so") for name in objects)
    assert not [name for name in names if "__pycache__" in name or "driftwise-" in name.partition("/")[2]]
    assert used(wheel, tmp_path) == ["wheel"]
    assert not list((tmp_path / "cache").glob("*"))


@pytest.mark.parametrize("env", [{"DRIFTWISE_CC": "none"}, {"DRIFTWISE_CC": "false"}, {"DRIFTWISE_OBJECTS": "none"}])
def test_without_a_compiler_it_is_a_wheel_for_all(tmp_path, env):
    wheel = built(tmp_path, **{"DRIFTWISE_OBJECTS": "front", **env})
    assert wheel.name.endswith("-py3-none-any.whl")
