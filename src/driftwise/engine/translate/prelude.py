"""What printed kernels lean on: a few lines of C, each written only where it is used."""

from itertools import pairwise
from typing import Any

from . import prelude_lanes
from .formats import DOUBLE
from .types import FLOAT, INT, LANES, Several

HEAD = """\
/* Written by driftwise from its kernels: do not edit. No header, no library, no memory of its own. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif
typedef double F;
typedef long long I;
typedef unsigned long long U;
typedef int B;"""

NEEDS: dict[str, tuple[str, ...]] = {
    "DW_NAN": ("dw_bits",), "DW_INF": ("dw_bits",), "dw_bits": ("DW_INLINE",), "dw_ldexp": ("dw_bits", "DW_APART"),
    "dw_frexp": ("dw_bits", "DW_APART"), "dw_abs": ("dw_bits",), "dw_copysign": ("dw_bits",),
    "dw_about_one": ("dw_bits",), "dw_power": ("DW_INLINE",), "dw_column": ("V2", "S1", "dw_at"),
    "dw_strided": ("V1", "S1", "DW_INLINE"),
    "dw_at": ("DW_INLINE",), "dw_sqrt": ("DW_INLINE",), "dw_max": ("DW_INLINE",), "dw_min": ("DW_INLINE",),
    "dw_maxi": ("DW_INLINE",), "dw_mini": ("DW_INLINE",), "dw_div": ("DW_INLINE",), "dw_mod": ("DW_INLINE",),
    "dw_absi": ("DW_INLINE",), "dw_floor": ("DW_INLINE",), "dw_finite": ("DW_INLINE",), "dw_isnan": ("DW_INLINE",),
}  # fmt: skip

OPERATIONS: dict[str, Any] = {
    "max": {FLOAT: "dw_max", INT: "dw_maxi", LANES: "dw_maxl"},
    "min": {FLOAT: "dw_min", INT: "dw_mini", LANES: "dw_minl"},
    "abs": {FLOAT: "dw_abs", INT: "dw_absi", LANES: "dw_absl"}, "//": {FLOAT: "dw_divf", INT: "dw_div"},
    "%": {FLOAT: "dw_modf", INT: "dw_mod"}, "sqrt": "dw_sqrt", "isfinite": "dw_finite", "isnan": "dw_isnan",
    "copysign": "dw_copysign", "ldexp": "dw_ldexp", "frexp": "dw_frexp",
    "about_one": "dw_about_one", "power": "dw_power", "strided": "dw_strided",
    "floor": "dw_floor",
    "select": "dw_select", "spread": "dw_spread", "mask": "dw_mask", "trunc": "dw_trunc", "agree": "dw_agree",
    "interleave": "dw_interleave", "own": "dw_own", "finite": "dw_clean", "gather": "dw_gather",
    "disagreements": "dw_odd",
}  # fmt: skip

COMPARISONS = {"<": "dw_lt", "<=": "dw_le", ">": "dw_gt", ">=": "dw_ge", "==": "dw_eq", "!=": "dw_ne"}  # of lanes
AFTER_TYPES = {
    **dict.fromkeys(("dw_frexp", "dw_about_one"), Several((FLOAT, INT))), "dw_frexpl": Several((LANES, LANES)),
}  # fmt: skip

_VIEW = {"V1": ("F", "n"), "V2": ("F", "n, m"), "V3": ("F", "n, m, k"), "V1i": ("I", "n"), "V2i": ("I", "n, m"),
         "S1": ("F", "n, s")}  # fmt: skip

TEXTS: dict[str, str] = {
    "DW_INLINE": """\
#if defined(__GNUC__) || defined(__clang__)
#define DW_INLINE inline __attribute__((always_inline))
#elif defined(_MSC_VER)
#define DW_INLINE __forceinline
#else
#define DW_INLINE inline
#endif""",
    "DW_APART": """\
#if defined(__GNUC__) || defined(__clang__)
#define DW_APART __attribute__((noinline))
#elif defined(_MSC_VER)
#define DW_APART __declspec(noinline)
#else
#define DW_APART
#endif""",
    "DW_EXPORT": """\
#if defined(_WIN32)
#define DW_EXPORT __declspec(dllexport)
#elif defined(__GNUC__) || defined(__clang__)
#define DW_EXPORT __attribute__((visibility("default")))
#else
#define DW_EXPORT
#endif""",
    "dw_at": "#define dw_at(i, n) (i)",
    **{name: f"typedef struct {{\n    {kind} *p;\n    I {sizes};\n}} {name};" for name, (kind, sizes) in _VIEW.items()},
    "DW_ABREAST": """\
/* The turns of a loop have nothing to do with one another: GCC, asked by `compilers`, takes two at once. */
#if defined(DW_SIMD)
#define DW_ABREAST _Pragma("omp simd")
#else
#define DW_ABREAST
#endif""",
    "dw_fetch": """\
#if defined(__GNUC__) || defined(__clang__)
#define dw_fetch(place) __builtin_prefetch(place)
#else
#define dw_fetch(place) ((void)0)
#endif""",
    "dw_bits": """\
static DW_INLINE F dw_bits(U bits)
{
    union { U u; F f; } both;
    both.u = bits;
    return both.f;
}
static DW_INLINE U dw_word(F x)
{
    union { U u; F f; } both;
    both.f = x;
    return both.u;
}""",
    "DW_NAN": "#define DW_NAN dw_bits(0x7ff8000000000000ULL)",
    "DW_INF": "#define DW_INF dw_bits(0x7ff0000000000000ULL)",
    "dw_sqrt": """\
#if defined(__GNUC__) || defined(__clang__)
#define dw_sqrt(x) __builtin_sqrt(x)
#elif defined(__TINYC__) && defined(__x86_64__)
static F dw_sqrt(F x)
{
    F *at = &x;
    __asm__ volatile (".byte 0xf2,0x0f,0x51,0x00\\n.byte 0xf2,0x0f,0x11,0x00" : : "a"(at) : "memory");
    return x;
}
#else
double sqrt(double);
#define dw_sqrt(x) sqrt(x)
#endif""",
    "dw_absi": "static DW_INLINE I dw_absi(I x) { return x < 0 ? -x : x; }",
    "dw_isnan": "static DW_INLINE B dw_isnan(F x) { return x != x; }",
    "dw_max": "static DW_INLINE F dw_max(F a, F b) { return b > a ? b : a; }",
    "dw_min": "static DW_INLINE F dw_min(F a, F b) { return b < a ? b : a; }",
    "dw_maxi": "static DW_INLINE I dw_maxi(I a, I b) { return b > a ? b : a; }",
    "dw_mini": "static DW_INLINE I dw_mini(I a, I b) { return b < a ? b : a; }",
    "dw_div": "static DW_INLINE I dw_div(I a, I b) { return a / b - ((a % b != 0) && ((a < 0) != (b < 0))); }",
    "dw_mod": """\
static DW_INLINE I dw_mod(I a, I b)
{
    I left = a % b;
    return left != 0 && ((left < 0) != (b < 0)) ? left + b : left;
}""",
    "dw_floor": "static DW_INLINE I dw_floor(F x) { return (I)x - (x < (F)(I)x); }",
    "dw_column": """\
static DW_INLINE S1 dw_column(V2 v, I j)
{
    S1 r;
    r.p = v.p + dw_at(j, v.m);
    r.n = v.n;
    r.s = v.m;
    return r;
}""",
    "dw_strided": "static DW_INLINE S1 dw_strided(V1 v) { S1 r; r.p = v.p; r.n = v.n; r.s = 1; return r; }",
}  # fmt: skip

CHECKED = {
    "DW_INLINE": "#define DW_INLINE",
    "dw_at": """\
#include <stdio.h>
#include <stdlib.h>
static I dw_at_(I i, I n, int line)
{
    if (i < 0 || i >= n) {
        fprintf(stderr, "line %d: index %lld of %lld\\n", line, i, n);
        abort();
    }
    return i;
}
#define dw_at(i, n) dw_at_(i, n, __LINE__)""",
}  # instead of those above, in a program that looks at every index

_STEPS = {"1": "", "2": " * v.m", "3": " * v.m * v.k", "1s": " * v.s", "1i": ""}
for _end, _step in _STEPS.items():
    _type = f"V{_end}" if _end != "1s" else "S1"
    for _name, _args, _lines in (
        ("cut", "I start, I stop", ["stop = stop > v.n ? v.n : stop;", "start = start > stop ? stop : start;"]),
        ("tail", "I start", ["const I stop = v.n;", "start = start > stop ? stop : start;"]),
        ("cut_", "I start, I stop", []),  # these end within the view: nothing is clipped
        ("tail_", "I start", ["const I stop = v.n;"]),
    ):
        NEEDS[f"dw_{_name}{_end}"] = (_type, "dw_at")
        TEXTS[f"dw_{_name}{_end}"] = "\n".join(
            [
                f"static DW_INLINE {_type} dw_{_name}{_end}({_type} v, {_args})",
                "{",
                f"    {_type} r = v;",
                *(f"    {line}" for line in _lines),
                f"    r.p = v.p + dw_at(start, v.n + 1){_step};",
                "    r.n = dw_at(stop - start, v.n - start + 1);",
                "    return r;",
                "}",
            ]
        )

for _dims, _kind in ((2, ""), (3, ""), (2, "i")):
    _whole, _row, _sizes = f"V{_dims}{_kind}", f"V{_dims - 1}{_kind}", ["n", "m", "k"][:_dims]
    NEEDS[f"dw_row{_dims}{_kind}"] = _whole, _row, "dw_at", "DW_INLINE"
    TEXTS[f"dw_row{_dims}{_kind}"] = "\n".join(
        [
            f"static DW_INLINE {_row} dw_row{_dims}{_kind}({_whole} v, I i)",
            "{",
            f"    {_row} r;",
            f"    r.p = v.p + dw_at(i, v.n) * {' * '.join(f'v.{size}' for size in _sizes[1:])};",
            *(f"    r.{to} = v.{of};" for to, of in pairwise(_sizes)),
            "    return r;",
            "}",
        ]
    )

for _of in (1, 2, 3):
    for _to in (1, 2, 3):
        _sizes = ["n", "m", "k"][:_to]
        NEEDS[f"dw_fold{_of}{_to}"] = f"V{_of}", f"V{_to}", "DW_INLINE"
        TEXTS[f"dw_fold{_of}{_to}"] = "\n".join(
            [
                f"static DW_INLINE V{_to} dw_fold{_of}{_to}(V{_of} v, {', '.join(f'I {size}' for size in _sizes)})",
                "{",
                f"    V{_to} r;",
                "    r.p = v.p;",
                *(f"    r.{size} = {size};" for size in _sizes),
                "    return r;",
                "}",
            ]
        )

TEXTS |= DOUBLE.texts() | prelude_lanes.TYPES
NEEDS |= prelude_lanes.NEEDS
for _name in ("V1", "V2", "V3", "S1", *(name for name in TEXTS if name.startswith(prelude_lanes.OF_VIEWS))):
    if not _name.endswith("i"):
        TEXTS[f"{_name}l"] = prelude_lanes.widened(TEXTS[_name])
        _needs = (prelude_lanes.widened(need) for need in NEEDS.get(_name, ()))
        NEEDS[f"{_name}l"] = "L", *_needs
TEXTS |= prelude_lanes.TEXTS
