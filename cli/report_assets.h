#pragma once
#include <string_view>

// Text files that are built into the program (cli/CMakeLists.txt).
namespace naturel {

extern const std::string_view page_style;         ///< cli/page.css
extern const std::string_view page_script;        ///< cli/page.js
extern const std::string_view report_page;        ///< cli/report.html
extern const std::string_view report_style;       ///< cli/report.css
extern const std::string_view report_surfaces;    ///< cli/report_surfaces.js
extern const std::string_view report_sensors;     ///< cli/report_sensors.js
extern const std::string_view report_script;      ///< cli/report.js
extern const std::string_view timing_page;        ///< cli/timing_report.html
extern const std::string_view timing_script;      ///< cli/timing_report.js
extern const std::string_view comparison_page;    ///< cli/comparison_report.html
extern const std::string_view comparison_script;  ///< cli/comparison_report.js
extern const std::string_view chart_script;       ///< Chart.js
extern const std::string_view chart_licence;      ///< what Debian says of its copyright
extern const std::string_view three_script;       ///< three.js
extern const std::string_view orbit_script;       ///< its OrbitControls
extern const std::string_view three_licence;      ///< what Debian says of its copyright

}  // namespace naturel
