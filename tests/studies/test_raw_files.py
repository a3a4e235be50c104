"""Recordings as the files they are: what counts as found, as false, and as absent."""

import numpy as np
import pytest
from driftwise_studies.score import raw_files
from driftwise_studies.score.raw_files import Known, Line, Raw, Told, verdicts


def told(changes=0, near=(), rows=4000, rmse=1.0):
    return Told("y", False, rows, changes, near, rmse, 1.0, 0.1)


def test_a_step_of_a_drawn_file_is_found_near_its_date_and_is_not_false(tmp_path):
    y = np.random.default_rng(11).standard_normal(600) + 4.0 * (np.arange(600) >= 300)
    (tmp_path / "drawn.csv").write_text("t_s,level\n" + "".join(f"{k},{x:.4f}\n" for k, x in enumerate(y)))
    there, elsewhere = Known("step", 300.0, 5.0), Known("nothing", 100.0, 5.0)
    seen = raw_files.read(Raw("drawn.csv", "level", (), (there, elsewhere)), tmp_path, True)
    assert seen.near[0] == pytest.approx(300, abs=5) and seen.near[1] is None
    assert seen.changes == 1 and seen.false == 0


def test_changes_beyond_the_promise_are_named_and_short_records_are_not_judged():
    steady = Line(Raw("steady"), (told(), told(changes=5)))
    short = Line(Raw("short"), (told(changes=9, rows=1999),) * 2)
    said = [line for line in verdicts([steady, short]) if "false" in line]
    assert "1 of 1" in said[0] and "0 of 1" in said[1] and "steady 1.25" in said[1] and "short" not in said[1]


def test_an_absent_file_is_said_and_not_met(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(raw_files, "FILES", (Raw("gone.csv", known=(Known("it", 1.0, 1.0),), is_irregular=True),))
    lines = list(raw_files.measure(tmp_path))
    assert "ABSENT" in capsys.readouterr().err and lines[0].told == ("absent", "absent")
    said = " ".join(verdicts(lines))
    assert "0 of 1 files read" in said and "(not: gone.csv it)" in said and "(not: gone.csv)" in said
    assert raw_files.table(lines).count("absent") == 2


def test_what_was_told_of_a_file_is_kept_until_the_file_is_another(tmp_path, monkeypatch):
    where = tmp_path / "drawn.csv"
    where.write_text("t_s,level\n0,1\n")
    answers = iter([told(near=(None, 3.0)), told(changes=2)])
    monkeypatch.setattr(raw_files, "read", lambda *_: next(answers))
    first = raw_files.remembered(Raw("drawn.csv"), tmp_path, True, tmp_path)
    assert raw_files.remembered(Raw("drawn.csv"), tmp_path, True, tmp_path) == first == told(near=(None, 3.0))
    where.write_text("t_s,level\n0,2\n")
    assert raw_files.remembered(Raw("drawn.csv"), tmp_path, True, tmp_path).changes == 2
    assert raw_files.kept_at(tmp_path / "kept") is None or (tmp_path / "kept").is_dir()
