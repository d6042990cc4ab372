#pragma once
#include <fmt/format.h>

#include <cmath>
#include <glm/vec3.hpp>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/band3.h"

namespace naturel {

/// A table as comma-separated values, cell by cell: text quoted where it must be, numbers to nine digits. A number that is not
/// finite is an internal fault.
class CsvTable {
public:
    CsvTable() = default;  ///< rows without a header
    explicit CsvTable(std::string_view header) : text_(header) { text_ += '\n'; }

    CsvTable& cell(std::string_view text) {
        separate();
        if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
            text_ += text;
            return *this;
        }
        text_ += '"';
        for (const char c : text)
            text_.append(c == '"' ? 2 : 1, c);
        text_ += '"';
        return *this;
    }
    CsvTable& cell(std::size_t number) {
        separate();
        fmt::format_to(std::back_inserter(text_), "{}", number);
        return *this;
    }
    CsvTable& cell(double number) {
        separate();
        if (!std::isfinite(number)) throw std::logic_error("a result is not a finite number");
        // + 0.0 turns -0 into 0.
        fmt::format_to(std::back_inserter(text_), "{:.9g}", number + 0.0);
        return *this;
    }
    CsvTable& cell(std::optional<double> number) { return number ? cell(*number) : cell(std::string_view()); }
    CsvTable& cell(const glm::dvec3& vector) { return cell(vector.x).cell(vector.y).cell(vector.z); }
    CsvTable& cell(const Band3& band) { return cell(band.r).cell(band.g).cell(band.b); }
    void end_row() {
        text_ += '\n';
        row_begins_ = true;
    }
    std::string take() && { return std::move(text_); }

private:
    void separate() {
        if (!row_begins_) text_ += ',';
        row_begins_ = false;
    }

    std::string text_;
    bool row_begins_ = true;
};

}  // namespace naturel
