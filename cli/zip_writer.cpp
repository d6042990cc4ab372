#include "cli/zip_writer.h"

#include <algorithm>
#include <array>
#include <limits>

#include "cli/little_endian.h"

namespace naturel {
namespace {

// From here on the 32 bits of the original form do not do.
constexpr std::uint64_t zip64_from = 0xffff'ffffu;
constexpr std::uint32_t see_zip64 = 0xffff'ffffu;
// 1 January 1980, midnight: the earliest date the format knows.
constexpr std::uint16_t dos_time = 0, dos_date = 0x0021;

/// CRC-32 of the reflected polynomial 0xedb88320 (ISO 3309), eight bytes at a time: tables[k] is for a byte that k more follow.
constexpr auto crc_tables = [] {
    std::array<std::array<std::uint32_t, 256>, 8> tables{};
    for (std::uint32_t n = 0; n < 256; ++n) {
        std::uint32_t crc = n;
        for (int bit = 0; bit < 8; ++bit)
            crc = (crc & 1u) != 0 ? 0xedb8'8320u ^ (crc >> 1) : crc >> 1;
        tables[0][n] = crc;
    }
    for (std::size_t k = 1; k < 8; ++k)
        for (std::size_t n = 0; n < 256; ++n)
            tables[k][n] = (tables[k - 1][n] >> 8) ^ tables[0][tables[k - 1][n] & 0xffu];
    return tables;
}();

std::uint32_t crc_continued(std::uint32_t crc, std::string_view bytes) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
    std::size_t i = 0;
    for (; i + 8 <= bytes.size(); i += 8)
        crc = crc_tables[7][byte(i) ^ (crc & 0xffu)] ^ crc_tables[6][byte(i + 1) ^ ((crc >> 8) & 0xffu)] ^
              crc_tables[5][byte(i + 2) ^ ((crc >> 16) & 0xffu)] ^ crc_tables[4][byte(i + 3) ^ (crc >> 24)] ^
              crc_tables[3][byte(i + 4)] ^ crc_tables[2][byte(i + 5)] ^ crc_tables[1][byte(i + 6)] ^ crc_tables[0][byte(i + 7)];
    for (; i < bytes.size(); ++i)
        crc = (crc >> 8) ^ crc_tables[0][(crc ^ byte(i)) & 0xffu];
    return crc;
}

std::uint32_t in_32_bits(std::uint64_t number) {
    return number < zip64_from ? static_cast<std::uint32_t>(number) : see_zip64;
}

}  // namespace

void ZipWriter::write(std::string_view bytes) {
    file_.write(bytes);
    offset_ += bytes.size();
}

void ZipWriter::add(std::string_view name, std::span<const std::string_view> parts) {
    Entry entry{.name = std::string(name), .offset = offset_};
    std::uint32_t crc = 0xffff'ffffu;
    for (const std::string_view part : parts) {
        crc = crc_continued(crc, part);
        entry.size += part.size();
    }
    entry.crc = crc ^ 0xffff'ffffu;

    const bool large = entry.size >= zip64_from;
    std::string header = "PK\x03\x04";
    append_bytes<std::uint16_t>(header, large ? 45 : 20);  // version needed, tenths
    append_bytes<std::uint16_t>(header, 0);                // flags
    append_bytes<std::uint16_t>(header, 0);                // stored
    append_bytes(header, dos_time);
    append_bytes(header, dos_date);
    append_bytes(header, entry.crc);
    append_bytes(header, in_32_bits(entry.size));  // compressed
    append_bytes(header, in_32_bits(entry.size));
    append_bytes(header, static_cast<std::uint16_t>(entry.name.size()));
    append_bytes<std::uint16_t>(header, large ? 20 : 0);  // extra fields
    header += entry.name;
    if (large) {
        append_bytes<std::uint16_t>(header, 1);  // ZIP64
        append_bytes<std::uint16_t>(header, 16);
        append_bytes(header, entry.size);
        append_bytes(header, entry.size);
    }
    write(header);
    for (const std::string_view part : parts)
        write(part);
    entries_.push_back(std::move(entry));
}

void ZipWriter::finish() {
    const std::uint64_t directory = offset_;
    for (const Entry& entry : entries_) {
        std::string extra;
        if (entry.size >= zip64_from) {
            append_bytes(extra, entry.size);
            append_bytes(extra, entry.size);
        }
        if (entry.offset >= zip64_from) append_bytes(extra, entry.offset);
        if (!extra.empty()) {
            std::string head;
            append_bytes<std::uint16_t>(head, 1);  // ZIP64
            append_bytes(head, static_cast<std::uint16_t>(extra.size()));
            extra.insert(0, head);
        }
        const std::uint16_t version = extra.empty() ? 20 : 45;
        std::string header = "PK\x01\x02";
        append_bytes(header, version);  // made by
        append_bytes(header, version);  // needed
        append_bytes<std::uint16_t>(header, 0);
        append_bytes<std::uint16_t>(header, 0);
        append_bytes(header, dos_time);
        append_bytes(header, dos_date);
        append_bytes(header, entry.crc);
        append_bytes(header, in_32_bits(entry.size));
        append_bytes(header, in_32_bits(entry.size));
        append_bytes(header, static_cast<std::uint16_t>(entry.name.size()));
        append_bytes(header, static_cast<std::uint16_t>(extra.size()));
        append_bytes<std::uint16_t>(header, 0);  // comment
        append_bytes<std::uint16_t>(header, 0);  // disk
        append_bytes<std::uint16_t>(header, 0);  // internal attributes
        append_bytes<std::uint32_t>(header, 0);  // external attributes
        append_bytes(header, in_32_bits(entry.offset));
        write(header + entry.name + extra);
    }
    const std::uint64_t size = offset_ - directory;
    const std::uint64_t count = entries_.size();
    std::string end;
    if (directory >= zip64_from || size >= zip64_from) {
        const std::uint64_t zip64_end = offset_;
        end = "PK\x06\x06";
        append_bytes<std::uint64_t>(end, 44);  // what follows of this record
        append_bytes<std::uint16_t>(end, 45);
        append_bytes<std::uint16_t>(end, 45);
        append_bytes<std::uint32_t>(end, 0);
        append_bytes<std::uint32_t>(end, 0);
        append_bytes(end, count);
        append_bytes(end, count);
        append_bytes(end, size);
        append_bytes(end, directory);
        end += "PK\x06\x07";
        append_bytes<std::uint32_t>(end, 0);
        append_bytes(end, zip64_end);
        append_bytes<std::uint32_t>(end, 1);
    }
    end += "PK\x05\x06";
    append_bytes<std::uint16_t>(end, 0);
    append_bytes<std::uint16_t>(end, 0);
    append_bytes(end, static_cast<std::uint16_t>(count));
    append_bytes(end, static_cast<std::uint16_t>(count));
    append_bytes(end, in_32_bits(size));
    append_bytes(end, in_32_bits(directory));
    append_bytes<std::uint16_t>(end, 0);  // comment
    write(end);
}

}  // namespace naturel
