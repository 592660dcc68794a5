// SPDX-License-Identifier: Apache-2.0
#include "program_post/run_c.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <system_error>

#include <robomosp/sdk/post_writer.h>

#include "program_post/run_c_files.h"
#include "kernel/letters.h"
#include "kernel/permit.h"
#include "kernel/process.h"
#include "kernel/text.h"

namespace robomosp::program_post {
namespace {

namespace fs = std::filesystem;

constexpr double kMostCompileSeconds = 60, kMostRunSeconds = 120;
constexpr std::uint64_t kMostMemory = std::uint64_t{2} << 30;
constexpr std::size_t kMostRecords = 2'000'000;

/// A folder that only this user reads, removed with the object.
class OwnFolder {
 public:
  OwnFolder() {
    std::error_code failed;
    std::string name = (fs::temp_directory_path(failed) / "robomosp-c-XXXXXX").string();
    if (!failed && ::mkdtemp(name.data()) != nullptr) path_ = name;
  }
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;
  ~OwnFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// The user's compiler; empty, and a sentence in `missing`, where there is none.
fs::path c_compiler(std::string& missing) {
  const char* chosen = std::getenv("ROBOMOSP_CC");
  const std::string wanted = chosen ? chosen : "";
  if (!wanted.empty() && wanted.front() == '/') return wanted;
  const std::vector<std::string> names =
      wanted.empty() ? std::vector<std::string>{"cc", "gcc", "clang"} : std::vector{wanted};
  for (const std::string& name : names)
    if (fs::path found = program_on_path(name); !found.empty()) return found;
  missing =
      wanted.empty()
          ? "there is no C compiler (cc, gcc or clang) on the search path; install one, or "
            "set ROBOMOSP_CC to another"
          : "the C compiler " + text::quote(wanted) + " of ROBOMOSP_CC is not on the search path";
  return {};
}
bool write_text(const fs::path& file, std::string_view text) {
  std::ofstream out(file, std::ios::binary);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  return static_cast<bool>(out.flush());
}
std::vector<double> numbers_in(std::istringstream& in) {
  std::vector<double> out;
  for (std::string word; in >> word;) {
    char* end = nullptr;
    const double v = std::strtod(word.c_str(), &end);
    if (end == word.c_str() || *end != '\0') break;
    out.push_back(v);
  }
  return out;
}
std::string reply(const std::vector<double>& v) {
  std::ostringstream out;
  out.precision(17);
  out << "ok";
  for (const double x : v) out << ' ' << x;
  out << '\n';
  return out.str();
}
std::string refusal(std::string message) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  return "no " + message.substr(0, 400) + "\n";
}
/// Rows of a pose, three of them, each with its place behind.
Pose pose_of_rows(const double* t, double to_metres) {
  Pose out;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) out.R[3 * r + c] = t[4 * r + c];
    out.p[r] = t[4 * r + 3] * to_metres;
  }
  return out;
}

/// Hears the program, and answers it.
class Listener {
 public:
  Listener(const CInputs& with, CCommands& out) : with_(with), out_(out), last_(with.start) {}
  std::string complaint;  ///< what the program itself said last
  bool is_over = false;

  std::string line(std::string_view text) {
    std::istringstream in{std::string(text)};
    std::string mark, what;
    in >> mark >> what;
    if (mark != "RMP!" && mark != "RMP?") {
      complaint = std::string(text.substr(0, 400));
      return {};
    }
    if (mark == "RMP?") return answer(what, in);
    if (++records_ > kMostRecords) {
      complaint = "it commands more than " + std::to_string(kMostRecords) + " steps";
      return {};
    }
    record(what, numbers_in(in));
    return {};
  }

 private:
  std::string answer(const std::string& what, std::istringstream& in) {
    if (what == "start") return reply(with_.start);
    const std::vector<double> v = numbers_in(in);
    if (what == "input" && v.size() == 1) {
      const int n = static_cast<int>(v[0]);
      const auto it = with_.inputs.find(n);
      if (it != with_.inputs.end()) return reply({it->second});
      return refusal("input " + std::to_string(n) + " has no value");
    }
    if (what == "fk") {
      const auto found = with_.kinematics->forward(v);
      if (!found.ok()) return refusal(found.error().message);
      const auto q = post::quaternion(found->R);
      return reply({found->p[0], found->p[1], found->p[2], q[0], q[1], q[2], q[3]});
    }
    if (what == "ik" && v.size() > 12) {
      const auto found =
          with_.kinematics->inverse(pose_of_rows(v.data(), 1), std::span(v).subspan(12), -1);
      if (!found.ok()) return refusal(found.error().message);
      return reply(*found);
    }
    return refusal("this request is not known");
  }
  void record(const std::string& what, const std::vector<double>& v) {
    if (v.empty()) return;
    out_.seconds = v[0];
    const std::span<const double> rest = std::span(v).subspan(1);
    if (what == "cycle") {
      ++out_.cycles;
      out_.has_times = true;
      // Its time is known with the next one, which begins where this ends.
      const double by = v[0] - cycle_time_;
      if (!before_.empty() && cycle_.size() == before_.size() && by > 1e-9)
        for (std::size_t i = 0; i < cycle_.size() && i < out_.rates.size(); ++i)
          out_.rates[i] = std::max(out_.rates[i], std::fabs(cycle_[i] - before_[i]) / by);
      before_ = cycle_.empty() ? with_.start : cycle_;
      cycle_.assign(rest.begin(), rest.end());
      cycle_time_ = v[0];
      out_.rates.resize(cycle_.size(), 0.0);
      last_ = cycle_;
    } else if (what == "axes") {
      last_.assign(rest.begin(), rest.end());
      // The library has seven axes; of an arm with fewer the others stay at 0.
      while (last_.size() > with_.start.size() && last_.back() == 0) last_.pop_back();
    } else if (what == "pose" && rest.size() == 13) {
      const double scale = rest[0] != 0 ? rest[0] : 1;
      auto found =
          with_.kinematics->inverse(pose_of_rows(rest.data() + 1, 0.001 / scale), last_, -1);
      if (found.ok()) last_ = std::move(*found);
      else last_.clear();
    } else if (what == "end") {
      out_.ends.push_back({last_, additional_});
    } else if (what == "output" && rest.size() == 2) {
      out_.outputs.push_back({v[0], rest[1], static_cast<int>(rest[0])});
    } else if (what == "additional") {
      additional_.assign(rest.begin(), rest.end());
      // It is set at the end of the motion before.
      if (!out_.ends.empty()) out_.ends.back().additional = additional_;
    } else if (what == "over") {
      is_over = true;
    }
  }

  const CInputs& with_;
  CCommands& out_;
  std::vector<double> last_, before_, cycle_, additional_;
  double cycle_time_ = 0;
  std::size_t records_ = 0;
};

}  // namespace

Result<CCommands> run_c(const PostedFiles& files, const CInputs& with, Progress& progress) {
  CCommands out;
  if (auto allowed = require(Effect::processes); !allowed.ok()) {
    out.not_run = "its C is compiled and run only for sessions that may start programs: " +
                  allowed.error().message;
    return out;
  }
  if (!with.kinematics) {
    out.not_run = "the robot is not known that its C would move";
    return out;
  }
  const fs::path compiler = c_compiler(out.not_run);
  if (compiler.empty()) return out;
  const OwnFolder folder;
  const auto put = [&](const std::string& name, std::string_view text) {
    // Names are of one file in one folder.
    return !folder.path().empty() && fs::path(name).filename() == fs::path(name) &&
           write_text(folder.path() / name, text);
  };
  bool is_written = true, has_additional = false;
  for (const auto& [name, text] : files) {
    is_written = is_written && put(name, text);
    has_additional = has_additional || text.find(
                                           "void rmp_additional(const double *values, int "
                                           "count) {") != std::string::npos;
  }
  is_written =
      is_written && put("seen.h", run_c_files::kSeen) &&
      put("robomosp_client.h", run_c_files::kClientHeader) && put("pa.h", run_c_files::kPaHeader) &&
      put("seen_program.c", "#include \"seen.h\"\n#include \"" + files.front().first + "\"\n") &&
      put("seen_robot.c", std::string(with.is_pa10 ? run_c_files::kPa10 : run_c_files::kRobomosp) +
                              run_c_files::kRecords);
  if (!is_written) {
    out.not_run = "a temporary folder for its C cannot be written";
    return out;
  }
  ProcessSpec make;
  make.program = compiler;
  make.seconds = kMostCompileSeconds;
  make.memory = kMostMemory;
  const std::string here = folder.path().string(), program = here + "/seen_program";
  make.arguments = {"-std=c99",
                    "-O1",
                    "-w",
                    "-I" + here,
                    "-o",
                    program,
                    here + "/seen_program.c",
                    here + "/seen_robot.c"};
  if (has_additional) make.arguments.emplace_back("-DRMP_SEEN_ADDITIONAL");
  make.arguments.emplace_back("-lm");
  std::string complaint;
  make.line = [&](std::string_view l) {
    if (complaint.empty() && l.find("error") != std::string_view::npos)
      complaint = std::string(l.substr(0, 300));
  };
  auto made = run_process(make, progress);
  if (!made.ok()) {
    if (made.error().code == ErrorCode::cancelled) return std::move(made).error();
    for (std::size_t at = complaint.find(here + "/"); at != std::string::npos;
         at = complaint.find(here + "/"))
      complaint.erase(at, here.size() + 1);
    out.not_run = "the compiler " + text::quote(compiler.string()) +
                  " does not take its C: " + (complaint.empty() ? made.error().message : complaint);
    return out;
  }
  Listener listener(with, out);
  ProcessSpec run;
  run.program = program;
  run.seconds = kMostRunSeconds;
  run.memory = kMostMemory;
  run.most_output = std::uint64_t{64} << 20;
  if (!with.is_pa10) {
    run.arguments = {"here", "robot"};
    for (const auto& [number, value] : with.inputs) {
      std::ostringstream text;
      text.precision(17);
      text << number << '=' << value;
      run.arguments.emplace_back("--input");
      run.arguments.push_back(text.str());
    }
  }
  run.answer = [&](std::string_view l) { return listener.line(l); };
  auto done = run_process(run, progress);
  if (!done.ok()) {
    if (done.error().code == ErrorCode::cancelled) return std::move(done).error();
    out.not_run = "its C was compiled, and ended before its end: " +
                  (listener.complaint.empty() ? done.error().message : listener.complaint);
    return out;
  }
  if (!listener.is_over)
    out.not_run = "its C was compiled, and ended before its end" +
                  (listener.complaint.empty() ? std::string() : ": " + listener.complaint);
  return out;
}

}  // namespace robomosp::program_post
