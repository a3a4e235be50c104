"""Kernels that nobody would write: drawn from the kernels' part of Python, with calls that change what others read."""

from __future__ import annotations

import random
from collections import namedtuple

HELPERS = """
def bump(v, i, x):
    v[i] += x
    return v[i]

def peek(v, i):
    return v[i] * 0.5

def take(w, i, n):
    w[i, n % 4] -= 1.0
    return n % 3 + i

def both(v, x):
    v[0] = x
    return x + 1.0, v.size

def turn(v):
    v[0], v[v.size - 1] = v[v.size - 1], v[0]

def first_above(v, x):
    for i in range(v.size):
        if v[i] > x:
            return i
    return -1

def made(v, x, n):
    v[1] = v[0]
    return Pair(x, n)

def longer(v, w, c):
    return v if c else w
"""
NAMES = "bump peek take both turn first_above made longer".split()
Pair = namedtuple("Pair", "number count")
SCOPE = {
    "__name__": __name__,
    "Pair": Pair,
    "TABLE": (0.5, -1.0, 3.0, 0.25),
    "COUNTS": (3, -2, 7),
    "ROWS": ((1.0, 2.0), (-3.0, 4.0)),
}


class Writer:
    """One random kernel; every choice comes from one seed."""

    def __init__(self, seed: int):
        self.r = random.Random(seed)
        self.lines: list[str] = []
        self.floats, self.ints, self.bools = ["x"], ["k"], []
        self.views, self.pairs = ["v", "w[1]"], []
        self.count = self.loops = 0

    def any(self, *choices):
        """Return what one of some functions gives."""
        return self.r.choice(choices)()

    # --- expressions ---------------------------------------------------------------------------------------

    def number(self, depth=2) -> str:
        """A float."""
        r, deep = self.r, depth - 1
        if depth <= 0:
            return r.choice([r.choice(self.floats), r.choice(self.floats), repr(r.choice([0.5, -1.5, 2.0, 0.0, 1e3]))])
        return self.any(
            lambda: self.number(0),
            lambda: f"({self.number(deep)} {r.choice('+-*')} {self.number(deep)})",
            lambda: f"({self.number(deep)} {r.choice('+-*')} {self.number(deep)})",
            lambda: f"({self.number(deep)} / (abs({self.number(deep)}) + {r.choice(['1.0', '2'])}))",
            lambda: f"-{self.number(deep)}",
            lambda: f"{r.choice(['max', 'min'])}({self.number(deep)}, {self.number(deep)})",
            lambda: f"{r.choice(['max', 'min'])}({self.number(deep)}, float({self.whole(deep)}), {self.number(deep)})",
            lambda: f"({self.number(deep)} if {self.truth(deep)} else {self.number(deep)})",
            lambda: self.element(deep),
            lambda: self.element(deep),
            lambda: f"bump({self.view()}, {self.r.choice(['0', '1'])}, {self.number(deep)})",
            lambda: f"bump({self.view()}, {self.r.choice(['0', '1'])}, {self.number(deep)})",
            lambda: f"peek({self.view()}, 0)",
            lambda: f"both({self.view()}, {self.number(deep)})[0]",
            lambda: f"made({self.view()}, {self.number(deep)}, {self.whole(deep)}).number",
            lambda: f"(1.0 * {self.whole(deep)})",
            lambda: f"TABLE[{self.whole(deep)} % 4]",
            lambda: f"TABLE[{r.randint(-4, 3)}]",
            lambda: f"ROWS[{self.whole(deep)} % 2][{r.randint(0, 1)}]",
            lambda: f"{r.choice(self.pairs)}.number" if self.pairs else self.number(deep),
        )

    def whole(self, depth=2) -> str:
        """An integer."""
        r, deep = self.r, depth - 1
        if depth <= 0:
            return r.choice([r.choice(self.ints), r.choice(self.ints), str(r.randint(-3, 5))])
        return self.any(
            lambda: self.whole(0),
            lambda: f"({self.whole(deep)} {r.choice('+-')} {self.whole(deep)})",
            lambda: f"({self.whole(deep)} * {self.whole(deep)} % 11)",
            lambda: f"({self.whole(deep)} {r.choice(['//', '%'])} {r.choice([2, 3, -3, 7])})",
            lambda: f"-{self.whole(deep)}",
            lambda: f"({self.whole(deep)} % 9) ** {r.randint(1, 3)}",
            lambda: f"int(max(min({self.number(deep)}, 9.0), -9.0))",
            lambda: f"({self.whole(deep)} if {self.truth(deep)} else {self.whole(deep)})",
            lambda: f"int({self.truth(deep)})",
            lambda: r.choice([f"{self.view()}.size", f"len({self.view()})", "w.shape[1]", "w.shape[0]"]),
            lambda: f"take(w, {r.randint(0, 2)}, {self.whole(deep)})",
            lambda: f"both({self.view()}, {self.number(deep)})[1]",
            lambda: f"first_above({self.view()}, {self.number(deep)})",
            lambda: f"COUNTS[{self.whole(deep)} % 3]",
            lambda: f"{r.choice(['max', 'min'])}({self.whole(deep)}, {self.whole(deep)})",
            lambda: f"{r.choice(self.pairs)}.count" if self.pairs else self.whole(deep),
        )

    def truth(self, depth=2) -> str:
        """A test."""
        r, deep = self.r, depth - 1
        if depth <= 0:
            return r.choice(self.bools) if self.bools and r.random() < 0.4 else f"{self.number(0)} > {self.number(0)}"
        return self.any(
            lambda: f"{self.number(deep)} {r.choice(['<', '<=', '>', '>=', '==', '!='])} {self.number(deep)}",
            lambda: f"{self.whole(deep)} {r.choice(['<', '<=', '>', '>=', '==', '!='])} {self.whole(deep)}",
            lambda: f"({self.whole(deep)} < {self.number(deep)} {r.choice(['<', '>='])} {self.number(deep)})",
            lambda: f"({self.truth(deep)} {r.choice(['and', 'or'])} {self.truth(deep)})",
            lambda: f"({self.truth(deep)} {r.choice(['and', 'or'])} {self.truth(deep)} or {self.truth(0)})",
            lambda: f"(not {self.truth(deep)})",
            lambda: self.truth(0),
        )

    def view(self) -> str:
        """A view of at least two numbers."""
        return self.r.choice(
            [*self.views, f"longer(v, w[0], {self.truth(0)})"] if self.r.random() < 0.2 else self.views
        )

    def element(self, depth) -> str:
        """A number of a view."""
        r = self.r
        if r.random() < 0.4:
            row = r.choice([str(r.randint(-3, 2)), f"{self.whole(depth)} % 3"])
            column = r.choice([str(r.randint(-4, 3)), f"{self.whole(depth)} % w.shape[1]", "-1"])
            return r.choice([f"w[{row}, {column}]", f"w[{row}][{column}]", f"w[:, {column}][{row}]"])
        view = r.choice(self.views)
        return f"{view}[{r.choice(['0', '1', '-1', f'{self.whole(depth)} % {view}.size'])}]"

    # --- statements ----------------------------------------------------------------------------------------

    def name(self, kind: str) -> str:
        """A new variable, or an old one."""
        known = {"f": self.floats, "n": self.ints, "b": self.bools}[kind]
        old = [one for one in known if one not in self.busy]
        if old and self.r.random() < 0.6:
            return self.r.choice(old)
        self.count += 1
        return f"{kind}{self.count}"

    def write(self, indent: int, text: str) -> None:
        self.lines.append("    " * indent + text)

    def know(self, name: str) -> str:
        """Note that a variable has a value."""
        known = {"f": self.floats, "x": self.floats, "n": self.ints, "k": self.ints, "b": self.bools}[name[0]]
        if name not in known:
            known.append(name)
        return name

    def block(self, indent: int, size: int) -> None:
        """Some statements; what they name for the first time is known inside alone."""
        kept = [list(one) for one in (self.floats, self.ints, self.bools, self.views, self.pairs)]
        for _ in range(size):
            self.statement(indent)
        if indent > 1:
            inside = self.floats, self.ints, self.bools, self.views, self.pairs
            for now, before in zip(inside, kept):
                now[:] = before

    def statement(self, indent: int) -> None:
        """One statement."""
        r, small = self.r, 2 if indent < 3 else 1
        kinds = [self.assign, self.assign, self.store, self.store, self.swap, self.act, self.cut, self.several]
        if indent < 4:
            kinds += [self.branch, self.branch, self.count_up, self.while_loop, self.each]
        if self.loops and r.random() < 0.15:
            self.write(indent, f"if {self.truth(1)}:")
            self.write(indent + 1, r.choice(["break", "continue"]))
        elif r.random() < 0.03:
            self.write(indent, f"if {self.truth(1)}:")
            self.write(indent + 1, f"return {self.number(1)}")
        r.choice(kinds)(indent, small)

    def assign(self, indent, size):
        r = self.r
        kind = r.choice("ffnb")
        value = {"f": self.number, "n": self.whole, "b": self.truth}[kind](r.randint(0, 3))
        name = self.name(kind)
        value = f"({value}) % 1000" if kind == "n" else value
        if r.random() < 0.1 and kind == "f":
            self.write(indent, f"{name} = f_twin = {value}")
            self.write(indent, f"{name} += f_twin")
        elif r.random() < 0.3 and kind == "f" and name in self.floats:
            self.write(indent, f"{name} {r.choice(['+=', '-=', '*='])} {value}")
        else:
            self.write(indent, f"{name} = {value}")
        self.know(name)

    def store(self, indent, size):
        target = self.element(1)
        sign = self.r.choice(["=", "=", "+=", "-=", "*="])
        self.write(indent, f"{target} {sign} {self.number(2)}")

    def swap(self, indent, size):
        r = self.r
        if r.random() < 0.5:
            one, two = self.element(1), self.element(1)
            self.write(indent, f"{one}, {two} = {two}, {self.number(1)}")
        else:
            one, two = self.name("f"), self.name("f")
            values = f"{self.number(1)}, {self.number(1)}"
            if one in self.floats and two in self.floats and r.random() < 0.5:
                values = f"{two}, {one} + {self.number(1)}"
            self.write(indent, f"{one}, {two} = {values}")
            self.know(one), self.know(two)

    def act(self, indent, size):
        self.write(indent, self.r.choice([f"turn({self.view()})", f"bump({self.view()}, 1, {self.number(2)})"]))

    def several(self, indent, size):
        r = self.r
        if r.random() < 0.5:
            one, two = self.name("f"), self.name("n")
            self.write(indent, f"{one}, {two} = {r.choice(['both', 'both'])}({self.view()}, {self.number(1)})")
            self.know(one), self.know(two)
        else:
            self.count += 1
            pair = r.choice([f"made(v, {self.number(1)}, {self.whole(1)})", f"Pair({self.number(1)}, {self.whole(1)})"])
            self.write(indent, f"p{self.count} = {pair}")
            self.pairs.append(f"p{self.count}")

    def cut(self, indent, size):
        r = self.r
        kind = r.random()
        if kind < 0.3:
            stretch = r.choice(
                ["1:", ":3", "1:4", ":", "-2:", ":-1", "-9:2", f"{self.whole(1)} % 3:", f":{self.whole(1)} % 9"]
            )
            self.write(indent, f"{r.choice(self.views)}[{stretch}] = {self.number(2)}")
            return
        self.count += 1
        value = r.choice(
            [f"w[{self.whole(1)} % 3]", "w[-1]", "v[1:]", "v[1:4]", "v[:-1]", "v[2:9]", "w[2, 1:]", "w[0, :3]"]
        )
        if kind > 0.8:
            value = r.choice(["w[:, 1]", "w[:, -1]"])
        self.write(indent, f"s{self.count} = {value}")
        self.views.append(f"s{self.count}")

    def branch(self, indent, size):
        self.write(indent, f"if {self.truth(2)}:")
        self.block(indent + 1, size)
        if self.r.random() < 0.4:
            self.write(indent, f"elif {self.truth(2)}:")
            self.block(indent + 1, 1)
        if self.r.random() < 0.6:
            self.write(indent, "else:")
            self.block(indent + 1, size)

    def count_up(self, indent, size):
        r = self.r
        name = self.name("n")
        ends = [
            f"{self.whole(1)} % 4",
            "3",
            f"{r.randint(-1, 1)}, {self.whole(1)} % 4",
            f"{self.whole(1)} % 4, -1, -1",
            "0, 5, 2",
        ]
        self.write(indent, f"for {name} in range({r.choice(ends)}):")
        is_new, before = name not in self.ints, self.loops
        self.know(name)
        self.loops += 1
        self.block(indent + 1, size)
        self.loops = before
        if is_new:
            self.ints.remove(name)

    def while_loop(self, indent, size):
        self.count += 1
        name = f"n{self.count}"
        self.write(indent, f"{name} = 0")
        self.write(indent, f"while {name} < {self.r.randint(1, 4)} and {self.truth(2)}:")
        self.write(indent + 1, f"{name} += 1")
        self.know(name)
        self.busy.add(name)
        self.loops += 1
        self.block(indent + 1, size)
        self.loops -= 1
        self.busy.discard(name)

    def each(self, indent, size):
        name = self.name("f")
        is_new, before = name not in self.floats, self.loops
        self.write(indent, f"for {name} in ({self.number(1)}, {self.number(1)}):")
        self.know(name)
        self.loops = 0
        self.block(indent + 1, 1)
        self.loops = before
        if is_new:
            self.floats.remove(name)

    def text(self, name: str) -> str:
        """Return the kernel."""
        self.busy: set[str] = {"k"}
        self.write(0, f"def {name}(v, w, k, x, out):")
        self.block(1, self.r.randint(3, 7))
        for i, one in enumerate([*self.floats, *self.ints][:8]):
            self.write(1, f"out[{i}] = {one}")
        self.write(1, f"return {self.number(2)}")
        return "\n".join(self.lines) + "\n"


def kernels(seeds) -> tuple[str, list[str]]:
    """Return the text of some random kernels, their helpers, and ``choose(which, v, w, k, x, out, found)``."""
    names = [f"kernel_{seed}" for seed in seeds]
    texts = [HELPERS, *(Writer(seed).text(name) for seed, name in zip(seeds, names))]
    lines = ["def choose(which, v, w, k, x, out, found):"]
    for i, name in enumerate(names):
        lines += [f"    if which == {i}:", f"        found[0] = {name}(v, w, k, x, out)"]
    return "\n".join([*texts, *lines]) + "\n", names
