// SPDX-License-Identifier: Apache-2.0
#include "document/digest.h"

namespace robomosp::document {

void feed(Fingerprinter& fp, const model::Body& body, const model::FeedReference& reference) {
  fp.add(to_string(model::kind_of_body(body)));
  model::feed(fp, model::content(body), reference);
}

Fingerprint record_fingerprint(const model::Record& record) {
  Fingerprinter fp("record/1");
  fp.add(std::string_view(record.name)).add(std::string_view(record.file));
  feed(fp, record.body, [](Fingerprinter& f, AnyId id) {
    f.add(static_cast<std::int64_t>(id.kind)).add(static_cast<std::int64_t>(id.number));
  });
  return fp.finish();
}

bool equal(const model::Record& a, const model::Record& b) {
  return a.file == b.file && a.disk == b.disk && same_content(a, b);
}

bool same_content(const model::Record& a, const model::Record& b) {
  return a.name == b.name && model::equal(a.body, b.body);
}

std::size_t record_bytes(const model::Record& record, const model::Record* other) {
  const model::Content c = model::content(record.body);
  const bool is_other = std::holds_alternative<model::OtherContent>(record.body);
  return sizeof(model::Record) + record.name.size() + record.file.size() +
         (is_other ? c.type->size : 0) +
         model::heap_bytes(c, other ? model::content(other->body) : model::Content{});
}

}  // namespace robomosp::document
