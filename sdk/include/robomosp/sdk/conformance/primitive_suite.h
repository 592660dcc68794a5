// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.primitive/1 (layer: contract helper for tests, GoogleTest,
// header-only): trees are well formed, equal for equal parameters, and no value in a parameter's
// range makes anything but a tree or an error. Include it in one file of a test program and
// instantiate PrimitiveConformance with PrimitiveSubject values.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/csg_primitive.h>

namespace robomosp::conformance {

struct PrimitiveSubject {
  std::string file, name;
};
inline void PrintTo(const PrimitiveSubject& s, std::ostream* os) { *os << s.name; }

/// A sentence about what is wrong with a tree, or "".
[[nodiscard]] inline std::string fault_of(const CsgTree& tree) {
  if (tree.nodes.empty()) return "the tree is empty";
  std::vector<std::size_t> children(tree.nodes.size(), 0);
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const CsgNode& n = tree.nodes[i];
    const std::string node = "node " + std::to_string(i);
    const CsgNodeInfo& info = csg_info(n.kind);
    if (info.kind != n.kind) return node + " is of no known kind";
    if (n.kind == CsgKind::custom) return node + " is custom; engines do not know that kind";
    if (i == 0 ? n.parent != -1 : n.parent < 0 || static_cast<std::size_t>(n.parent) >= i)
      return node + " does not come after its parent";
    if (i > 0) {
      const auto parent = static_cast<std::size_t>(n.parent);
      if (csg_info(tree.nodes[parent].kind).children == CsgChildren::none)
        return node + " is inside a primitive";
      ++children[parent];
    }
    for (const double v : n.placement.R)
      if (!std::isfinite(v)) return node + " has a placement that is not finite";
    for (const double v : n.placement.p)
      if (!std::isfinite(v)) return node + " has a placement that is not finite";
    for (std::size_t k = 0; k < csg_size_count(n.kind); ++k) {
      const double size = n.sizes[k];
      const CsgRange range = info.sizes[k].range;
      if (!std::isfinite(size) || (range == CsgRange::positive && size <= 0) ||
          (range == CsgRange::not_negative && size < 0) ||
          (range == CsgRange::count && (size < 1 || size != std::floor(size))))
        return node + " has a bad " + std::string(info.sizes[k].name);
    }
    const bool has_profile = n.kind == CsgKind::prism || n.kind == CsgKind::revolution;
    if (has_profile != (n.profile != nullptr)) return node + " has a profile too many or too few";
    if ((n.kind == CsgKind::imported) != (n.geometry != nullptr))
      return node + " has a geometry too many or too few";
    if (!n.profile) continue;
    for (const CsgLoop& loop : n.profile->loops)
      for (const CsgCurve& c : loop.curves) {
        const std::size_t needed = c.kind == CsgCurve::Kind::arc      ? 2
                                   : c.kind == CsgCurve::Kind::circle ? 2
                                                                      : 1;
        if (c.kind == CsgCurve::Kind::spline ? c.points.empty() : c.points.size() != needed)
          return node + " has a curve with the wrong number of points";
        for (const auto& p : c.points)
          if (!std::isfinite(p[0]) || !std::isfinite(p[1]))
            return node + " has a profile that is not finite";
      }
  }
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const CsgChildren allowed = csg_info(tree.nodes[i].kind).children;
    if ((allowed == CsgChildren::one && children[i] != 1) ||
        (allowed == CsgChildren::any && children[i] == 0))
      return "node " + std::to_string(i) + " has the wrong number of children";
  }
  return {};
}

[[nodiscard]] inline bool equal(const CsgTree& a, const CsgTree& b) {
  if (a.nodes.size() != b.nodes.size()) return false;
  for (std::size_t i = 0; i < a.nodes.size(); ++i) {
    const CsgNode &x = a.nodes[i], &y = b.nodes[i];
    if (x.kind != y.kind || x.parent != y.parent || x.placement.R != y.placement.R ||
        x.placement.p != y.placement.p || x.sizes != y.sizes || x.name != y.name ||
        x.select != y.select || (x.profile == nullptr) != (y.profile == nullptr) ||
        (x.profile && !(*x.profile == *y.profile)))
      return false;
  }
  return true;
}

class PrimitiveConformance : public testing::TestWithParam<PrimitiveSubject> {
 protected:
  void SetUp() override {
    auto found = find_provider<CsgPrimitive>(GetParam().file, GetParam().name);
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    provider_ = *found;
    primitive_ = create<CsgPrimitive>(*provider_);
    ASSERT_NE(primitive_, nullptr);
  }
  Result<CsgTree> build(const Params& params) const {
    NoProgress progress;
    return primitive_->build(params, progress);
  }
  const rmp_provider* provider_ = nullptr;
  std::unique_ptr<CsgPrimitive> primitive_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(PrimitiveConformance);

TEST_P(PrimitiveConformance, ItsDefaultsMakeAWellFormedTree) {
  for (std::uint32_t i = 0; i < provider_->param_count; ++i) {
    const rmp_param p = rmp_param_at(*provider_, i);
    EXPECT_TRUE(p.default_text || (p.flags & RMP_OPTIONAL))
        << "parameter " << p.name << " needs a default to be tried out";
  }
  const auto tree = build(TableParams(*provider_));
  ASSERT_TRUE(tree.ok()) << tree.error().sentence();
  EXPECT_EQ(fault_of(*tree), "");
}

TEST_P(PrimitiveConformance, EqualParametersMakeEqualTrees) {
  const auto first = build(TableParams(*provider_)), again = build(TableParams(*provider_));
  ASSERT_TRUE(first.ok() && again.ok());
  EXPECT_TRUE(equal(*first, *again));
}

TEST_P(PrimitiveConformance, SeveralThreadsBuildEqualTreesAtOnce) {
  const TableParams params(*provider_);
  const auto alone = build(params);
  ASSERT_TRUE(alone.ok());
  at_once(4, [&](std::size_t) {
    const auto tree = build(params);
    EXPECT_TRUE(tree.ok() && equal(*tree, *alone));
  });
}

TEST_P(PrimitiveConformance, EveryNumberOfAParametersRangeMakesATreeOrAnError) {
  for (std::uint32_t i = 0; i < provider_->param_count; ++i) {
    const rmp_param p = rmp_param_at(*provider_, i);
    const std::string type = p.type;
    if ((type != "int" && type != "real") || p.min > p.max) continue;
    for (const double part : {0.0, 0.01, 0.2, 0.5, 0.8, 1.0}) {
      double value = p.min + part * (p.max - p.min);
      if (type == "int") value = std::round(value);
      TableParams params(*provider_);
      params.set(p.name, value);
      const auto tree = build(params);
      if (tree.ok()) EXPECT_EQ(fault_of(*tree), "") << p.name << " = " << value;
      else EXPECT_NE(tree.error().message, "") << p.name << " = " << value;
    }
  }
}

}  // namespace robomosp::conformance
