// SPDX-License-Identifier: Apache-2.0
// The adapter between an editor and programs that are debugged, and what its files share, one for
// each subject of requests (layer: application, remote only).
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "kernel/call_queue.h"
#include "kernel/text.h"
#include "remote/debuggee.h"
#include "remote/framed_messages.h"

namespace robomosp::remote::adapter {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

inline constexpr std::size_t kMostWaitingRequests = std::size_t{64}
                                                    << 20;  ///< bytes that wait to be answered
inline constexpr std::size_t kMostBreakpoints = 100'000;    ///< of all sources; of all routines
inline constexpr std::size_t kMostSources = 10'000;         ///< that have breakpoints, or had
inline constexpr std::size_t kMostReferences = 200'000;     ///< of one stop
inline constexpr std::size_t kMostParts = 10'000;           ///< of one answer
inline constexpr std::size_t kMostNotes = 1000;             ///< reported at once
inline constexpr std::size_t kMostTargets = 50;             ///< of one gotoTargets
inline constexpr std::size_t kMostCompletions = 500;
inline constexpr const char* kAsks =
    "The program waits for a line: type it in the debug console, and continue.";
inline constexpr std::uint64_t kMostSource = std::uint64_t{16}
                                             << 20;      ///< of a file that is compared
inline constexpr auto kFirstNap = 1ms, kMostNap = 20ms;  ///< between looks at programs that run
inline constexpr auto kFarNap = 50ms;                    ///< the same in another program
inline constexpr auto kIdle = 100ms;
/// How long what runs may take when the input has ended.
inline constexpr auto kLastWork = 5s;
inline constexpr int kAdapterAgain = 20;  ///< between requests to end [ms]

inline constexpr int kEndedByUser = 130;

struct AdapterFailure {
  std::string sentence;
  std::string word = {};  ///< "cancelled" or "notStopped", as the protocol has them
};
using Answer = std::variant<Json, AdapterFailure>;

// ---- values of commands ----

const Value* at(const Value& v, std::string_view name);
std::string text_at(const Value& v, std::string_view name);
std::int64_t number_at(const Value& v, std::string_view name, std::int64_t otherwise = 0);
double real_at(const Value& v, std::string_view name);
bool flag_at(const Value& v, std::string_view name);
const List& list_of(const Value& v);
const List& list_at(const Value& v, std::string_view name);
bool same(std::string_view a, std::string_view b);
std::string_view line_of(std::string_view text, std::size_t line);
/// Bytes before a column as units of UTF-16, both from 1.
std::int64_t units(std::string_view line, std::int64_t column);
/// The byte behind so many units of UTF-16.
std::size_t byte_behind(std::string_view text, std::size_t count);
std::string seconds(double t);
/// Requests of the protocol that are not served, and why.
const char* why_not(std::string_view command);

class Adapter {
 public:
  Adapter(ioci::Application& app, ioci::Session& session, lua::LuaState& lua, int in, int out);
  ~Adapter();
  Adapter(const Adapter&) = delete;
  Adapter& operator=(const Adapter&) = delete;

  void print(std::string_view text) { say(std::string(text), "stdout"); }

  int run();

 private:
  struct Waiting {
    Json message;
    std::size_t bytes = 0;
    bool is_cancelled = false;
  };

  // ---- output [any thread] ----

  void write(Json message);
  void event(const char* name, Json body);
  void say(const std::string& text, const char* category);
  /// Something is wrong that no request is answered with.
  void complain(const std::string& sentence) { say(sentence + "\n", "important"); }
  /// Behind the answer to the request that is handled.
  void later(const char* name, Json body) { events_.emplace_back(name, std::move(body)); }
  void tell_events();

  void answer(const Json& request, Answer made);

  // ---- the reader's thread ----

  void read_all();

  void take(std::string body);
  void cancel(const Json& request);
  /// With mutex_ held.
  void interrupt_current();
  bool interrupts_again();

  // ---- the session's thread ----

  int work();

  using Method = Answer (Adapter::*)(const Json&);
  enum class Needs : std::uint8_t { nothing, initialized, loaded, stopped };
  struct Request {
    Method method;
    Needs needs;
  };
  static const std::map<std::string, Request, std::less<>>& requests();

  void handle(const Waiting& w);

  Result<Value> ask(std::string_view command, Map args = {});
  static AdapterFailure failed(const Error& e);

  // ---- the session ----

  Answer initialize(const Json& a);

  /// A text of the arguments; an error where it is something else.
  static Result<std::string> text_argument(const Json& a, const char* name);
  static Result<std::vector<std::string>> texts_argument(const Json& a, const char* name);
  static Result<std::optional<double>> number_argument(const Json& a, const char* name);
  static Result<bool> flag_argument(const Json& a, const char* name);
  /// What launch and attach have in common.
  Result<RunSettings> run_settings(const Json& a);
  [[nodiscard]] std::string entry() const;

  Answer launch(const Json& a);

  Answer attach(const Json& a);

  Answer loaded(std::unique_ptr<Debuggee> made, const char* how);

  /// Names of the programs and their files.
  Result<void> know_programs();

  Answer configuration_done(const Json&);
  /// The programs are before their first statement, or where another client has left them.
  Answer begin();

  Answer disconnect(const Json& a);

  Answer terminate(const Json&);

  Answer restart(const Json& a);

  // ---- breakpoints ----

  /// A program of the run.
  struct Known {
    std::string name;
    std::vector<std::string> files;
  };
  struct Wanted {
    std::int64_t id = 0;
    std::int64_t line = 0;
    std::string routine, condition, hits, log;
    std::vector<std::int64_t> numbers;  ///< of the run
    bool is_verified = false;
    std::int64_t at_line = 0, at_column = 0;
    std::string message, program, file;
  };
  struct WantedOf {
    std::string path, name;  ///< of the source
    std::int64_t reference = 0;
    std::vector<Wanted> all;
  };

  Json shown(const Wanted& w);
  void clear(Wanted& w);
  void clear_all();
  void set(Wanted& w, const Known& program, const std::string& file);
  /// Into the run, as far as it has the file or the routine.
  void place(WantedOf& of);
  void place(Wanted& w);
  /// All that are known, as a new run has none.
  void place_breakpoints();

  /// Files of programs that a source means.
  std::vector<std::pair<const Known*, std::string>> files_of(const WantedOf& of);

  /// Path, name and reference of a source of the arguments.
  Result<WantedOf> source_argument(const Json& a);

  Answer set_breakpoints(const Json& a);

  Answer set_function_breakpoints(const Json& a);

  Answer set_exception_breakpoints(const Json& a);

  Answer breakpoint_locations(const Json& a);

  // ---- sources ----

  fs::path path_of(const std::string& given) const;
  /// A text with the places where its lines begin.
  struct Lines {
    std::string text;
    std::vector<std::size_t> starts;
    [[nodiscard]] std::string_view at(std::int64_t line) const {
      if (line < 1 || static_cast<std::size_t>(line) > starts.size()) return {};
      const std::string_view rest =
          std::string_view(text).substr(starts[static_cast<std::size_t>(line) - 1]);
      return rest.substr(0, rest.find('\n'));
    }
  };
  const Lines& program_lines(const std::string& program, const std::string& file);
  /// Whether a file on the disk is what a program runs.
  bool has_text(const fs::path& path, const std::string& program, const std::string& file);
  /// By the path of a file that has its text, else by a number under which it can be asked for.
  Json source_of(const std::string& program, const std::string& file);
  std::int64_t column_of(const std::string& program, const std::string& file, std::int64_t line,
                         std::int64_t column);

  Answer loaded_sources(const Json&);

  Answer source(const Json& a);

  // ---- where it is ----

  struct Thread {
    std::string program;
    std::int64_t process = 0;
    bool operator<(const Thread& o) const {
      return std::pair(program, process) < std::pair(o.program, o.process);
    }
  };
  std::int64_t thread_number(const Thread& t);
  std::int64_t first_thread();
  Result<Thread> thread_argument(const Json& a);

  Answer threads(const Json&);
  /// Reports to the editor which processes have begun and ended since.
  void tell_threads();

  /// What is written and noted since.
  void tell_notes(const Value& place);
  /// "t = 6.32 s: carry: text" is what a program writes; everything else is passed on as it is.
  void tell_note(const std::string& note);

  void runs();
  void forget_stop();

  void look();

  /// Reports where it is, or that it is over. `thread`: that of the request.
  void arrived(const Value& place, std::int64_t thread);
  void hit(std::int64_t number, Json& body);
  void end(int code);

  // ---- continuing ----

  /// Forward: over what is recorded where the past is shown, else computed.
  Answer go_on(const Json& a, const char* command, const char* recorded);
  Answer continue_run(const Json& a);
  Answer next(const Json& a) { return go_on(a, "run.step_over", "over"); }
  Answer step_in(const Json& a) { return go_on(a, "run.step_into", "into"); }
  Answer step_out(const Json& a) { return go_on(a, "run.step_out", "out"); }

  void stopped_at(const Value& place, const Thread& thread, const char* reason,
                  const std::string& description);
  Answer go_back(const Json& a, const char* to, const char* reason);
  Answer step_back(const Json& a) { return go_back(a, "into", "step"); }
  Answer reverse_continue(const Json& a) { return go_back(a, "breakpoint", "breakpoint"); }

  Answer goto_targets(const Json& a);
  Answer go_to(const Json& a);

  Answer pause(const Json& a);

  // ---- frames and variables ----

  struct FramePlace {
    Thread thread;
    std::int64_t number = 1;  ///< of the stack, 1 is the innermost; 0 = program and modules
  };
  struct Reference {
    enum Kind : std::uint8_t { variables, parts, world } kind = variables;
    FramePlace frame;
    std::string path;  ///< of a variable, or of a member of the world
  };

  Answer stack_trace(const Json& a);
  std::int64_t frame_number(const FramePlace& f);
  /// Of an argument frameId; without one the program's and modules' variables.
  Result<FramePlace> frame_argument(const Json& a);
  static Map of_frame(const FramePlace& f);
  std::int64_t reference(Reference r);

  Answer scopes(const Json& a);

  Json variable(const Value& v, const std::string& path, const FramePlace& frame);
  static std::string part_path(const std::string& whole, const std::string& name);

  Answer variables(const Json& a);

  /// Time, signals, joints and objects of the world at the time that is shown.
  Answer world_variables(const Reference& r, std::size_t start, std::size_t count);

  Answer assigned(const FramePlace& frame, const std::string& path, const std::string& value);
  Answer set_variable(const Json& a);
  Answer set_expression(const Json& a);

  Answer evaluate(const Json& a);
  /// The place of := outside of texts.
  static std::size_t assignment(std::string_view s);

  Answer completions(const Json& a);

  Answer exception_info(const Json& a);

  ioci::Application& app_;
  ioci::Session& session_;
  lua::LuaState& lua_;
  const int in_, out_;
  const int wake_ = ::eventfd(0, EFD_CLOEXEC);  ///< ends the reader
  std::uint64_t messages_ = 0;

  std::mutex write_mutex_;
  std::int64_t said_ = 0;  // guarded by write_mutex_
  std::atomic<bool> is_broken_{false};

  std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by mutex_:
  std::deque<Waiting> waiting_;
  std::size_t waiting_bytes_ = 0;
  Json current_;  ///< seq of the request that is answered; null = none
  bool is_input_over_ = false, is_done_ = false;
  bool wants_interrupt_ = false;  ///< of the request that is answered, until it ends
  bool was_interrupted_ = false;  ///< by this, not by the user

  std::atomic<bool> cancel_{false};

  // The session's thread:
  struct Target {
    double time = 0;
    Thread thread;
  };
  std::unique_ptr<Debuggee> debuggee_;
  std::vector<Known> programs_;
  std::vector<std::pair<const char*, Json>> events_;
  Value speed_{"max"};
  bool is_initialized_ = false, is_configured_ = false, is_over_ = false;
  bool is_running_ = false, is_ended_ = false;
  bool is_faulted_ = false, is_end_told_ = false;
  std::string reads_;  ///< program that waits for a line; "" = none
  Value fault_;
  bool stops_on_entry_ = false, stops_at_end_ = false, has_no_debug_ = false;
  bool breaks_on_faults_ = true;
  bool has_types_ = false, has_paging_ = false;
  std::int64_t first_line_ = 1, first_column_ = 1;
  std::chrono::milliseconds nap_ = kFirstNap;
  Clock::time_point next_look_{};
  std::int64_t told_notes_ = 0;
  std::map<std::string, WantedOf> wanted_;  ///< by source
  std::vector<Wanted> functions_;
  std::int64_t breakpoints_made_ = 0;
  std::map<std::int64_t, std::pair<std::int64_t, bool>>
      ids_;                      ///< by number of the run; of a routine
  std::set<std::string> paths_;  ///< that the editor has named
  std::map<std::pair<std::string, std::string>, Json> sources_;  ///< by program and file
  std::map<std::pair<std::string, std::string>, Lines> texts_;   ///< the same
  std::map<std::int64_t, std::pair<std::string, std::string>> references_to_sources_;
  std::map<Thread, std::int64_t> threads_;
  std::map<std::int64_t, Thread> threads_by_number_;
  std::set<std::int64_t> threads_told_;
  // Of one stop:
  std::map<std::int64_t, FramePlace> frames_;
  std::map<std::pair<Thread, std::int64_t>, std::int64_t> frame_numbers_;
  std::int64_t frames_made_ = 0;  ///< of all stops
  std::map<Thread, Value> stacks_;
  std::vector<Reference> references_;
  std::vector<Target> targets_;
};

}  // namespace robomosp::remote::adapter
