// SPDX-License-Identifier: Apache-2.0
#include "document/digest.h"

namespace robomosp::document {

void feed(Fingerprinter& fp, const model::Body& body, const model::FeedReference& reference) {
  fp.add(to_string(model::kind_of_body(body)));
  model::feed(fp, model::content(body), reference);
}

void feed(Fingerprinter& fp, const std::vector<model::KeptSolver>& solvers) {
  // Records without any have the fingerprints that they had before there were any.
  for (const model::KeptSolver& s : solvers)
    fp.add(std::string_view(s.interface))
        .add(std::string_view(s.name))
        .add(std::string_view(s.provides))
        .add(std::string_view(s.text));
}

Fingerprint record_fingerprint(const model::Record& record) {
  Fingerprinter fp("record/1");
  fp.add(std::string_view(record.name)).add(std::string_view(record.file));
  feed(fp, record.body, [](Fingerprinter& f, AnyId id) {
    f.add(static_cast<std::int64_t>(id.kind)).add(static_cast<std::int64_t>(id.number));
  });
  feed(fp, record.solvers);
  return fp.finish();
}

bool equal(const model::Record& a, const model::Record& b) {
  return a.file == b.file && a.disk == b.disk && same_content(a, b);
}

bool same_content(const model::Record& a, const model::Record& b) {
  return a.name == b.name && a.solvers == b.solvers && model::equal(a.body, b.body);
}

std::size_t record_bytes(const model::Record& record, const model::Record* other) {
  const model::Content c = model::content(record.body);
  const bool is_other = std::holds_alternative<model::OtherContent>(record.body);
  std::size_t texts = 0;
  for (const model::KeptSolver& s : record.solvers) texts += sizeof s + s.text.size();
  return sizeof(model::Record) + texts + record.name.size() + record.file.size() +
         (is_other ? c.type->size : 0) +
         model::heap_bytes(c, other ? model::content(other->body) : model::Content{});
}

}  // namespace robomosp::document
