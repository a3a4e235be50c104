/* The operations of this machine against those of ieee_addition.c: prints how many of so many pairs differ. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

uint64_t __wrap___aeabi_dadd(uint64_t a, uint64_t b);
uint64_t __wrap___aeabi_dsub(uint64_t a, uint64_t b);

static uint64_t state = 88172645463325252ULL;

static uint64_t drawn(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    return state ^= state << 17;
}

/* Ends of the mantissas, all exponents: subnormal, infinite, near to each other. */
static double number(unsigned exponents)
{
    uint64_t bits = drawn(), kind = drawn() % 4, few = drawn() % 8, exponent;
    double x;
    exponent = exponents == 2048 ? drawn() % 2048 : 1023 - exponents / 2 + drawn() % exponents;
    bits &= 0x800FFFFFFFFFFFFFULL;
    if (kind == 1) {
        bits |= 0xFFFFFFFFFFFF8ULL;
    } else if (kind == 2) {
        bits &= 0x8000000000000007ULL;
    } else if (kind == 3) {
        bits = (bits & 0x8000000000000000ULL) | few << drawn() % 49;
    }
    bits |= exponent << 52;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static uint64_t bits_of(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return x == x ? bits : 1; /* one NaN is as good as another */
}

static int differ(double c, uint64_t bits)
{
    double x;
    memcpy(&x, &bits, sizeof x);
    return bits_of(c) != bits_of(x);
}

int main(void)
{
    long i, wrong = 0;
    for (i = 0; i < 4000000; i++) {
        unsigned exponents = i % 4 == 0 ? 2048 : i % 4 == 1 ? 4 : 140;
        volatile double a = number(exponents), b = number(exponents);
        uint64_t p, q;
        memcpy(&p, (const void *)&a, sizeof p);
        memcpy(&q, (const void *)&b, sizeof q);
        wrong += differ(a + b, __wrap___aeabi_dadd(p, q)) + differ(a - b, __wrap___aeabi_dsub(p, q));
    }
    printf("%ld\n", wrong);
    return 0;
}
