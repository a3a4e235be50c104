"""What kernels of eight lanes lean on, besides: vectors of GCC and Clang, and what the same bits need of them."""

import re

OF_VIEWS = "dw_row", "dw_cut", "dw_tail", "dw_fold", "dw_column", "dw_strided"  # what there is for views of each kind

NEEDS: dict[str, tuple[str, ...]] = {
    "M": ("L", "DW_INLINE"), "dw_spread": ("L", "DW_INLINE"), "dw_selectm": ("M",), "dw_agree": ("M",),
    "dw_cleanl": ("dw_finitel",), "dw_maxl": ("M",), "dw_minl": ("M",), "dw_absl": ("L", "DW_INLINE"),
    "dw_sqrtl": ("L", "DW_INLINE"), "dw_truncl": ("L", "DW_INLINE"), "dw_copysignl": ("L", "DW_INLINE"),
    "dw_finitel": ("M", "dw_spread"), "dw_isnanl": ("M",), "dw_whole": ("L", "DW_INLINE"),
    "dw_frexpl": ("M", "dw_spread", "dw_finitel", "dw_absl", "dw_whole"),
    "dw_ldexpl": ("M", "dw_spread", "dw_whole"),
    "dw_interleave": ("V1", "V1l", "DW_INLINE"), "dw_gather": ("V2", "V1i", "L", "dw_at", "DW_INLINE"),
    **dict.fromkeys(("dw_mask", "dw_select", "dw_lt", "dw_le", "dw_gt", "dw_ge", "dw_eq", "dw_ne"), ("M",)),
    "dw_odd": ("dw_agree",),
}  # fmt: skip

TYPES = {
    "L": """\
/* Eight numbers, eight words. */
typedef double L __attribute__((vector_size(64), may_alias));
typedef long long W __attribute__((vector_size(64), may_alias));""",
    "M": """\
/* Eight truth values: bits where the processor has registers of them, and GCC must be told, else words of -1 and 0. */
#if defined(__AVX512DQ__) && !defined(__clang__)
typedef unsigned char M;
#define DW_COMPARE(a, b, how, sign) ((M)__builtin_ia32_cmppd512_mask(a, b, how, -1, 4))
#define dw_lanes(m) ((int)(m))
#define dw_mask(x) ((M)((x) ? 255 : 0))
static DW_INLINE L dw_select(M m, L a, L b) { return __builtin_ia32_blendmpd_512_mask(b, a, m); }
#else
typedef W M;
#define DW_COMPARE(a, b, how, sign) ((M)((a) sign (b)))
static DW_INLINE int dw_lanes(M m)
{
#if defined(__AVX512DQ__)
    return (int)(unsigned char)__builtin_ia32_cvtq2mask512(m);
#else
    int found = 0;
    for (int l = 0; l < 8; l++)
        found |= (int)(m[l] & 1) << l;
    return found;
#endif
}
static DW_INLINE M dw_mask(int x) { return (M){0} - (x ? 1 : 0); }
static DW_INLINE L dw_select(M m, L a, L b) { return (L)(((W)a & m) | ((W)b & ~m)); }
#endif
static DW_INLINE M dw_lt(L a, L b) { return DW_COMPARE(a, b, 17, <); }
static DW_INLINE M dw_le(L a, L b) { return DW_COMPARE(a, b, 18, <=); }
static DW_INLINE M dw_gt(L a, L b) { return DW_COMPARE(a, b, 30, >); }
static DW_INLINE M dw_ge(L a, L b) { return DW_COMPARE(a, b, 29, >=); }
static DW_INLINE M dw_eq(L a, L b) { return DW_COMPARE(a, b, 0, ==); }
static DW_INLINE M dw_ne(L a, L b) { return DW_COMPARE(a, b, 4, !=); }""",
}
TEXTS: dict[str, str] = {
    "dw_spread": "static DW_INLINE L dw_spread(F x) { return (L){x, x, x, x, x, x, x, x}; }",
    "dw_selectm": "static DW_INLINE M dw_selectm(M m, M a, M b) { return (M)((a & m) | (b & ~m)); }",
    "dw_agree": """\
static DW_INLINE B dw_agree(M m, I *odd)
{
    int lanes = dw_lanes(m);
    *odd += lanes != 0 && lanes != 255;
    return lanes == 255;
}
#define dw_odd(odd) (*(odd))""",
    "dw_maxl": "static DW_INLINE L dw_maxl(L a, L b) { return dw_select(dw_gt(b, a), b, a); }",
    "dw_minl": "static DW_INLINE L dw_minl(L a, L b) { return dw_select(dw_lt(b, a), b, a); }",
    "dw_absl": "static DW_INLINE L dw_absl(L x) { return (L)((W)x & 0x7fffffffffffffffLL); }",
    "dw_sqrtl": """\
static DW_INLINE L dw_sqrtl(L x)
{
#if defined(__AVX512F__) && defined(__clang__)
    return __builtin_ia32_sqrtpd512(x, 4);
#elif defined(__AVX512F__)
    return __builtin_ia32_sqrtpd512_mask(x, x, -1, 4);
#else
    for (int l = 0; l < 8; l++)
        x[l] = __builtin_sqrt(x[l]);
    return x;
#endif
}""",
    "dw_truncl": """\
static DW_INLINE L dw_truncl(L x)
{
    return __builtin_convertvector(__builtin_convertvector(x, W), L);
}""",
    "dw_copysignl": """\
static DW_INLINE L dw_copysignl(L x, L y)
{
    return (L)(((W)x & 0x7fffffffffffffffLL) | ((W)y & ~0x7fffffffffffffffLL));
}""",
    "dw_finitel": "static DW_INLINE M dw_finitel(L x) { return dw_eq(x - x, dw_spread(0.0)); }",
    "dw_cleanl": "static DW_INLINE B dw_cleanl(L x) { return dw_lanes(dw_finitel(x)) == 255; }",
    "dw_isnanl": "static DW_INLINE M dw_isnanl(L x) { return dw_ne(x, x); }",
    "dw_whole": """\
/* Whole numbers below 2^51 in the lower digits of 1.5 2^52, to and fro. */
static DW_INLINE L dw_whole(W n) { return (L)(n + 0x4338000000000000LL) - 6755399441055744.0; }
static DW_INLINE W dw_digits(L n) { return (W)(n + 6755399441055744.0) - 0x4338000000000000LL; }""",
    "dw_ldexpl": """\
static DW_INLINE L dw_choose(L n, F most, F high, F least, F low, F other)
{
    L found = dw_select(dw_lt(n, dw_spread(least)), dw_spread(low), dw_spread(other));
    return dw_select(dw_gt(n, dw_spread(most)), dw_spread(high), found);
}
static DW_INLINE L dw_ldexpl(L x, L n)
{
    for (int twice = 0; twice < 2; twice++) {
        x *= dw_choose(n, 1023.0, 8.98846567431158e307, -1022.0, 2.004168360008973e-292, 1.0);
        n += dw_choose(n, 1023.0, -1023.0, -1022.0, 969.0, 0.0);
    }
    n = dw_select(dw_gt(n, dw_spread(1023.0)), dw_spread(1023.0), n);
    n = dw_select(dw_lt(n, dw_spread(-1022.0)), dw_spread(-1022.0), n);
    return x * (L)((dw_digits(n) + 1023) << 52);
}""",
    "dw_frexpl": """\
static DW_INLINE PAIR dw_frexpl(L x)
{
    PAIR found;
    M is_small = dw_lt(dw_absl(x), dw_spread(2.2250738585072014e-308));
    M is_usual = (M)(dw_finitel(x) & dw_ne(x, dw_spread(0.0)));
    W word = (W)dw_select(is_small, x * 18014398509481984.0, x);
    L exponent = dw_whole((word >> 52 & 0x7ff) - 1022);
    exponent = dw_select(is_small, exponent - 54.0, exponent);
    found.i0 = dw_select(is_usual, (L)((word & 0x800fffffffffffffLL) | 0x3fe0000000000000LL), x);
    found.i1 = dw_select(is_usual, exponent, dw_spread(0.0));
    return found;
}""",
    "dw_interleave": """\
static DW_INLINE V1l dw_interleave(V1 v)
{
    V1l r;
    r.p = (L *)v.p;
    r.n = v.n / 8;
    return r;
}""",
    "dw_gather": """\
static DW_INLINE L dw_gather(V2 v, V1i rows, I column)
{
#define DW_OF(l) v.p[dw_at(rows.p[l], v.n) * v.m + column]
    return (L){DW_OF(0), DW_OF(1), DW_OF(2), DW_OF(3), DW_OF(4), DW_OF(5), DW_OF(6), DW_OF(7)};
}""",
}


def widened(text: str) -> str:
    """Return what is written for views of floats for those of lanes."""
    return re.sub(r"\b(V\d|S1|dw_(?:row|cut|tail|fold|column|strided)\w*)\b", r"\1l", text).replace("F *p", "L *p")
