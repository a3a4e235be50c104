"""The site: every page is found from the start page once, broken links are seen, formulas are drawn."""

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from scripts import changelog, check_site, reference

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


@pytest.fixture
def extension(monkeypatch):
    """Return the import of an extension of the site."""
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    for name in ("pages", "docstrings"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return __import__


def test_every_page_is_in_one_table_of_contents(extension):
    pages = extension("pages")
    named = Counter(pages.named(DOCS))
    assert not [name for name, times in named.items() if times > 1]
    ours = {str(path.relative_to(DOCS).with_suffix("")) for path in DOCS.rglob("*.md")}
    made = ("reference", "gallery", "tutorials")
    ours = {name for name in ours if not name.startswith(tuple(f"{folder}/" for folder in made))}
    assert ours == {name for name in named if not name.startswith(made)} | {"index", "reference", *pages.left(DOCS)}


def test_a_page_that_nobody_named_is_a_guide(extension, tmp_path):
    pages = extension("pages")
    (tmp_path / "docs").mkdir()
    for name, text in {"index": "```{toctree}\nhowto\nTitle <a>\n```\n", "howto": "", "a": "", "b": ""}.items():
        (tmp_path / "docs" / f"{name}.md").write_text(text)
    assert pages.named(tmp_path / "docs") == ["howto", "a"] and pages.left(tmp_path / "docs") == ["b"]


def test_every_public_name_has_an_example_its_arguments_shapes_and_units(capsys):
    assert reference.main("--check") == 0, capsys.readouterr().out


def test_a_docstring_that_lacks_something_is_named():
    def poor(y, gain, *, noise_std):
        """Return nothing.

        Parameters
        ----------
        y : what was measured
        noise_std : float
        """

    name = reference.Name("driftwise.poor", poor, ["driftwise.poor"])
    lacks = ["an example", "argument gain", "the shape of y", "the unit of noise_std"]
    assert sorted(reference.lacking(name)) == sorted(lacks)


def test_docstrings_keep_formulas_and_bars(extension):
    said = ["Mean of |e|, ``|z|``:", "", "    R <- R exp(|d|)", "", "x : int | None"]
    shown = extension("docstrings").as_typed(said)
    assert shown == [r"Mean of \|e\|, ``|z|``:", "", "::", "", "    R <- R exp(|d|)", "", r"x : int \| None"]


def test_broken_links_are_found(tmp_path):
    (tmp_path / "a.html").write_text(
        '<p id="here"><a href="b.html#no">x</a><a href="#here">x</a><a href="c.html">x</a>'
    )
    (tmp_path / "b.html").write_text(
        '<script src="https://cdn.example/x.js"></script><a href="https://example.org">x</a>'
    )
    broken, outside = check_site.check(tmp_path)
    assert len(broken) == 3 and "no such anchor" in broken[0] and "not there" in broken[1] and "loads" in broken[2]
    assert outside == {"https://cdn.example/x.js", "https://example.org"}


@pytest.mark.slow
def test_the_site_builds_without_a_warning_and_its_links_hold(tmp_path):
    pytest.importorskip("sphinx_gallery", reason="pip install -e '.[docs]': THE SITE WAS NOT BUILT")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-D", "plot_gallery=0", "-d"]
    done = subprocess.run(
        [*command, str(tmp_path / "doctrees"), str(DOCS), str(tmp_path / "site")], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-3000:]
    broken, _ = check_site.check(tmp_path / "site")
    assert not broken, broken[:20]


def test_fragments_are_gathered_by_kind(tmp_path, monkeypatch):
    monkeypatch.setattr(changelog, "FRAGMENTS", tmp_path)
    monkeypatch.setattr(changelog, "PAGE", tmp_path / "out" / "CHANGELOG.md")
    (tmp_path / "out").mkdir()
    for name, text in {"a.added.md": "One.\nMore.", "b.fixed.md": "Two.", "README.md": "no"}.items():
        (tmp_path / name).write_text(text)
    assert changelog.main("--help") == 2 and not changelog.PAGE.exists()
    assert changelog.main() == 0 and changelog.main("1.0") == 0
    said = changelog.PAGE.read_text()
    assert "Unreleased" not in said and said.index("## 1.0") < said.index("* One.\n  More.") < said.index("* Two.")
    assert [path.name for path in tmp_path.glob("*.md")] == ["README.md"]
    (tmp_path / "c.odd.md").write_text("?")
    assert changelog.main() == 1


def test_completion_knows_the_commands():
    env = {**os.environ, "_DRIFTWISE_COMPLETE": "complete_bash", "COMP_WORDS": "driftwise tr", "COMP_CWORD": "1"}
    done = subprocess.run([sys.executable, "-m", "driftwise"], env=env, capture_output=True, text=True, timeout=60)
    assert done.stdout.split() == ["track"]
