// SPDX-License-Identifier: Apache-2.0
// Drafts of sessions and their commands: draft.open, run, start, changes, accept, discard, list.
#include "ioci/core/drafts.h"

#include <algorithm>
#include <utility>

#include "ioci/core/commands.h"
#include "kernel/text.h"

namespace robomosp::ioci {

std::uint64_t Drafts::open(Session& session, std::string label) {
  const document::Author author = app_.author(session);
  auto draft = std::make_shared<document::Draft>(app_.document, std::move(label), author);
  std::vector<Entry> ended;
  std::uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    if (drafts_.size() >= most_) {
      ended = end_orphans();
      most_ = 2 * drafts_.size() + 16;
    }
    number = next_++;
    drafts_.emplace(number, Entry{number, draft, session.alive_});
  }
  tell_discarded(ended);
  tell("opened", number, *draft, {});
  return number;
}

std::vector<Drafts::Entry> Drafts::end_orphans() {
  std::vector<Entry> ended;
  for (auto it = drafts_.begin(); it != drafts_.end();)
    if (it->second.session.expired()) {
      ended.push_back(std::move(it->second));
      it = drafts_.erase(it);
    } else {
      ++it;
    }
  return ended;
}

void Drafts::tell_discarded(const std::vector<Entry>& ended) {
  for (const Entry& e : ended) {
    (void)e.draft->discard();
    tell("discarded", e.number, *e.draft, {});
  }
}

Result<std::shared_ptr<document::Draft>> Drafts::own(Session& session, std::uint64_t number) {
  const std::uint64_t me = app_.author(session).session;
  const std::lock_guard lock(mutex_);
  if (const auto at = drafts_.find(number);
      at != drafts_.end() && at->second.draft->author().session == me)
    return at->second.draft;
  return error(ErrorCode::unknown_name,
               "there is no open draft " + std::to_string(number) + " of session " +
                   text::quote(session.name()),
               "draft.open opens one; draft.list lists them.");
}

std::vector<std::uint64_t> Drafts::jobs_of(std::uint64_t number) const {
  std::vector<std::uint64_t> out;
  for (const JobStatus& j : app_.jobs.list())
    if (j.owner.draft == number && (j.state == JobState::waiting || j.state == JobState::running))
      out.push_back(j.id);
  return out;
}

Result<document::Commit> Drafts::accept(Session& session, std::uint64_t number,
                                        const Progress& progress) {
  RMP_TRY_ASSIGN(const auto draft, own(session, number));
  if (const auto jobs = jobs_of(number); !jobs.empty())
    return error(ErrorCode::conflict,
                 "job#" + std::to_string(jobs.front()) + " works on the draft " +
                     text::quote(draft->label()),
                 "Wait for it with job.wait, or cancel it.");
  auto commit = draft->accept(&progress);
  if (!commit.ok()) return commit;
  {
    const std::lock_guard lock(mutex_);
    drafts_.erase(number);
  }
  tell("accepted", number, *draft, commit->changed);
  return commit;
}

Result<void> Drafts::discard(Session& session, std::uint64_t number) {
  RMP_TRY_ASSIGN(const auto draft, own(session, number));
  if (!draft->discard())
    return error(ErrorCode::conflict,
                 "the draft " + text::quote(draft->label()) + " is being accepted");
  for (const std::uint64_t job : jobs_of(number)) app_.jobs.cancel(job);
  {
    const std::lock_guard lock(mutex_);
    drafts_.erase(number);
  }
  tell("discarded", number, *draft, {});
  return {};
}

std::vector<Drafts::Entry> Drafts::list() {
  std::vector<Entry> out, ended;
  {
    const std::lock_guard lock(mutex_);
    ended = end_orphans();
    for (const auto& [number, entry] : drafts_) out.push_back(entry);
  }
  tell_discarded(ended);
  return out;
}

void Drafts::tell_edited(std::uint64_t number, const document::Draft& draft,
                         const document::Commit& commit) {
  tell("edited", number, draft, commit.changed);
}

void Drafts::tell(const char* what, std::uint64_t number, const document::Draft& draft,
                  const std::vector<AnyId>& changed) {
  if (!(app_.events.topics() & bit(Topic::draft))) return;
  List handles;
  for (const AnyId id : changed) handles.emplace_back(Application::handle(id));
  app_.events.publish(
      Topic::draft,
      {what, Map{{"draft", static_cast<std::int64_t>(number)},
                 {"label", draft.label()},
                 {"session", draft.author().name},
                 {"session_number", static_cast<std::int64_t>(draft.author().session)},
                 {"changed", std::move(handles)}}});
}

namespace {

std::uint64_t draft_of(const Map& args) {
  return static_cast<std::uint64_t>(integer(args, "draft"));
}

Map arguments_of(const Map& args) {
  const Value* given = args.find("arguments");
  return given && given->as_map() ? *given->as_map() : Map{};
}

Result<Value> open_draft(CommandContext& ctx, const Map& args) {
  return Value(
      static_cast<std::int64_t>(ctx.app.kept<Drafts>().open(ctx.session, text_of(args, "label"))));
}

Result<Value> run_draft(CommandContext& ctx, const Map& args) {
  return ctx.app.dispatch_on_draft(ctx.session, draft_of(args), text_of(args, "command"),
                                   arguments_of(args));
}

Result<Value> start_draft(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(Handle job,
                 ctx.app.dispatch_async(ctx.session, text_of(args, "command"), arguments_of(args),
                                        {.gesture = 0, .draft = draft_of(args)}));
  return Value(std::move(job));
}

/// As events tell it: handles of what is new, names of what is gone, fields of what is edited.
Map changes_value(const std::vector<document::RecordChange>& records) {
  List added, removed, edited;
  for (const document::RecordChange& r : records) {
    const Handle handle = Application::handle(r.id);
    if (!r.before) {
      added.emplace_back(Map{{"id", handle}, {"name", r.after->name}});
    } else if (!r.after) {
      removed.emplace_back(Map{{"id", handle}, {"name", r.before->name}});
    } else {
      List fields;
      for (std::string& f : changed_fields(*r.before, *r.after)) fields.emplace_back(std::move(f));
      edited.emplace_back(
          Map{{"id", handle}, {"name", r.after->name}, {"fields", std::move(fields)}});
    }
  }
  return Map{
      {"added", std::move(added)}, {"removed", std::move(removed)}, {"edited", std::move(edited)}};
}

Result<Value> list_changes(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto draft, ctx.app.kept<Drafts>().own(ctx.session, draft_of(args)));
  return Value(changes_value(draft->changes()));
}

Result<Value> accept_draft(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const document::Commit commit,
                 ctx.app.kept<Drafts>().accept(ctx.session, draft_of(args), ctx.progress));
  List changed;
  const auto now = ctx.app.document.now();
  for (const AnyId id : commit.changed)
    if (now->find(id)) changed.emplace_back(Application::handle(id));
  return Value(Map{{"label", commit.label},
                   {"revision", static_cast<std::int64_t>(commit.revision)},
                   {"changed", std::move(changed)}});
}

Result<Value> discard_draft(CommandContext& ctx, const Map& args) {
  RMP_TRY(ctx.app.kept<Drafts>().discard(ctx.session, draft_of(args)));
  return Value();
}

Result<Value> list_drafts(CommandContext& ctx, const Map&) {
  const std::uint64_t me = ctx.app.author(ctx.session).session;
  const std::uint64_t revision = ctx.app.document.now()->revision();
  List out;
  for (const Drafts::Entry& e : ctx.app.kept<Drafts>().list()) {
    List jobs;
    for (const std::uint64_t job : ctx.app.kept<Drafts>().jobs_of(e.number))
      jobs.emplace_back(Handle{"job", job});
    const document::Author& author = e.draft->author();
    out.emplace_back(
        Map{{"draft", static_cast<std::int64_t>(e.number)},
            {"label", e.draft->label()},
            {"session", author.name},
            {"session_number", static_cast<std::int64_t>(author.session)},
            {"mine", author.session == me},
            {"commits", e.draft->commits()},
            {"changed", e.draft->changes().size()},
            {"behind", static_cast<std::int64_t>(revision - e.draft->base()->revision())},
            {"jobs", std::move(jobs)}});
  }
  return Value(std::move(out));
}

ParamSpec draft_param() {
  return between(needed("draft", "int", "", "What draft.open returned."), 1, 9e15);
}
ParamSpec command_name() { return needed("command", "string", "", "Name of the command."); }
ParamSpec command_arguments() { return optional("arguments", "map", "", "Its arguments by name."); }

}  // namespace

RMP_COMMANDS(draft_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "draft.open",
       .classic = "",
       .summary = "Opens a draft: edits that only this session sees until they are accepted.",
       .details =
           "A draft begins with the document's records as they are. draft.run and draft.start run "
           "commands on it, draft.changes lists what it changes, and draft.accept makes one step "
           "of it, or draft.discard nothing. A session may have any number of drafts; they are "
           "discarded with it.",
       .example = "material.create{name = \"brass\", density = 8500}\n"
                  "local d = draft.open(\"try a lighter one\")\n"
                  "draft.run{draft = d, command = \"material.set\", arguments = {id = \"brass\", "
                  "density = 8400}}\n"
                  "assert(material.describe(\"brass\").density == 8500)\n"
                  "draft.accept(d)\nassert(material.describe(\"brass\").density == 8400)",
       .params = {needed("label", "string", "", "What its step is called.")},
       .returns = {"int", "", "Its number.", {}},
       .effect = Effect::edits,
       .run = open_draft,
       .own_transaction = true});
  all.push_back(
      {.name = "draft.run",
       .classic = "",
       .summary = "Runs a command on a draft.",
       .details =
           "It sees the draft's records, and what it edits stays there. Recordings that it makes "
           "are there for all. Refused are commands on the history, those that save records, and "
           "those that change more of the program than records and recordings.",
       .example = "local d = draft.open(\"bolt\")\n"
                  "draft.run{draft = d, command = \"material.create\", arguments = {name = "
                  "\"steel\", density = 7850}}\n"
                  "assert(#draft.run{draft = d, command = \"material.list\"} == 1)\n"
                  "assert(#material.list() == 0)\ndraft.discard(d)",
       .params = {draft_param(), command_name(), command_arguments()},
       .returns = {"any", "", "What the command returns.", {}},
       .effect = Effect::edits,
       .run = run_draft,
       .own_transaction = true});
  all.push_back(
      {.name = "draft.start",
       .classic = "",
       .summary = "Starts a command on a draft as a job.",
       .details = "It works on the draft's records as they are now. Jobs of one draft run beside "
                  "each other; what one of them looked at and another changed meanwhile is a "
                  "conflict of the one that ends last.",
       .example = "material.create{name = \"brass\", density = 8500}\n"
                  "local d = draft.open(\"density\")\n"
                  "draft.start{draft = d, command = \"material.set\", arguments = {id = "
                  "\"brass\", density = 8400}}:wait()\n"
                  "assert(#draft.changes(d).edited == 1)\ndraft.discard(d)",
       .params = {draft_param(), command_name(), command_arguments()},
       .returns = {"handle", "", "The job.", {}},
       .effect = Effect::edits,
       .run = start_draft,
       .own_transaction = true});
  all.push_back({.name = "draft.changes",
                 .classic = "",
                 .summary = "Lists what accepting a draft would change.",
                 .details = "",
                 .example =
                     "local d = draft.open(\"bolt\")\n"
                     "draft.run{draft = d, command = \"material.create\", arguments = {name = "
                     "\"steel\", density = 7850}}\n"
                     "assert(draft.changes(d).added[1].name == \"steel\")\ndraft.discard(d)",
                 .params = {draft_param()},
                 .returns = {"map",
                             "",
                             "",
                             {field("added", "list", "", "Tables with id and name."),
                              field("removed", "list", "", "Tables with id and name."),
                              field("edited", "list", "",
                                    "Tables with id, name and the fields that differ.")}},
                 .effect = Effect::reads,
                 .run = list_changes});
  all.push_back(
      {.name = "draft.accept",
       .classic = "",
       .summary = "Publishes a draft as one step of the document, and ends the draft.",
       .details =
           "If others have changed the document in the meantime, the edits are repeated on its "
           "present state, provided that everything the editing commands read is unchanged; "
           "otherwise the error names the changes, and the draft stays open. Rejected while a job "
           "works on it.",
       .example = "local d = draft.open(\"bolt\")\n"
                  "for _, name in ipairs{\"steel\", \"brass\"} do\n"
                  "  draft.run{draft = d, command = \"material.create\", arguments = {name = name, "
                  "density = 8000}}\nend\n"
                  "draft.accept(d)\nassert(#material.list() == 2)\n"
                  "document.undo()\nassert(#material.list() == 0)",
       .params = {draft_param()},
       .returns = {"map",
                   "",
                   "",
                   {field("label", "string", "", "The step."),
                    field("revision", "int", "", "Revision of the document now."),
                    field("changed", "list", "",
                          "Handles of the records that changed and still exist.")}},
       .effect = Effect::edits,
       .run = accept_draft,
       .own_transaction = true});
  all.push_back({.name = "draft.discard",
                 .classic = "",
                 .summary = "Ends a draft and drops its edits.",
                 .details = "Jobs that work on it are cancelled. Recordings that its commands made "
                            "and files that they wrote stay.",
                 .example = "local d = draft.open(\"bolt\")\ndraft.discard(d)\n"
                            "assert(#draft.list() == 0)",
                 .params = {draft_param()},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = discard_draft,
                 .own_transaction = true});
  all.push_back({.name = "draft.list",
                 .classic = "",
                 .summary = "Lists the drafts that are open, those of all sessions.",
                 .details = "",
                 .example = "local d = draft.open(\"bolt\")\nlocal all = draft.list()\n"
                            "assert(all[#all].draft == d and all[#all].mine)\ndraft.discard(d)",
                 .params = {},
                 .returns = {"list",
                             "",
                             "",
                             {field("draft", "int", "", "Its number."),
                              field("label", "string", "", "What its step is called."),
                              field("session", "string", "", "The session that opened it."),
                              field("session_number", "int", "", "The number of that session."),
                              field("mine", "bool", "", "True for those of the session that asks."),
                              field("commits", "int", "", "Commands that edited it."),
                              field("changed", "int", "", "Records that it changes."),
                              field("behind", "int", "",
                                    "Changes of the document since the draft was opened."),
                              field("jobs", "list", "", "Jobs that work on it.")}},
                 .effect = Effect::reads,
                 .run = list_drafts});
  return all;
}

}  // namespace robomosp::ioci
