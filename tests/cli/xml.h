#pragma once
#include <string>

namespace naturel::tests {

/// What is wrong with a text as XML: empty when tags nest, attributes are quoted and entities known.
std::string xml_fault(const std::string& text);

}  // namespace naturel::tests
