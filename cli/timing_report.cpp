#include "cli/timing_report.h"

#include <nlohmann/json.hpp>

#include "cli/page_template.h"
#include "cli/report_assets.h"
#include "cli/svg_sheet.h"

namespace naturel {

std::string timing_report(const nlohmann::ordered_json& timing) {
    const std::string scene = xml_text(timing.at("scene").at("file").get<std::string>());
    const std::string title = scene + " · naturel timing", data = script_text(timing);
    return fill_template(timing_page, {{"TITLE", title},
                                       {"SCENE", scene},
                                       {"DATA", data},
                                       {"STYLE", page_style},
                                       {"CHART_LICENCE", chart_licence},
                                       {"CHART", chart_script},
                                       {"PAGE", page_script},
                                       {"SCRIPT", timing_script}});
}

}  // namespace naturel
