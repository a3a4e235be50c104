"""Find out how a delimited text file is written, from its first lines."""

from __future__ import annotations

import csv
import itertools
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from driftwise.engine.errors import InputError
from driftwise.tables.cell_kinds import GROUPED, kind
from driftwise.tables.dates import are_compact
from driftwise.tables.day_order import day_order
from driftwise.tables.marks import Marks, marks_of
from driftwise.tables.said_interval import interval_of

COMMENTS = ("#", "%")
DELIMITERS = ("\t", ";", "|", ",", " ")
SAMPLE_LINES = 200
HEADER_LINES = 5
MIXED = 0.05  # share of the rows that a kind of them has, of which several are mixed
SAID_LINES = 50  # as wide as the table, in which a header is looked for
LOGGERS = frozenset({"TOA5", "TOACI1", "TOB1"})  # that write about themselves above the names, as many cells or not
PROCESSED = frozenset(
    ["", "Avg", "Smp", "Min", "Max", "Tot", "Std", "WVc", "Med"]
)  # what a logger did, below the units

_OF_DAY = re.compile(r"\d\d?:\d\d(:\d\d([.,]\d+)?)?$")


@dataclass(frozen=True)
class Dialect:
    """How a file is written: `names` of the columns, lines to `skip` before the first row of numbers."""

    delimiter: str
    decimal: str
    names: tuple[str, ...]
    skip: int
    has_header: bool
    units: dict[str, str] = field(default_factory=dict)
    stamps: frozenset[str] = frozenset()  # columns of time stamps
    texts: frozenset[str] = frozenset()  # columns of words
    day_first: bool = True  # whether 1/2/2024 is the first of February
    is_day_known: bool = True  # whether anything says so
    marks: dict[str, Marks] = field(default_factory=dict)  # what cells carry beside numbers
    interval: float | None = None  # seconds between samples, as lines above the rows give it


def split(line: str, delimiter: str) -> list[str]:
    """Split one line into stripped cells, honouring double quotes."""
    try:
        if delimiter == " ":
            return next(csv.reader([" ".join(line.split())], delimiter=" "), []) if '"' in line else line.split()
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])]
    except csv.Error:
        return line.split(delimiter)


def sniff(lines: list[str], further: Sequence[str] = ()) -> Dialect:
    """Return the dialect of a file from its first lines (physical lines, without line ends)."""
    content, comments = [], []
    for number, line in enumerate(lines):
        if line.lstrip().startswith(COMMENTS):
            comments.append((number, line.lstrip()[1:].strip()))
        elif line.strip():
            content.append((number, line))
        if len(content) == SAMPLE_LINES:
            break
    forced = None
    if content and re.fullmatch(r"sep=.", content[0][1].strip("\r \n").lower() or ""):
        forced = content.pop(0)[1].strip()[-1]  # what Excel writes as its first line
    if not content:
        raise InputError("the table holds no rows: every line is blank or a comment. Was the recording ever started?")
    delimiter = forced or _delimiter([line for _, line in content])
    numbers = [number for number, _ in content]
    rows = [split(line, delimiter) for _, line in content]
    _refuse_mixed(rows[len(rows) // 2 :])
    width = _width(rows)
    wide = [i for i, row in enumerate(rows) if len(row) == width]
    numeric = _numeric([rows[i] for i in wide[len(wide) // 2 :]], width)
    first = _first(rows, wide, numeric)
    body = [row for row in rows[first + 1 :] if len(row) == width]
    marks = [_marks([row[j] for row in body]) for j in range(width)]
    if any(marks):
        rows = [
            [m.bare(cell) if m else cell for m, cell in zip(marks, row)] if len(row) == width else row for row in rows
        ]
        body = [row for row in rows[first + 1 :] if len(row) == width]
    known = set(numeric)
    numeric = [j for j, mark in enumerate(marks) if mark or j in known]

    header, units, start = _header(rows, first, width, numeric)
    if header is not None and len(header) < width:
        named = [row for row in rows[start:] if len(row) == width]  # also the first, where it is the only one
        header = aligned(header, named, [line for _, line in content[start:]])
    if header is None:
        header = _commented_header([text for n, text in comments if n < numbers[start]], delimiter, width)
    names = unique(header or [], width)
    skip = numbers[start] if start < len(rows) else numbers[-1] + 1
    kinds = [Counter(kind(row[j]) for row in body) for j in range(width)]
    total = sum(kinds, Counter())
    decimal = "," if total["comma"] > 0 and not _has_dots(body) else "."
    above = [split(text, delimiter) for n, text in comments if n < skip] + rows[:start]
    later = [*lines[:: 1 + len(lines) // SAMPLE_LINES], lines[-1], *further]
    day_first, is_day_known = day_order(body, [split(line, delimiter) for line in later])
    return Dialect(
        delimiter=delimiter,
        decimal=decimal,
        day_first=day_first,
        is_day_known=is_day_known,
        names=tuple(names),
        skip=skip,
        has_header=header is not None,
        units={name: mark.unit for name, mark in zip(names, marks) if mark and mark.unit}
        | {name: unit.strip("[]() ") for name, unit in zip(names, units) if unit.strip("[]() ")},
        stamps=frozenset(n for n, k in zip(names, kinds) if k["stamp"] > k["number"] + k["comma"] + k["text"])
        | {
            name
            for j, name in enumerate(names)
            if are_compact([row[j] for row in rows[start:] if len(row) == width and kind(row[j]) != "missing"])
        },
        texts=frozenset(n for n, k in zip(names, kinds) if k["text"] > k["number"] + k["comma"] + k["stamp"]),
        marks={name: mark for name, mark in zip(names, marks) if mark},
        interval=interval_of(above, decimal),
    )


def _marks(cells: list[str]) -> Marks | None:
    """Return what the cells of a column of words carry beside numbers, None where they are none."""
    known = [(cell, kind(cell)) for cell in cells if kind(cell) != "missing"]
    return marks_of([cell for cell, _ in known]) if any(what == "text" for _, what in known) else None


def _delimiter(lines: list[str]) -> str:
    """Return the delimiter that cuts most lines into the same number (two or more) of sensible cells."""
    best, best_score = ",", 0.0
    for delimiter in DELIMITERS:
        rows = [split(line, delimiter) for line in lines]
        width = _width(rows)
        if width < 2:
            continue
        alike = [row for row in rows if len(row) == width]
        cells = [cell for row in (alike[1:] or alike) for cell in row]
        sensible = sum(kind(cell) != "text" for cell in cells) / len(cells)
        score = len(alike) / len(rows) * (0.25 + sensible) * (0.9 if delimiter == " " else 1.0)
        if score > best_score + 1e-9:
            best, best_score = delimiter, score
    return best


def _refuse_mixed(rows: list[list[str]]) -> None:
    """Raise `InputError` where each row begins with the name of its kind, and kinds have cells of their own."""
    kinds = Counter((row[0], len(row)) for row in rows)
    often = {name: width for (name, width), count in kinds.items() if count >= MIXED * len(rows)}
    is_mixed = len(often) > 1 and len(set(often.values())) > 1 and all(kind(row[0]) == "text" for row in rows)
    if is_mixed and len({name for name, _ in kinds}) == len(kinds):
        told = ", ".join(f"{name} with {width}" for name, width in sorted(often.items()))
        raise InputError(
            f"rows of several kinds are mixed, each with cells of its own ({told}): keep the rows of one, by its name."
        )


def _width(rows: list[list[str]]) -> int:
    """Return the commonest number of cells; of equally common ones the largest."""
    counts = Counter(len(row) for row in rows)
    return max(counts, key=lambda width: (counts[width], width))


def _numeric(body: list[list[str]], width: int) -> list[int]:
    """Return the columns that hold numbers or stamps more often than words."""
    kinds = [Counter(kind(row[j]) for row in body) for j in range(width)]
    return [j for j, k in enumerate(kinds) if k["number"] + k["comma"] + k["stamp"] > k["text"]]


def _first(rows: list[list[str]], wide: list[int], numeric: list[int]) -> int:
    """Return the first row as wide as the table, or the header that follows lines of what was recorded and how.

    These may be padded to be as wide, or have names and values of their own. A header has words where the rows below
    it have numbers; lines that are a part of it, and rows between which words stand, are left as they are.
    ``wide`` are the rows as wide as the table, ``numeric`` the columns of numbers in the lower half of them.
    """
    cells = {i: {kind(rows[i][j]) for j in numeric} for i in wide[:SAID_LINES]}
    named = [i for i, kinds in cells.items() if kinds == {"text"}]
    named = [i for i in named if not _is_setting(rows[i])] or named
    if not named:  # lines about the record may be as wide, alone among others
        alone = [i for i in cells if i + 1 not in wide and "text" in cells[i]]
        return next((i for i in wide if i not in alone), wide[0])
    begin = named[-1]
    below = next((i for i in wide if i > begin), begin)
    if below - begin > 1 and _stands_over(_marked(rows[below - 1]), numeric):
        return below  # the line that names the columns is longer or shorter than they are
    while begin - 1 in named:
        begin -= 1
    before = [i for i in wide if i < begin]
    is_part = len(before) < HEADER_LINES and all(_is_words(rows[i]) for i in before)
    is_called = all(kind(rows[i][0]) != "text" for i in wide[len(wide) // 2 :])  # a word says that it is no row
    rows_before = [i for i in before if not (is_called and kind(rows[i][0]) == "text")]
    is_among_rows = any(not cells[i] & {"text", "missing"} for i in rows_before)
    return wide[0] if is_part or is_among_rows else begin


def _is_words(row: list[str]) -> bool:
    kinds = {kind(cell) for cell in row}
    return "text" in kinds and not kinds & {"comma", "stamp", "number"} and not any(map(_OF_DAY.match, row))


def _is_setting(row: list[str]) -> bool:
    """Whether a line says something of the columns, Inverted = NO, and does not name them."""
    return row[0].endswith(("=", ":"))


def _stands_over(row: list[str], numeric: list[int]) -> bool:
    """Whether words stand over all columns of numbers, whatever follows to the right of them."""
    return bool(numeric) and len(row) > numeric[-1] and _is_words([row[j] for j in numeric])


def _counts_columns(row: list[str], body: list[list[str]]) -> bool:
    """Whether a row of numbers is a header: the columns counted from 0 or 1, over rows of which none goes on so.

    It is what is written of a table of numbers that never had names.
    """
    counted = [[str(k + start) for k in range(len(row))] for start in (0, 1)]
    if len(row) < 3 or [cell.strip() for cell in row] not in counted:
        return False
    return any("." in cell or "," in cell or "e" in cell.lower() for line in body for cell in line)


def _names(row: list[str], numeric: list[int]) -> bool:
    """Whether a line above the rows can name their columns, or give their units."""
    return _is_words(row) or _stands_over(row, numeric)


def _marked(row: list[str]) -> list[str]:
    """Return a line of names without the mark that some formats put before them: ~A DEPTH GR."""
    return row[1:] if len(row) > 1 and row[0][:1] == "~" else row


def _is_header(row: list[str], numeric: list[int], body: list[list[str]]) -> bool:
    if _counts_columns(row, body):
        return True
    if numeric:
        return any(kind(row[j]) == "text" for j in numeric)
    return _is_words(row)


def _header(rows, first, width, numeric):
    """Return (names or None, units, index of the first row of data).

    A header may have several lines: titles, names of groups over names, and a last one of units.
    """
    if not _is_header(rows[first], numeric, rows[first + 1 :]):
        start = first
        while start and first - start < HEADER_LINES and _names(rows[start - 1], numeric):
            start -= 1
            if rows[start][0][:1] == "~":
                break
        lines = [_marked(row) for row in rows[start:first]]
        if all(map(_is_words, lines)):  # a header with fewer or more cells than the rows
            lines = [row for row in lines if len(row) == len(lines[-1]) > 1]
        else:  # it says something else, too, to the right of the names
            lines = [row[: numeric[-1] + 1] for row in lines if len(row) > numeric[-1]]
        if not lines:
            return None, [], first
        return *_names_and_units(lines, len(lines[0])), first
    start = first + 1
    while start < min(len(rows), first + HEADER_LINES) and len(rows[start]) == width and _is_words(rows[start]):
        if not numeric:  # a table of words: nothing tells a second line from data
            break
        start += 1
    return *_names_and_units(rows[first:start], width), start


def aligned(header: list[str], body: list[list[str]], lines: list[str]) -> list[str]:
    """Return the names of a header that has fewer cells than the rows, blank where there is none; or refuse.

    What has no name is what stands to the right, if that is empty or words, or if dates stand first; or the labels
    of the rows (R's write.table names no column for them), if they are quoted, words, or count by one.
    """
    width, named = len(body[0]), len(header)
    columns = [Counter(kind(row[j]) for row in body) for j in range(width)]
    is_labelled = width == named + 1 and _are_labels(header[0], body, lines)
    if is_labelled and columns[-1]["text"]:
        return ["", *header]
    if all(not column["number"] + column["comma"] for column in columns[named:]) or columns[0]["stamp"]:
        return header
    if is_labelled:
        return ["", *header]
    hint = (
        "Decimal commas in a table cut at commas? Export it with decimal points, or with semicolons between cells"
        if width <= 2 * named and all(column["number"] + column["missing"] == len(body) for column in columns)
        and not any("." in cell for row in body for cell in row)
        else "Give the header a cell for each column"
    )  # fmt: skip
    told = ", ".join(header[:6]) + (", .." if named > 6 else "")
    raise InputError(
        f"the header names {named} column{'s' * (named != 1)} ({told}), but the rows have {width} cells of numbers: "
        f"which is whose cannot be known. {hint}."
    )


def _value(cell: str) -> float:
    """Return the number in a cell, NaN where it holds none that is written plainly."""
    try:
        return float(cell.replace(".", "").replace(",", ".") if kind(cell) == "comma" else cell)
    except ValueError:
        return float("nan")


def _are_labels(name: str, body: list[list[str]], lines: list[str]) -> bool:
    """Whether rows begin with labels: quoted where numbers need no quotes, words, or counting by one.

    What counts by one may also be the clock that the first ``name`` says, unless what follows is one.
    """
    from driftwise.tables.column_roles import parse

    first = [row[0] for row in body]
    if all(line.lstrip().startswith('"') for line in lines) or all(kind(cell) == "text" for cell in first):
        return True
    if not all(map(str.isdecimal, first)) or any(int(b) - int(a) != 1 for a, b in itertools.pairwise(first)):
        return False
    if all(kind(row[1]) == "stamp" for row in body):
        return True
    second = [_value(row[1]) for row in body]
    is_rising = all(a < b for a, b in itertools.pairwise(second))
    return is_rising or not parse(name).kinds & {"time", "counter"}


def _names_and_units(lines, width):
    """Return names and units from the lines of a header."""
    named = [line for line in lines if width <= 2 or sum(map(bool, line)) > 1]  # one cell in a wide line is a title
    lines = named or lines[-1:]
    if len(lines) > 1 and lines[0][0] in LOGGERS:
        lines = lines[1:]
    if len(lines) > 1 and set(lines[-1]) <= PROCESSED:
        lines = lines[:-1]
    units: list[str] = []
    if len(lines) > 1 and (_are_units(lines[-1]) or (len(lines) == 2 and _are_short(lines))):
        units = lines.pop()
    return _joined(lines), units


def _are_units(line: list[str]) -> bool:
    """Whether most cells of a line of words are units."""
    from driftwise.tables.column_roles import is_unit

    cells = [cell for cell in line if cell]
    return sum(is_unit(cell) for cell in cells) > 0.5 * len(cells)


def _are_short(lines: list[list[str]]) -> bool:
    """Whether a second line of words can be units of its own: short, under a line of names without blanks."""
    return all(lines[0]) and max(map(len, lines[1])) <= 8


def _joined(lines: list[list[str]]) -> list[str]:
    """Return one name per column; the name of a group stands for the blanks to its right."""
    whole = []
    for line in lines[:-1]:
        filled, last = [], ""
        for cell in line:
            last = cell or last
            filled.append(last)
        whole.append(filled)
    return [" ".join(dict.fromkeys(cell for cell in cells if cell)) for cells in zip(*whole, lines[-1])]


def _commented_header(comments: list[str], delimiter: str, width: int):
    """Return the last comment line that names every column (what numpy.savetxt writes), or None."""
    for text in reversed(comments):
        for cells in (split(text, delimiter), text.split()):
            if len(cells) == width and _is_words(cells) and not (width == 1 and interval_of([cells])):
                return cells
    return None


def unique(header: list[str], width: int) -> list[str]:
    """Return `width` different names: blanks become column3, repetitions get .2, .3 appended."""
    names: dict[str, None] = {}
    last: dict[str, int] = {}
    for j in range(width):
        base = (header[j].strip() if j < len(header) else "") or f"column{j + 1}"
        name, count = base, last.get(base, 1)
        while name in names:
            count += 1
            name = f"{base}.{count}"
        last[base], names[name] = count, None
    return list(names)


def _has_dots(body: list[list[str]]) -> bool:
    return any("." in cell and kind(cell) == "number" and not GROUPED.match(cell) for row in body for cell in row)
