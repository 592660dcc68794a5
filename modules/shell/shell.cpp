// SPDX-License-Identifier: Apache-2.0
// The command line of `robomosp`.
#include "shell/shell.h"

#include <signal.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "kernel/text.h"
#include "shell/connecting.h"
#include "shell/inspection.h"
#include "shell/interactive.h"
#include "shell/posting.h"
#include "shell/program.h"
#include "shell/scripts.h"
#include "shell/serving.h"

namespace robomosp::shell {

namespace {

/// A usage fault of CLI11 as one sentence.
int usage_fault(const Voice& voice, const CLI::App& cli, const CLI::ParseError& e) {
  std::string what = e.what();
  while (!what.empty() && (what.back() == '.' || what.back() == '\n')) what.pop_back();
  const auto subcommands = [](const CLI::App& of) {
    std::vector<std::string> names;
    for (const CLI::App* sub : of.get_subcommands([](const CLI::App*) { return true; }))
      names.push_back(sub->get_name());
    return names;
  };
  // CLI11 says only that a subcommand is missing, not which word was none.
  const auto parsed = cli.get_subcommands();
  const auto extras = cli.remaining(true);
  if (dynamic_cast<const CLI::RequiredError*>(&e) && parsed.size() == 1 && !extras.empty()) {
    const auto known = subcommands(*parsed.front());
    if (!known.empty()) {
      const std::string near = text::did_you_mean(extras.front(), known);
      return voice.fail(error(
          ErrorCode::usage,
          parsed.front()->get_name() + " has no subcommand " + text::quote(extras.front()),
          (near.empty() ? std::string() : near + " ") + "It has " + text::enumerate(known) + "."));
    }
  }
  const std::vector<std::string> names = subcommands(cli);
  std::string hint = "robomosp --help lists the subcommands.";
  const auto word = what.rfind(' ');
  if (dynamic_cast<const CLI::ExtrasError*>(&e) && word != std::string::npos)
    if (const std::string near = text::did_you_mean(what.substr(word + 1), names); !near.empty())
      hint = near + " " + hint;
  return voice.fail(error(ErrorCode::usage, std::move(what), std::move(hint)));
}

}  // namespace

int shell_main(int argc, char** argv) {
  ::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is an error of whoever writes it
  Settings s;
  CLI::App cli("ROBOMOSP: robotics modeling and simulation. Without a subcommand: the console.",
               "robomosp");
  cli.set_version_flag("--version", "robomosp " ROBOMOSP_VERSION " (" + lua::lua_version() +
                                        ", SDK " RMP_SDK_VERSION ", " RMP_ABI_TAG ")");
  cli.add_flag("--json", s.json, "Results and errors as JSON objects on standard output");
  cli.add_flag("-q,--quiet", s.quiet, "No warnings, banner or progress");
  cli.add_flag(
      "--no-cache", s.no_cache,
      "Do not use the caches: compute every derived value anew, and keep none between runs");
  cli.add_flag("--trust", s.trust,
               "Run Lua solvers that are stored in files in this run, without asking");
  cli.add_flag("--no-plugins", s.no_plugins,
               "Load no plugin at the start, not even the shipped ones");
  cli.add_flag("--trace", s.trace, "Show the call stack of a script's error");
  cli.add_option("--color", s.color, "auto, always or never; NO_COLOR is respected")
      ->check(CLI::IsMember({"auto", "always", "never"}));
  cli.add_option("--plugin-path", s.plugin_path,
                 "Folder of plugins, searched first (may be repeated)")
      ->allow_extra_args(false);
  cli.add_option("--library", s.library,
                 "Folder of materials, parts and robots instead of the shipped one")
      ->allow_extra_args(false);
  cli.require_subcommand(0, 1);
  cli.fallthrough();

  std::string file, code, folder;
  CLI::App* run = cli.add_subcommand("run", "Run a Lua script: run FILE [ARGS...]");
  run->add_option("file", file, "Script")->required();
  Sandbox sandbox;
  run->add_flag("--sandbox", sandbox.is_wanted,
                "Run an untrusted script: in a locked process, with the effects of --allow");
  run->add_option("--allow", sandbox.allow, "With --sandbox: effects that its commands may have")
      ->capture_default_str();
  run->add_option("--limits", sandbox.limits,
                  "With --sandbox: memory=256,cpu=10,wall=60,output=1 (MiB, s, s, MiB)");
  run->add_flag("--without-seccomp", sandbox.without_seccomp,
                "With --sandbox: run even if the system cannot filter system calls");
  run->prefix_command();
  CLI::App* eval =
      cli.add_subcommand("eval", "Evaluate one expression or statement and print the result");
  eval->add_option("code", code, "Lua")->required();
  CLI::App* rpc =
      cli.add_subcommand("rpc", "JSON-RPC 2.0 on standard input and output, one message per line");
  CLI::App* language_server = cli.add_subcommand(
      "language-server",
      "Language server for robot programs in editors: LSP on standard input and output");
  CLI::App* debug_adapter = cli.add_subcommand(
      "debug-adapter",
      "Debug adapter for robot programs in editors: DAP on standard input and output");
  bool is_stdio = true;
  language_server->add_flag("--stdio", is_stdio, "Accepted without effect: some editors pass it");
  debug_adapter->add_flag("--stdio", is_stdio, "Accepted without effect: some editors pass it");
  ServeSettings how;
  CLI::App* serve = cli.add_subcommand(
      "serve", "Let other programs work on one world: JSON-RPC and classic lines over sockets");
  serve->add_option("script", how.script, "Lua script to run first");
  serve
      ->add_option("--listen", how.listen,
                   "HOST:PORT, [IPv6]:PORT or unix:PATH (may be repeated); default: 127.0.0.1:7007")
      ->allow_extra_args(false);
  serve->add_option("--certificate", how.certificate, "TLS: PEM file of the certificate");
  serve->add_option("--key", how.key, "TLS: PEM file of the private key, mode 600");
  serve->add_flag("--tls-everywhere", how.tls_everywhere, "TLS also on addresses of this machine");
  serve->add_option("--token-file", how.token_file, "File of tokens instead of the user's");
  serve->add_flag("--needs-token", how.needs_token, "Clients on this machine need a token, too");
  serve
      ->add_option("--allow", how.allow,
                   "Rights of clients without a token; default: reads,edits,simulates")
      ->delimiter(',')
      ->allow_extra_args(false);
  serve
      ->add_option("--grant", how.grant,
                   "A command that clients without a token may run (repeatable)")
      ->allow_extra_args(false);
  serve->add_option("--folder", how.folder,
                    "Folder of the files that clients without a token read and write");
  serve->add_option("--limit", how.limits, "A limit, such as seconds=60 (may be repeated)")
      ->allow_extra_args(false);
  serve->add_flag("--browser", how.browser,
                  "Serve browsers, too: a page at the same address shows the world");
  serve
      ->add_option(
          "--origin", how.origins,
          "Origin of other pages that may connect, such as https://robots.example (repeatable)")
      ->allow_extra_args(false);
  serve->add_option("--audit", how.audit, "File to which a line is appended for each request");
  ConnectSettings there;
  CLI::App* connect = cli.add_subcommand(
      "connect", "Console of a program that runs a server: HOST:PORT, [IPv6]:PORT or unix:PATH");
  connect->add_option("address", there.address, "Address of the server")->required();
  connect->add_option("--token-file", there.token_file, "File with the token, mode 600");
  connect->add_option("--certificate", there.certificate,
                      "TLS: PEM file of the certificate to trust; default: those of the system");
  connect->add_flag("--tls", there.tls,
                    "TLS also with this machine; for other hosts it is the default");
  connect->add_flag("--no-tls", there.no_tls, "No TLS: others can read the connection")
      ->excludes("--tls")
      ->excludes("--certificate");
  connect->add_option("--timeout", there.seconds, "Time limit for connecting [s]")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  PostSettings posted;
  CLI::App* post =
      cli.add_subcommand("post",
                         "Write a program in a controller's language: post PROGRAM.irl --target "
                         "krl -o FOLDER; exit code 1 if it cannot be translated");
  post->add_option("file", posted.file, "Program");
  post->add_option("--target", posted.target, "Language, such as krl, rapid or c");
  post->add_option("--profile", posted.profile,
                   "Controller: a name of the library, or a .ctl file");
  post->add_option("--robot", posted.robot, "Robot: a name of the library, or a .rbt file");
  post->add_option("-o,--output", posted.folder,
                   "Existing folder for the files; if omitted, they are printed");
  post->add_option("--form", posted.form, "automatic, structured or flat")
      ->check(CLI::IsMember({"automatic", "structured", "flat"}))
      ->capture_default_str();
  post->add_option("--name", posted.name, "Name of the program on the controller");
  post->add_option("--only-robot", posted.only_robot,
                   "For a program for several robots: the part for this one's controller");
  post->add_option("--templates", posted.templates, "Target made of templates: its file");
  post->add_flag("--check", posted.check, "List the faults and write nothing");
  post->add_flag(
      "--run-check", posted.run_check,
      "Check it by a run, in the world or alone with the robot; if it has errors, post nothing");
  post->add_option("--world", posted.world,
                   "World for the run: a .wld file, or a .lua script that makes it");
  CLI::Option* const is_run = post->get_option("--run-check");
  post->add_option("--picture", posted.picture,
                   "With --run-check: the path of the tool, a .png file")
      ->needs(is_run);
  post->add_option("--plot", posted.plot,
                   "With --run-check: joints against their limits, .svg, .png or .pdf")
      ->needs(is_run);
  post->add_option("--side-by-side", posted.side_by_side,
                   "Page with the code of several targets (--target krl,rapid): .html, .md or .txt")
      ->excludes("--only-robot");
  post->add_flag("--overwrite", posted.overwrite, "Replace existing files");
  post->footer(
      "Exit codes: 0 posted; 1 the program has errors, or the target cannot express it: nothing is "
      "written; 2 wrong usage; 3 wrong input: a file, folder, pack, target, robot or controller "
      "that is missing or cannot be used; 130 interrupted.");
  post->require_subcommand(0, 1);
  PostTest tested;
  CLI::App* post_test = post->add_subcommand("test",
                                             "Test a target with the sample programs and every "
                                             "construct; the exit code is 1 if anything is wrong");
  post_test->add_option("what", tested.what,
                        "Target, plugin (.so), pack (.post), its folder, or a controller (.ctl)");
  post_test
      ->add_option("--robot", tested.robot, "Robot: a name of the library, a .rbt file, or none")
      ->capture_default_str();
  post_test->add_option("--profile", tested.profile,
                        "Controller: a name of the library, or a .ctl file");
  post_test->add_option("--program", tested.programs, "An additional program (may be repeated)")
      ->allow_extra_args(false);
  post_test->add_option(
      "--reader", tested.reader,
      "Folder for the files that an independent reader needs to read the posts back");
  post_test->add_flag("--brief", tested.brief, "Only list constructs that are refused or wrong");
  post_test->footer(
      "Exit codes: 0 nothing is wrong; 1 something is lost, has no line or differs the second "
      "time; 2 "
      "wrong usage; 3 wrong input: nothing could be tested; 130 interrupted.");
  IrlWords program;
  IrlSettings& irl_how = program.settings;
  CLI::App* irl = cli.add_subcommand(
      "irl",
      "Run a robot program: irl PROGRAM.irl alone, with --robot NAME, or with --connect HOST:PORT "
      "in the world of a server; the exit code is 1 after a fault, 5 after HALT");
  irl->add_option("file", irl_how.file, "Program; also in a controller's language (program.import)")
      ->required();
  irl->add_flag("--check", irl_how.check, "List the faults and do not run it");
  irl->add_flag("--code", irl_how.code, "Only print its three-address code");
  irl->add_option(
         "--set", irl_how.set,
         "NAME=VALUE of a variable, assigned after its declaration, or of an input (repeatable)")
      ->allow_extra_args(false);
  irl->add_option("--language", irl_how.language,
                  "Language or reader, if the file's text does not identify it");
  irl->add_option("--robot", irl_how.robot,
                  "Robot that it moves: a name of the library or a .rbt file; with --connect its "
                  "name in the world");
  irl->add_option("--frame", irl_how.frame,
                  "Frame or object of the world in which targets are given");
  irl->add_option("--tool", irl_how.tool, "Tool of the robot for the targets");
  irl->add_option("--bind", irl_how.bind, "NAME=SIGNAL of the world (repeatable)")
      ->allow_extra_args(false);
  irl->add_option("--grip", irl_how.grip,
                  "NAME of an output that grips and releases, or NAME=OBJECT (repeatable)")
      ->allow_extra_args(false);
  irl->add_flag("--free", irl_how.free, "Signals that the world lacks belong to the program");
  irl->add_option("-o,--output", irl_how.record,
                  "Recording of the run: a .csv, .npz, .json or .rec file");
  irl->add_option("--most-time", irl_how.most_time, "Longest time of a run with a robot [s]")
      ->check(CLI::Range(1e-3, 1e9))
      ->capture_default_str();
  irl->add_option("--most-instructions", irl_how.most_instructions,
                  "Without a robot: limit of instructions; 0 is no limit")
      ->check(CLI::Range(0.0, 9e15))
      ->capture_default_str();
  irl->add_flag("--real-time", irl_how.real_time, "Waits take their time even without a robot");
  irl->add_flag("--fast", irl_how.fast, "With --connect: as fast as possible");
  irl->add_option("--connect", irl_how.connect,
                  "HOST:PORT, [IPv6]:PORT or unix:PATH of a program that runs a server");
  irl->add_option("--world", irl_how.world, "With --connect: name of the world on the server");
  irl->add_option("--token-file", program.token_file, "File with the token, mode 600");
  irl->add_option("--certificate", irl_how.certificate,
                  "TLS: PEM file of the certificate to trust; default: those of the system");
  irl->add_flag("--tls", irl_how.tls,
                "TLS also with this machine; for other hosts it is the default");
  irl->add_flag("--no-tls", irl_how.no_tls, "No TLS: others can read the connection")
      ->excludes("--tls")
      ->excludes("--certificate");
  irl->add_option("--timeout", irl_how.seconds, "Time limit for connecting [s]")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  CLI::App* classic =
      cli.add_subcommand("classic",
                         "Run classic command lines in order, such as: classic \"Worlds Open "
                         "worlds/pa10_circle.wld\" \"PRobot pa10 mGetDHP\"");
  classic->prefix_command();
  CLI::App* plugin = cli.add_subcommand("plugin", "Inspect plugins");
  plugin->require_subcommand(1);
  CLI::App* plugin_list =
      plugin->add_subcommand("list", "List the plugins that were found and loaded");
  CLI::App* plugin_check = plugin->add_subcommand(
      "check", "Load a file in a child process and report whether it would be accepted");
  plugin_check->add_option("file", file, "Plugin file")->required();
  CLI::App* plugin_test =
      plugin->add_subcommand("test",
                             "Run the conformance suites of the SDK on all providers of a file: "
                             "test FILE [GTEST OPTIONS...]");
  plugin_test->add_option("file", file, "Plugin file")->required();
  std::string sdk;
  plugin_test->add_option("--sdk", sdk, "Prefix of the installed SDK with the suites");
  plugin_test->prefix_command();
  CLI::App* commands = cli.add_subcommand("commands", "List the commands");
  commands->add_option("--markdown", folder, "Write the reference pages to this folder");
  CLI::App* doctor = cli.add_subcommand("doctor", "Show versions, folders, and missing parts");
  std::string about;
  CLI::App* help = cli.add_subcommand("help", "Show this text, or that of a subcommand");
  help->add_option("subcommand", about, "Subcommand");
  // Subcommands inherit the fallthrough of global options; what follows these two belongs to the
  // script or the line.
  run->fallthrough(false);
  classic->fallthrough(false);
  plugin_test->fallthrough(false);

  // `robomosp file.lua` is `robomosp run file.lua`.
  std::vector<char*> given_words(argv, argv + argc);
  std::string run_word = "run";
  for (std::size_t i = 1; i < given_words.size(); ++i) {
    const std::string_view word = given_words[i];
    if (word == "--color" || word == "--plugin-path" || word == "--library") {
      ++i;
    } else if (!word.starts_with('-')) {
      if (word.ends_with(".lua"))
        given_words.insert(given_words.begin() + static_cast<std::ptrdiff_t>(i), run_word.data());
      break;
    }
  }

  cli.footer(
      "Examples:\n"
      "  robomosp                                   the console; help() explains\n"
      "  robomosp cell.lua                          run a script\n"
      "  robomosp < lines.txt                       run lines as they are typed at the console\n"
      "  robomosp eval 'robot(\"puma560\"):fk{q = {0, \"90 deg\", 0, 0, 0, 0}}.position'\n"
      "  robomosp irl weld.irl --robot kr5 -o weld.csv\n"
      "  robomosp post weld.irl --target krl --robot kr5 -o .\n"
      "  robomosp serve cell.lua --browser          share a world with other programs\n"
      "  robomosp help post                         options of a subcommand");

  // After parsing, CLI11 gives the help of the subcommand that was parsed.
  const std::string overview = cli.help();
  try {
    cli.parse(static_cast<int>(given_words.size()), given_words.data());
  } catch (const CLI::Success& e) {
    return cli.exit(e);
  } catch (const CLI::ParseError& e) {
    // Options may not have been read yet; --json must hold for this error too.
    for (int i = 1; i < argc; ++i) s.json = s.json || std::string_view(argv[i]) == "--json";
    return usage_fault(Voice(s), cli, e);
  }
  Voice voice(s);
  if (s.json) (void)voice.keep_output();
  if (help->parsed()) {
    if (about.empty()) {
      voice.line(overview);
      return 0;
    }
    for (const CLI::App* subcommand : cli.get_subcommands(nullptr)) {
      if (subcommand->get_name() != about) continue;
      voice.line(subcommand->help("robomosp"));
      return 0;
    }
    return voice.fail(error(ErrorCode::usage, "there is no subcommand " + text::quote(about),
                            "robomosp --help lists the subcommands."));
  }
  if (run->parsed()) {
    if (sandbox.is_wanted) return run_sandboxed(s, voice, file, run->remaining(), sandbox);
    for (const char* only : {"--allow", "--limits", "--without-seccomp"})
      if (run->count(only) > 0)
        return voice.fail(error(ErrorCode::usage, std::string(only) + " goes with --sandbox",
                                "Write run --sandbox " + std::string(only) + " ... FILE."));
    return run_script(s, voice, file, run->remaining());
  }
  if (eval->parsed()) return run_eval(s, voice, code);
  if (post_test->parsed()) return run_post_test(s, voice, tested);
  if (post->parsed()) {
    if (posted.file.empty())
      return voice.fail(error(ErrorCode::usage, "post needs a program",
                              "Write post PROGRAM.irl --target krl, or post test TARGET."));
    return run_post(s, voice, posted);
  }
  if (irl->parsed()) return run_program(s, voice, program);
  if (rpc->parsed()) return run_rpc(s, voice);
  if (language_server->parsed()) return run_language_server(s, voice);
  if (debug_adapter->parsed()) return run_debug_adapter(s, voice);
  if (serve->parsed()) return run_serve(s, voice, how);
  if (connect->parsed()) return run_connect(s, voice, there);
  if (classic->parsed()) {
    const auto words = classic->remaining();
    if (words.empty())
      return voice.fail(error(ErrorCode::usage, "classic needs a command line",
                              "Write classic \"PRobot pa10 mGetDHP\"."));
    return run_classic(s, voice, classic_lines(words));
  }
  if (plugin_check->parsed()) return run_plugin_check(voice, file);
  if (plugin_test->parsed()) return run_plugin_test(voice, file, sdk, plugin_test->remaining());
  if (plugin_list->parsed()) return run_plugin_list(s, voice);
  if (commands->parsed()) return run_commands(s, voice, folder);
  if (doctor->parsed()) return run_doctor(s, voice);
  return run_console(s, voice);
}

}  // namespace robomosp::shell
