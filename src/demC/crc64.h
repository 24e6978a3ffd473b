/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * crc64.h - checksum of bytes that finds every error of one byte, and of up to eight in a row.
 *
 * The generator polynomial of ECMA-182 (1992), annex B, bits reflected, begun and ended with all
 * bits inverted, as the xz format has it; eight bytes at a time with eight tables (Kounavis &
 * Berry, IEEE Trans. Comput. 57 (2008) 1550, doi:10.1109/TC.2008.85). Of "123456789" it is
 * 995dc9bbdf1939fa.
 *
 * Pieces are summed apart and joined: a checksum is linear in the bits, and n bytes behind them
 * multiply those of a piece by x^(8 n) modulo the generator, which takes some log n products of
 * polynomials over GF(2).
 */
#ifndef CRC64_H
#define CRC64_H

#include <stddef.h>
#include <stdint.h>

#define CRC64_GENERATOR UINT64_C(0xC96C5795D7870F42)

typedef struct crc64 {
    uint64_t table[8][256];
    uint64_t state;
} crc64;

static inline void crc64_begin(crc64 *c)
{
    for (unsigned b = 0; b < 256; b++) {
        uint64_t x = b;
        for (int bit = 0; bit < 8; bit++) x = x & 1 ? x >> 1 ^ CRC64_GENERATOR : x >> 1;
        c->table[0][b] = x;
    }
    for (int t = 1; t < 8; t++)
        for (unsigned b = 0; b < 256; b++) {
            const uint64_t x = c->table[t - 1][b];
            c->table[t][b] = x >> 8 ^ c->table[0][x & 255];
        }
    c->state = ~UINT64_C(0);
}

static inline void crc64_add(crc64 *c, const void *data, size_t n)
{
    const unsigned char *p = data;
    uint64_t x = c->state;
    for (; n >= 8; n -= 8, p += 8) {
        for (int b = 0; b < 8; b++) x ^= (uint64_t)p[b] << 8 * b;
        uint64_t next = 0;
        for (int b = 0; b < 8; b++) next ^= c->table[7 - b][x >> 8 * b & 255];
        x = next;
    }
    for (; n > 0; n--, p++) x = x >> 8 ^ c->table[0][(x ^ *p) & 255];
    c->state = x;
}

static inline uint64_t crc64_end(const crc64 *c)
{
    return ~c->state;
}

/* a b modulo the generator; the highest bit is the coefficient of 1, the lowest that of x^63. */
static inline uint64_t crc64_product(uint64_t a, uint64_t b)
{
    uint64_t sum = 0;
    for (uint64_t bit = UINT64_C(1) << 63; bit; bit >>= 1) {
        if (a & bit) sum ^= b;
        b = b & 1 ? b >> 1 ^ CRC64_GENERATOR : b >> 1; /* times x */
    }
    return sum;
}

/* The checksum of a piece with the checksum `first` and n bytes behind it with `second`. */
static inline uint64_t crc64_join(uint64_t first, uint64_t second, uint64_t n)
{
    /* The inverted bits at the end of the first cancel against those at the begin of the second. */
    for (uint64_t power = UINT64_C(1) << 55; n; n >>= 1) { /* x^8, x^16, x^32... */
        if (n & 1) first = crc64_product(first, power);
        power = crc64_product(power, power);
    }
    return first ^ second;
}

#endif
