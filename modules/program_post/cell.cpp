// SPDX-License-Identifier: Apache-2.0
#include "program_post/cell.h"

#include <cmath>

#include <robomosp/sdk/post_writer.h>

#include "program_post/legalise.h"
#include "program_post/pose_rewriter.h"

namespace robomosp::program_post {
namespace {

class InCell final : PoseRewriter {
 public:
  InCell(ProgramTables& t, const CellPlaces& cell) : PoseRewriter(t), cell_(cell) {}
  void run() {
    if (!has_poses()) return;
    for (std::uint32_t i = 0; i < t_.motions.size(); ++i) add(i);
  }

 private:
  void add(std::uint32_t i) {
    const rmp_code_motion m = t_.motions[i];
    const bool has_frame = cell_.frame && has_places(m);
    bool is_framed = false, is_tooled = false;
    rewrite_attributes(
        i,
        [&](rmp_code_attribute& a) {
          is_tooled = is_tooled || a.attribute == RMP_ATTR_TOOL;
          if (a.attribute == RMP_ATTR_FRAME && cell_.frame) {
            is_framed = true;
            a.value = composed(*cell_.frame, a);
          }
          return true;
        },
        [&] {
          if (has_frame && !is_framed)
            t_.attributes.push_back({RMP_ATTR_FRAME, pose(*cell_.frame, m.span), m.span});
          if (cell_.tool && !is_tooled)
            t_.attributes.push_back({RMP_ATTR_TOOL, pose(*cell_.tool, m.span), m.span});
        });
  }

  const CellPlaces& cell_;
};

}  // namespace

std::unique_ptr<ProgramTables> in_cell(const rmp_code& code, const CellPlaces& cell) {
  if (!cell.frame && !cell.tool) return nullptr;
  auto tables = copied_tables(code);
  InCell(*tables, cell).run();
  tables->seal();
  return tables;
}

}  // namespace robomosp::program_post
