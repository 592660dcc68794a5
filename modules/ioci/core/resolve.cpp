// SPDX-License-Identifier: Apache-2.0
// Records and handles by name, and their names.
#include <algorithm>
#include <utility>

#include "document/validate.h"
#include "io/native.h"
#include "ioci/core/application.h"
#include "ioci/core/commands.h"
#include "ioci/core/handle_text.h"
#include "kernel/permit.h"
#include "kernel/text.h"
#include "model/handle.h"

namespace robomosp::ioci {
namespace {

bool is_record_kind(std::string_view kind) { return kind_from(kind).has_value(); }

std::string kinds_text(std::string_view kinds) {
  std::string out(kinds == "any" ? "record" : kinds);
  for (std::size_t at = 0; (at = out.find('|', at)) != std::string::npos; at += 4)
    out.replace(at, 1, " or ");
  return out;
}

}  // namespace

Error stale_handle(const Handle& h) {
  return error(ErrorCode::stale_handle,
               h.kind + "#" + std::to_string(h.number) + " no longer exists",
               "It was removed, or its creation was undone. Get a new handle by name.");
}

std::optional<Handle> handle_from_text(const HandleKinds& kinds, std::string_view s) {
  const auto hash = s.rfind('#');
  if (hash == std::string_view::npos) return std::nullopt;
  const auto number = text::read_int(s.substr(hash + 1));
  if (!number || *number <= 0) return std::nullopt;
  const std::string_view kind = s.substr(0, std::min(hash, s.find(':')));
  if (!is_record_kind(kind) && !kinds.find(kind)) return std::nullopt;
  return Handle{std::string(kind), static_cast<std::uint64_t>(*number)};
}

std::optional<std::pair<Kind, std::string_view>> kind_and_name(std::string_view s) {
  const auto colon = s.find(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const auto kind = kind_from(s.substr(0, colon));
  return kind ? std::optional(std::pair(*kind, s.substr(colon + 1))) : std::nullopt;
}

std::optional<Handle> handle_by_name(const document::Snapshot& snapshot, std::string_view kinds,
                                     std::string_view s) {
  // Names have neither ":" nor "#", so that the forms of texts are told apart.
  const auto given = kind_and_name(s);
  if (given && kinds_include(kinds, to_string(given->first)))
    if (const auto id = snapshot.find(given->first, given->second)) return model::handle(*id);
  for (const Kind k : all_kinds())
    if (kinds_include(kinds, to_string(k)))
      if (const auto id = snapshot.find(k, s)) return model::handle(*id);
  return std::nullopt;
}

std::optional<std::string> reference_text(const document::Snapshot& snapshot, const Handle& h) {
  const auto kind = kind_from(h.kind);
  const model::Record* r = kind ? snapshot.find(AnyId{*kind, h.number}) : nullptr;
  if (!r) return std::nullopt;
  const bool is_alone = std::none_of(all_kinds().begin(), all_kinds().end(), [&](Kind k) {
    return k != *kind && snapshot.find(k, r->name);
  });
  return is_alone ? r->name : h.kind + ":" + r->name;
}

bool kinds_include(std::string_view kinds, std::string_view kind) {
  if (kinds == "any") return true;
  while (!kinds.empty()) {
    const auto bar = kinds.find('|');
    if (kinds.substr(0, bar) == kind) return true;
    if (bar == std::string_view::npos) return false;
    kinds.remove_prefix(bar + 1);
  }
  return false;
}

Handle Application::handle(AnyId id) { return model::handle(id); }

Result<AnyId> Application::record_id(const document::Snapshot& snapshot, const Handle& h) {
  const auto kind = kind_from(h.kind);
  if (!kind)
    return error(ErrorCode::invalid_argument, document::with_article(h.kind) + " is not a record");
  const AnyId id{*kind, h.number};
  if (!snapshot.find(id)) return stale_handle(h);
  return id;
}

Result<Handle> Application::resolve(const document::Snapshot& snapshot, std::string_view kinds,
                                    const Value& value) const {
  const auto check_handle = [&](const Handle& h) -> Result<Handle> {
    // "any" is a record of any kind.
    if (!kinds_include(kinds, h.kind) || (kinds == "any" && !is_record_kind(h.kind)))
      return error(ErrorCode::invalid_argument, describe(h) + " is " +
                                                    document::with_article(h.kind) + ", not " +
                                                    document::with_article(kinds_text(kinds)));
    if (is_record_kind(h.kind)) {
      RMP_TRY(record_id(snapshot, h));
    } else if (const HandleKinds::Entry* entry = handle_kinds.find(h.kind)) {
      if (!entry->name_of(h.number)) return stale_handle(h);
    } else {
      return error(ErrorCode::invalid_argument,
                   "there is no record of kind " + text::quote(h.kind));
    }
    return h;
  };
  if (const Handle* h = value.as_handle()) return check_handle(*h);
  const std::string* name = value.as_string();
  if (!name)
    return error(ErrorCode::invalid_argument,
                 value.text() + " is not the name of " + document::with_article(kinds_text(kinds)),
                 "Give its name or a handle.");
  if (const auto h = handle_by_name(snapshot, kinds, *name)) return *h;
  if (const auto h = handle_from_text(handle_kinds, *name)) return check_handle(*h);
  for (const HandleKinds::Entry& entry : handle_kinds.all())
    if (kinds_include(kinds, entry.kind) && kinds != "any")
      if (const auto number = text::read_int(*name); number && *number > 0)
        return check_handle(Handle{entry.kind, static_cast<std::uint64_t>(*number)});

  const auto given = kind_and_name(*name);
  if (given && !kinds_include(kinds, to_string(given->first)))
    return error(ErrorCode::invalid_argument,
                 text::quote(*name) + " is " + document::with_article(to_string(given->first)) +
                     ", not " + document::with_article(kinds_text(kinds)));
  constexpr std::size_t kMostNamed = 12;
  std::vector<std::string> known, references;
  std::string hint;
  const std::string word(given ? given->second : std::string_view(*name));
  for (const Kind k : all_kinds()) {
    if (!kinds_include(kinds, to_string(k)) || (given && given->first != k)) continue;
    for (const AnyId id : snapshot.list(k)) {
      known.push_back(snapshot.find(id)->name);
      if (references.size() < kMostNamed)
        references.push_back(*reference_text(snapshot, handle(id)));
    }
    if (hint.empty() && library_file(*this, k, word))
      hint =
          std::string(to_string(k)) + ".get(" + text::quote(word) + ") loads it from the library.";
  }
  if (hint.empty()) hint = text::did_you_mean(word, known);
  if (hint.empty() && !known.empty() && known.size() <= kMostNamed)
    hint = "There " + std::string(known.size() == 1 ? "is " : "are ") +
           text::enumerate(references) + ".";
  return error(ErrorCode::unknown_name,
               "there is no " + kinds_text(kinds) + " " + text::quote(*name) + " in the document",
               hint);
}

Result<Handle> CommandContext::resolve(std::string_view kinds, const Value& value) const {
  auto found = app.resolve(snapshot(), kinds, value);
  const std::string* name = value.as_string();
  if (found.ok() || !name || kinds == "any" || !may_edit_ || !transaction_ ||
      found.error().code != ErrorCode::unknown_name)
    return found;
  if (!session.may(Effect::files_read) || denied_within().meets(Effect::files_read)) return found;
  const auto given = kind_and_name(*name);
  for (const Kind kind : all_kinds()) {
    if (!kinds_include(kinds, to_string(kind)) || (given && given->first != kind)) continue;
    const auto file = library_file(app, kind, given ? std::string(given->second) : *name);
    if (!file) continue;
    const OwnWorkScope own;
    const bool before = transaction_->set_outside_history(true);
    auto loaded = io::load(*transaction_, *file, app.library, kind);
    transaction_->set_outside_history(before);
    if (!loaded.ok()) return std::move(loaded).error().in(file->string());
    for (const std::string& note : loaded->notes)
      app.messages.post(Severity::info, "file_note", note, "io");
    return Application::handle(loaded->id);
  }
  return found;
}

std::optional<std::string> Application::name_in(const document::Snapshot& snapshot,
                                                const Handle& h) const {
  if (const auto kind = kind_from(h.kind)) {
    const model::Record* r = snapshot.find(AnyId{*kind, h.number});
    return r ? std::optional(r->name) : std::nullopt;
  }
  const HandleKinds::Entry* entry = handle_kinds.find(h.kind);
  return entry ? entry->name_of(h.number) : std::nullopt;
}

std::optional<std::string> Application::name_of(const Handle& h, const Session* session) const {
  if (session && session->transaction_) return name_in(session->transaction_->now(), h);
  return name_in(*document.now(), h);
}

std::string Application::describe(const Handle& h, const Session* session) const {
  const std::string number = "#" + std::to_string(h.number);
  if (!is_record_kind(h.kind)) return h.kind + number;
  const auto name = name_of(h, session);
  return name ? h.kind + ":" + *name + number : h.kind + number;
}

}  // namespace robomosp::ioci
