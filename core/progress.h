#pragma once
#include <atomic>
#include <cstddef>
#include <string_view>

namespace naturel {

/// Told how far a run is, and asked whether to go on. Thread-safe.
class Progress {
public:
    virtual ~Progress() = default;

    /// A stage of `total` steps begins. Called from serial code.
    virtual void begin(std::string_view stage, std::size_t total) = 0;

    /// `steps` more of the current stage are done. Called from any thread, as often as one likes.
    virtual void advance(std::size_t steps = 1) = 0;

    /// The current stage is over.
    virtual void end() = 0;

    /// True once the user wants the program to stop.
    virtual bool interrupted() const = 0;
};

/// Says nothing and never stops.
class NoProgress final : public Progress {
public:
    void begin(std::string_view, std::size_t) override {}
    void advance(std::size_t) override {}
    void end() override {}
    bool interrupted() const override { return false; }
};

}  // namespace naturel
