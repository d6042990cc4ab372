#include "cli/file_stems.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>

namespace naturel {

std::vector<std::string> file_stems(const std::vector<std::string>& ids) {
    std::vector<std::string> stems;
    std::set<std::string> taken;
    for (const std::string& id : ids) {
        std::string stem = id;
        for (char& c : stem) {
            const auto byte = static_cast<unsigned char>(c);
            const bool harmless = byte >= 0x80 || std::isalnum(byte) != 0 || c == '-' || c == '_' || c == '.';
            if (!harmless) c = '_';
        }
        if (stem.empty() || stem.front() == '.' || stem.front() == '-') stem.insert(stem.begin(), '_');
        // 255 bytes is the usual limit of a name; endings and numbers are added. A UTF-8 character is not
        // cut.
        if (stem.size() > 200) {
            std::size_t end = 200;
            while ((static_cast<unsigned char>(stem[end]) & 0xc0) == 0x80)
                --end;
            stem.resize(end);
        }
        const auto in_lower_case = [](std::string text) {
            std::ranges::transform(text, text.begin(), [](unsigned char c) {
                return c < 0x80 ? static_cast<char>(std::tolower(c)) : c;
            });
            return text;
        };
        std::string unique = stem;
        for (int n = 2; !taken.insert(in_lower_case(unique)).second; ++n)
            unique = fmt::format("{}_{}", stem, n);
        stems.push_back(unique);
    }
    return stems;
}

}  // namespace naturel
