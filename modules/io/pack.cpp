// SPDX-License-Identifier: Apache-2.0
#include "io/pack.h"

#include <unordered_set>
#include <utility>
#include <vector>

#include "io/native_print.h"

namespace robomosp::io {

Result<Pack> pack(const document::Snapshot& now, AnyId id) {
  const auto name_of = [](AnyId each) {
    return std::string(to_string(each.kind)) + "-" + std::to_string(each.number) +
           std::string(extension(each.kind));
  };
  Pack out;
  out.main = name_of(id);
  std::unordered_set<AnyId> seen{id};
  std::vector<AnyId> open{id};
  while (!open.empty()) {
    const AnyId each = open.back();
    open.pop_back();
    const model::Record* record = now.find(each);
    if (!record)
      return error(ErrorCode::stale_handle, now.describe(each) + " no longer exists",
                   "Look it up again by its name.");
    const std::string name = name_of(each);
    RMP_TRY_ASSIGN(std::string text, print_record(now, *record, name, name_of));
    out.files.texts.emplace(name, std::move(text));
    if (const auto* solid = std::get_if<model::Solid>(&record->body))
      for (const auto& node : solid->nodes)
        if (node.geometry)
          out.files.geometries.emplace(geometry_file_name(name, *node.geometry), node.geometry);
    model::for_each_reference(record->body, [&](AnyId target, std::string_view) {
      if (seen.insert(target).second) open.push_back(target);
    });
  }
  return out;
}

}  // namespace robomosp::io
