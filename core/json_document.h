#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace naturel {

enum class JsonKind : std::uint8_t { null, boolean, number, text, list, object };

class JsonDocument;
struct JsonMember;

/// One value of a document, which must outlive it. Cheap to copy.
class JsonValue {
public:
    JsonValue(const JsonDocument& document, std::uint32_t node) : document_(&document), node_(node) {}

    JsonKind kind() const;
    bool boolean() const;                     ///< of a boolean
    double number() const;                    ///< of a number; finite
    const std::string& text() const;          ///< of a text; UTF-8
    std::vector<JsonValue> items() const;     ///< of a list
    std::vector<JsonMember> members() const;  ///< of an object, in file order; each key once

    /// For messages: `text "abc"`, `the number 1.50`, `a list`, ...
    std::string describe() const;

    /// Throws InputError "file:line:column: /json/path: text" for this value.
    [[noreturn]] void refuse(const std::string& text) const;

private:
    const JsonDocument* document_;
    std::uint32_t node_;
};

struct JsonMember {
    JsonValue key;  ///< a text; refuse() points at the key itself
    JsonValue value;
};

/// A JSON text with // and /* */ comments, in which every key and value knows where it stands.
/// nlohmann::json checks and converts; lines and columns (of characters, from 1) come from the text itself.
class JsonDocument {
public:
    static constexpr std::size_t max_bytes = std::size_t{64} << 20;
    static constexpr std::size_t max_depth = 64;

    /// Throws InputError if the text is not UTF-8, not JSON, has a key twice in an object, a number that
    /// overflows, is nested deeper than max_depth or longer than max_bytes. file_name appears in messages, and kind in that of a text
    /// without anything.
    JsonDocument(std::string text, std::string file_name, std::string kind = "scene");

    JsonValue root() const { return {*this, 0}; }
    const std::string& file_name() const { return file_name_; }

private:
    friend class JsonValue;
    class Events;

    /// Nodes stand in the order of the text; the children of a node follow it. In an object a key node
    /// precedes each value node.
    struct Node {
        double number = 0.0;
        std::uint32_t offset = 0;  ///< of its first character in text_
        std::uint32_t end = 0;     ///< one past its last descendant; 0 while that is not known
        std::uint32_t text = 0;    ///< into strings_
        JsonKind kind = JsonKind::null;
    };

    std::string path_to(std::uint32_t node) const;
    std::string position(std::size_t offset) const;  // "file:line:column"
    std::uint32_t next_sibling(std::uint32_t node) const;

    std::string text_;
    std::string file_name_, kind_;
    std::vector<Node> nodes_;
    std::vector<std::string> strings_;
};

/// A user's text between quotes, fit for one line of a message: control characters replaced, cut when long.
std::string in_quotes(std::string_view text);

}  // namespace naturel
