#pragma once
#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace naturel::tests {

/// A table of tests/data: comma separated, one header line, no quoting.
struct CsvTable {
    std::vector<std::string> columns;
    std::vector<std::vector<std::string>> rows;

    const std::string& text(std::size_t row, const std::string& column) const {
        const auto found = std::find(columns.begin(), columns.end(), column);
        if (found == columns.end()) throw std::runtime_error("no column " + column);
        return rows.at(row).at(static_cast<std::size_t>(found - columns.begin()));
    }
    double number(std::size_t row, const std::string& column) const { return std::stod(text(row, column)); }

    /// The first row whose `column` says `value`.
    std::size_t row_where(const std::string& column, const std::string& value) const {
        for (std::size_t row = 0; row < rows.size(); ++row) {
            if (text(row, column) == value) return row;
        }
        throw std::runtime_error("no row " + value);
    }
};

/// file_name: in tests/data.
inline CsvTable read_csv(const std::string& file_name) {
    std::ifstream file(NATUREL_SOURCE_DIR "/tests/data/" + file_name);
    if (!file) throw std::runtime_error("cannot read " + file_name);
    const auto cells = [](const std::string& line) {
        std::vector<std::string> out;
        std::istringstream stream(line);
        for (std::string cell; std::getline(stream, cell, ',');)
            out.push_back(cell);
        return out;
    };
    CsvTable table;
    std::string line;
    std::getline(file, line);
    table.columns = cells(line);
    while (std::getline(file, line)) {
        if (!line.empty()) table.rows.push_back(cells(line));
    }
    return table;
}

}  // namespace naturel::tests
