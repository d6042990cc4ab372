#pragma once
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// How report and figures read the content of comparison.json: what is missing or of another type is absent,
// not an error.
namespace naturel {

using ComparisonJson = nlohmann::ordered_json;

/// The value below keys; null where there is none. By value: GCC 13 and later take a reference to a list for what the result refers to.
const ComparisonJson& value_below(const ComparisonJson& json, std::vector<std::string> keys);
std::optional<double> number_below(const ComparisonJson& json, const std::vector<std::string>& keys);
std::string text_below(const ComparisonJson& json, const std::vector<std::string>& keys);

/// The numbers of a list, NaN for what is none.
std::vector<double> numbers_below(const ComparisonJson& json, const std::vector<std::string>& keys);

/// Ids of the sensor sets, in their order.
std::vector<std::string> sensor_sets(const ComparisonJson& comparison);

/// The set with most points, the first of them; empty if there is none.
std::string largest_set(const ComparisonJson& comparison);

/// Whether the ingredient's effect on a set's total exceeds the reference's own error.
bool is_resolved(const ComparisonJson& comparison, const ComparisonJson& ingredient, const std::string& set);

/// A number with a true minus: "−0.0123"; with plus: "+4.00". digits: significant ones, those left of the
/// point are all shown.
std::string report_number(double value, bool plus = false, int digits = 3);

}  // namespace naturel
