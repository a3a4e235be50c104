"""What C needs of the bits of numbers: the same few functions for doubles and for single precision."""

from __future__ import annotations

import struct
from typing import NamedTuple

from ..elementary.pairs import ROOT_HALF


class Format(NamedTuple):
    """A format of IEEE 754."""

    digits: int  # binary digits behind the point
    bias: int  # what the exponent is stored with
    number: str  # how literals of such numbers end
    word: str  # and those of words of their bits

    def texts(self) -> dict[str, str]:
        """Return the functions in C, by their names."""
        infinite = 2 * self.bias + 1
        sign = infinite + 1 << self.digits
        step = self.bias - 2 - self.digits  # down by so much, no digit is lost
        known = {
            "DIGITS": self.digits, "BIAS": self.bias, "LEAST": self.bias - 1, "STEP": step, "UP": 2.0**self.bias,
            "DOWN": 2.0**-step, "FAR": 2 * self.bias + self.digits + 2, "INFINITE": f"{infinite:#x}",
            "REST": f"{sign - 1:#x}{self.word}", "SIGN": f"{sign:#x}{self.word}",
            "LIFTED_LEAST": self.bias + 1 + self.digits, "ENDING": self.number.lower(),
            "LIFTED": 2.0 ** (self.digits + 2), "HALF": f"{self.bias - 1 << self.digits:#x}{self.word}",
            "ONE_WORD": f"{self.bias << self.digits:#x}{self.word}",
            "ROOT_HALF": f"{self.bits(ROOT_HALF):#x}{self.word}",
            "NOT_EXPONENT": f"{sign | (1 << self.digits) - 1:#x}{self.word}",
        }  # fmt: skip
        return {name: self._filled(text, known) for name, text in TEXTS.items()}

    def bits(self, number: float) -> int:
        """Return the word of a number."""
        size, kind = ("Q", "d") if self.digits > 32 else ("I", "f")
        return struct.unpack(size, struct.pack(kind, number))[0]

    def _filled(self, text: str, known: dict) -> str:
        """Return a text with the numbers of this format in it."""
        for name, value in [*known.items(), ("ZERO", 0.0), ("ONE", 1.0)]:
            text = text.replace(f"${name};", f"{value!r}{self.number}" if isinstance(value, float) else str(value))
        return text


TEXTS = {
    "dw_abs": """\
static DW_INLINE F dw_abs(F x)
{
#if defined(__GNUC__) || defined(__clang__)
    return __builtin_fabs$ENDING;(x);
#else
    return dw_bits(dw_word(x) & $REST;);
#endif
}""",
    "dw_copysign": """\
static DW_INLINE F dw_copysign(F x, F y)
{
#if defined(__GNUC__) || defined(__clang__)
    return __builtin_copysign$ENDING;(x, y);
#else
    return dw_bits((dw_word(x) & $REST;) | (dw_word(y) & $SIGN;));
#endif
}""",
    "dw_finite": "static DW_INLINE B dw_finite(F x) { return x - x == $ZERO;; }",
    "dw_power": """\
static DW_INLINE F dw_power(F a, I n)
{
    F result = $ONE;;
    U left = (U)(n < 0 ? -n : n);
    while (left) {
        if (left & 1)
            result *= a;
        left >>= 1;
        a *= a;
    }
    return n < 0 ? $ONE; / result : result;
}""",
    "dw_ldexp": """\
static DW_APART F dw_far_ldexp(F x, I n)
{
    n = n > $FAR; ? $FAR; : n < -$FAR; ? -$FAR; : n;
    while (n > $BIAS;) {
        x *= $UP;;
        n -= $BIAS;;
    }
    while (n < -$LEAST;) {
        x *= $DOWN;;
        n += $STEP;;
    }
    return x * dw_bits((U)($BIAS; + n) << $DIGITS;);
}
static DW_INLINE F dw_ldexp(F x, I n)
{
    return n >= -$LEAST; && n <= $BIAS; ? x * dw_bits((U)($BIAS; + n) << $DIGITS;) : dw_far_ldexp(x, n);
}""",
    "dw_frexp": """\
static DW_APART PAIR dw_odd_frexp(F x)
{
    PAIR found;
    const U word = dw_word(x * $LIFTED;);
    const B is_small = x != $ZERO; && x - x == $ZERO;;
    found.i0 = is_small ? dw_bits((word & $NOT_EXPONENT;) | $HALF;) : x;
    found.i1 = is_small ? (I)(word >> $DIGITS; & $INFINITE;) - $LIFTED_LEAST; : 0;
    return found;
}
static DW_INLINE PAIR dw_frexp(F x)
{
    PAIR found;
    const U word = dw_word(x);
    const I exponent = (I)(word >> $DIGITS; & $INFINITE;);
    if (exponent == 0 || exponent == $INFINITE;)
        return dw_odd_frexp(x);
    found.i0 = dw_bits((word & $NOT_EXPONENT;) | $HALF;);
    found.i1 = exponent - $LEAST;;
    return found;
}""",
    "dw_about_one": """\
static DW_INLINE PAIR dw_about_one(F x)
{
    PAIR found;
    const U word = dw_word(x);
    const U above = word + ($ONE_WORD; - $ROOT_HALF;);
    found.i0 = dw_bits(word + $ONE_WORD; - (above >> $DIGITS; << $DIGITS;));
    found.i1 = (I)(above >> $DIGITS;) - $BIAS;;
    return found;
}""",
}
DOUBLE, SINGLE = Format(52, 1023, "", "ULL"), Format(23, 127, "F", "U")
