"""Tables: what is refused, and what comes through pipes or breaks off."""

import bz2
import gzip
import io
import os
import sys
import threading

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from small_tables import put, read

from driftwise.engine.errors import InputError
from driftwise.tables import checks, csvfile, growing
from driftwise.tables.parts import parts_of
from driftwise.tables.record import open_record


def test_unknown_column_suggests_and_lists(tmp_path):
    path = put(tmp_path, "time,heater_V,temp_degC\n0,1,2\n1,2,3\n")
    with pytest.raises(InputError) as caught:
        open_record(path, "temp_degc", ["heater"])
    assert "no column 'temp_degc' for the output. Did you mean 'temp_degC'" in str(caught.value)
    assert "time, heater_V, temp_degC" in str(caught.value)
    with pytest.raises(InputError, match="two parts to play"):
        open_record(path, "temp_degC", ["temp_degC"])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"\n \n\r\n", "is empty"),
        (b"u,y\n", "a header but no rows"),
        (b"# nothing\n# at all\n", "every line is blank or a comment"),
        (b"u,y\n1,\n2,NA\n3,-\n", "column 'y' is empty in all 3 rows"),
        (b"u,y\n1,5\n2,5\n3,5\n", "output column 'y' is 5 in all 3 rows: a constant"),
        (b"u,y\n1,5\n", "in its only row"),
        (b"PK\x03\x04\x00\x00", "Excel workbook"),
        (b"\x00\x01\x02" * 50, "zero bytes"),
    ],
)
def test_useless_files_say_why(tmp_path, content, words):
    path = put(tmp_path, content)
    with pytest.raises(InputError, match=words) as caught:
        list(open_record(path, "y"))
    assert str(caught.value).startswith(path), "the message names the file"
    assert "\n" not in str(caught.value), "one paragraph"


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be"])
def test_unicode_text_of_a_spreadsheet_is_read_to_its_end(tmp_path, encoding):
    text = "Heizung (W)\tTemperatur (°C)\r\n" + "".join(f"{k % 7}\t{k},5\r\n" for k in range(200_000))
    data = text.encode(encoding) if encoding == "utf-16" else b"\xfe\xff" + text.encode(encoding)
    record = open_record(put(tmp_path, data), "Temperatur (°C)", ["Heizung (W)"])
    y = np.concatenate([chunk.columns[record.output] for chunk in record])
    np.testing.assert_array_equal(y, np.arange(200_000) + 0.5)
    assert record.bad == record.source.ragged == 0 and record.source.fraction == 1.0


def test_an_input_that_is_empty_is_refused_and_a_constant_one_is_not(tmp_path):
    with pytest.raises(InputError, match="column 'u' is empty"):
        read(put(tmp_path, "u,y\n,1\n,2\n"), "y", ["u"])
    read(put(tmp_path, "u,y\n3,1\n3,2\n"), "y", ["u"])


def test_missing_file_and_folder(tmp_path):
    put(tmp_path, "y\n1\n2\n", "plant.csv")
    with pytest.raises(InputError, match=r"no such file. Did you mean .*plant\.csv"):
        open_record(str(tmp_path / "plan.csv"), "y")
    with pytest.raises(InputError, match="is a folder"):
        open_record(str(tmp_path), "y")
    with pytest.raises(InputError, match="no folder"):
        open_record(str(tmp_path / "away" / "x.csv"), "y")


def test_an_output_that_starts_late_is_waited_for(tmp_path, monkeypatch):
    path = put(tmp_path, "u,y\n" + "".join(f"{k},{'' if k < 500 else k}\n" for k in range(1000)))
    chunks = list(open_record(path, "y", chunk_rows=64))
    assert sum(c.rows for c in chunks) == 1000
    monkeypatch.setattr(checks, "PATIENCE", 256)
    with pytest.raises(InputError, match="empty in its first 256 rows"):
        list(open_record(path, "y", chunk_rows=64))


def test_standard_input(monkeypatch):
    class Trickle(io.RawIOBase):
        """A pipe that hands over a few bytes at a time."""

        def __init__(self, data):
            self.data = data

        def readable(self):
            return True

        def read(self, size=-1):
            part, self.data = self.data[: min(7, size)], self.data[min(7, size) :]
            return part

    class Stdin:
        buffer = Trickle(b"u,y\n" + b"".join(b"%d,%d\n" % (k, k * k) for k in range(50)))

    monkeypatch.setattr(sys, "stdin", Stdin)
    record, columns, _ = read("-")
    assert columns["y"].tolist() == [k * k for k in range(50)]
    assert record.source.fraction is None


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
@pytest.mark.parametrize("content, y", [(b"u,y\n1,2.5\n-1,3.5\n", [2.5, 3.5]), (b"PAR1" + bytes(60), None)])
def test_a_named_pipe_is_read_once_from_its_beginning(tmp_path, content, y):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    writer = threading.Thread(target=lambda: path.write_bytes(content))
    writer.start()
    if y is None:
        with pytest.raises(InputError, match="give the file itself"):
            read(str(path), "y", ["u"])
    else:
        record, columns, _ = read(str(path), "y", ["u"])
        assert columns["y"].tolist() == y and record.source.fraction is None
    writer.join(10.0)
    assert not writer.is_alive()
    with pytest.raises(InputError, match=r"pipe will not do, give a file"):
        parts_of(str(path))


def test_a_line_without_an_end_is_refused_and_not_held_in_memory(monkeypatch):
    monkeypatch.setattr(growing, "LONGEST_LINE", 1 << 20)

    class Endless:
        taken = 0

        def __init__(self, head):
            self.head = head

        def read(self, size):
            head, self.head = self.head[:size], self.head[size:]
            self.taken += size
            return head + b"1" * (size - len(head))

    for head in (b"1", b"u,y\n" + b"1,2\n" * 100_000 + b"1"):
        stream = Endless(head)
        with pytest.raises(InputError, match="line is longer than 1 MiB"):
            list(csvfile.CsvSource(stream).batches(["y"] if b"y" in head else ["column1"]))
        assert stream.taken < 1 << 24


@pytest.mark.parametrize("kind", ["gz", "bz2", "parquet"])
def test_a_table_that_breaks_off_on_the_way_is_told_by_its_name(tmp_path, kind):
    rng = np.random.default_rng(1)
    path, values = tmp_path / f"t.csv.{kind}", rng.standard_normal(4000)
    text = "y\n" + "".join(f"{v}\n" for v in values)
    if kind == "parquet":
        pq.write_table(pa.table({"y": values}), path, compression="none")
        content = bytearray(path.read_bytes())
        content[4:40] = b"\xff" * 36
    else:
        content = {"gz": gzip, "bz2": bz2}[kind].compress(text.encode())[:-30]
    path.write_bytes(content)
    with pytest.raises(InputError, match=f"t.csv.{kind}: it cannot be read to its end"):
        for _ in open_record(str(path), "y"):
            pass


def test_what_unpacks_to_one_endless_line_is_told_by_its_name(tmp_path):
    path = put(tmp_path, gzip.compress(b"t,y\n1,2\n" + b"\n" * (70 << 20), 1), "t.csv.gz")
    with pytest.raises(InputError, match=r"t\.csv\.gz: a line is longer"):
        for _ in open_record(path, "y"):
            pass
