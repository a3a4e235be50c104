"""What the documentation shows runs: docstring examples, the README's code, its links and its figures."""

import doctest
import importlib
import pkgutil
import re
from pathlib import Path

import pytest

import driftwise as dw
from driftwise.engine import compile as compile_engine

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
MODULES = [m.name for m in pkgutil.walk_packages(dw.__path__, "driftwise.")]


@pytest.mark.parametrize("name", MODULES)
def test_docstring_examples(name):
    module = importlib.import_module(name)
    failed, _ = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert failed == 0


def test_readme_code_runs(capsys):
    code = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
    assert code
    for block in code:
        exec(compile(block, "README.md", "exec"), {})
    assert "second-order model" in capsys.readouterr().out


def test_contributed_code_runs(tmp_path, monkeypatch):
    """As the files that the page tells to write."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(compile_engine, "driver", compile_engine.plain_driver)
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


def test_public_names_exist_and_are_documented():
    for name in dw.__all__:
        assert (getattr(dw, name).__doc__ or "").strip(), name
