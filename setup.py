"""The build: as `pyproject.toml` says, and loops compiled ahead where there is a compiler (`driftwise.cli.stock`).

``DRIFTWISE_OBJECTS`` says which: ``none``, ``front`` (what comes first, some seconds; what `pip install .` makes) or
``all`` (what a wheel for others has; what `python -m build` makes).
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

IS_INSTALLED_AT_ONCE = "PIP_BUILD_TRACKER" in os.environ or "UV" in os.environ  # by whoever waits for it
EXTENT = os.environ.get("DRIFTWISE_OBJECTS") or ("front" if IS_INSTALLED_AT_ONCE else "all")


def objects(build_lib) -> Path:
    """Return where the wheel has its objects."""
    return Path(build_lib).resolve() / "driftwise" / "engine" / "objects"


class Build(build_py):
    """The modules, and then the objects of these very modules."""

    def run(self):
        super().run()
        if self.editable_mode:  # sources that change: loops are compiled at first use, into the user's cache
            return
        folder = objects(self.build_lib)
        shutil.rmtree(folder, ignore_errors=True)
        if EXTENT == "none":
            return
        folder.mkdir(parents=True)
        paths = os.pathsep.join(filter(None, (str(Path(self.build_lib).resolve()), os.environ.get("PYTHONPATH"))))
        command = [sys.executable, "-m", "driftwise.cli.stock", str(folder), EXTENT]
        done = subprocess.run(
            command, env={**os.environ, "PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}, check=False
        )
        if done.returncode:
            print("driftwise: loops were not compiled ahead (above is why); that happens at their first use")
        for path in folder.iterdir():
            if path.suffix != ".so":  # a workshop that was left
                shutil.rmtree(path, ignore_errors=True)


class Wheel(bdist_wheel):
    """For this kind of machine, whatever its Python, if there are objects in it; else for all."""

    def get_tag(self):
        platform = super().get_tag()[2]
        has_objects = any(objects(self.get_finalized_command("build_py").build_lib).glob("*.so"))
        return "py3", "none", platform if has_objects else "any"


class Mixed(Distribution):
    """Modules with machine code among them."""

    def has_ext_modules(self):
        return True


setup(cmdclass={"build_py": Build, "bdist_wheel": Wheel}, distclass=Mixed)
