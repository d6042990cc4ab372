#include "tests/cli/xml.h"

#include <vector>

namespace naturel::tests {

std::string xml_fault(const std::string& text) {
    std::vector<std::string> open;
    std::size_t k = text.find("?>");
    if (!text.starts_with("<?xml ") || k == std::string::npos) return "no declaration";
    for (k += 2; k < text.size(); ++k) {
        if (text[k] == '&') {
            const std::size_t end = text.find(';', k);
            const std::string entity = text.substr(k, end - k + 1);
            if (entity != "&amp;" && entity != "&lt;" && entity != "&gt;" && entity != "&quot;")
                return "entity " + entity;
            continue;
        }
        if (text[k] != '<') continue;
        std::size_t end = k + 1;
        bool quoted = false;
        for (; end < text.size() && (quoted || text[end] != '>'); ++end) {
            if (text[end] == '<') return "a tag in a tag";
            if (text[end] == '"') quoted = !quoted;
        }
        if (end == text.size()) return "a tag without end";
        const std::string tag = text.substr(k + 1, end - k - 1);
        const std::string name = tag.substr(0, tag.find_first_of(" /", 1));
        if (tag.front() == '/') {
            if (open.empty() || "/" + open.back() != tag) return "</" + tag + "> closes nothing";
            open.pop_back();
        } else if (tag.back() != '/') {
            open.push_back(name);
        }
        k = end;
    }
    return open.empty() ? "" : open.back() + " is not closed";
}

}  // namespace naturel::tests
