#include "core/spectrum_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/errors.h"

namespace naturel {
namespace {

/// From the vacuum ultraviolet to the thermal infrared: tables of solar transmittance reach beyond the visible range.
constexpr Range wavelength_range{100.0, 100000.0, "nm"};
/// What lies beyond these wavelengths holds 0.4 % of the luminous flux of D65: the last value may stand for it.
constexpr double first_needed_nm = 400.0, last_needed_nm = 700.0;

/// What is wrong with the wavelengths as a whole; empty if nothing is.
std::string range_fault(const Spectrum& spectrum) {
    if (spectrum.wavelength_nm.empty()) return "the spectrum is empty (from 400 to 700 nm are needed)";
    const double first = spectrum.wavelength_nm.front(), last = spectrum.wavelength_nm.back();
    if (first <= first_needed_nm && last >= last_needed_nm) return {};
    return fmt::format("the spectrum reaches from {} to {} nm (it must cover {} to {} nm)", first, last,
                       first_needed_nm, last_needed_nm);
}

/// What is wrong with the next wavelength; empty if it follows the ones before.
std::string order_fault(const Spectrum& spectrum, double nm) {
    if (spectrum.wavelength_nm.empty() || nm > spectrum.wavelength_nm.back()) return {};
    return fmt::format("the wavelength {} nm does not follow {} nm (they must increase)", nm,
                       spectrum.wavelength_nm.back());
}

Spectrum read_inline(const JsonValue& value) {
    Spectrum spectrum;
    for (const JsonValue& item : read_list(value, "[wavelength_nm, value]")) {
        const auto [nm, share] = read_numbers<2>(item, "wavelength in nm, value", {wavelength_range, share_range});
        if (const std::string fault = order_fault(spectrum, nm); !fault.empty()) item.refuse(fault);
        spectrum.wavelength_nm.push_back(nm);
        spectrum.value.push_back(share);
    }
    if (const std::string fault = range_fault(spectrum); !fault.empty()) value.refuse(fault);
    return spectrum;
}

struct Cell {
    std::string_view text;
    std::size_t column = 1;  // in characters, from 1
};

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view blanks = " \t\r\"";
    const auto first = text.find_first_not_of(blanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::vector<Cell> cells_of(std::string_view line) {
    const char separator = line.find(';') != std::string_view::npos ? ';'
                           : line.find(',') != std::string_view::npos ? ','
                                                                      : '\t';
    const auto characters = [](std::string_view bytes) {
        return static_cast<std::size_t>(
            std::ranges::count_if(bytes, [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
    };
    std::vector<Cell> cells;
    for (std::size_t begin = 0;;) {
        const std::size_t end = std::min(line.find(separator, begin), line.size());
        const std::string_view raw = line.substr(begin, end - begin);
        const std::string_view text = trimmed(raw);
        const std::size_t at = text.empty() ? begin : static_cast<std::size_t>(text.data() - line.data());
        cells.push_back({text, 1 + characters(line.substr(0, at))});
        if (end == line.size()) return cells;
        begin = end + 1;
    }
}

std::optional<double> number_in(std::string_view text) {
    double number = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number)) return {};
    return number;
}

/// One column of a CSV file against its first.
class CsvColumn {
public:
    CsvColumn(const SideFiles::Text& file, const JsonValue& file_value, const std::optional<JsonValue>& column)
        : file_(file), file_value_(file_value), column_(column) {}

    Spectrum read() {
        std::string_view rest = file_.text;
        if (rest.starts_with("\xef\xbb\xbf")) rest.remove_prefix(3);  // byte order mark
        bool started = false;
        for (std::size_t line_number = 1; !rest.empty(); ++line_number) {
            const std::size_t end = std::min(rest.find('\n'), rest.size());
            const std::string_view line = rest.substr(0, end);
            rest.remove_prefix(std::min(end + 1, rest.size()));
            if (trimmed(line).empty() || trimmed(line).front() == '#') continue;
            const std::vector<Cell> cells = cells_of(line);
            if (!started) {
                started = true;
                if (!number_in(cells.front().text)) {
                    choose(cells, true);
                    continue;
                }
                choose(cells, false);
            }
            add(cells, line_number);
        }
        if (const std::string fault = range_fault(spectrum_); !fault.empty())
            file_value_.refuse(fmt::format("{}: {}", in_quotes(file_value_.text()), fault));
        return std::move(spectrum_);
    }

private:
    /// Finds the column by the first line, which holds names or already numbers.
    void choose(const std::vector<Cell>& cells, bool names) {
        count_ = cells.size();
        if (!column_) {
            if (count_ != 2)
                file_value_.refuse(fmt::format("{} has {} columns (name the one that is meant: \"column\")",
                                               in_quotes(file_value_.text()), count_));
            return;
        }
        std::vector<std::string_view> known;
        for (std::size_t k = 1; k < count_ && names; ++k)
            known.push_back(cells[k].text);
        const auto found = std::ranges::find(known, read_text(*column_));
        if (found == known.end())
            column_->refuse(fmt::format("there is no column {} in {} {}", in_quotes(column_->text()),
                                        in_quotes(file_value_.text()), suggestion(column_->text(), known)));
        chosen_ = 1 + static_cast<std::size_t>(found - known.begin());
    }

    void add(const std::vector<Cell>& cells, std::size_t line) {
        const auto refuse = [&](std::size_t column, const std::string& text) {
            throw InputError(fmt::format("{}:{}:{}", file_.file_name, line, column), text);
        };
        if (cells.size() != count_)
            refuse(1, fmt::format("the line has {} cells ({} as in the first line would be right)", cells.size(), count_));
        const auto number = [&](const Cell& cell, const Range& range) {
            if (cell.text.empty())
                refuse(cell.column, fmt::format("the cell is empty ({} would be right)", range.words()));
            const auto value = number_in(cell.text);
            if (!value)
                refuse(cell.column, fmt::format("{} is not a number ({} would be right)", in_quotes(cell.text), range.words()));
            if (*value < range.low || *value > range.high)
                refuse(cell.column, fmt::format("{} is out of range ({} would be right)", *value, range.words()));
            return *value;
        };
        const double nm = number(cells.front(), wavelength_range);
        if (const std::string fault = order_fault(spectrum_, nm); !fault.empty()) refuse(cells.front().column, fault);
        spectrum_.value.push_back(number(cells[chosen_], share_range));
        spectrum_.wavelength_nm.push_back(nm);
    }

    const SideFiles::Text& file_;
    const JsonValue& file_value_;
    const std::optional<JsonValue>& column_;
    std::size_t count_ = 0, chosen_ = 1;
    Spectrum spectrum_;
};

}  // namespace

Spectrum read_spectrum(const JsonValue& value, SideFiles& files) {
    if (value.kind() == JsonKind::list) return read_inline(value);
    if (value.kind() != JsonKind::object)
        value.refuse(value.describe() +
                     " stands where a spectrum belongs ([[wavelength_nm, value], ...] or {\"file\": ...})");
    const SceneObject object(value, scene_keys::spectrum_file);
    const JsonValue file = object.at("file");
    const std::optional<JsonValue> column = object.find("column");
    return CsvColumn(files.read(file), file, column).read();
}

}  // namespace naturel
