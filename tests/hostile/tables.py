"""Tables as no program should write them, and some programs do: drawn from a generator, as bytes and an ending."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass, field

import numpy as np

NAMES = [
    "<script>pwn()</script>", '"><img src=x onerror=pwn()>', "=cmd|' /C calc'!A0", "@SUM(1)", "+1", "-1",
    "\x1b[31mred\x1b[0m", "\x1b]0;pwn\x07", "a\tb", "a,b", 'say "y"', "\u202eevil", "e\u0301", "\u00e9", "\U0001f600",
    "\ufeff", " ", "", "nan", "1.0", "__proto__", "constructor", "{{7*7}}", "${7*7}", "%s%n", "../../etc/passwd",
    "x" * 5000, "CON", "\u0000"[:0], "time", "t", "y (m/s)", "y [\u00b0C]", "y_std", "b0", "status", "\u2028",
    "</td></table>", "&amp;lt;", "\\u003cscript\\u003e", "[link=x]y[/link]", "[bold]", "[/]", "y\\",
]  # fmt: skip
CELLS = [
    "", " ", "NA", "nan", "-nan", "inf", "-Infinity", "1e400", "-1e400", "1e-400", "1e308", "-1.7e308", "5e-324",
    "1e", "e5", "--1", "+-1", "+1", "1_000", "0x1F", "1,5", "1.234.567", "1'000", "(1.0)", "1.0-", "\u22121",
    "\uff11\uff12", "\u0661\u0662", "1 000", "1\u00a0000", "TRUE", "off", "#DIV/0!", "#N/A", "=1+1", "NULL", "None",
    "\\N", "-9999", "-999.25", "9999", "32767", "99999", "1e30", "9" * 400, "0" * 9999, "0." + "3" * 9999,
    "x" * 70_000, "12:30", "24:00:00", "2024-02-30", "9999-12-31", "0001-01-01", "1970-01-01T00:00:00Z", "20240230",
    "1/0", "1;2", "\x00", "\x1a", "\x1b[2J", "\x7f", "\u0000", '"', '""', '"1"', "'1'", "1 m/s", "12 %", "\u00bd",
    "1\u2028", "-", "?", "*", "<1", "1e5e5", ".", ",", "1.", ".5", "-.5e-3", "1d5", "1.#QNAN", "1.#INF", "1\r2",
]  # fmt: skip


@dataclass
class Table:
    """A table in the making: cells as text, and how they are put together; `bytes` is what becomes of it."""

    names: list[str]
    rows: list[list[str]]
    delimiter: str = ","
    newline: str = "\n"
    encoding: str = "utf-8"
    has_header: bool = True
    before: str = ""
    after: str = ""
    bent: list = field(default_factory=list)  # what is done to the bytes in the end
    told: list[str] = field(default_factory=list)  # what was done, in words

    def to_bytes(self) -> bytes:
        lines = [self.names, *self.rows] if self.has_header else self.rows
        text = self.before + "".join(self.delimiter.join(line) + self.newline for line in lines) + self.after
        data = text.encode(self.encoding, "replace")
        for bend in self.bent:
            data = bend(data)
        return data


def plain(rng, rows: int) -> Table:
    """Return an honest table: a clock, one or two inputs, an output that follows them."""
    k = int(rng.integers(1, 3))
    u = rng.standard_normal((rows, k)).round(4)
    y, last = np.zeros(rows), 0.0
    for t in range(rows):
        last = y[t] = 0.8 * last + u[t].sum() + 0.1 * rng.standard_normal()
    clock = CLOCKS[int(rng.integers(len(CLOCKS)))](rows)
    cells = [[stamp, *(f"{v:g}" for v in u[t]), f"{y[t]:.5g}"] for t, stamp in enumerate(clock)]
    return Table(["t", *(f"u{i + 1}" if i else "u" for i in range(k)), "y"], cells)


def _dates(step, form):
    begin = dt.datetime(2024, 3, 30, 23)
    return lambda rows: [(begin + i * step).strftime(form) for i in range(rows)]


CLOCKS = [
    lambda rows: [str(i) for i in range(rows)],
    lambda rows: [f"{0.1 * i:.1f}" for i in range(rows)],
    lambda rows: [str(1_700_000_000_000 + 1000 * i) for i in range(rows)],
    lambda rows: [str(45_000 + i) for i in range(rows)],
    _dates(dt.timedelta(minutes=10), "%Y-%m-%d %H:%M:%S"),
    _dates(dt.timedelta(minutes=10), "%Y-%m-%dT%H:%M:%SZ"),
    _dates(dt.timedelta(days=1), "%d.%m.%Y"),
    _dates(dt.timedelta(days=1), "%m/%d/%Y"),
    _dates(dt.timedelta(minutes=1), "%H:%M:%S"),
    _dates(dt.timedelta(seconds=1), "%Y%m%d%H%M%S"),
]

BENDS = []  # what makes a table hostile


def bend(function):
    """Add a function (table, rng) to what is drawn from."""
    BENDS.append(function)
    return function


def hostile(rng, most: int = 150) -> Table:
    """Return a table with one to three things wrong with it."""
    table = plain(rng, int(rng.choice([1, 3, 12, 60, most])))
    for at in rng.choice(len(BENDS), int(rng.integers(1, 4)), replace=False):
        BENDS[at](table, rng)
        table.told.append(BENDS[at].__name__)
    return table


def _some(table, rng, share=0.05):
    """Yield places (row, column) of cells, at least one."""
    count = max(1, int(share * len(table.rows)))
    for _ in range(count if table.rows else 0):
        row = int(rng.integers(len(table.rows)))
        if table.rows[row]:
            yield row, int(rng.integers(len(table.rows[row])))


@bend
def odd_cells(table, rng):
    for row, column in _some(table, rng, float(rng.choice([0.01, 0.2, 2.0]))):
        table.rows[row][column] = CELLS[int(rng.integers(len(CELLS)))]


@bend
def one_odd_cell_everywhere(table, rng):
    cell, column = CELLS[int(rng.integers(len(CELLS)))], int(rng.integers(len(table.names)))
    for row in table.rows[int(rng.integers(3)) :]:
        if column < len(row):
            row[column] = cell


@bend
def odd_names(table, rng):
    for column in range(len(table.names)):
        if rng.random() < 0.6:
            table.names[column] = NAMES[int(rng.integers(len(NAMES)))]


@bend
def names_twice(table, rng):
    table.names = [table.names[-1]] * len(table.names)


@bend
def header_of_another_length(table, rng):
    table.names = table.names[int(rng.integers(1, 3)) :] if rng.random() < 0.5 else [*table.names, "z", ""]


@bend
def no_header(table, rng):
    table.has_header = False


@bend
def header_again(table, rng):
    table.rows.insert(len(table.rows) // 2, list(table.names))


@bend
def ragged(table, rng):
    for row, _ in _some(table, rng, float(rng.choice([0.01, 0.5]))):
        table.rows[row] = (
            table.rows[row][:-1] if rng.random() < 0.5 else table.rows[row] + ["1"] * int(rng.integers(1, 40))
        )


@bend
def many_columns(table, rng):
    more = int(rng.choice([20, 300]))
    table.names += [f"c{i}" for i in range(more)]
    for row in table.rows:
        row += ["1"] * more


@bend
def few_rows(table, rng):
    del table.rows[int(rng.integers(3)) :]


@bend
def constant(table, rng):
    for row in table.rows:
        row[-1] = "7"


@bend
def all_missing(table, rng):
    column = int(rng.integers(len(table.names)))
    for row in filter(None, table.rows):  # one without a cell has none to miss
        row[min(column, len(row) - 1)] = ""


@bend
def huge_numbers(table, rng):
    power = int(rng.choice([-320, -160, 30, 99, 101, 160, 307]))
    for row in table.rows:
        row[-1] = f"{row[-1]}e{power}"


@bend
def one_outlier(table, rng):
    for row, _ in [*_some(table, rng, 0.0)]:
        table.rows[row][-1] = str(rng.choice(["1e18", "-1e99", "1e299"]))


@bend
def clock_shuffled(table, rng):
    order = rng.permutation(len(table.rows))
    for row, stamp in zip(table.rows, [table.rows[i][0] for i in order]):
        row[0] = stamp


@bend
def clock_stands(table, rng):
    for row in table.rows[len(table.rows) // 2 :]:
        row[0] = table.rows[0][0]


@bend
def sentinel_dates(table, rng):
    for row, _ in _some(table, rng):
        table.rows[row][0] = str(rng.choice(["9999-12-31", "0001-01-01", "1899-12-30 00:00:00", "2262-04-12", "-1"]))


@bend
def other_delimiter(table, rng):
    table.delimiter = str(rng.choice([";", "\t", "|", " ", "  ", ", ", ":", "\x1f", "\\t", "^"]))


@bend
def decimal_commas(table, rng):
    table.rows = [[cell.replace(".", ",") for cell in row] for row in table.rows]


@bend
def line_ends(table, rng):
    table.newline = str(rng.choice(["\r\n", "\r", "\n\r", "\r\r\n", "\n\n", "\x0b", "\x0c\n", "\u2028", "\x85"]))


@bend
def mixed_line_ends(table, rng):
    ends, which = [b"\n", b"\r\n", b"\r"], iter(rng.integers(0, 3, 1 << 14))
    table.bent.append(lambda data: b"".join(line + ends[next(which, 0)] for line in data.split(b"\n")))


@bend
def other_encoding(table, rng):
    table.names[-1] += "\u00e9"
    table.encoding = str(
        rng.choice(["latin-1", "cp1252", "utf-8-sig", "utf-16", "utf-16-le", "utf-32", "utf-7", "cp037", "shift-jis"])
    )


@bend
def broken_utf8(table, rng):
    table.bent.append(lambda data: _spoilt(data, rng, [0x80, 0xC0, 0xE2, 0xFF, 0xED], 3))


@bend
def zero_bytes(table, rng):
    table.bent.append(lambda data: _spoilt(data, rng, [0], int(rng.choice([1, 40]))))


@bend
def any_bytes(table, rng):
    table.bent.append(lambda data: _spoilt(data, rng, range(256), int(rng.choice([1, 5, 100]))))


@bend
def cut_off(table, rng):
    table.bent.append(lambda data: data[: int(rng.integers(len(data) + 1))])


@bend
def stray_quotes(table, rng):
    table.bent.append(lambda data: _spoilt(data, rng, b'"', int(rng.integers(1, 4))))


@bend
def quoted_newlines(table, rng):
    for row, column in _some(table, rng):
        table.rows[row][column] = f'"{table.rows[row][column]}\n{"x" * int(rng.choice([0, 9, 5000]))}"'


@bend
def a_preamble(table, rng):
    table.before = str(
        rng.choice(
            [
                "sep=;\n",
                "# made by\n" * 3,
                "\n\n",
                "Device;X1\nSerial;7\n\n",
                "%\n",
                "\ufeff\ufeff",
                "<html>\n",
                "{\n",
                "---\n",
                '"\n',
                "#" * 9000,
            ]
        )
    )


@bend
def a_tail(table, rng):
    table.after = str(
        rng.choice(["\n" * 50, "\x1a", "Total,1,2,3\n", "," * 99, '"', "# end", " ", "\x00" * 512, "1,2", "\r"])
    )


def _spoilt(data: bytes, rng, values, count: int) -> bytes:
    spoilt = bytearray(data)
    for _ in range(count if spoilt else 0):
        spoilt[int(rng.integers(len(spoilt)))] = values[int(rng.integers(len(values)))]
    return bytes(spoilt)
