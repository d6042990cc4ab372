#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/comparison_figures.h"
#include "cli/comparison_report.h"

/// Writes report.html and the figures of a comparison.json. Usage: naturel_write_report COMPARISON.json
/// FOLDER
int main(int count, char** arguments) {
    if (count != 3) {
        std::cerr << "usage: naturel_write_report COMPARISON.json FOLDER\n";
        return 2;
    }
    std::ifstream file(arguments[1]);
    const auto comparison = nlohmann::ordered_json::parse(file);
    const std::filesystem::path folder(arguments[2]);
    std::filesystem::create_directories(folder);
    const auto write = [&](const std::string& name, const std::string& text) {
        std::ofstream(folder / name) << text;
    };
    write("report.html", naturel::comparison_report(comparison));
    for (const auto& [name, text] : naturel::comparison_figures(comparison))
        write(name, text);
}
