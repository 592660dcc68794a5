// SPDX-License-Identifier: Apache-2.0
#include "program_post/carriage.h"

#include <cmath>
#include <cstdint>
#include <optional>

#include <robomosp/sdk/post_writer.h>
#include <robomosp/sdk/program_turns.h>

#include "kernel/text.h"
#include "program_post/cell.h"
#include "program_post/legalise.h"
#include "program_post/pose_rewriter.h"
#include "spatial/identity.h"

namespace robomosp::program_post {
namespace {

class ForRail final : PoseRewriter {
 public:
  ForRail(ProgramTables& t, const rmp_code& code, const Carrier& carrier, const KnownPoints& known,
          RailKind kind, const PostCapabilities& caps, std::vector<Remark>& remarks)
      : PoseRewriter(t),
        carrier_(carrier),
        known_(known),
        kind_(kind),
        caps_(caps),
        remarks_(remarks),
        is_controllers_(counts_maker_axes(code)) {}
  void run() {
    if (!has_poses()) return;
    for (std::uint32_t i = 0; i < t_.motions.size() && i < known_.motions.size(); ++i) one(i);
  }

 private:
  [[nodiscard]] bool gives_additional(const rmp_code_motion& m) const {
    for (std::uint32_t k = 0; k < m.target_count; ++k)
      if (const auto r = role_of_target(m, k);
          r == RMP_ROLE_JOINT || r == RMP_ROLE_ROBTARGET || r == RMP_ROLE_ADD_JOINT)
        return true;
    return false;
  }
  /// ADAX_CONTROL, where it is a number; -1 = it is computed.
  [[nodiscard]] std::int64_t control(const rmp_code_motion& m) const {
    std::int64_t out = 0;
    for (std::uint32_t k = 0; k < m.attribute_count; ++k) {
      const rmp_code_attribute& a = t_.attributes[m.first_attribute + k];
      if (a.attribute != RMP_ATTR_ADAX_CONTROL) continue;
      out = is_known(a.value) ? t_.constants[ex(a.value).constant].integer : -1;
    }
    return out;
  }
  /// Whether a joint that carries the arm moves; those of positioners count where none can move.
  [[nodiscard]] bool moves_rail(const CarriedMotion& c) const {
    for (const CarriedAxis& a : carrier_.axes)
      if ((a.rail >= 0 || kind_ == RailKind::none) && c.from && c.to &&
          (*c.from)[a.number - 1] != (*c.to)[a.number - 1])
        return true;
    return false;
  }
  void tell(std::uint32_t severity, const rmp_span& at, std::string message, std::string hint) {
    remarks_.push_back({severity, at, std::move(message), std::move(hint)});
  }

  void one(std::uint32_t i) {
    const rmp_code_motion m = t_.motions[i];
    const CarriedMotion& c = known_.motions[i];
    const bool is_path = m.interpolation != RMP_MOVE_PTP;
    const std::int64_t how = control(m);
    const bool moves = moves_rail(c) || (c.to && !c.from && gives_additional(m));
    const bool lacks_curve =
        (m.interpolation == RMP_MOVE_CIRCLE && (caps_.motions & kPostCircle) == 0) ||
        (m.interpolation == RMP_MOVE_PATH && (caps_.motions & kPostPath) == 0);
    if (lacks_curve && moves && kind_ != RailKind::none)
      tell(RMP_FAULT_ERROR, m.span,
           "additional joints that carry the robot move within this motion, which " +
               std::string(caps_.title) + " writes as straight pieces",
           "Move them before by a MOVE of their own, or write the pieces as MOVE LIN.");
    if (kind_ == RailKind::base) {
      if (how == kKeep) take_out_control(i);
      else if (how == 0 && is_path && moves && !is_controllers_)
        tell(RMP_FAULT_WARNING, m.span,
             "the rail moves with this motion: in the run the tool's path is straight as seen from "
             "the carriage, at the controller as seen from the base",
             "ADAX_CONTROL := TCP_KEEP runs it as the controller does.");
      return;
    }
    if (kind_ == RailKind::none && (moves || (!c.to && gives_additional(m)))) {
      tell(RMP_FAULT_ERROR, m.span,
           c.to ? std::string(caps_.title) +
                      " has no external axes, and an additional joint moves here"
                : std::string(caps_.title) +
                      " has no external axes, and it is known at run time only whether an "
                      "additional joint moves here",
           "Leave the rail where it is, or post for a controller with external axes.");
      return;
    }
    if (is_path && moves && is_controllers_ && how == 0)
      tell(RMP_FAULT_WARNING, m.span,
           "the rail moves with this motion: in the run the tool's path is straight as seen from "
           "the base, at the controller as seen from the carriage",
           "Move the rail by a MOVE of its own.");
    if (!has_places(m)) return;
    if (!c.to) {
      tell(RMP_FAULT_ERROR, m.span,
           "where the carriage is at the end of this motion is known at run time only, and " +
               std::string(caps_.title) + " measures its targets from there",
           "Give the target its additional joints as constants (ROBTARGET), or post the flattened "
           "program (form = \"flat\").");
      return;
    }
    const auto frame = spatial::unless_identity(post::inverse(carriage_at(carrier_, *c.to)));
    if (!frame) return;
    bool is_framed = false;
    rewrite_attributes(
        i,
        [&](rmp_code_attribute& a) {
          if (a.attribute == RMP_ATTR_FRAME) {
            is_framed = true;
            a.value = composed(*frame, a);
          }
          return true;
        },
        [&] {
          if (!is_framed) t_.attributes.push_back({RMP_ATTR_FRAME, pose(*frame, m.span), m.span});
        });
  }
  void take_out_control(std::uint32_t i) {
    rewrite_attributes(
        i, [](const rmp_code_attribute& a) { return a.attribute != RMP_ATTR_ADAX_CONTROL; }, [] {});
  }

  static constexpr std::int64_t kKeep = 1;  ///< TCP_KEEP
  const Carrier& carrier_;
  const KnownPoints& known_;
  RailKind kind_;
  const PostCapabilities& caps_;
  std::vector<Remark>& remarks_;
  bool is_controllers_;  ///< the program is a controller's
};

}  // namespace

std::unique_ptr<ProgramTables> for_rail(const rmp_code& code, const Carrier& carrier,
                                        const KnownPoints& known, RailKind kind,
                                        const PostCapabilities& caps,
                                        std::vector<Remark>& remarks) {
  auto tables = copied_tables(code);
  ForRail(*tables, code, carrier, known, kind, caps, remarks).run();
  tables->seal();
  return tables;
}

}  // namespace robomosp::program_post
