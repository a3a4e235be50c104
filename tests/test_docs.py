"""What the documentation shows runs: docstring examples, the README's code, its links and its figures."""

import copy
import doctest
import importlib
import pkgutil
import re
from pathlib import Path

import pytest

import driftwise as dw
from driftwise.detect import registry as detect_registry
from driftwise.memory import registry
from driftwise.tracking import formats

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
MODULES = [m.name for m in pkgutil.walk_packages(dw.__path__, "driftwise.")]


@pytest.mark.parametrize("name", MODULES)
def test_docstring_examples(name):
    module = importlib.import_module(name)
    if ">>> " not in Path(module.__file__ or "").read_text(encoding="utf-8"):  # nothing to look for
        return
    failed, _ = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert failed == 0


TOLD = {
    "docs/index.md": "first-order model",
    "README.md": "second-order model",
    "docs/start.md": "second-order model",
    "docs/python.md": "second-order model",
}


@pytest.mark.parametrize("page", TOLD)
def test_code_of_the_first_pages_runs(page, capsys):
    code = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.S)
    assert code
    for block in code:
        exec(compile(block, page, "exec"), {})
    assert TOLD[page] in capsys.readouterr().out


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_bytes()) <= 6000


def test_contributed_code_runs(tmp_path, monkeypatch):
    """As the files that the page tells to write."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("DRIFTWISE_ENGINE", "python")
    for table in (registry, detect_registry):  # what the page registers, it registers for itself
        monkeypatch.setattr(table, "ENTRIES", copy.copy(table.ENTRIES))
    monkeypatch.setattr(formats, "WRITERS", dict(formats.WRITERS))
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "contribute.md").read_text(), re.S)
    assert blocks
    for number, block in enumerate(blocks):
        (tmp_path / f"contributed_{number}.py").write_text(block)
        importlib.import_module(f"contributed_{number}")


@pytest.mark.parametrize("page", [p for p in PAGES if ">>> " in p.read_text()], ids=lambda p: p.name)
def test_examples_of_pages(page):
    failed, tried = doctest.testfile(str(page), module_relative=False, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert tried and not failed


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_and_figures_exist(page):
    for target in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), f"{page.name} points to {target}"


def test_what_pages_ask_of_estimators_and_traces_is_there():
    kinds = {
        kind for name in MODULES for kind in vars(importlib.import_module(name)).values() if isinstance(kind, type)
    }
    traces = {name for kind in kinds if kind.__name__.endswith("Trace") for name in dir(kind)}
    families = {name for kind in kinds if "Estimator" in {k.__name__ for k in kind.__mro__} for name in dir(kind)}
    for page in PAGES:
        asked = re.findall(r"\b(trace|est)\.(\w+)\(", page.read_text())
        gone = [f"{of}.{name}" for of, name in asked if name not in {"trace": traces, "est": families}[of]]
        assert not gone, f"{page.name} asks for {gone}"


def test_public_names_exist_and_are_documented():
    for name in dw.__all__:
        assert (getattr(dw, name).__doc__ or "").strip(), name


@pytest.mark.parametrize("page", sorted((ROOT / "src").rglob("README.md")), ids=lambda p: p.parent.name)
def test_readmes_of_folders_name_files_that_exist(page):
    places = [page.parent, *(p for p in page.parent.iterdir() if p.is_dir()), ROOT, ROOT / "src" / "driftwise"]
    for name in re.findall(r"`([\w./]+\.(?:py|html|css|csv|md))`", page.read_text()):
        assert any((place / name).exists() for place in places), name


def test_every_folder_says_what_belongs_there():
    package = ROOT / "src" / "driftwise"
    floors = [p for p in package.iterdir() if (p / "__init__.py").exists()]
    for folder in [*floors, package / "fleet" / "spark", package / "tracking" / "formats"]:
        assert (folder / "README.md").exists(), folder.name
