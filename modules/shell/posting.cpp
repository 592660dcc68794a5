// SPDX-License-Identifier: Apache-2.0
#include "shell/posting.h"

#include <cstdio>
#include <filesystem>
#include <utility>

#include "kernel/text.h"
#include "program_post/packs.h"

namespace robomosp::shell {

namespace {

/// Tells an error of a post and gives its exit code: what files and folders do not allow is wrong
/// input, as an unknown name is.
int fail_post(const Voice& voice, const Error& e) {
  const int code = voice.fail(e);
  if (e.code == ErrorCode::unsupported) return 1;  // the target cannot say it
  return e.code == ErrorCode::io ? 3 : code;
}

/// Faults at places to standard error, "file:line:column: severity: sentence" a line.
void tell_faults(const Settings& s, const List& faults) {
  for (const Value& each : faults) {
    const Map& f = *each.as_map();
    if (s.quiet && *f.find("severity")->as_string() != "error") continue;
    const std::string hint = *f.find("hint")->as_string();
    std::fprintf(
        stderr, "%s\n",
        text::visible(*f.find("file")->as_string() + ":" + f.find("line")->text() + ":" +
                      f.find("column")->text() + ": " + *f.find("severity")->as_string() + ": " +
                      *f.find("message")->as_string() + (hint.empty() ? "" : " " + hint))
            .c_str());
  }
}

/// All that is wrong with a pack of templates, a line each; false = nothing is.
bool tell_pack_faults(const Settings& s, const Voice& voice, const std::string& file) {
  List faults;
  for (const auto& f : program_post::pack_faults(file))
    faults.emplace_back(Map{{"severity", "error"},
                            {"file", f.file},
                            {"line", static_cast<std::int64_t>(f.line)},
                            {"column", static_cast<std::int64_t>(f.column)},
                            {"message", f.message + "."},
                            {"hint", f.hint}});
  if (faults.empty() || voice.json()) return false;  // with --json one error has them all
  tell_faults(s, faults);
  return true;
}

/// Writes a page with the code of several targets side by side; where one cannot say the program,
/// the page says so, and it ends with 1.
int compare_posts(Program& p, const Settings& s, const Voice& voice, const PostSettings& how,
                  const Map& args) {
  Map asked{{"id", *args.find("id")}, {"form", how.form}, {"file", how.side_by_side}};
  if (const Value* robot = args.find("robot")) asked.set("robot", *robot);
  List targets;
  for (const std::string_view each : text::split(how.target, ','))
    targets.emplace_back(std::string(text::trim(each)));
  asked.set("targets", Value(std::move(targets)));
  auto made = p.app->dispatch(*p.session, "program.compare_targets", asked);
  if (!made.ok()) return fail_post(voice, made.error());
  const Map& found = *made->as_map();
  bool is_correct = true;
  for (const Value& each : *found.find("targets")->as_list())
    is_correct = is_correct && *each.as_map()->find("correct")->as_bool();
  if (voice.json()) {
    voice.result(*made, "");
    return is_correct ? 0 : 1;
  }
  if (!s.quiet)
    for (const Value& each : *found.find("differences")->as_list()) {
      const Map& d = *each.as_map();
      std::fprintf(
          stderr, "%s\n",
          text::visible(*d.find("file")->as_string() + ":" + d.find("line")->text() + ": " +
                        *d.find("kind")->as_string() + ": " + *d.find("text")->as_string())
              .c_str());
    }
  voice.line(*found.find("points")->as_string());
  voice.line(how.side_by_side);
  return is_correct ? 0 : 1;
}

/// The program of the file, and the world that has it, of a script that makes both: its bindings
/// count, and what runs beside it. A script whose worlds have no program of that file gives its
/// only world this one. What the script prints goes to standard error.
Result<std::pair<Value, Value>> cell_of_script(Program& p, const PostSettings& how) {
  p.printed = [](std::string_view text) { std::fwrite(text.data(), 1, text.size(), stderr); };
  RMP_TRY(p.lua->run_file(how.world));
  const auto ask = [&](const char* command, const Map& args) {
    return p.app->dispatch(*p.session, command, args);
  };
  const std::string wanted = std::filesystem::path(how.file).filename().string();
  RMP_TRY_ASSIGN(const Value worlds, ask("world.list", Map{}));
  std::vector<std::pair<Value, Value>> found;
  for (const Value& world : *worlds.as_list()) {
    RMP_TRY_ASSIGN(const Value programs, ask("world.programs", Map{{"id", world}}));
    for (const Value& each : *programs.as_list()) {
      RMP_TRY_ASSIGN(const Value id,
                     ask("program.get", Map{{"name", *each.as_map()->find("program")}}));
      RMP_TRY_ASSIGN(const Value files, ask("program.files", Map{{"id", id}}));
      const List& all = *files.as_list();
      if (!all.empty() && *all.front().as_map()->find("name")->as_string() == wanted)
        found.emplace_back(id, world);
    }
  }
  if (found.size() == 1) return found.front();
  if (!found.empty())
    return error(ErrorCode::conflict,
                 "the script has " + std::to_string(found.size()) + " programs of the file " +
                     text::quote(wanted) + " in its worlds",
                 "Make it create one.", how.world);
  if (worlds.as_list()->size() != 1)
    return error(ErrorCode::not_found,
                 "the script makes " + std::to_string(worlds.as_list()->size()) +
                     " worlds, and none has a program of the file " + text::quote(wanted),
                 "Make it create one world, or place the program with world.add_program.",
                 how.world);
  const Value& world = worlds.as_list()->front();
  RMP_TRY_ASSIGN(const Value id, ask("program.import", Map{{"file", how.file}}));
  RMP_TRY(ask("world.add_program", Map{{"id", world}, {"program", id}}));
  return std::pair(id, world);
}

/// What is missing, and the known targets.
Error no_target(Program& p, const char* what, const char* hint) {
  std::string all;
  if (const auto targets = p.app->dispatch(*p.session, "program.targets", Map{}); targets.ok())
    for (const Value& each : *targets->as_list())
      all += (all.empty() ? "" : ", ") + *each.as_map()->find("name")->as_string();
  return error(ErrorCode::usage, what, std::string(hint) + ". Targets are " + all + ".");
}

}  // namespace

/// Posts a program to the files of a controller; its faults go to standard error, a line each.
int run_post(const Settings& s, const Voice& voice, const PostSettings& how) {
  Program p;
  if (auto started = start(p, s, voice, "post"); !started.ok())
    return fail_post(voice, started.error());
  const auto ask = [&](const char* command, const Map& args) {
    return p.app->dispatch(*p.session, command, args);
  };
  if (how.target.empty() && how.templates.empty() &&
      (how.profile.empty() || !how.side_by_side.empty()))
    return voice.fail(no_target(p, "post needs a target", "Write --target krl, or --profile"));
  Map args;
  if (!how.templates.empty()) {
    if (tell_pack_faults(s, voice, how.templates)) return 3;
    auto added = ask("program.add_target", Map{{"file", how.templates}});
    if (!added.ok()) return fail_post(voice, added.error());
    if (!how.target.empty() && how.target != *added->as_string())
      return fail_post(
          voice, error(ErrorCode::invalid_argument,
                       "the target " + text::quote(how.target) + " is requested, but the pack is " +
                           text::quote(*added->as_string()),
                       "Give --target or --templates.", "--target"));
    args.set("target", *added);
  }
  const bool is_script = how.world.ends_with(".lua");
  Result<Value> program = Value();
  if (is_script) {
    auto found = cell_of_script(p, how);
    if (!found.ok()) return voice.fail(found.error(), p.lua->traceback());
    program = found->first;
    args.set("world", found->second);
  } else {
    program = ask("program.import", Map{{"file", how.file}});
  }
  if (!program.ok()) return fail_post(voice, program.error());
  args.set("id", *program);
  // All errors of a source are reported, before anything else.
  auto checked = ask("program.check", Map{{"id", *program}});
  if (!checked.ok()) return fail_post(voice, checked.error());
  if (!*checked->as_map()->find("correct")->as_bool()) {
    if (voice.json()) voice.result(*checked, "");
    else tell_faults(s, *checked->as_map()->find("faults")->as_list());
    return 1;
  }
  if (!how.target.empty()) args.set("target", how.target);
  if (!how.profile.empty()) {
    if (how.profile.ends_with(".ctl")) {
      auto loaded = ask("file.load", Map{{"file", how.profile}});
      if (!loaded.ok()) return fail_post(voice, loaded.error());
      args.set("profile", *loaded);
    } else {
      auto found = ask("controller.get", Map{{"name", how.profile}});
      if (!found.ok()) return fail_post(voice, found.error());
      args.set("profile", *found);
    }
  }
  if (!how.robot.empty()) {
    if (how.robot.ends_with(".rbt")) {
      auto loaded = ask("file.load", Map{{"file", how.robot}});
      if (!loaded.ok()) return fail_post(voice, loaded.error());
      args.set("robot", *loaded);
    } else {
      auto found = ask("robot.get", Map{{"name", how.robot}});
      if (!found.ok()) return fail_post(voice, found.error());
      args.set("robot", *found);
    }
  }
  if (!how.world.empty() && !is_script) {
    auto loaded = ask("file.load", Map{{"file", how.world}});
    if (!loaded.ok()) return fail_post(voice, loaded.error());
    auto placed = ask("world.add_program", Map{{"id", *loaded}, {"program", *program}});
    if (!placed.ok()) return fail_post(voice, placed.error());
    args.set("world", *loaded);
  }
  if (!how.side_by_side.empty()) return compare_posts(p, s, voice, how, args);
  if (!how.folder.empty()) args.set("folder", how.folder);
  if (!how.name.empty()) args.set("name", how.name);
  if (!how.only_robot.empty()) args.set("only_robot", how.only_robot);
  args.set("run_check", how.run_check);
  if (!how.picture.empty()) args.set("picture", how.picture);
  if (!how.plot.empty()) args.set("plot", how.plot);
  args.set("form", how.form);
  args.set("overwrite", how.overwrite);
  // All faults are wanted, not the first: what is wrong is looked for before anything is written.
  args.set("check", true);
  auto posted = ask("program.post", args);
  if (!posted.ok()) return fail_post(voice, posted.error());
  const Map found = *posted->as_map();
  const bool is_correct = *found.find("correct")->as_bool();
  if (is_correct && !how.check && !how.folder.empty()) {
    args.set("check", false);
    args.set("run_check", false);  // it has just been correct
    args.erase("picture");
    args.erase("plot");
    posted = ask("program.post", args);
    if (!posted.ok()) return fail_post(voice, posted.error());
  }
  if (voice.json()) {
    voice.result(*posted, "");
    return is_correct ? 0 : 1;
  }
  tell_faults(s, *found.find("faults")->as_list());
  if (const Value* run = found.find("run"); run && !s.quiet)
    for (const Value& each : *run->as_map()->find("not_checked")->as_list())
      std::fprintf(stderr, "not checked: %s\n", text::visible(*each.as_string()).c_str());
  if (!is_correct) return 1;
  const Map written = *posted->as_map();
  for (const Value& each : *written.find("files")->as_list()) {
    const Map& f = *each.as_map();
    if (const Value* path = f.find("path")) voice.line(*path->as_string());
    else if (!how.check) {
      voice.line("=== " + *f.find("name")->as_string());
      std::string text = *f.find("text")->as_string();
      if (text.ends_with('\n')) text.pop_back();
      voice.line(text);
    }
  }
  return 0;
}

int run_post_test(const Settings& s, const Voice& voice, const PostTest& how) {
  Program p;
  if (auto started = start(p, s, voice, "post"); !started.ok()) return voice.fail(started.error());
  if (how.what.empty())
    return voice.fail(no_target(p, "post test needs a target",
                                "Write post test krl, or a plugin, pack or controller"));
  const Ask ask = [&](const char* command, const Map& args) {
    return p.app->dispatch(*p.session, command, args);
  };
  std::error_code none;
  const bool is_pack = how.what.ends_with(".post") ||
                       std::filesystem::is_regular_file(
                           std::filesystem::path(how.what) / program_post::kPackFile, none);
  if (is_pack && tell_pack_faults(s, voice, how.what)) return 3;
  Map report;
  const auto tested = test_post(
      *p.app, ask, how,
      [&](const std::string& l) {
        if (!voice.json()) voice.line(text::visible(l));
      },
      report);
  if (!tested.ok()) return fail_post(voice, tested.error());
  if (voice.json()) voice.result(report, "");
  return *tested;
}

}  // namespace robomosp::shell
