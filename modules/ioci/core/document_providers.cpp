// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/document_providers.h"

#include <map>
#include <utility>

#include "ioci/core/application.h"
#include "ioci/core/commands.h"
#include "kernel/interface_adapters.h"
#include "model/declare.h"
#include "model/default_provider.h"

namespace robomosp::ioci {
namespace {

using model::DefaultProvider;

const DefaultProvider& content(const model::Record& r) {
  return std::get<model::OtherContent>(r.body).as<DefaultProvider>();
}

/// The current id of an interface that an older program may have written; as it is when unknown.
std::string current(const std::string& id) {
  const std::string now = current_interface(id);
  return now.empty() ? id : now;
}

/// By interface id; of two records of one interface the older one holds.
std::map<std::string, std::string> choices(const document::Snapshot& s) {
  std::map<std::string, std::string> out;
  for (const AnyId id : s.list(default_provider_kind())) {
    const DefaultProvider& d = content(*s.find(id));
    out.emplace(current(d.interface), d.provider);
  }
  return out;
}

}  // namespace

Kind default_provider_kind() {
  static const Kind kind =
      model::register_kind_of<DefaultProvider>("default_provider", ".default", "defaults");
  return kind;
}

void follow_document_providers(Application& app) {
  const Kind kind = default_provider_kind();
  app.document.on_commit([&app, kind](const document::Commit& commit) {
    bool is_other = commit.kind == document::CommitKind::clear;
    for (const AnyId id : commit.changed) is_other = is_other || id.kind == kind;
    if (!is_other) return;
    auto chosen = choices(*app.document.now());
    app.registry.set_document_defaults(chosen);
    for (const auto& [interface_id, name] : chosen) {
      const auto found = app.registry.find(interface_id, name);
      if (!found.ok())
        app.messages.post(Severity::warning, "default_missing",
                          app.registry.find(interface_id, "").ok()
                              ? "The document chooses the provider " + text::quote(name) + " of " +
                                    text::quote(interface_id) + ", which is not there or disabled"
                              : app.registry.find(interface_id, "").error().sentence(),
                          "provider");
    }
  });
}

Result<void> keep_document_provider(CommandContext& ctx, const std::string& interface_id,
                                    const std::string& name) {
  if (!name.empty()) RMP_TRY(ctx.app.registry.find(interface_id, name));
  std::vector<AnyId> kept;
  for (const AnyId id : ctx.snapshot().list(default_provider_kind()))
    if (current(content(*ctx.snapshot().find(id)).interface) == interface_id) kept.push_back(id);
  document::Transaction& tx = ctx.edit();
  for (std::size_t i = name.empty() ? 0 : 1; i < kept.size(); ++i) RMP_TRY(tx.remove(kept[i]));
  if (name.empty()) return {};
  if (!kept.empty())
    return tx.edit(kept[0], [&](model::Record& r) -> Result<void> {
      std::get<model::OtherContent>(r.body).as<DefaultProvider>() = {interface_id, name};
      return {};
    });
  const auto dot = interface_id.find('.'), slash = interface_id.find('/');
  const std::string brief = interface_id.substr(dot + 1, slash - dot - 1);
  model::Record record{
      brief, "", model::OtherContent(default_provider_kind(), DefaultProvider{interface_id, name})};
  RMP_TRY(tx.add(std::move(record)));
  return {};
}

}  // namespace robomosp::ioci
