// SPDX-License-Identifier: Apache-2.0
#include "program_post/cell.h"

#include <array>
#include <cmath>

#include <robomosp/sdk/post_writer.h>

#include "program_post/legalise.h"
#include "program_post/rewriter.h"

namespace robomosp::program_post {
namespace {

class InCell final : Rewriter {
 public:
  InCell(ProgramTables& t, const CellPlaces& cell) : Rewriter(t), cell_(cell) {
    for (std::uint32_t i = 0; i < t_.types.size(); ++i) {
      if (t_.types[i].role == RMP_ROLE_POSITION) position_ = i;
      if (t_.types[i].role == RMP_ROLE_ORIENTATION) orientation_ = i;
      if (t_.types[i].role == RMP_ROLE_POSE) pose_ = i;
    }
  }
  void run() {
    if (position_ == RMP_NONE || orientation_ == RMP_NONE || pose_ == RMP_NONE) return;
    for (std::uint32_t i = 0; i < t_.motions.size(); ++i) add(i);
  }

 private:
  [[nodiscard]] bool is_to_joints(const rmp_code_motion& m) const {
    for (std::uint32_t k = 0; k < m.target_count; ++k) {
      const std::uint32_t role = t_.types[ex(t_.links[m.first_target + k]).type].role;
      if (role != RMP_ROLE_JOINT && role != RMP_ROLE_MAIN_JOINT && role != RMP_ROLE_ADD_JOINT)
        return false;
    }
    return true;
  }
  void add(std::uint32_t i) {
    const rmp_code_motion m = t_.motions[i];
    const bool has_frame = cell_.frame && !is_to_joints(m);
    const auto begin = static_cast<std::uint32_t>(t_.attributes.size());
    bool is_framed = false, is_tooled = false;
    for (std::uint32_t k = 0; k < m.attribute_count; ++k) {
      rmp_code_attribute a = t_.attributes[m.first_attribute + k];
      is_tooled = is_tooled || a.attribute == RMP_ATTR_TOOL;
      if (a.attribute == RMP_ATTR_FRAME && cell_.frame) {
        is_framed = true;
        a.value =
            expression(RMP_EXPR_COMPOSE, pose_, a.span, {made(*cell_.frame, a.span), a.value});
      }
      t_.attributes.push_back(a);
    }
    if (has_frame && !is_framed)
      t_.attributes.push_back({RMP_ATTR_FRAME, made(*cell_.frame, m.span), m.span});
    if (cell_.tool && !is_tooled)
      t_.attributes.push_back({RMP_ATTR_TOOL, made(*cell_.tool, m.span), m.span});
    t_.motions[i].first_attribute = begin;
    t_.motions[i].attribute_count = static_cast<std::uint32_t>(t_.attributes.size()) - begin;
  }
  std::uint32_t made(const Pose& p, const rmp_span& span) {
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

  const CellPlaces& cell_;
  std::uint32_t position_ = RMP_NONE, orientation_ = RMP_NONE, pose_ = RMP_NONE;
};

}  // namespace

std::unique_ptr<ProgramTables> in_cell(const rmp_code& code, const CellPlaces& cell) {
  if (!cell.frame && !cell.tool) return nullptr;
  auto tables = copied_tables(code);
  InCell(*tables, cell).run();
  tables->seal();
  return tables;
}

std::optional<Pose> unless_identity(const Pose& p) {
  constexpr double kSame = 1e-9;
  double away = 0;
  for (const double x : p.p) away = std::fmax(away, std::fabs(x));
  for (std::size_t i = 0; i < 9; ++i)
    away = std::fmax(away, std::fabs(p.R[i] - (i % 4 == 0 ? 1.0 : 0.0)));
  return away < kSame ? std::nullopt : std::optional(p);
}

}  // namespace robomosp::program_post
