#include "core/json_document.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>

#include "core/errors.h"

namespace naturel {
namespace {

bool is_continuation(char byte) {
    return (static_cast<unsigned char>(byte) & 0xc0) == 0x80;
}

/// Offset of the first byte that is not part of well-formed UTF-8 (Unicode 15, table 3-7) or is zero; npos if
/// none.
std::size_t find_bad_byte(std::string_view text) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
    };
    for (std::size_t i = 0; i < text.size();) {
        const unsigned lead = byte(i), second = byte(i + 1);
        std::size_t length = 0;
        if (lead > 0x00 && lead < 0x80) length = 1;
        if (lead >= 0xc2 && lead <= 0xdf) length = 2;
        if (lead >= 0xe0 && lead <= 0xef) length = 3;
        if (lead >= 0xf0 && lead <= 0xf4) length = 4;
        if (length == 0) return i;
        for (std::size_t k = 1; k < length; ++k) {
            if ((byte(i + k) & 0xc0) != 0x80) return i;
        }
        const bool overlong = (lead == 0xe0 && second < 0xa0) || (lead == 0xf0 && second < 0x90);
        const bool surrogate = lead == 0xed && second > 0x9f;
        const bool beyond_unicode = lead == 0xf4 && second > 0x8f;
        if (overlong || surrogate || beyond_unicode) return i;
        i += length;
    }
    return std::string_view::npos;
}

/// The first 60 characters of a UTF-8 text, "..." appended if some are left out; control characters become
/// "?".
std::string fit_for_message(std::string_view text) {
    constexpr std::size_t longest = 60;
    std::size_t end = 0;
    for (std::size_t count = 0; end < text.size() && count < longest; ++count) {
        ++end;
        while (end < text.size() && is_continuation(text[end]))
            ++end;
    }
    std::string result(text.substr(0, end));
    for (char& c : result) {
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
    }
    return end < text.size() ? result + "..." : result;
}

/// RFC 6901: "~" and "/" of a key are written "~0" and "~1" in a path.
std::string path_part(std::string_view key) {
    std::string part;
    for (const char c : fit_for_message(key)) {
        if (c == '~') part += "~0";
        if (c == '/') part += "~1";
        if (c != '~' && c != '/') part += c;
    }
    return part;
}

}  // namespace

std::string in_quotes(std::string_view text) {
    return '"' + fit_for_message(text) + '"';
}

/// Receives nlohmann's events and follows the text in step with them, so that each event finds its place.
/// nlohmann has already checked the syntax of what it reports; the scanning here may therefore be simple.
class JsonDocument::Events {
public:
    using number_integer_t = nlohmann::json::number_integer_t;
    using number_unsigned_t = nlohmann::json::number_unsigned_t;
    using number_float_t = nlohmann::json::number_float_t;
    using string_t = nlohmann::json::string_t;
    using binary_t = nlohmann::json::binary_t;

    explicit Events(JsonDocument& document) : document_(document) {
        if (document.text_.starts_with("\xef\xbb\xbf"))
            cursor_ = 3;  // the byte order mark some editors write
    }

    bool null() { return add_scalar(JsonKind::null, 0.0); }
    bool boolean(bool value) { return add_scalar(JsonKind::boolean, value ? 1.0 : 0.0); }
    bool number_integer(number_integer_t value) {
        return add_scalar(JsonKind::number, static_cast<double>(value));
    }
    bool number_unsigned(number_unsigned_t value) {
        return add_scalar(JsonKind::number, static_cast<double>(value));
    }
    bool number_float(number_float_t value, const string_t&) { return add_scalar(JsonKind::number, value); }
    bool string(string_t& value) { return add_text(std::move(value)); }
    bool binary(binary_t&) { return false; }  // JSON texts have none

    bool key(string_t& value) {
        const bool is_new = open_.back().keys.insert(value).second;
        add_text(std::move(value));
        if (!is_new) {
            JsonValue(document_, last_node())
                .refuse("this key is already in the object (each key may stand once)");
        }
        state_ = State::after_key;
        return true;
    }

    bool start_object(std::size_t) { return open(JsonKind::object); }
    bool start_array(std::size_t) { return open(JsonKind::list); }
    bool end_object() { return close(); }
    bool end_array() { return close(); }

    bool parse_error(std::size_t, const std::string&, const nlohmann::json::exception& fault) {
        constexpr int number_overflow = 406;  // nlohmann's numbering
        if (fault.id == number_overflow) {
            const std::uint32_t node = add_node(JsonKind::number);
            JsonValue(document_, node)
                .refuse(fmt::format("the number {} is too large to be read (at most 1.8e308)",
                                    token_at(cursor_)));
        }
        const std::string expected = skip_to_fault();
        if (const std::string reason = lexical_reason(fault.what()); reason.starts_with("invalid comment")) {
            refuse(reason + " (comments are // to the end of the line, or /* */)");
        } else if (!reason.empty()) {
            refuse(fmt::format("{} ({} is expected here)", reason, expected));
        }
        if (cursor_ == document_.text_.size()) {
            refuse(fmt::format("the file ends too early ({} is expected here)", expected));
        }
        refuse(fmt::format("unexpected {} ({} is expected here)", token_at(cursor_), expected));
    }

private:
    enum class State { start, after_key, after_opening, after_value };

    struct OpenContainer {
        std::uint32_t node;
        std::set<std::string> keys;  // seen so far
    };

    std::uint32_t last_node() const { return static_cast<std::uint32_t>(document_.nodes_.size() - 1); }

    void skip_blanks_and_comments() {
        const std::string& text = document_.text_;
        for (;;) {
            cursor_ = std::min(text.find_first_not_of(" \t\r\n", cursor_), text.size());
            if (text.compare(cursor_, 2, "//") == 0) {
                cursor_ = std::min(text.find_first_of("\r\n", cursor_), text.size());
            } else if (text.compare(cursor_, 2, "/*") == 0) {
                const std::size_t end = text.find("*/", cursor_ + 2);
                if (end == std::string::npos) return;  // nlohmann reports it
                cursor_ = end + 2;
            } else {
                return;
            }
        }
    }

    bool skip(char c) {
        if (cursor_ == document_.text_.size() || document_.text_[cursor_] != c) return false;
        ++cursor_;
        skip_blanks_and_comments();
        return true;
    }

    /// Moves to the first character of the token that the next event is about.
    void next_token() {
        skip_blanks_and_comments();
        if (state_ == State::after_key) skip(':');
        if (state_ == State::after_value) skip(',');
    }

    /// Moves past a scalar.
    void skip_token() {
        const std::string& text = document_.text_;
        if (text[cursor_] != '"') {
            cursor_ = std::min(text.find_first_of(" \t\r\n,:]}/", cursor_), text.size());
            return;
        }
        for (++cursor_; text[cursor_] != '"'; ++cursor_) {
            if (text[cursor_] == '\\') ++cursor_;
        }
        ++cursor_;
    }

    std::uint32_t add_node(JsonKind kind) {
        next_token();
        document_.nodes_.push_back({.offset = static_cast<std::uint32_t>(cursor_), .kind = kind});
        return last_node();
    }

    bool add_scalar(JsonKind kind, double value) {
        const std::uint32_t node = add_node(kind);
        document_.nodes_[node].number = value;
        document_.nodes_[node].end = node + 1;
        skip_token();
        state_ = State::after_value;
        return true;
    }

    bool add_text(std::string&& value) {
        document_.strings_.push_back(std::move(value));
        add_scalar(JsonKind::text, 0.0);
        document_.nodes_.back().text = static_cast<std::uint32_t>(document_.strings_.size() - 1);
        return true;
    }

    bool open(JsonKind kind) {
        const std::uint32_t node = add_node(kind);
        if (open_.size() == max_depth) {
            JsonValue(document_, node)
                .refuse(fmt::format("nested too deep (at most {} levels are read)", max_depth));
        }
        open_.push_back({.node = node, .keys = {}});
        ++cursor_;
        state_ = State::after_opening;
        return true;
    }

    bool close() {
        skip_blanks_and_comments();
        ++cursor_;
        document_.nodes_[open_.back().node].end = last_node() + 1;
        open_.pop_back();
        state_ = State::after_value;
        return true;
    }

    bool at_closing_bracket() const {
        return cursor_ < document_.text_.size() &&
               (document_.text_[cursor_] == '}' || document_.text_[cursor_] == ']');
    }

    /// Moves to the token that does not fit and returns what would.
    std::string skip_to_fault() {
        skip_blanks_and_comments();
        if (state_ == State::start) return fmt::format("a {}, an object in {{ }},", document_.kind_);
        if (state_ == State::after_key) return skip(':') ? "a value" : "\":\"";
        if (open_.empty()) return "the end of the file";
        const bool in_object = document_.nodes_[open_.back().node].kind == JsonKind::object;
        const std::string item = in_object ? "a key in double quotes" : "a value";
        const std::string bracket = in_object ? "\"}\"" : "\"]\"";
        if (state_ == State::after_opening) return item + " or " + bracket;
        if (!skip(',')) return "\",\" or " + bracket;
        return at_closing_bracket() ? item + " or no comma before it" : item;
    }

    /// nlohmann's reason why characters do not form a token, e.g. "invalid string: missing closing quote";
    /// empty if they do, or if showing them says as much.
    static std::string lexical_reason(std::string_view what) {
        const std::size_t begin = what.find(" - invalid ");
        const std::size_t end = what.find("; last read: ");
        if (begin == std::string_view::npos || end == std::string_view::npos || end < begin) return {};
        const std::string_view reason = what.substr(begin + 3, end - begin - 3);
        return reason == "invalid literal" ? std::string() : std::string(reason);
    }

    /// The token at an offset for a message: a bracket, a text in its quotes, or a word.
    std::string token_at(std::size_t offset) const {
        const std::string_view text = std::string_view(document_.text_).substr(offset);
        if (text[0] == '"') return in_quotes(text.substr(1, text.find('"', 1) - 1));
        const std::size_t word = text.find_first_of(" \t\r\n,:[]{}\"'/");
        return in_quotes(text.substr(0, std::max<std::size_t>(word, 1)));
    }

    /// The path names the innermost object or list, and the key if its value is at fault.
    [[noreturn]] void refuse(const std::string& text) const {
        const std::uint32_t node = open_.empty()                ? 0
                                   : state_ == State::after_key ? last_node()
                                                                : open_.back().node;
        throw InputError(document_.position(cursor_) + ": " + document_.path_to(node), text);
    }

    JsonDocument& document_;
    std::vector<OpenContainer> open_;
    std::size_t cursor_ = 0;  // offset behind the last token
    State state_ = State::start;
};

JsonDocument::JsonDocument(std::string text, std::string file_name, std::string kind)
    : text_(std::move(text)), file_name_(std::move(file_name)), kind_(std::move(kind)) {
    if (text_.size() > max_bytes) {
        throw InputError(file_name_,
                         fmt::format("the file is too large (at most {} bytes are read)", max_bytes));
    }
    if (const std::size_t bad = find_bad_byte(text_); bad != std::string::npos) {
        throw InputError(position(bad) + ": /",
                         fmt::format("byte 0x{:02x} is not text in UTF-8 (save the file as UTF-8)",
                                     static_cast<unsigned char>(text_[bad])));
    }
    Events events(*this);
    constexpr bool strict = true, ignore_comments = true;
    nlohmann::json::sax_parse(text_, &events, nlohmann::json::input_format_t::json, strict, ignore_comments);
}

/// A JSON pointer (RFC 6901), but "/" for the whole document.
std::string JsonDocument::path_to(std::uint32_t node) const {
    std::string path;
    for (std::uint32_t container = 0; container < node;) {
        const bool is_object = nodes_[container].kind == JsonKind::object;
        std::uint32_t child = container + 1;
        for (std::size_t i = 0;; ++i) {
            const std::uint32_t value = is_object ? child + 1 : child;
            const bool last = value >= nodes_.size() || nodes_[value].end == 0 || nodes_[value].end > node;
            if (!last) {
                child = nodes_[value].end;
                continue;
            }
            path += '/' + (is_object ? path_part(strings_[nodes_[child].text]) : std::to_string(i));
            if (child == node) return path;  // a key stands for its member
            container = value;
            break;
        }
    }
    return path.empty() ? "/" : path;
}

std::string JsonDocument::position(std::size_t offset) const {
    std::size_t line = 1, line_begin = text_.starts_with("\xef\xbb\xbf") ? 3 : 0;
    for (std::size_t i = 0; i < offset; ++i) {
        const bool lone_return = text_[i] == '\r' && (i + 1 == text_.size() || text_[i + 1] != '\n');
        if (text_[i] == '\n' || lone_return) ++line, line_begin = i + 1;
    }
    std::size_t column = 1;
    for (std::size_t i = line_begin; i < offset; ++i)
        column += !is_continuation(text_[i]);
    return fmt::format("{}:{}:{}", file_name_, line, column);
}

std::uint32_t JsonDocument::next_sibling(std::uint32_t node) const {
    return nodes_[node].end;
}

JsonKind JsonValue::kind() const {
    return document_->nodes_[node_].kind;
}

bool JsonValue::boolean() const {
    NATUREL_EXPECT(kind() == JsonKind::boolean);
    return document_->nodes_[node_].number != 0.0;
}

double JsonValue::number() const {
    NATUREL_EXPECT(kind() == JsonKind::number);
    return document_->nodes_[node_].number;
}

const std::string& JsonValue::text() const {
    NATUREL_EXPECT(kind() == JsonKind::text);
    return document_->strings_[document_->nodes_[node_].text];
}

std::vector<JsonValue> JsonValue::items() const {
    NATUREL_EXPECT(kind() == JsonKind::list);
    std::vector<JsonValue> items;
    for (std::uint32_t i = node_ + 1; i < document_->nodes_[node_].end; i = document_->next_sibling(i)) {
        items.emplace_back(*document_, i);
    }
    return items;
}

std::vector<JsonMember> JsonValue::members() const {
    NATUREL_EXPECT(kind() == JsonKind::object);
    std::vector<JsonMember> members;
    for (std::uint32_t i = node_ + 1; i < document_->nodes_[node_].end; i = document_->next_sibling(i + 1)) {
        members.push_back({JsonValue(*document_, i), JsonValue(*document_, i + 1)});
    }
    return members;
}

std::string JsonValue::describe() const {
    switch (kind()) {
        case JsonKind::null:
            return "null";
        case JsonKind::boolean:
            return boolean() ? "true" : "false";
        case JsonKind::number:
            return fmt::format("the number {}", number());
        case JsonKind::text:
            return "the text " + in_quotes(text());
        case JsonKind::list:
            return "a list";
        case JsonKind::object:
            break;
    }
    return "an object";
}

void JsonValue::refuse(const std::string& text) const {
    throw InputError(document_->position(document_->nodes_[node_].offset) + ": " + document_->path_to(node_),
                     text);
}

}  // namespace naturel
