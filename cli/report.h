#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "cli/surface_mesh.h"

namespace naturel {

/// A picture that the report shows.
struct ReportPicture {
    std::string view;
    std::string file;  ///< relative to the folder of results
    std::string png;   ///< its bytes
};

/// A page that shows a result in any browser: HTML with data, pictures and scripts in one file that loads nothing.
/// summary: text of summary.json. sensors: bytes of sensors.csv, which the page reads and hands out as they are.
std::string report_html(const Result& result, const SurfaceMesh& mesh, std::string_view summary, std::string_view sensors,
                        const std::vector<ReportPicture>& pictures);

}  // namespace naturel
