// SPDX-License-Identifier: Apache-2.0
#include "kernel/permit.h"

#include "kernel/text.h"

namespace robomosp {
namespace {

// The one thing that cannot be handed down as an argument: providers, importers and whoever else
// opens a file in the end were not written with sessions in mind.
thread_local const Permit* current = nullptr;

}  // namespace

std::string_view to_string(Effect e) {
  switch (e) {
    case Effect::reads: return "reads";
    case Effect::edits: return "edits";
    case Effect::simulates: return "simulates";
    case Effect::files_read: return "files_read";
    case Effect::files_write: return "files_write";
    case Effect::processes: return "processes";
    case Effect::providers: return "providers";
    case Effect::loads_code: return "loads_code";
    case Effect::stops: return "stops";
    case Effect::administers: return "administers";
  }
  return "reads";
}

std::string_view phrase(Effect e) {
  switch (e) {
    case Effect::reads: return "reads the document";
    case Effect::edits: return "edits the document";
    case Effect::simulates: return "makes or changes recordings, runs or caches";
    case Effect::files_read: return "reads files";
    case Effect::files_write: return "writes files";
    case Effect::processes: return "starts other programs";
    case Effect::providers: return "changes which providers there are";
    case Effect::loads_code: return "loads code";
    case Effect::stops: return "stops the program";
    case Effect::administers: return "administers connections and their rights";
  }
  return "reads the document";
}

std::vector<Effect> Effects::list() const {
  std::vector<Effect> out;
  for (const Effect e : kAllEffects)
    if (has(e)) out.push_back(e);
  return out;
}

std::string Effects::text() const {
  std::string out;
  for (const Effect e : list()) {
    if (e == Effect::reads && *this != Effects(Effect::reads)) continue;
    out += (out.empty() ? "" : ", ") + std::string(to_string(e));
  }
  return out;
}

PermitScope::PermitScope(const Permit* permit) noexcept : before_(current) { current = permit; }
PermitScope::~PermitScope() { current = before_; }

OwnWorkScope::OwnWorkScope()
    : permit_{current ? current->session : "",
              current ? current->work : "",
              Effects::all(),
              {},
              false,
              false,
              current ? current->files : nullptr},
      scope_(permit_.files ? &permit_ : nullptr) {}

const Permit* current_permit() noexcept { return current; }

Effects denied_within() noexcept {
  return current && current->holds_within ? current->denied : Effects();
}

std::shared_ptr<const Permit> keep_permit() {
  if (!current) return nullptr;
  struct Kept {
    std::string session, work;
    Permit permit;
  };
  auto kept = std::make_shared<Kept>();
  kept->session = current->session;
  kept->work = current->work;
  kept->permit = {kept->session,         kept->work,    current->declared, current->denied, false,
                  current->holds_within, current->files};
  return {kept, &kept->permit};
}

Error not_permitted(std::string_view session, std::string_view work, Effect effect) {
  return error(ErrorCode::permission,
               "session " + text::quote(session) + " may not run " + std::string(work) +
                   ", which " + std::string(phrase(effect)),
               "Start the session with the right to do so.");
}

Result<void> require(Effect effect) {
  if (!current) return {};
  if (current->denied.has(effect)) {
    current->was_refused = true;
    return not_permitted(current->session, current->work, effect);
  }
  if (!current->declared.has(effect))
    return error(ErrorCode::internal,
                 std::string(current->work) + " " + std::string(phrase(effect)) +
                     ", which the command table does not declare",
                 "Nothing was done. Please report this.");
  return {};
}

}  // namespace robomosp
