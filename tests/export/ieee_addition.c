/* Sums and differences of doubles by whole numbers, rounded to nearest, ties to even: IEEE 754-2019, 4.3.1.
 *
 * GCC's library for processors without double arithmetic (libgcc 12.2, ieee754-df.S) rounds some differences of numbers
 * that are 2^31 to 2^33 apart the wrong way: 0x1.ffffffffffffbp-33 - 0x1.0000000000001p+0. Linked in its place.
 */
#include <stdint.h>

uint64_t __wrap___aeabi_dadd(uint64_t a, uint64_t b); /* their bits: such calls use no registers of doubles */
uint64_t __wrap___aeabi_dsub(uint64_t a, uint64_t b);

#define SIGN (1ULL << 63)
#define ONE (1ULL << 52)
#define INFINITE (0x7FFULL << 52)
#define GUARD 3

static uint64_t sum(uint64_t a, uint64_t b)
{
    uint64_t sign, m, n, low;
    int e, f, apart;
    if ((a & ~SIGN) < (b & ~SIGN)) { /* a is the larger */
        m = a;
        a = b;
        b = m;
    }
    if ((a & ~SIGN) >= INFINITE) {
        return (a & ~SIGN) > INFINITE || ((b & ~SIGN) == INFINITE && a != b) ? INFINITE | ONE >> 1 : a;
    }
    sign = a & SIGN;
    e = (int)(a >> 52 & 0x7FF);
    f = (int)(b >> 52 & 0x7FF);
    m = (a & (ONE - 1)) | (e ? ONE : 0);
    n = (b & (ONE - 1)) | (f ? ONE : 0);
    e += e == 0;
    f += f == 0;
    m <<= GUARD;
    n <<= GUARD;
    apart = e - f;
    if (apart > 60) {
        n = 0; /* too small to count */
    } else if (apart) {
        low = n & ((1ULL << apart) - 1);
        n = n >> apart | (low != 0); /* what is shifted out leaves a mark */
    }
    if ((a ^ b) & SIGN) {
        m -= n;
        if (m == 0) {
            return 0;
        }
    } else {
        m += n;
    }
    while (m < ONE << GUARD && e > 1) {
        m <<= 1;
        e--;
    }
    if (m >= ONE << (GUARD + 1)) {
        m = m >> 1 | (m & 1);
        e++;
    }
    low = m & ((1u << GUARD) - 1);
    m >>= GUARD;
    m += low > 4 || (low == 4 && (m & 1));
    if (m >= ONE << 1) {
        m >>= 1;
        e++;
    }
    if (e >= 0x7FF) {
        return sign | INFINITE;
    }
    return m < ONE ? sign | m : sign | (uint64_t)e << 52 | (m & (ONE - 1));
}

uint64_t __wrap___aeabi_dadd(uint64_t a, uint64_t b) { return sum(a, b); }
uint64_t __wrap___aeabi_dsub(uint64_t a, uint64_t b) { return sum(a, b ^ SIGN); }
