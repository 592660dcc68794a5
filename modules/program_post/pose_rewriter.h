// SPDX-License-Identifier: Apache-2.0
// Rows for passes that write poses into motions (layer: data processing, program_post).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <robomosp/sdk/post_writer.h>
#include <robomosp/sdk/types.h>

#include "program_post/rewriter.h"

namespace robomosp::program_post {

/// A rewriter that also makes expressions of poses, of the program's types POSITION, ORIENTATION
/// and POSE.
class PoseRewriter : public Rewriter {
 public:
  explicit PoseRewriter(ProgramTables& tables) : Rewriter(tables) {
    for (std::uint32_t i = 0; i < t_.types.size(); ++i) {
      if (t_.types[i].role == RMP_ROLE_POSITION) position_ = i;
      if (t_.types[i].role == RMP_ROLE_ORIENTATION) orientation_ = i;
      if (t_.types[i].role == RMP_ROLE_POSE) pose_ = i;
    }
  }

 protected:
  /// Whether the program has these types; pose() and composed() need them.
  [[nodiscard]] bool has_poses() const {
    return position_ != RMP_NONE && orientation_ != RMP_NONE && pose_ != RMP_NONE;
  }
  /// POSE(POSITION(x, y, z), ORIQUAT(w, x, y, z)) of a pose in m; lengths of programs are in mm.
  std::uint32_t pose(const Pose& p, const rmp_span& span) {
    const auto q = post::quaternion(p.R);
    const std::array<std::uint32_t, 3> xyz{real(p.p[0] * 1000, span), real(p.p[1] * 1000, span),
                                           real(p.p[2] * 1000, span)};
    const std::array<std::uint32_t, 4> wxyz{real(q[0], span), real(q[1], span), real(q[2], span),
                                            real(q[3], span)};
    const std::uint32_t place =
        expression(RMP_EXPR_MAKE, position_, span, std::span<const std::uint32_t>(xyz));
    const std::uint32_t turn =
        expression(RMP_EXPR_MAKE, orientation_, span, std::span<const std::uint32_t>(wxyz));
    return expression(RMP_EXPR_MAKE, pose_, span, {place, turn});
  }
  /// The FRAME of an attribute as seen through `frame`: their product.
  std::uint32_t composed(const Pose& frame, const rmp_code_attribute& a) {
    return expression(RMP_EXPR_COMPOSE, pose_, a.span, {pose(frame, a.span), a.value});
  }
  [[nodiscard]] std::uint32_t role_of_target(const rmp_code_motion& m, std::uint32_t k) const {
    return t_.types[ex(t_.links[m.first_target + k]).type].role;
  }
  /// Whether a target of the motion is a place of the tool, rather than joint values.
  [[nodiscard]] bool has_places(const rmp_code_motion& m) const {
    for (std::uint32_t k = 0; k < m.target_count; ++k)
      if (const std::uint32_t role = role_of_target(m, k);
          role != RMP_ROLE_JOINT && role != RMP_ROLE_MAIN_JOINT && role != RMP_ROLE_ADD_JOINT)
        return true;
    return false;
  }
  /// Replaces the attributes of a motion by those that `see(attribute)` keeps: it may change each,
  /// and returns false for one to leave out. `more()` then appends others to t_.attributes.
  template <class See, class More>
  void rewrite_attributes(std::uint32_t motion, See&& see, More&& more) {
    const rmp_code_motion m = t_.motions[motion];
    const auto begin = static_cast<std::uint32_t>(t_.attributes.size());
    for (std::uint32_t k = 0; k < m.attribute_count; ++k) {
      rmp_code_attribute a = t_.attributes[m.first_attribute + k];
      if (see(a)) t_.attributes.push_back(a);
    }
    more();
    t_.motions[motion].first_attribute = begin;
    t_.motions[motion].attribute_count = static_cast<std::uint32_t>(t_.attributes.size()) - begin;
  }

 private:
  std::uint32_t position_ = RMP_NONE, orientation_ = RMP_NONE, pose_ = RMP_NONE;
};

}  // namespace robomosp::program_post
