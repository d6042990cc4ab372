#pragma once
#include <vector>

namespace naturel {

/// Nodes and weights for integrals over [0, 1]: sum of weights[k] f(nodes[k]).
struct QuadratureRule {
    std::vector<double> nodes;  ///< increasing, inside (0, 1)
    std::vector<double> weights;
};

/// The rule of `count` nodes that is exact for polynomials up to degree 2 count - 1.
QuadratureRule gauss_legendre(int count);

}  // namespace naturel
