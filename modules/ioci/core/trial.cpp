// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/trial.h"

#include "ioci/core/drafts.h"
#include "kernel/text.h"

namespace robomosp::ioci {
namespace {

/// A trial is open on this thread.
thread_local bool is_trying_here = false;

}  // namespace

std::unique_ptr<Trial> Trial::open(Application& app, Session& session) {
  if (is_trying_here || Jobs::here() != 0 || !session.may(Effect::edits)) return nullptr;
  auto& drafts = app.kept<Drafts>();
  if (!drafts.may_try(session)) return nullptr;
  return std::unique_ptr<Trial>(new Trial(app, session, drafts.open_hidden(session)));
}

Trial::Trial(Application& app, Session& session, std::uint64_t draft)
    : app_(app), session_(session), draft_(draft) {
  is_trying_here = true;
}

Trial::~Trial() {
  is_trying_here = false;
  (void)app_.kept<Drafts>().discard(session_, draft_);
}

bool Trial::may_run(const CommandSpec& spec) {
  constexpr Effects kTried = Effects(Effect::reads) | Effect::edits | Effect::files_read;
  return !spec.own_transaction &&
         !(spec.effect | spec.sometimes).meets(Effects::all().without(kTried));
}

Result<Value> Trial::run(std::string_view command, const Map& args) {
  const CommandSpec* spec = app_.commands.find(command);
  if (!spec) return app_.commands.unknown(command);
  if (!may_run(*spec))
    return error(ErrorCode::permission,
                 text::quote(spec->name) + " does more than edit records and is not tried");
  return app_.dispatch_on_draft(session_, draft_, command, args);
}

}  // namespace robomosp::ioci
