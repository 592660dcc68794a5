// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/commands.h"
#include "ioci/records/field_values.h"

namespace robomosp::ioci {

Map describe_record(const document::Snapshot& snapshot, AnyId id) {
  const model::Record* r = snapshot.find(id);
  Map m;
  m.append("name", r->name);
  m.append("kind", to_string(id.kind));
  m.append("file", r->file);
  add_fields(m, snapshot, *r);
  // material.create and material.set take the opacity apart from the colour.
  if (const auto* material = std::get_if<model::Material>(&r->body))
    m.set("opacity", static_cast<double>(material->colour.a));
  return m;
}

}  // namespace robomosp::ioci
