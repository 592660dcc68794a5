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
                                               Progress& progress,
                                               std::span<const GivenValue> values) {
  if (files.empty())
    return error(ErrorCode::invalid_argument, "there is no file to compile",
                 "Give the program's source.");
  for (const SourceFile& f : files)
    if (f.text.size() > kMostBytes)
      return error(ErrorCode::unsupported,
                   "the source has more than " + std::to_string(kMostBytes) + " bytes",
                   "Split it over modules.", std::string(f.name));
  for (const GivenValue& v : values)
    if (v.text.size() > kMostBytes)
      return error(ErrorCode::unsupported,
                   "the value has more than " + std::to_string(kMostBytes) + " bytes", {},
                   std::string(v.name));
  auto out = std::make_unique<ProgramTables>();
  Names names;
  Faults faults;
  Checker checker(*out, names, faults, files, progress);
  checker.give(values);
  if (!checker.run()) return error(ErrorCode::cancelled, "the compiler was cancelled");
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
                                     " errors, and the others are not listed"),
                           ""});
  if (faults.errors() == 0) {
    progress.report(0.8, "three-address code");
    lower(*out);
  }
  out->seal();
  return out;
}

std::vector<std::string> needs(const SourceFile& file) {
  std::vector<std::string> out;
  if (file.text.size() > kMostBytes) return out;
  Names names;
  Faults faults;
  Source s;
  s.name = file.name;
  s.text = file.text;
  scan(s, names, faults);
  parse(s, Unit::program, names, faults);
  if (s.nodes.empty()) return out;
  const auto written = [&](std::uint32_t token) { return s.word(s.tokens[token]); };
  for (std::uint32_t h = s.nodes[0].first; h != kNone; h = s.nodes[h].next) {
    const Node& n = s.nodes[h];
    if (n.kind == N::specification || n.kind == N::use_data_list)
      out.push_back(string_value(written(n.name_token)));
    if (n.kind != N::import_) continue;
    if (n.name != kNone) {
      out.push_back(std::string(written(n.name_token)) + ".irl");
      continue;
    }
    for (std::uint32_t x = n.first; x != kNone; x = s.nodes[x].next)
      out.push_back(std::string(written(s.nodes[x].name_token)) + ".irl");
  }
  return out;
}

}  // namespace robomosp::irl
