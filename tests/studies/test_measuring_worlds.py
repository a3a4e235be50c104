"""Measuring and judging on drawn worlds: bars, totals, rankings, judgements on record."""

import re
import subprocess

import numpy as np
import pytest
from drawn_worlds import DRAWN
from driftwise_studies.score.worlds import field, judged, measured, ranking, told

from driftwise.engine.errors import InputError

# --- measuring ---------------------------------------------------------------------------------------------


def test_who_never_forgets_is_the_reference_of_constants():
    line = field.one(0, 0, 4, ["Constant()", "AutoMemory()"])  # nothing troubles it
    assert line.system.troubles == ("nothing",)
    assert 0.97 < line.found["Constant()"].ratio < 1.03
    again = field.play(0, [0], 4, ["Constant()"])
    assert again[0].found["Constant()"].ratio == line.found["Constant()"].ratio
    words = field.by_trouble([line], "Constant()") + field.worst([line], "Constant()")
    assert "| nothing, alone | 1 |" in words and line.system.about in words


def test_bars_are_counted_after_the_jumps_that_count():
    inside = np.ones((1, 200, 2), bool)
    inside[0, 100:115, 0] = False
    jumps = np.array([[100, 150]])
    assert measured.held_after(inside, jumps, np.array([[True, True]])) == 0.75
    assert measured.held_after(inside, jumps, np.array([[False, True]])) == 1.0
    assert np.isnan(measured.held_after(inside, jumps, np.array([[False, False]])))


def line(ratio, told_, tellable, false):
    """Return a line of the field by hand."""
    system = DRAWN[0] if not tellable else DRAWN[9]
    jumps = np.array([tellable], bool).reshape(1, -1)
    one = measured.Measured(1.0, ratio, ratio, 0.9, np.nan, np.nan, np.nan, np.array([told_], bool), false, 0.0, 1.0)
    return field.Line(system, told.Told(1.0, 1.0, "", jumps), np.full(jumps.shape, 2.5), {"AutoMemory()": one})


def test_totals_by_hand():
    lines = [line(1.0, [], [], 0.5), line(4.0, [True, True, False], [True, False, True], 7.0)]
    found = field.total(lines, "AutoMemory()")
    assert found.mean == pytest.approx(2.0) and found.worst == 4.0 and found.systems == 2
    assert (found.told, found.tellable) == (1, 2)
    assert found.false == 0.5  # jumps told where parameters do jump are no false ones of a system that rests
    assert "| 2 to 3 | 3 | 2 | 1 | 0.50 |" in field.by_size(lines, "AutoMemory()")
    met = dict(
        judged.verdicts(found._replace(mean=1.1, high=1.3, worst=1.7, told=9, tellable=10, false=0.02, after=0.9))
    )
    assert sum(met.values()) == 6 and not next(good for words, good in met.items() if "bars hold" in words)


def test_the_ranking_names_the_winner():
    lines = [field.one(0, number, 1, ["Constant()", "GainFloor(50.0)", "GainFloor(200.0)"]) for number in (0, 3)]
    words = ranking.wins(lines, lines[0].found)
    assert re.search(r"\| Constant \| `Constant\(\)` \| [\d.]+ \| 1 \|.*\| nothing \|", words)
    assert re.search(r"\| GainFloor \| .* \| 1 \|.*\| walk all \|", words)
    assert "`GainFloor(200.0)`" in ranking.ranks(lines, lines[0].found) + ranking.alone(lines, lines[0].found)


# --- judging -----------------------------------------------------------------------------------------------


def test_the_judging_seed_is_that_of_the_last_commit_that_moved_a_constant(monkeypatch):
    said = {"status": "", "rev-parse": "false", "log": "00ff00aa" + 32 * "1"}
    monkeypatch.setattr(judged, "git", lambda *words: said[words[0]])
    assert judged.seed() == ("00ff00aa" + 32 * "1", 0x00FF00AA)
    said["status"] = " M src/driftwise/memory/auto.py"
    with pytest.raises(InputError, match="commit first"):
        judged.seed()
    said.update(status="", **{"rev-parse": "true"})
    with pytest.raises(InputError, match="cut short"):
        judged.seed()


def test_every_file_with_a_constant_is_there():
    assert all((judged.ROOT / name).exists() for name in judged.CONSTANTS)


def test_every_part_of_the_default_that_has_a_constant_moves_the_seed():
    """Also what mixing takes from elsewhere: a part that is missing could be chosen in sight of its judge."""
    folder = judged.ROOT / "src" / "driftwise" / "memory"
    parts = {file.stem for file in folder.glob("*.py") if "from .auto_constants import" in file.read_text()}
    assert parts | {"wind_up"} <= set(judged.CHOSEN)


def test_a_judgement_is_appended_and_made_once(tmp_path):
    page, lines = tmp_path / "judged.md", [line(1.0, [], [], 0.0)]
    page.write_text("# Judged\n")
    judged.refuse_twice(judged.title("a" * 40, 1, 1), page)
    judged.append(judged.judgement("a" * 40, 1, 1, lines, "AutoMemory()", (1.05, 1.13)), page)
    first = page.read_text()
    judged.append(judged.judgement("b" * 40, 2, 1, lines, "AutoMemory()", None), page)
    assert "* met: mean ratio of the eight" in first and "* **missed**: their worst: 1.13 (at most 1.12)" in first
    assert first.startswith("# Judged\n") and page.read_text().startswith(first)
    with pytest.raises(InputError, match="judged already"):
        judged.refuse_twice(judged.title("a" * 40, 1, 1), page)
    judged.refuse_twice(judged.title("a" * 40, 1, 2), page)


def test_tables_go_between_their_markers(tmp_path):
    page = tmp_path / "worlds.md"
    page.write_text("a\n<!-- one: begin -->\nold\n<!-- one: end -->\n<!-- two: begin -->\n<!-- two: end -->\nz\n")
    judged.write("one", "new\n", page)
    assert page.read_text().startswith("a\n<!-- one: begin -->\nnew\n<!-- one: end -->\n<!-- two: begin")
    assert page.read_text().endswith("<!-- two: end -->\nz\n")


def test_no_judgement_was_ever_taken_back():
    try:
        past = subprocess.run(
            ["git", "-C", str(judged.ROOT), "log", "-p", "--format=", "--", str(judged.PAGE)],
            capture_output=True, text=True, check=True,
        ).stdout  # fmt: skip
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no history here")
    assert not re.findall(r"^-(?:##|\||\*).*", past, re.M)
