// SPDX-License-Identifier: Apache-2.0
#include "compile.h"

#include <algorithm>
#include <string>
#include <utility>

#include "checker.h"

namespace robomosp::irl {
namespace {

constexpr std::size_t kMostBytes = std::size_t{64} << 20;

}  // namespace

Result<std::unique_ptr<ProgramTables>> compile(std::span<const SourceFile> files,
                                               Progress& progress) {
  if (files.empty())
    return error(ErrorCode::invalid_argument, "there is no file to compile",
                 "Give the program's source.");
  for (const SourceFile& f : files)
    if (f.text.size() > kMostBytes)
      return error(ErrorCode::unsupported,
                   "the source has more than " + std::to_string(kMostBytes) + " bytes",
                   "Split it over modules.", std::string(f.name));
  auto out = std::make_unique<ProgramTables>();
  Names names;
  Faults faults;
  Checker checker(*out, names, faults, files, progress);
  if (!checker.run()) return error(ErrorCode::cancelled, "the compiler was stopped");
  std::stable_sort(faults.all.begin(), faults.all.end(), [](const Fault& a, const Fault& b) {
    return std::pair(a.file, a.at.begin) < std::pair(b.file, b.at.begin);
  });
  for (const Fault& f : faults.all)
    out->faults.push_back({f.severity,
                           {f.file, f.at.line, f.at.column, f.at.begin, f.at.end},
                           out->keep(f.message),
                           out->keep(f.hint)});
  if (faults.errors() > Faults::kMost)
    out->faults.push_back({RMP_FAULT_NOTE, out->faults.back().span,
                           out->keep("there are more than " + std::to_string(Faults::kMost) +
                                     " errors, and the others are left out"),
                           ""});
  if (faults.errors() == 0) {
    progress.report(0.8, "three-address code");
    lower(*out);
  }
  out->seal();
  return out;
}

}  // namespace robomosp::irl
