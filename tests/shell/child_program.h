// SPDX-License-Identifier: Apache-2.0
// The program `robomosp` as a child of a test, with pipes.
#pragma once

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace robomosp::test {

namespace fs = std::filesystem;

inline const std::string kProgram = std::string(ROBOMOSP_BUILD_DIR) + "/bin/robomosp";

struct Outcome {
  int code = -1;
  std::string out, err;
  long memory = 0;  ///< most that it held [KiB]
};

inline std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A folder of this test process, removed at the end.
struct Folder {
  fs::path path;
  Folder() {
    std::string name = (fs::temp_directory_path() / "robomosp-shell-XXXXXX").string();
    path = ::mkdtemp(name.data());
  }
  ~Folder() { fs::remove_all(path); }
};

[[noreturn]] inline void execute(std::vector<std::string> args) {
  args.insert(args.begin(), kProgram);
  std::vector<char*> argv;
  for (std::string& a : args) argv.push_back(a.data());
  argv.push_back(nullptr);
  ::execv(kProgram.c_str(), argv.data());
  ::_exit(127);
}

/// `most_file`: bytes that a file may have; negative = any number.
inline Outcome run(const std::vector<std::string>& args, const std::string& input = {},
                   long most_file = -1) {
  const Folder folder;
  std::ofstream(folder.path / "in", std::ios::binary) << input;
  std::fflush(nullptr);  // or the child would print what waits in the buffers once more
  const pid_t child = ::fork();
  if (child == 0) {
    if (!std::freopen((folder.path / "in").c_str(), "r", stdin)) ::_exit(126);
    if (!std::freopen((folder.path / "out").c_str(), "w", stdout)) ::_exit(126);
    if (!std::freopen((folder.path / "err").c_str(), "w", stderr)) ::_exit(126);
    const rlimit limit{static_cast<rlim_t>(most_file), static_cast<rlim_t>(most_file)};
    if (most_file >= 0 && ::setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(126);
    execute(args);
  }
  int status = 0;
  rusage used{};
  ::wait4(child, &status, 0, &used);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          slurp(folder.path / "out"), slurp(folder.path / "err"), used.ru_maxrss};
}

}  // namespace robomosp::test
