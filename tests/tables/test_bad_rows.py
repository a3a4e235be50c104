"""Bad cells and rows are counted and keep their place, and nothing depends on how a file is cut."""

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_tables import NaN, put, read

from driftwise.engine.errors import InputError
from driftwise.tables import autoread, csvfile
from driftwise.tables.dataset import open_dataset
from driftwise.tables.record import open_record

# --- bad cells and rows ------------------------------------------------------------------------------------


def test_bad_rows_are_counted_flagged_and_keep_their_place(tmp_path):
    rows = [f"{k},{k * k}" for k in range(20)]
    rows[5] = "5,broken"
    rows[8] = "8"
    rows[11] = "11,inf"
    rows[13] = "13,169,7,8"
    rows[15] = "u,y"  # a header again, where two recordings were joined
    record, columns, bad = read(put(tmp_path, "u,y\n" + "\n".join(rows) + "\n"), "y", ["u"])
    lost = [5, 8, 11, 13, 15]
    assert np.flatnonzero(bad["y"]).tolist() == lost
    assert np.flatnonzero(np.isnan(columns["y"])).tolist() == lost
    good = np.setdiff1d(np.arange(20), lost)
    assert columns["y"][good].tolist() == (good**2).tolist()
    assert np.flatnonzero(bad["u"]).tolist() == [8, 13, 15]
    assert (record.source.ragged, record.bad) == (2, 8)
    assert record.first_bad == "row 6, column 'y'"


def test_a_stray_quote_costs_one_row_at_most(tmp_path):
    rows = [f"{k},{k},ok" for k in range(200)]
    rows[50] = '50,50,5" pipe'
    rows[70] = '70,"70,ok'
    rows[90] = '90,90,"an open end'
    record, columns, _ = read(put(tmp_path, "u,y,note\n" + "\n".join(rows)))
    assert len(columns["y"]) == 200
    assert np.isnan(columns["y"]).sum() <= 1
    assert columns["y"][-1] == 199
    assert record.source.ragged <= 1


def test_a_column_of_mostly_text_is_refused(tmp_path):
    path = put(tmp_path, "u,y\n" + "".join(f"{k},state{k}\n" for k in range(9)))
    with pytest.raises(InputError, match="column 'y': 9 of the first 9 cells are not numbers"):
        list(open_record(path, "y"))


def test_numbers_beyond_all_bounds_are_called_so(tmp_path):
    path = put(tmp_path, "t,y,u\n" + "".join(f"{k},{k % 7}.5e{120 - 400 * (k % 5 == 4)},{k % 3}\n" for k in range(90)))
    said = "column 'y': most of its first 90 cells are numbers beyond 1e100"
    with pytest.raises(InputError, match=said):
        list(open_record(path, "y"))
    with pytest.raises(InputError, match=said):
        open_dataset(path, "t", "y")
    with pytest.raises(InputError, match="column 'y' has numbers beyond 1e100"):
        autoread.read(path, output="y")
    table, _ = autoread.read(path, output="u")
    assert table["y"].why == "numbers beyond 1e100"
    few = put(tmp_path, "t,y\n" + "".join(f"{k},{k % 7}.5{'e120' * (k == 3)}\n" for k in range(90)))
    record = open_record(few, "y")
    assert sum(chunk.bad for chunk in record) == 1 and not record.beyond


@settings(max_examples=60, deadline=None)
@given(
    cells=st.lists(
        st.tuples(
            st.one_of(st.floats(-1e6, 1e6), st.just(None)),
            st.one_of(st.floats(-1e6, 1e6), st.just(None), st.sampled_from(["text", "1.2.3", "inf", "1e999", "--5"])),
        ),
        min_size=3,
        max_size=60,
    ),
    delimiter=st.sampled_from([",", ";", "\t", "|"]),
    comma=st.booleans(),
    newline=st.sampled_from(["\n", "\r\n"]),
    chunk=st.integers(1, 50),
    block=st.integers(8, 400),
)
def test_what_is_written_is_read_however_it_is_cut(tmp_path_factory, cells, delimiter, comma, newline, chunk, block):
    comma = comma and delimiter != ","
    bad = [isinstance(y, str) for _, y in cells]
    values = [NaN if y is None or isinstance(y, str) else y for _, y in cells]

    def write(value):
        text = "" if value is None else value if isinstance(value, str) else repr(value)
        return text.replace(".", ",") if comma and not isinstance(value, str) else text

    lines = [delimiter.join(["k", "u", "y"])]
    lines += [delimiter.join([str(k), write(u), write(y)]) for k, (u, y) in enumerate(cells)]
    seen = [v for v in values if v == v]
    if not seen or min(seen) == max(seen) or sum(bad) > len(seen) or all(u is None for u, _ in cells):
        return
    path = put(tmp_path_factory.mktemp("t"), newline.join(lines) + newline)
    before, csvfile.BLOCK = csvfile.BLOCK, block
    try:
        record, columns, flags = read(path, "y", ["u"], "k", chunk_rows=len(cells), raw=True)
        again, cut, _ = (
            read(path, "y", ["u"], "k", chunk_rows=chunk, raw=True) if not any(bad) else (record, columns, flags)
        )
    finally:
        csvfile.BLOCK = before
    np.testing.assert_array_equal(columns["y"], values)
    np.testing.assert_array_equal(columns["u"], [NaN if u is None else u for u, _ in cells])
    np.testing.assert_array_equal(flags["y"], bad)
    np.testing.assert_array_equal(columns["k"], np.arange(len(cells)))
    assert record.bad == sum(bad)
    np.testing.assert_array_equal(cut["y"], columns["y"])
    np.testing.assert_array_equal(cut["u"], columns["u"])
    assert again.bad == record.bad


def test_small_blocks_with_comments_quotes_and_ragged_rows(tmp_path, monkeypatch):
    rng = np.random.default_rng(3)
    lines, expected = ["k,note,y"], []
    for k in range(3000):
        draw = rng.random()
        if draw < 0.02:
            lines.append("# a remark, with commas")
        if draw > 0.98:
            lines.append("")
        if 0.4 < draw < 0.41:
            lines.append(f"{k},{k}")
            expected.append(NaN)
        else:
            note = '"two\nlines, quoted"' if 0.5 < draw < 0.52 else "x"
            lines.append(f"{k},{note},{k / 8}")
            expected.append(k / 8)
    path = put(tmp_path, "\n".join(lines))
    monkeypatch.setattr(csvfile, "HEAD", 500)
    for block in (200, 1000, 10**6):
        monkeypatch.setattr(csvfile, "BLOCK", block)
        record, columns, _ = read(path)
        np.testing.assert_array_equal(columns["y"], expected)
        assert record.source.ragged == np.isnan(expected).sum()


def test_chunks_have_exactly_the_rows_asked_for(tmp_path):
    path = put(tmp_path, "y\n" + "\n".join(map(str, range(1003))))
    chunks = list(open_record(path, "y", chunk_rows=100))
    assert [c.rows for c in chunks] == [100] * 10 + [3]
    assert [c.first_row for c in chunks] == list(range(0, 1003, 100))


# --- refusals ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ragged", ["3,é", "3,1,2.5,4,é", "3,1,2.5,é"])
def test_a_ragged_row_of_latin_letters_is_counted_without_a_traceback(tmp_path, monkeypatch, ragged):
    raised = []
    monkeypatch.setattr(sys, "unraisablehook", raised.append)
    rows = [f"{k},{(-1) ** k},{k / 2}" for k in range(6)]
    text = "\n".join(["time,u,y", *rows[:3], ragged, *rows[4:]]) + "\n"
    record, columns, _ = read(put(tmp_path, text.encode("latin-1")), "y", ["u"])
    assert not raised
    assert np.isnan(columns["y"][3]) and columns["y"][4] == 2.0 and len(columns["y"]) == 6
    assert record.source.ragged == 1
