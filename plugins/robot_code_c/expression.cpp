// SPDX-License-Identifier: Apache-2.0
#include "expression.h"

#include <bit>
#include <cmath>
#include <utility>

namespace robomosp::robot_code {
namespace {

double apply(Operation f, double x) {
  switch (f) {
    case Operation::sine: return std::sin(x);
    case Operation::cosine: return std::cos(x);
    default: return std::sqrt(x);
  }
}

}  // namespace

std::size_t Graph::Hash::operator()(const NodeData& n) const {
  std::uint64_t h = std::bit_cast<std::uint64_t>(n.value) * 0x9e3779b97f4a7c15ULL;
  h ^= (static_cast<std::uint64_t>(n.a) << 32 | n.b) * 0xbf58476d1ce4e5b9ULL;
  h ^= static_cast<std::uint64_t>(n.operation) * 0x94d049bb133111ebULL;
  return static_cast<std::size_t>(h ^ (h >> 29));
}
bool Graph::Equal::operator()(const NodeData& x, const NodeData& y) const {
  return x.operation == y.operation && x.a == y.a && x.b == y.b && x.value == y.value;
}

Node Graph::keep(const NodeData& n) {
  const auto [at, is_new] = known_.emplace(n, static_cast<Node>(nodes_.size()));
  if (is_new) nodes_.push_back(n);
  return at->second;
}

Node Graph::constant(double value) {
  return keep({Operation::constant, 0, 0, value == 0 ? 0.0 : value});  // no -0
}
Node Graph::input(std::uint32_t array, std::uint32_t element) {
  return keep({Operation::input, array, element, 0});
}

Node Graph::add(Node a, Node b) {
  const NodeData x = nodes_[a], y = nodes_[b];
  if (is(a, Operation::constant) && is(b, Operation::constant)) return constant(x.value + y.value);
  if (is_constant(a, 0)) return b;
  if (is_constant(b, 0)) return a;
  if (is(a, Operation::negate) && is(b, Operation::negate)) return negate(add(x.a, y.a));
  if (is(b, Operation::negate)) return subtract(a, y.a);
  if (is(a, Operation::negate)) return subtract(b, x.a);
  if (a > b) std::swap(a, b);
  return keep({Operation::add, a, b, 0});
}

Node Graph::subtract(Node a, Node b) {
  const NodeData x = nodes_[a], y = nodes_[b];
  if (is(a, Operation::constant) && is(b, Operation::constant)) return constant(x.value - y.value);
  if (is_constant(b, 0)) return a;
  if (is_constant(a, 0)) return negate(b);
  if (a == b) return constant(0);
  if (is(b, Operation::negate)) return add(a, y.a);
  if (is(a, Operation::negate)) return negate(add(x.a, b));
  return keep({Operation::subtract, a, b, 0});
}

Node Graph::multiply(Node a, Node b) {
  if (is(b, Operation::constant)) std::swap(a, b);
  const NodeData x = nodes_[a], y = nodes_[b];
  if (is(a, Operation::constant)) {
    if (is(b, Operation::constant)) return constant(x.value * y.value);
    if (x.value == 0) return a;
    if (x.value == 1) return b;
    if (x.value < 0) return negate(multiply(constant(-x.value), b));
    if (is(b, Operation::negate)) return negate(multiply(a, y.a));
    if (is(b, Operation::multiply) && is(y.a, Operation::constant))
      return multiply(constant(x.value * nodes_[y.a].value), y.b);
    return keep({Operation::multiply, a, b, 0});
  }
  if (is(a, Operation::negate) && is(b, Operation::negate)) return multiply(x.a, y.a);
  if (is(a, Operation::negate)) return negate(multiply(x.a, b));
  if (is(b, Operation::negate)) return negate(multiply(a, y.a));
  if (a > b) std::swap(a, b);
  return keep({Operation::multiply, a, b, 0});
}

Node Graph::divide(Node a, Node b) {
  const NodeData x = nodes_[a], y = nodes_[b];
  if (is(b, Operation::constant)) return multiply(constant(1 / y.value), a);
  if (is_constant(a, 0)) return a;
  if (is(a, Operation::negate)) return negate(divide(x.a, b));
  if (is(b, Operation::negate)) return negate(divide(a, y.a));
  return keep({Operation::divide, a, b, 0});
}

Node Graph::negate(Node a) {
  const NodeData x = nodes_[a];
  if (is(a, Operation::constant)) return constant(-x.value);
  if (is(a, Operation::negate)) return x.a;
  if (is(a, Operation::subtract)) return subtract(x.b, x.a);
  return keep({Operation::negate, a, 0, 0});
}

Node Graph::function(Operation f, Node a) {
  const NodeData x = nodes_[a];
  if (is(a, Operation::constant)) return constant(apply(f, x.value));
  if (is(a, Operation::negate) && f == Operation::sine) return negate(function(f, x.a));
  if (is(a, Operation::negate) && f == Operation::cosine) return function(f, x.a);
  return keep({f, a, 0, 0});
}

Node Graph::select(Node a, Node b) {
  if (is_constant(b, 0)) return b;
  return keep({Operation::select, a, b, 0});
}

std::vector<double> Graph::evaluate(std::span<const std::span<const double>> inputs,
                                    std::span<const Node> outputs) const {
  std::vector<double> v(nodes_.size());
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const NodeData& n = nodes_[i];
    switch (n.operation) {
      case Operation::constant: v[i] = n.value; break;
      case Operation::input: v[i] = n.a < inputs.size() ? inputs[n.a][n.b] : 0; break;
      case Operation::add: v[i] = v[n.a] + v[n.b]; break;
      case Operation::subtract: v[i] = v[n.a] - v[n.b]; break;
      case Operation::multiply: v[i] = v[n.a] * v[n.b]; break;
      case Operation::divide: v[i] = v[n.a] / v[n.b]; break;
      case Operation::negate: v[i] = -v[n.a]; break;
      case Operation::sine:
      case Operation::cosine:
      case Operation::square_root: v[i] = apply(n.operation, v[n.a]); break;
      case Operation::select: v[i] = v[n.a] > 0 ? v[n.b] : 0; break;
    }
  }
  std::vector<double> out;
  out.reserve(outputs.size());
  for (const Node n : outputs) out.push_back(v[n]);
  return out;
}

Number Number::both(const Number& x, const Number& y, Node (Graph::*f)(Node, Node)) {
  if (Graph* g = x.graph_ ? x.graph_ : y.graph_) return {*g, (g->*f)(x.in(*g), y.in(*g))};
  if (f == &Graph::add) return x.value_ + y.value_;
  if (f == &Graph::subtract) return x.value_ - y.value_;
  return f == &Graph::multiply ? x.value_ * y.value_ : x.value_ / y.value_;
}

Number Number::function(Operation f) const {
  return graph_ ? Number(*graph_, graph_->function(f, node_)) : Number(apply(f, value_));
}

}  // namespace robomosp::robot_code
