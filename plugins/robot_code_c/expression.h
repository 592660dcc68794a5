// SPDX-License-Identifier: Apache-2.0
// Arithmetic that is written down instead of carried out: a graph of operations in which equal
// ones are one and constants are folded (layer: plugin).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace robomosp::robot_code {

using Node = std::uint32_t;

enum class Operation : std::uint8_t {
  constant,  ///< value
  input,     ///< element `b` of input array `a`
  add,
  subtract,
  multiply,
  divide,
  negate,
  sine,
  cosine,
  square_root,
  select,  ///< b where a > 0, else 0
};

/// Neither a constant nor an input.
[[nodiscard]] constexpr bool is_operation(Operation o) {
  return o != Operation::constant && o != Operation::input;
}
/// Uses both operands.
[[nodiscard]] constexpr bool is_binary(Operation o) {
  return o == Operation::add || o == Operation::subtract || o == Operation::multiply ||
         o == Operation::divide || o == Operation::select;
}

struct NodeData {
  Operation operation = Operation::constant;
  Node a = 0, b = 0;
  double value = 0;
};

/// Operands come before the operations that use them.
class Graph {
 public:
  Node constant(double value);
  Node input(std::uint32_t array, std::uint32_t element);
  Node add(Node a, Node b);
  Node subtract(Node a, Node b);
  Node multiply(Node a, Node b);
  Node divide(Node a, Node b);
  Node negate(Node a);
  Node function(Operation f, Node a);  ///< sine, cosine or square_root
  Node select(Node a, Node b);

  [[nodiscard]] const NodeData& operator[](Node n) const { return nodes_[n]; }
  [[nodiscard]] std::size_t size() const { return nodes_.size(); }
  /// Values of the outputs for given inputs, computed as written.
  [[nodiscard]] std::vector<double> evaluate(std::span<const std::span<const double>> inputs,
                                             std::span<const Node> outputs) const;

 private:
  struct Hash {
    std::size_t operator()(const NodeData& n) const;
  };
  struct Equal {
    bool operator()(const NodeData& x, const NodeData& y) const;
  };
  Node keep(const NodeData& n);
  [[nodiscard]] bool is(Node n, Operation o) const { return nodes_[n].operation == o; }
  [[nodiscard]] bool is_constant(Node n, double v) const {
    return is(n, Operation::constant) && nodes_[n].value == v;
  }
  std::vector<NodeData> nodes_;
  std::unordered_map<NodeData, Node, Hash, Equal> known_;
};

/// A number of a graph, or a plain one that belongs to none yet.
class Number {
 public:
  Number() = default;
  Number(double value) : value_(value) {}  // NOLINT: numbers convert
  Number(Graph& graph, Node node) : graph_(&graph), node_(node) {}
  /// Its node in the graph.
  [[nodiscard]] Node in(Graph& graph) const { return graph_ ? node_ : graph.constant(value_); }

  friend Number operator+(const Number& x, const Number& y) { return both(x, y, &Graph::add); }
  friend Number operator-(const Number& x, const Number& y) { return both(x, y, &Graph::subtract); }
  friend Number operator*(const Number& x, const Number& y) { return both(x, y, &Graph::multiply); }
  friend Number operator/(const Number& x, const Number& y) { return both(x, y, &Graph::divide); }
  friend Number operator-(const Number& x) {
    return x.graph_ ? Number(*x.graph_, x.graph_->negate(x.node_)) : Number(0.0 - x.value_);
  }
  Number& operator+=(const Number& x) { return *this = *this + x; }
  Number& operator-=(const Number& x) { return *this = *this - x; }
  [[nodiscard]] Number sine() const { return function(Operation::sine); }
  [[nodiscard]] Number cosine() const { return function(Operation::cosine); }
  [[nodiscard]] Number square_root() const { return function(Operation::square_root); }
  /// `value` where this is above 0, else 0. Not for plain numbers.
  [[nodiscard]] Number if_positive(double value) const {
    return {*graph_, graph_->select(node_, graph_->constant(value))};
  }

 private:
  static Number both(const Number& x, const Number& y, Node (Graph::*f)(Node, Node));
  [[nodiscard]] Number function(Operation f) const;
  Graph* graph_ = nullptr;
  Node node_ = 0;
  double value_ = 0;
};

}  // namespace robomosp::robot_code
