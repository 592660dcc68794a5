// SPDX-License-Identifier: Apache-2.0
#include "kernel/plugin_trial.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

#include "kernel/permit.h"
#include "kernel/process.h"
#include "kernel/text.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace robomosp {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProgram = "robomosp-plugin-trial";
/// What that program says at the end, when opening the file did not end it.
constexpr std::string_view kDone = "\x1erobomosp-plugin-trial: done\x1e";
constexpr const char* kMarker = "opening-";
/// A file that ended processes this often is not tried any more.
constexpr int kMostFailures = 2;

// Read by a handler of exit(), which carries no context.
std::array<char, 4096> g_opening{};

/// A plugin called exit() while it was opened: that is no success.
void at_exit() {
  if (g_opening[0] == '\0') return;
  std::fprintf(stderr,
               "error: plugin \"%s\" ended the program while it was loaded. It is left out at the "
               "next start; --no-plugins starts without any.\n",
               g_opening.data());
  std::fflush(stderr);
  ::_exit(3);
}

/// When a process began, in ticks since the machine did; "" = there is no such process.
std::string start_of(std::string_view pid) {
  std::ifstream in("/proc/" + std::string(pid) + "/stat");
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const auto name_end = text.rfind(')');  // the name may hold anything
  if (name_end == std::string::npos) return {};
  std::istringstream rest(text.substr(name_end + 1));
  std::string field;
  for (int i = 3; i <= 22; ++i) rest >> field;  // proc(5): starttime is the 22nd
  return field;
}

class Silent final : public Progress {
 public:
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return false; }
};

Error left_out(const std::string& what, const std::string& hint) {
  return error(ErrorCode::plugin_refused, what, hint);
}

}  // namespace

fs::path PluginTrials::state_folder() {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  if (state && *state == '/') return fs::path(state) / "robomosp" / "plugins";
  if (home && *home) return fs::path(home) / ".local" / "state" / "robomosp" / "plugins";
  return {};
}

PluginTrials::PluginTrials(fs::path state, double seconds)
    : state_(std::move(state)), seconds_(seconds) {
  if (state_.empty()) return;
  read();
  find_deaths();
}

PluginTrials::~PluginTrials() {
  if (marker_file_ >= 0) ::close(marker_file_);
  std::error_code ignored;
  if (!marker_.empty()) fs::remove(marker_, ignored);
}

std::string PluginTrials::key_of(const fs::path& file) {
  struct stat s {};
  if (::stat(file.c_str(), &s) != 0) return {};
  return std::to_string(s.st_size) + " " + std::to_string(s.st_mtim.tv_sec) + "." +
         std::to_string(s.st_mtim.tv_nsec) + " " + file.string();
}

/// One line a file: failures, passed, sits out, then size, time and path, a tab, how it failed.
void PluginTrials::read() {
  std::ifstream in(state_ / "trials");
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    Record r;
    std::string key;
    if (!(words >> r.failures >> r.passed >> r.sits_out) || words.get() != ' ') continue;
    std::getline(words, key, '\t');
    std::getline(words, r.how);
    if (!key.empty()) records_.insert_or_assign(key, std::move(r));
  }
}

void PluginTrials::write() const {
  if (state_.empty()) return;
  std::error_code failed;
  fs::create_directories(state_, failed);
  const fs::path temporary = state_ / ("trials." + std::to_string(::getpid()));
  {
    std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
    for (const auto& [key, r] : records_)
      if (key.find('\n') == std::string::npos)
        out << r.failures << ' ' << r.passed << ' ' << r.sits_out << ' ' << key << '\t' << r.how
            << '\n';
    if (!out.flush()) {
      out.close();
      fs::remove(temporary, failed);
      return;  // remembered for this run only
    }
  }
  fs::rename(temporary, state_ / "trials", failed);
}

/// Markers of processes that are no more: what they were opening ended them.
void PluginTrials::find_deaths() {
  std::error_code failed;
  bool found = false;
  for (fs::directory_iterator it(state_, failed), end; !failed && it != end; it.increment(failed)) {
    const std::string name = it->path().filename().string();
    if (!name.starts_with(kMarker)) continue;
    const std::string pid = name.substr(std::strlen(kMarker));
    std::ifstream in(it->path());
    std::string start, key;
    std::getline(in, start);
    std::getline(in, key);
    // A process that has its marker but runs is another start; one of the same number is not it.
    if (const std::string now = start_of(pid); !now.empty() && now == start) continue;
    std::error_code ignored;
    fs::remove(it->path(), ignored);
    if (key.empty()) continue;  // nothing was being opened
    Record& r = records_[key];
    ++r.failures;
    r.passed = false;
    r.sits_out = true;
    r.how = "ended the program while it was loaded";
    found = true;
  }
  if (found) write();
}

Result<void> PluginTrials::try_out(const fs::path& file) const {
  ProcessSpec spec;
  spec.program = helper_program(kProgram);
  spec.arguments = {file.string()};
  spec.seconds = seconds_;
  spec.memory = std::uint64_t{64} << 30;
  spec.most_output = std::uint64_t{16} << 20;
  Silent progress;
  const PermitScope own(nullptr);  // the loader's own business, whoever asked for the plugin
  auto said = run_process(spec, progress);
  if (!said.ok()) {
    // Without the helper (a program that is not installed with it) only the marker guards.
    if (said.error().code == ErrorCode::not_found) return {};
    std::string how = said.error().message;
    if (how.starts_with("it took longer"))
      how = "did not come back within " + text::print_rounded(seconds_) + " s while it was loaded";
    else if (how.starts_with("it ended with"))
      how = "ended the process that loaded it" + how.substr(std::strlen("it ended"));
    else if (how.starts_with("it crashed")) how = how.substr(3) + " while it was loaded";
    return error(ErrorCode::plugin_refused, how);
  }
  if (!said->ends_with(kDone))
    return error(ErrorCode::plugin_refused, "ended the process that loaded it");
  return {};
}

Result<void> PluginTrials::admit(const fs::path& file, bool trusted, bool is_asked) {
  const std::string key = key_of(file);
  if (key.empty()) return {};  // the loader says what it cannot open
  const auto known = records_.find(key);
  const int failures = known == records_.end() ? 0 : known->second.failures;
  if (failures == 0 && (trusted || (known != records_.end() && known->second.passed))) return {};
  if (failures > 0 && !is_asked) {
    Record& r = known->second;
    if (failures >= kMostFailures)
      return left_out("it " + r.how + ", " + std::to_string(failures) + " times, and is left out",
                      "Update or remove it; plugin.load tries it once more.");
    if (r.sits_out) {
      r.sits_out = false;
      const std::string how = r.how;
      write();
      return left_out("it " + how + " at the start before, and is left out",
                      "It is tried once more at the next start; remove it if it is not needed.");
    }
  }
  const auto tried = try_out(file);
  // Older builds of the same file are of no interest any more.
  const std::string path = " " + file.string();
  std::erase_if(records_, [&](const auto& r) { return r.first != key && r.first.ends_with(path); });
  Record& r = records_[key];
  if (tried.ok()) {
    r.passed = true;
    if (is_asked) r.failures = 0;
    write();
    return {};
  }
  ++r.failures;
  r.passed = false;
  r.how = tried.error().message;
  const bool is_last = r.failures >= kMostFailures;
  const std::string how = r.how;
  write();
  return left_out("it " + how + ", and is left out",
                  is_last ? "Update or remove it; plugin.load tries it once more."
                          : "It is tried once more at the next start; remove it if it is not "
                            "needed.");
}

PluginTrials::Opening::Opening(PluginTrials& trials, const fs::path& file) : trials_(trials) {
  static const bool registered = std::atexit(&at_exit) == 0;
  (void)registered;
  const std::string text = file.string();
  const std::size_t n = std::min(text.size(), g_opening.size() - 1);
  std::copy_n(text.data(), n, g_opening.data());
  g_opening[n] = '\0';
  if (trials_.state_.empty()) return;
  if (trials_.marker_file_ < 0) {
    std::error_code failed;
    fs::create_directories(trials_.state_, failed);
    trials_.marker_ = trials_.state_ / (kMarker + std::to_string(::getpid()));
    trials_.marker_file_ =
        ::open(trials_.marker_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  }
  if (trials_.marker_file_ < 0) return;  // no place to remember: only the trial guards
  const std::string what = start_of("self") + "\n" + key_of(file) + "\n";
  if (::ftruncate(trials_.marker_file_, 0) != 0) return;
  [[maybe_unused]] const ssize_t written =
      ::pwrite(trials_.marker_file_, what.data(), what.size(), 0);
}

PluginTrials::Opening::~Opening() {
  g_opening[0] = '\0';
  if (trials_.marker_file_ >= 0) {
    [[maybe_unused]] const int cut = ::ftruncate(trials_.marker_file_, 0);
  }
}

}  // namespace robomosp
