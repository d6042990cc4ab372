#pragma once
#include <string_view>

// Text files that are built into the program (cli/CMakeLists.txt).
namespace naturel {

extern const std::string_view page_style;         ///< cli/page.css
extern const std::string_view page_script;        ///< cli/page.js
extern const std::string_view timing_page;        ///< cli/timing_report.html
extern const std::string_view timing_script;      ///< cli/timing_report.js
extern const std::string_view comparison_page;    ///< cli/comparison_report.html
extern const std::string_view comparison_script;  ///< cli/comparison_report.js
extern const std::string_view chart_script;       ///< Chart.js
extern const std::string_view chart_licence;      ///< what Debian says of its copyright

}  // namespace naturel
