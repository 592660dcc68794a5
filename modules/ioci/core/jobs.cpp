// SPDX-License-Identifier: Apache-2.0
// Jobs: commands that go on while their session does something else.
#include "ioci/core/commands.h"

namespace robomosp::ioci {
namespace {

std::uint64_t number_of(const Map& args) { return args.find("id")->as_handle()->number; }

Map status_map(const JobStatus& s) {
  Map out{{"id", Handle{"job", s.id}},
          {"label", s.label},
          {"state", to_string(s.state)},
          {"fraction", s.fraction},
          {"what", s.what}};
  append_owner(out, s.owner);
  return out;
}

Result<Value> list_jobs(CommandContext& ctx, const Map&) {
  List out;
  for (const JobStatus& s : ctx.app.jobs.list()) out.emplace_back(status_map(s));
  return Value(std::move(out));
}

Result<Value> cancel(CommandContext& ctx, const Map& args) {
  return Value(ctx.app.jobs.cancel(number_of(args)));
}

Result<Value> progress(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const JobStatus s, ctx.app.jobs.status(number_of(args)));
  return Value(status_map(s));
}

Result<Value> wait(CommandContext& ctx, const Map& args) {
  return ctx.app.jobs.wait(number_of(args), [&] { return ctx.progress.cancelled(); });
}

}  // namespace

RMP_COMMANDS(job_commands) {
  std::vector<CommandSpec> all;
  const std::vector<ParamSpec> status{
      field("id", "handle", "", "The job."),
      field("label", "string", "", "Label of the job."),
      field("state", "string", "", "waiting, running, done, failed or cancelled."),
      field("fraction", "real", "", "Progress, 0 to 1."),
      field("what", "string", "", "Its present activity."),
      field("session", "string", "",
            "The session that started it; left out for the program's own."),
      field("session_number", "int", "", "The number of that session."),
      field("gesture", "int", "", "The gesture that its edits join, if any."),
      field("draft", "int", "", "The draft that it works on, if any.")};
  all.push_back({.name = "job.list",
                 .classic = "",
                 .summary = "Lists the jobs of all sessions.",
                 .details = "Of the jobs that have ended, the last 256 are kept.",
                 .example = "start(\"world.list\"):wait()\nassert(#job.list() >= 1)",
                 .params = {},
                 .returns = {"list", "", "", status},
                 .effect = Effect::reads,
                 .run = list_jobs});
  all.push_back({.name = "job.progress",
                 .classic = "",
                 .summary = "Returns the state and the progress of a job.",
                 .details = "",
                 .example = "local job = start(\"world.list\")\njob:wait()\n"
                            "assert(job:progress().state == \"done\")",
                 .params = {self("job")},
                 .returns = {"map", "", "", status},
                 .effect = Effect::reads,
                 .run = progress});
  all.push_back({.name = "job.wait",
                 .classic = "",
                 .summary = "Waits for the end of a job and returns the result of its command.",
                 .details = "An error of the job becomes an error of this command. The result can "
                            "be read again later. If the wait is interrupted, the job continues.",
                 .example = "material.create{name = \"brass\", density = 8500}\n"
                            "local job = start(\"material.list\")\nassert(#job:wait() == 1)",
                 .params = {self("job")},
                 .returns = {"any", "", "The result of the job's command.", {}},
                 .effect = Effect::reads,
                 .run = wait});
  all.push_back({.name = "job.cancel",
                 .classic = "",
                 .summary = "Cancels a job.",
                 .details = "A cancelled job leaves document and recordings unchanged; a job that "
                            "is already past that point ends with its result.",
                 .example = "for _, j in ipairs(job.list()) do\n  job.cancel(j.id)\nend",
                 .params = {self("job")},
                 .returns = {"bool", "", "False if it had already finished.", {}},
                 .effect = Effect::simulates,
                 .run = cancel});
  return all;
}

}  // namespace robomosp::ioci
