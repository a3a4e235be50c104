"""Lines as they come: whole ones, and none beyond the longest."""

from driftwise.engine.errors import InputError
from driftwise.tables import growing


def test_a_line_too_long_is_told_and_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr(growing, "LONGEST_LINE", 1000)
    monkeypatch.setattr(growing, "MOST", 64)
    path = tmp_path / "plots.csv"
    path.write_bytes(b"first\nsec")
    source = growing.Growing(str(path), pause=0.0)
    assert source.read() == (b"first\n", False) and source.place[1] == 6
    with open(path, "ab") as file:
        file.write(b"ond\n" + b"x" * 3000 + b"\nthird\nrest")
    found: bytes = b""
    told: list[str] = []
    for _ in range(100):
        try:
            found += source.read()[0]
        except InputError as error:
            told.append(str(error).partition(" than")[0])
        assert sum(map(len, source._partial)) <= 1000 + 64
    assert (found, source.rest()) == (b"second\nthird\n", b"rest")
    assert told == [f"{path}: a line is longer"]
    assert source.place[1] == path.stat().st_size
    source.close()
