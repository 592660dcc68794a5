// SPDX-License-Identifier: Apache-2.0
#include "exchange/export_pairs.h"

#include <map>
#include <utility>

#include "collision/cache.h"
#include "collision/collision.h"

namespace robomosp::exchange {

Result<std::vector<ExportPair>> export_pairs(const evaluation::Sources& from, RobotId id,
                                             std::size_t samples, std::uint64_t seed,
                                             Progress& progress) {
  RMP_TRY_ASSIGN(const auto m, collision::collision_model(from, AnyId(id), progress));
  const model::Robot& robot = *from.snapshot.get(id);
  // Bodies are named as the links; the first of the name "base" is the base itself.
  std::map<std::string, std::int32_t> links;
  for (std::size_t i = 0; i < robot.links.size(); ++i)
    links.emplace(robot.links[i].name, static_cast<std::int32_t>(i));
  std::vector<std::int32_t> link_of;
  bool has_base = false;
  for (const collision::CollisionBody& b : m->bodies()) {
    const auto found = links.find(b.name);
    const bool is_base = b.name == "base" && b.joint < 0 && !has_base;
    has_base = has_base || is_base;
    link_of.push_back(is_base || found == links.end() ? -1 : found->second);
  }
  std::map<std::pair<std::int32_t, std::int32_t>, ExportPair> out;
  const auto put = [&](const CollisionPair& pair, ExportPair::Why why, std::string text) {
    ExportPair p;
    p.a = link_of[static_cast<std::size_t>(pair.a)];
    p.b = link_of[static_cast<std::size_t>(pair.b)];
    if (p.a == p.b) return;
    if (p.a > p.b) std::swap(p.a, p.b);
    p.why = why;
    p.text = std::move(text);
    out.try_emplace({p.a, p.b}, std::move(p));
  };
  for (const collision::PassedPair& p : m->passed())
    put(p.pair,
        p.reason == collision::PairReason::adjacent ? ExportPair::Why::adjacent
        : p.reason == collision::PairReason::always ? ExportPair::Why::always
                                                    : ExportPair::Why::rule,
        p.text);
  // What moves as one touches always or never.
  for (std::size_t i = 0; i < m->bodies().size(); ++i)
    for (std::size_t k = i + 1; k < m->bodies().size(); ++k)
      if (m->bodies()[i].joint == m->bodies()[k].joint)
        put({static_cast<std::int32_t>(i), static_cast<std::int32_t>(k)}, ExportPair::Why::adjacent,
            "");
  RMP_TRY_ASSIGN(const auto found, m->sample_pairs(samples, seed, progress));
  for (const collision::SampledPair& p : found)
    put(p.pair, p.always ? ExportPair::Why::always : ExportPair::Why::never, "");
  std::vector<ExportPair> pairs;
  for (auto& [key, pair] : out) pairs.push_back(std::move(pair));
  return pairs;
}

}  // namespace robomosp::exchange
