#include "cli/guarded.h"

#include <cstdio>
#include <exception>
#include <new>

#include "core/errors.h"

namespace naturel {

ExitCode guarded(const std::function<ExitCode()>& action, const std::function<void(const std::string&)>& tell) {
    const auto say = [&](const std::string& text) {
        if (tell)
            tell(text);
        else
            std::fprintf(stderr, "naturel: %s\n", text.c_str());
    };
    try {
        const ExitCode code = action();
        if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
            throw InputError("standard output", "cannot be written (disk full?)");
        return code;
    } catch (const InputError& error) {
        say(error.what());
        return ExitCode::bad_input;
    } catch (const Interrupted&) {
        say("interrupted");
        return ExitCode::interrupted;
    } catch (const std::bad_alloc&) {
        say("out of memory (a coarser grid, smaller pictures or fewer threads need less)");
        return ExitCode::internal_fault;
    } catch (const std::exception& error) {
        say(std::string("internal fault: ") + error.what());
        return ExitCode::internal_fault;
    }
}

}  // namespace naturel
