"""Run PTX, the assembly language of NVIDIA's GPUs, as far as compiled recursions use it: one thread after the other.

It knows nothing of what it runs. Source: NVIDIA, *Parallel Thread Execution ISA*, chapter 9. Not in it: shared
memory, barriers, rounding other than to nearest; ``rcp.approx`` gives more digits than a GPU's.
"""

import math
import re
import struct
from fractions import Fraction

import numpy as np

FORMATS = {"f64": "d", "u64": "q", "s64": "q", "b64": "q", "u32": "i", "s32": "i", "b32": "i", "f32": "f"}
COMPARE = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="}
WHOLE = {
    "add": "{0} + {1}", "sub": "{0} - {1}", "mul": "{0} * {1}", "shl": "{0} << {1}", "shr": "{0} >> {1}",
    "and": "{0} & {1}", "or": "{0} | {1}", "xor": "{0} ^ {1}", "min": "min({0}, {1})", "max": "max({0}, {1})",
    "neg": "-{0}", "not": "~{0}", "abs": "abs({0})", "div": "quotient({0}, {1})",
    "mad": "{0} * {1} + {2}",
}  # fmt: skip
REAL = {
    "add": "{0} + {1}", "sub": "{0} - {1}", "mul": "{0} * {1}", "div": "divide({0}, {1})", "fma": "fuse({0}, {1}, {2})",
    "neg": "-{0}", "abs": "abs({0})", "sqrt": "root({0})", "max": "largest({0}, {1})",
    "min": "-largest(-{0}, -{1})", "rcp": "divide(1.0, {0})",
}  # fmt: skip
LOGIC = {"and": "{0} and {1}", "or": "{0} or {1}", "not": "not {0}", "xor": "{0} != {1}", "mov": "{0}"}


def fold(value, bits):
    """Return an integer as a signed one of so many bits."""
    value &= (1 << bits) - 1
    return value - (1 << bits) if value >> (bits - 1) else value


def divide(a, b):
    """Return a / b as IEEE 754 has it."""
    with np.errstate(all="ignore"):
        return float(np.float64(a) / np.float64(b))


def fuse(a, b, c):
    """Return a b + c, rounded once."""
    if not all(map(math.isfinite, (a, b, c))):
        return a * b + c
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    return float(exact) if exact else a * b + c


def quotient(a, b):
    """Return the whole number of times b goes into a, towards zero."""
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


def nearest(a):
    """Return the nearest whole number, the even one of two."""
    return round(a) if math.isfinite(a) else a


def root(a):
    """Return the square root, NaN of what has none."""
    return math.sqrt(a) if a >= 0 else math.nan


def largest(a, b):
    """Return the larger number; one that is NaN does not count."""
    return a if b != b or a > b else b


def cast(kinds, to, *values):
    """Return the bits of numbers read as other kinds."""
    found = struct.unpack("<" + to, struct.pack("<" + kinds, *values))
    return found if len(found) > 1 else found[0]


def operand(text):
    """Return an operand as Python: a register or a number."""
    if text.startswith("%"):
        return f"r[{text!r}]"
    if text.startswith(("0d", "0f")):
        kind = ">d" if text[1] == "d" else ">f"
        return f"float('{struct.unpack(kind, bytes.fromhex(text[2:]))[0]!r}')"
    if text.startswith("__"):  # where something lies in memory
        return "r['depot']" if text.startswith("__local_depot") else f"r[{text!r}]"
    return text


def kind_of(text):
    """Return the format of what a register holds."""
    return {"%fd": "d", "%f": "f", "%rd": "q"}.get(re.match(r"%[a-z]*", text)[0], "i")


def compute(name, a):
    """Return the Python of an instruction with operands ``a``."""
    verb, *marks = name.split(".")
    kind = marks[-1]
    bits = int(kind[1:]) if kind[1:].isdigit() else 0
    plain = [f"({v} & {(1 << bits) - 1})" if kind[0] == "u" else v for v in a]
    if verb == "setp":
        same = " and ".join(f"{v} == {v}" for v in a) if kind[0] == "f" else "True"
        if marks[0] in ("nan", "num"):
            return f"not ({same})" if marks[0] == "nan" else same
        says = f"{plain[0]} {COMPARE[marks[0][:2]]} {plain[1]}"
        return f"not ({same}) or {says}" if marks[0][2:] == "u" else f"{same} and {says}"
    if verb == "selp":
        return f"{a[0]} if {a[2]} else {a[1]}"
    if kind == "pred":
        return LOGIC[verb].format(*a)
    if verb == "cvt":
        to = marks[-2]
        value = {"rni": f"nearest({a[0]})", "rzi": f"trunc({a[0]})"}.get(marks[0], plain[0])
        return f"float({value})" if to[0] == "f" else f"fold({value}, {to[1:]})"
    if verb in ("mov", "cvta"):
        return a[0]
    if kind[0] == "f":
        if verb in ("add", "sub", "mul"):
            assert "rn" in marks, f"{name} leaves it to the assembler to fuse"
        return REAL[verb].format(*a)
    if marks[0] == "hi":
        return f"fold({plain[0]} * {plain[1]} >> {bits}, {bits})"
    return f"fold({WHOLE[verb].format(*plain)}, {64 if 'wide' in marks else bits})"


def statement(name, text):
    """Return one instruction as a line of Python."""
    place = re.search(r"\[(.*)\]", text)
    given = [v.strip() for v in re.sub(r"\[.*\]|[{}]", "", text).split(",") if v.strip()]
    a = [operand(v) for v in given]
    if name == "call.uni":
        to, function, *passed = re.findall(r"\w+", text)
        return f"r[{to!r}] = call('{function}', [{', '.join(f'r[{v!r}]' for v in passed)}])"
    if ".param." in name:  # of this function, or of one that it calls
        own = re.search(r"_param_(\d+)$", place[1])
        where = f"r['parameters'][{own[1]}]" if own else f"r['{place[1].split('+')[0]}']"
        return f"{a[0]} = {where}" if name.startswith("ld.") else f"{where} = {a[0]}"
    if name.startswith(("ld.", "st.")):
        form = "<" + FORMATS[name.rsplit(".", 1)[1]] * len(a)
        where = " + ".join(operand(v) for v in place[1].split("+"))
        if name.startswith("ld."):
            return f"{', '.join(a)}, = unpack('{form}', memory, {where})"
        return f"pack('{form}', memory, {where}, {', '.join(a)})"
    if name.startswith("mov.b"):
        kinds = [kind_of(v) if v.startswith("%") else "q" for v in given]
        kinds = ["i" if v == "%temp" else k for v, k in zip(given, kinds)]
        to = 2 if text.startswith("{") else 1
        return f"{', '.join(a[:to])} = cast('{''.join(kinds[to:])}', '{''.join(kinds[:to])}', {', '.join(a[to:])})"
    return f"{a[0]} = {compute(name, a[1:])}"


def translate(function, body):
    """Return the blocks of a function as Python, and the number of each label."""
    blocks, labels = [[]], {}
    body = re.sub(r"call\.uni[^;]*;", lambda found: " ".join(found[0].split()), body)
    for line in body.splitlines():
        line = line.split("//")[0].strip()
        if line.endswith(":"):
            labels[line[:-1]] = len(blocks)
            blocks.append([])
        found = re.match(r"(?:@(!?)(%p\d+)\s+)?([a-z][\w.]*)\s*(.*);$", line)
        if found:
            no, guard, name, rest = found.groups()
            does = "return None" if name == "ret" else f"return labels[{rest!r}]" if name[:3] == "bra" else ""
            does = does or statement(name, rest)
            blocks[-1].append(f"if {'not ' if no else ''}r[{guard!r}]: {does}" if guard else does)
    lines = []
    for i, block in enumerate(blocks):
        lines += [f"def {function}_{i}(r):", *("    " + line for line in block), f"    return {i + 1}"]
    return "\n".join(lines), labels


def launch(code, arrays, threads, of_block=64):
    """Run so many threads of the only kernel; ``arrays`` are passed as numba does, and written in place."""
    memory, parameters, starts = bytearray(16), [], []
    for array in arrays:
        starts.append(len(memory))
        parameters += [0, 0, array.size, array.itemsize, len(memory), *array.shape, *array.strides]
        memory += array.tobytes() + bytes(-array.nbytes % 16)
    fixed = {"depot": len(memory), "%ntid.x": of_block}
    memory += bytes(int((re.findall(r"__local_depot0\[(\d+)\]", code) or [0])[0]))
    scope = {
        "quotient": quotient, "nearest": nearest, "trunc": math.trunc,
        "memory": memory, "labels": {}, "unpack": struct.unpack_from, "pack": struct.pack_into, "fold": fold,
        "divide": divide, "fuse": fuse, "root": root, "largest": largest, "cast": cast,
    }  # fmt: skip

    def call(function, passed):
        registers, block = {**fixed, "parameters": passed}, 0
        while block is not None:
            block = scope[f"{function}_{block}"](registers)
        return registers.get("func_retval0")

    scope["call"] = call
    kernel = ""
    for kind, name, body in re.findall(r"\.(func|entry)\s[^;{]*?(\w+)\((?:[^;{]*)\)[^;{]*\n\{(.*?)\n\}", code, re.S):
        source, labels = translate(name, body)
        exec(source, scope)
        scope["labels"] |= labels
        kernel = name if kind == "entry" else kernel
    for thread in range(threads):
        fixed |= {"%tid.x": thread % of_block, "%ctaid.x": thread // of_block}
        call(kernel, parameters)
    for array, start in zip(arrays, starts):
        array[...] = np.frombuffer(memory, array.dtype, array.size, start).reshape(array.shape)
