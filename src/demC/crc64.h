/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * crc64.h - checksum of bytes that finds every error of one byte, and of up to eight in a row.
 *
 * The generator polynomial of ECMA-182 (1992), annex B, bits reflected, begun and ended with all
 * bits inverted, as the xz format has it; eight bytes at a time with eight tables (Kounavis &
 * Berry, IEEE Trans. Comput. 57 (2008) 1550, doi:10.1109/TC.2008.85). Of "123456789" it is
 * 995dc9bbdf1939fa.
 */
#ifndef CRC64_H
#define CRC64_H

#include <stddef.h>
#include <stdint.h>

typedef struct crc64 {
    uint64_t table[8][256];
    uint64_t state;
} crc64;

static inline void crc64_begin(crc64 *c)
{
    const uint64_t polynomial = UINT64_C(0xC96C5795D7870F42);
    for (unsigned b = 0; b < 256; b++) {
        uint64_t x = b;
        for (int bit = 0; bit < 8; bit++) x = x & 1 ? x >> 1 ^ polynomial : x >> 1;
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

#endif
