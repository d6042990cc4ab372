#include "cli/backends.h"

#include <algorithm>
#include <limits>

namespace naturel {

BackendOptions settled(BackendOptions options, const PatchGrid& grid) {
    if (options.embree.form_factors == FormFactorMethod::pairwise && grid.gather_patch_count > options.most_patches_for_pairs)
        options.embree.form_factors = FormFactorMethod::hemisphere;
    options.most_patches_for_pairs = std::numeric_limits<std::size_t>::max();  // what is settled holds for companions, too
    return options;
}

const std::vector<Backend>& all_backends() {
    static const std::vector<Backend> backends{
        {"hemicube", "",
         [](const Building& building, const PatchGrid& grid, const BackendOptions& options) {
             return make_hemicube_visibility(building, grid, options.hemicube);
         }},
#ifdef NATUREL_EMBREE_VERSION
        {"embree", "Embree " NATUREL_EMBREE_VERSION,
         [](const Building& building, const PatchGrid& grid, const BackendOptions& options) {
             return make_embree_visibility(building, grid, settled(options, grid).embree);
         }},
#endif
    };
    return backends;
}

std::string default_backend() {
    return std::string(all_backends().back().name);
}

std::vector<std::string> backend_words() {
    std::vector<std::string> words;
    for (const Backend& backend : all_backends())
        words.emplace_back(backend.name);
    if (words.size() > 1) words.emplace_back("both");
    return words;
}

std::vector<Backend> backends_named(std::string_view word) {
    if (word == "both" && all_backends().size() > 1) return all_backends();
    std::vector<Backend> found;
    std::ranges::copy_if(all_backends(), std::back_inserter(found),
                         [&](const Backend& backend) { return backend.name == word; });
    return found;
}

}  // namespace naturel
