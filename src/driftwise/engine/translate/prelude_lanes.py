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
    "dw_interleave": ("V1", "V1l", "DW_INLINE"), "dw_own": ("V1l", "DW_INLINE"),
    "dw_gather": ("V2", "V1i", "L", "dw_at", "DW_INLINE"),
    **dict.fromkeys(("dw_collect", "dw_scatter"), ("dw_gather", "DW_QUARTERS", "V1l", "DW_UNROLL")),
    "DW_QUARTERS": ("L", "dw_at"),
    **dict.fromkeys(("dw_mask", "dw_select", "dw_lt", "dw_le", "dw_gt", "dw_ge", "dw_eq", "dw_ne"), ("M",)),
    "dw_odd": ("dw_agree",),
}  # fmt: skip

TYPES = {
    "L": """\
/* Eight numbers, eight words. */
typedef double L __attribute__((vector_size(64), may_alias));
typedef long long W __attribute__((vector_size(64), may_alias));""",
    "M": """\
/* Eight truth values: bits where the processor has registers of them, else words of -1 and 0. */
#if defined(__AVX512DQ__)
typedef unsigned char M;
#define DW_COMPARE(a, b, how, sign) ((M)__builtin_ia32_cmppd512_mask(a, b, how, -1, 4))
#define dw_lanes(m) ((int)(m))
#define dw_mask(x) ((M)((x) ? 255 : 0))
#if defined(__clang__)
static DW_INLINE L dw_select(M m, L a, L b) { return __builtin_ia32_selectpd_512(m, a, b); }
#else
static DW_INLINE L dw_select(M m, L a, L b) { return __builtin_ia32_blendmpd_512_mask(b, a, m); }
#endif
#else
typedef W M;
#define DW_COMPARE(a, b, how, sign) ((M)((a) sign (b)))
static DW_INLINE int dw_lanes(M m)
{
#if defined(__AVX__) && defined(__clang__)
    typedef double half __attribute__((vector_size(32), may_alias));
    const half *h = (const half *)&m;
    return __builtin_ia32_movmskpd256(h[0]) | __builtin_ia32_movmskpd256(h[1]) << 4;
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
    if (lanes == 255)
        return 1;
    *odd += lanes != 0;
    return 0;
}
#define dw_odd(odd) (*(odd))""",
    "dw_maxl": """\
#if defined(__AVX512F__) && defined(__clang__)
static DW_INLINE L dw_maxl(L a, L b) { return __builtin_ia32_maxpd512(b, a, 4); }
#elif defined(__AVX512F__)
static DW_INLINE L dw_maxl(L a, L b) { return __builtin_ia32_maxpd512_mask(b, a, a, -1, 4); }
#else
static DW_INLINE L dw_maxl(L a, L b) { return dw_select(dw_gt(b, a), b, a); }
#endif""",
    "dw_minl": """\
#if defined(__AVX512F__) && defined(__clang__)
static DW_INLINE L dw_minl(L a, L b) { return __builtin_ia32_minpd512(b, a, 4); }
#elif defined(__AVX512F__)
static DW_INLINE L dw_minl(L a, L b) { return __builtin_ia32_minpd512_mask(b, a, a, -1, 4); }
#else
static DW_INLINE L dw_minl(L a, L b) { return dw_select(dw_lt(b, a), b, a); }
#endif""",
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
#if defined(__AVX512DQ__) /* 0x9f: zero, infinite, no number */
    M is_odd = (M)__builtin_ia32_fpclasspd512_mask(x, 0x9f, -1);
    L zero = {0};
    found.i0 = dw_select(is_odd, x, __builtin_ia32_getmantpd512_mask(x, 2, zero, -1, 4));
    found.i1 = dw_select(is_odd, zero, __builtin_ia32_getexppd512_mask(x, zero, -1, 4) + 1.0);
#else
    M is_small = dw_lt(dw_absl(x), dw_spread(2.2250738585072014e-308));
    M is_usual = (M)(dw_finitel(x) & dw_ne(x, dw_spread(0.0)));
    W word = (W)dw_select(is_small, x * 18014398509481984.0, x);
    L exponent = dw_whole((word >> 52 & 0x7ff) - 1022);
    exponent = dw_select(is_small, exponent - 54.0, exponent);
    found.i0 = dw_select(is_usual, (L)((word & 0x800fffffffffffffLL) | 0x3fe0000000000000LL), x);
    found.i1 = dw_select(is_usual, exponent, dw_spread(0.0));
#endif
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
    "dw_own": """\
static DW_INLINE V1l dw_own_(L *p, I n) { V1l r; r.p = p; r.n = n; return r; }
#define dw_own(n) dw_own_((L[n]){{0}}, n)""",
    "dw_gather": """\
static DW_INLINE L dw_gather(V2 v, V1i rows, I column)
{
#define DW_OF(l) v.p[dw_at(rows.p[l], v.n) * v.m + column]
    return (L){DW_OF(0), DW_OF(1), DW_OF(2), DW_OF(3), DW_OF(4), DW_OF(5), DW_OF(6), DW_OF(7)};
}""",
    "DW_UNROLL": """\
/* Loops of a step are of a few turns: GCC is told to write them out, Clang by its command line. */
#if defined(__GNUC__) && !defined(__clang__)
#define DW_UNROLL _Pragma("GCC unroll 16")
#else
#define DW_UNROLL
#endif""",
    "DW_QUARTERS": """\
#if defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector)
/* Four columns of a table are turned in registers: a row of four numbers is a load or a store. */
typedef double L4 __attribute__((vector_size(32), may_alias, aligned(8)));
#define DW_QUARTERS 1
#define DW_ROW(l) *(L4 *)(v.p + dw_at(rows.p[l], v.n) * v.m + c)
#define DW_BOTH(x, y) __builtin_shufflevector(x, y, 0, 1, 2, 3, 4, 5, 6, 7)
#define DW_HALF(x, from) __builtin_shufflevector(x, x, from, from + 1, from + 2, from + 3)
#define DW_EVEN(x, y) __builtin_shufflevector(x, y, 0, 8, 2, 10, 4, 12, 6, 14)
#define DW_ODD(x, y) __builtin_shufflevector(x, y, 1, 9, 3, 11, 5, 13, 7, 15)
#endif
#endif""",
    "dw_collect": """\
static DW_INLINE void dw_collect(V2 v, V1i rows, V1l x)
{
    I c = 0;
#if defined(DW_QUARTERS)
    DW_UNROLL
    for (; c + 4 <= x.n; c += 4) {
        L a = DW_BOTH(DW_ROW(0), DW_ROW(4)), b = DW_BOTH(DW_ROW(1), DW_ROW(5));
        L d = DW_BOTH(DW_ROW(2), DW_ROW(6)), e = DW_BOTH(DW_ROW(3), DW_ROW(7));
        L p = __builtin_shufflevector(a, d, 0, 1, 8, 9, 4, 5, 12, 13);
        L q = __builtin_shufflevector(b, e, 0, 1, 8, 9, 4, 5, 12, 13);
        L r = __builtin_shufflevector(a, d, 2, 3, 10, 11, 6, 7, 14, 15);
        L s = __builtin_shufflevector(b, e, 2, 3, 10, 11, 6, 7, 14, 15);
        x.p[c] = DW_EVEN(p, q);
        x.p[c + 1] = DW_ODD(p, q);
        x.p[c + 2] = DW_EVEN(r, s);
        x.p[c + 3] = DW_ODD(r, s);
    }
#endif
    DW_UNROLL
    for (; c < x.n; c++)
        x.p[c] = dw_gather(v, rows, c);
}""",
    "dw_scatter": """\
static DW_INLINE void dw_scatter(V1l x, V2 v, V1i rows)
{
    I c = 0;
#if defined(DW_QUARTERS)
    DW_UNROLL
    for (; c + 4 <= x.n; c += 4) {
        L a = DW_EVEN(x.p[c], x.p[c + 1]), b = DW_ODD(x.p[c], x.p[c + 1]);
        L d = DW_EVEN(x.p[c + 2], x.p[c + 3]), e = DW_ODD(x.p[c + 2], x.p[c + 3]);
        L p = __builtin_shufflevector(a, d, 0, 1, 8, 9, 2, 3, 10, 11);
        L q = __builtin_shufflevector(b, e, 0, 1, 8, 9, 2, 3, 10, 11);
        L r = __builtin_shufflevector(a, d, 4, 5, 12, 13, 6, 7, 14, 15);
        L s = __builtin_shufflevector(b, e, 4, 5, 12, 13, 6, 7, 14, 15);
        DW_ROW(0) = DW_HALF(p, 0);
        DW_ROW(1) = DW_HALF(q, 0);
        DW_ROW(2) = DW_HALF(p, 4);
        DW_ROW(3) = DW_HALF(q, 4);
        DW_ROW(4) = DW_HALF(r, 0);
        DW_ROW(5) = DW_HALF(s, 0);
        DW_ROW(6) = DW_HALF(r, 4);
        DW_ROW(7) = DW_HALF(s, 4);
    }
#endif
    DW_UNROLL
    for (; c < x.n; c++) {
        const L y = x.p[c];
#define DW_TO(l) v.p[dw_at(rows.p[l], v.n) * v.m + c] = y[l]
        DW_TO(0), DW_TO(1), DW_TO(2), DW_TO(3), DW_TO(4), DW_TO(5), DW_TO(6), DW_TO(7);
    }
}""",
}


def widened(text: str) -> str:
    """Return what is written for views of floats for those of lanes."""
    return re.sub(r"\b(V\d|S1|dw_(?:row|cut|tail|fold|column|strided)\w*)\b", r"\1l", text).replace("F *p", "L *p")
