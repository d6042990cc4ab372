#include "core/errors.h"

#include <cstdio>
#include <cstdlib>

namespace naturel {

void report_broken_expectation(const char* expression, const char* file, int line) {
    std::fprintf(stderr, "naturel: internal fault: expected %s at %s:%d\n", expression, file, line);
    std::abort();
}

}  // namespace naturel
