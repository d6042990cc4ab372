#include "cli/json_text.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

bool is_list_of_numbers(const Json& json) {
    return json.is_array() && std::ranges::all_of(json, [](const Json& element) {
               return element.is_number() || is_list_of_numbers(element);
           });
}

void append(std::string& text, const Json& json, std::size_t depth) {
    if (!json.is_structured() || json.empty() || is_list_of_numbers(json)) {
        // JSON knows neither infinity nor NaN; the library would write null and nobody would notice.
        if (json.is_number_float() && !std::isfinite(json.get<double>()))
            throw std::logic_error("a result is not a finite number");
        if (json.is_array() && !json.empty()) {
            text += '[';
            for (const Json& element : json) {
                if (&element != &json.front()) text += ", ";
                append(text, element, depth);
            }
            text += ']';
            return;
        }
        text += json_line(json);
        return;
    }
    const std::string line(2 * (depth + 1), ' ');
    text += json.is_object() ? "{" : "[";
    bool first = true;
    for (const auto& [key, element] : json.items()) {
        text += first ? "\n" : ",\n";
        first = false;
        text += line;
        if (json.is_object()) text += json_line(key) + ": ";
        append(text, element, depth + 1);
    }
    text += '\n' + std::string(2 * depth, ' ') + (json.is_object() ? '}' : ']');
}

}  // namespace

std::string json_text(const Json& json) {
    std::string text;
    append(text, json, 0);
    return text + '\n';
}

std::string json_line(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace naturel
