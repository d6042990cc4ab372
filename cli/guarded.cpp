#include "cli/guarded.h"

#include <cstdio>
#include <exception>
#include <new>

#include "core/errors.h"

namespace naturel {

ExitCode guarded(const std::function<ExitCode()>& action) {
    try {
        const ExitCode code = action();
        if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
            throw InputError("standard output", "cannot be written (disk full?)");
        return code;
    } catch (const InputError& error) {
        std::fprintf(stderr, "naturel: %s\n", error.what());
        return ExitCode::bad_input;
    } catch (const Interrupted&) {
        std::fputs("naturel: interrupted\n", stderr);
        return ExitCode::interrupted;
    } catch (const std::bad_alloc&) {
        std::fputs("naturel: out of memory (a coarser grid, smaller pictures or fewer threads need less)\n", stderr);
        return ExitCode::internal_fault;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "naturel: internal fault: %s\n", error.what());
        return ExitCode::internal_fault;
    }
}

}  // namespace naturel
