#pragma once
#include "cli/options.h"
#include "core/progress.h"

namespace naturel {

/// `naturel formfactors`: computes the form factors of a scene, writes them and prints how well they fulfil closure and
/// reciprocity.
void write_form_factors(const FormFactorsOptions& options, Progress& progress);

}  // namespace naturel
