#pragma once
#include <stdexcept>
#include <string>

namespace naturel {

/// Bad input: a scene, an option or a file that the user can correct. Thrown where it is read; exit code 3.
/// where: "room.json:12:7: /apertures/0/vertices" or a file or option name; may be empty.
/// text: what is wrong, why, and what would be right.
struct InputError : std::runtime_error {
    InputError(const std::string& where, const std::string& text)
        : std::runtime_error(where.empty() ? text : where + ": " + text) {}
};

/// The user pressed Ctrl-C (or the process was asked to end); exit code 130.
struct Interrupted : std::runtime_error {
    Interrupted() : std::runtime_error("interrupted") {}
};

[[noreturn]] void report_broken_expectation(const char* expression, const char* file, int line);

}  // namespace naturel

/// A precondition that only a bug in naturel can break. Checked in debug and sanitizer builds.
#ifdef NDEBUG
#define NATUREL_EXPECT(condition) static_cast<void>(0)
#else
#define NATUREL_EXPECT(condition) \
    ((condition) ? static_cast<void>(0) : ::naturel::report_broken_expectation(#condition, __FILE__, __LINE__))
#endif
