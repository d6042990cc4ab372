#include "cli/build_description.h"

#include <fmt/core.h>
#include <tbb/version.h>

#include "cli/backends.h"

namespace naturel {

std::vector<std::pair<std::string, std::string>> build_description() {
    std::vector<std::pair<std::string, std::string>> list{{"naturel", NATUREL_VERSION},
#ifdef __clang__
                                                          {"compiler", __VERSION__},
#else
                                                          {"compiler", "gcc " __VERSION__},
#endif
                                                          {"flags", NATUREL_FLAGS},
                                                          {"TBB", TBB_runtime_version()},
                                                          {"OpenImageIO", NATUREL_OPENIMAGEIO_VERSION}};
    for (const Backend& backend : all_backends())
        if (!backend.library.empty()) list.emplace_back(backend.name, backend.library);
    return list;
}

}  // namespace naturel
