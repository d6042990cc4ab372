#include "tests/cli/png.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <stdexcept>

namespace naturel::tests {
namespace {

/// A code of RFC 1951, 3.2.2: lengths say how many bits each symbol takes.
class HuffmanCode {
public:
    explicit HuffmanCode(std::span<const int> lengths) {
        for (const int length : lengths) ++count_[static_cast<std::size_t>(length)];
        count_[0] = 0;
        for (std::size_t length = 1; length < count_.size(); ++length)
            for (std::size_t symbol = 0; symbol < lengths.size(); ++symbol)
                if (lengths[symbol] == static_cast<int>(length)) symbols_.push_back(static_cast<int>(symbol));
    }

    template <class NextBit>
    int symbol(const NextBit& next_bit) const {
        int code = 0, first = 0, index = 0;
        for (std::size_t length = 1; length < count_.size(); ++length) {
            code |= next_bit();
            if (code - first < count_[length]) return symbols_[static_cast<std::size_t>(index + code - first)];
            index += count_[length];
            first = (first + count_[length]) << 1;
            code <<= 1;
        }
        throw std::runtime_error("a code that is none");
    }

private:
    std::array<int, 16> count_{};
    std::vector<int> symbols_;
};

/// What a stream of zlib holds (RFC 1950, 1951).
std::vector<unsigned char> inflated(const std::string& zlib) {
    std::size_t bit = 16;  // behind the two bytes of the header
    const auto next_bit = [&] {
        const auto byte = static_cast<unsigned char>(zlib.at(bit / 8));
        return byte >> (bit++ % 8) & 1;
    };
    const auto bits = [&](int count) {
        int value = 0;
        for (int k = 0; k < count; ++k) value |= next_bit() << k;
        return value;
    };
    std::vector<unsigned char> out;
    for (bool last = false; !last;) {
        last = bits(1) == 1;
        const int kind = bits(2);
        if (kind == 0) {
            bit = (bit + 7) / 8 * 8;
            const int size = bits(16);
            bits(16);
            for (int k = 0; k < size; ++k) out.push_back(static_cast<unsigned char>(bits(8)));
            continue;
        }
        std::vector<int> literal_lengths, distance_lengths;
        if (kind == 1) {
            for (int k = 0; k < 288; ++k) literal_lengths.push_back(k < 144 ? 8 : k < 256 ? 9 : k < 280 ? 7 : 8);
            distance_lengths.assign(30, 5);
        } else {
            const int literals = bits(5) + 257, distances = bits(5) + 1, codes = bits(4) + 4;
            std::array<int, 19> lengths{};
            constexpr std::array<std::size_t, 19> order{16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
            for (int k = 0; k < codes; ++k) lengths[order[static_cast<std::size_t>(k)]] = bits(3);
            const HuffmanCode code(lengths);
            std::vector<int> all;
            while (static_cast<int>(all.size()) < literals + distances) {
                const int symbol = code.symbol(next_bit);
                if (symbol < 16) {
                    all.push_back(symbol);
                } else {
                    const int repeated = symbol == 16 ? all.back() : 0;
                    const int times = symbol == 16 ? 3 + bits(2) : symbol == 17 ? 3 + bits(3) : 11 + bits(7);
                    all.insert(all.end(), static_cast<std::size_t>(times), repeated);
                }
            }
            literal_lengths.assign(all.begin(), all.begin() + literals);
            distance_lengths.assign(all.begin() + literals, all.end());
        }
        const HuffmanCode literal(literal_lengths), distance(distance_lengths);
        for (int symbol = literal.symbol(next_bit); symbol != 256; symbol = literal.symbol(next_bit)) {
            if (symbol < 256) {
                out.push_back(static_cast<unsigned char>(symbol));
                continue;
            }
            const int place = symbol - 257, length_bits = place < 8 || place == 28 ? 0 : (place - 4) / 4;
            const int length = place == 28 ? 258 : place < 8 ? 3 + place : 3 + ((4 + place % 4) << length_bits) + bits(length_bits);
            const int far = distance.symbol(next_bit), far_bits = far < 4 ? 0 : (far - 2) / 2;
            const int back = far < 4 ? 1 + far : 1 + ((2 + far % 2) << far_bits) + bits(far_bits);
            for (int k = 0; k < length; ++k) out.push_back(out.at(out.size() - static_cast<std::size_t>(back)));
        }
    }
    return out;
}

}  // namespace

PngPicture read_png(const std::string& file) {
    const auto number = [&](std::size_t at) {
        std::uint32_t value = 0;
        for (std::size_t k = at; k < at + 4; ++k) value = 256 * value + static_cast<unsigned char>(file.at(k));
        return value;
    };
    if (!file.starts_with("\x89PNG\r\n\x1a\n")) throw std::runtime_error("not a PNG file");
    PngPicture picture{.width = number(16), .height = number(20), .channels = file.at(25) == 2 ? 3u : 4u};
    if (file.at(24) != 8 || (file.at(25) != 2 && file.at(25) != 6) || file.at(28) != 0) throw std::runtime_error("a PNG file of another kind");
    std::string data;
    for (std::size_t at = 8; at < file.size(); at += 12 + number(at))
        if (file.compare(at + 4, 4, "IDAT") == 0) data += file.substr(at + 8, number(at));
    const std::vector<unsigned char> rows = inflated(data);
    const std::size_t row_bytes = picture.width * picture.channels;
    picture.bytes.resize(picture.height * row_bytes);
    for (std::size_t row = 0; row < picture.height; ++row) {
        const int filter = rows.at(row * (row_bytes + 1));
        for (std::size_t k = 0; k < row_bytes; ++k) {
            const auto at = [&](std::size_t up, std::size_t left) {
                return row < up || k < left ? 0 : static_cast<int>(picture.bytes[(row - up) * row_bytes + k - left]);
            };
            const int a = at(0, picture.channels), b = at(1, 0), c = at(1, picture.channels), p = a + b - c;
            const int nearest = std::abs(p - a) <= std::abs(p - b) && std::abs(p - a) <= std::abs(p - c) ? a : std::abs(p - b) <= std::abs(p - c) ? b : c;
            const std::array predicted{0, a, b, (a + b) / 2, nearest};
            picture.bytes[row * row_bytes + k] = static_cast<unsigned char>(rows.at(row * (row_bytes + 1) + 1 + k) + predicted.at(static_cast<std::size_t>(filter)));
        }
    }
    return picture;
}

}  // namespace naturel::tests
