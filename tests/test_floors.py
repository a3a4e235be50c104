"""Imports point down: no circle, function-level imports included, the table of verbs aside."""

from scripts.house_tree import circles, imports


def test_no_import_circle():
    found = circles(imports())
    assert not found, "modules that import each other: " + "; ".join(", ".join(group) for group in found)


def test_a_circle_is_found(tmp_path):
    files = {
        "a.py": "from .low import b\n",
        "low/b.py": "def late():\n    from ..c import thing\n",
        "c.py": "import driftwise.a\n",
        "low/__init__.py": "",
        "__init__.py": "",
        "results/verbs.py": "from ..d import draw\n",
        "d.py": "from .results import verbs\n",
    }
    root = tmp_path / "driftwise"
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    assert circles(imports(root)) == [["driftwise.a", "driftwise.c", "driftwise.low.b"]]
