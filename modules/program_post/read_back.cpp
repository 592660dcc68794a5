// SPDX-License-Identifier: Apache-2.0
#include "program_post/read_back.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include <robomosp/sdk/post_writer.h>
#include <robomosp/sdk/program_reader.h>

#include "kernel/text.h"
#include "motion/provider_params.h"
#include "program_source/reader_settings.h"

namespace robomosp::program_post {
namespace {

using program_source::Workshop;

Result<std::shared_ptr<const CompiledProgram>> compile_texts(
    const Workshop& with, const std::vector<std::pair<std::string, std::string>>& texts) {
  RMP_TRY_ASSIGN(const ProviderInfo info, with.from.registry.find(Language::kInterfaceId, "irl"));
  RMP_TRY_ASSIGN(const auto language, with.from.registry.create<Language>(info.name));
  model::ProviderChoice choice;
  choice.name = info.name;
  RMP_TRY_ASSIGN(const auto params, motion::checked_params(info, choice, "provider irl"));
  std::vector<SourceFile> sources;
  for (const auto& [name, text] : texts) sources.push_back({name, text, {}});
  LanguageTask task;
  task.files = sources;
  RMP_TRY_ASSIGN(auto made, language->compile(task, *params, with.progress));
  const rmp_code& c = made->code();
  for (std::uint32_t i = 0; i < c.faults.count; ++i) {
    const auto& f = row<rmp_code_fault>(c.faults, i);
    if (f.severity == RMP_FAULT_ERROR)
      return error(ErrorCode::invalid_argument, std::string(f.message), f.hint);
  }
  return std::shared_ptr<const CompiledProgram>(std::move(made));
}

/// What the profile says of the controller, as settings of the reader that asks for them.
Map settings_for(const ProviderInfo& reader, const model::Controller* profile, double joint_speed) {
  Map out = profile ? program_source::reader_settings(reader, *profile) : Map{};
  const auto asks = [&](std::string_view name) {
    return std::any_of(reader.schema.begin(), reader.schema.end(),
                       [&](const auto& f) { return f.name == name; });
  };
  if (asks("joint_speed") && joint_speed > 0 && !out.find("joint_speed"))
    out.set("joint_speed", Value(joint_speed));
  // Of RAPID the speed that 100 % become where the profile has none.
  if (reader.name == "rapid") out.set("tcp_speed", Value(5.0));
  if (asks("c_ptp_mm") && !out.find("c_ptp_mm"))
    out.set("c_ptp_mm", Value(0.05));  // as the posts have it without an option
  if (!profile) return out;
  if (profile->max_speed > 0 && asks("tcp_speed")) out.set("tcp_speed", Value(profile->max_speed));
  for (const auto& o : profile->options) {
    if (o.name == "fig_xor" && asks("fig_xor"))
      if (const auto n = text::read_int(o.value)) out.set("fig_xor", Value(*n));
    if (o.name == "ptp_radius" && asks("c_ptp_mm"))
      if (const auto v = text::read_real(o.value); v && *v > 0)
        out.set("c_ptp_mm", Value(*v / 1000));
  }
  return out;
}

}  // namespace

Result<ReadBack> read_posted(const Workshop& with, const PostedFiles& files,
                             const model::Controller* profile, double joint_speed) {
  ReadBack out;
  if (files.empty()) {
    out.not_read = "nothing was posted";
    return out;
  }
  const auto& [name, text] = files.front();
  const auto dot = name.rfind('.');
  const std::string extension = dot == std::string::npos ? "" : post::lower(name.substr(dot + 1));
  std::shared_ptr<ProgramReader> best;
  std::int32_t most = -1;
  ProviderInfo of;
  for (const ProviderInfo& info : with.from.registry.list(ProgramReader::kInterfaceId)) {
    if (!info.enabled) continue;
    RMP_TRY_ASSIGN(auto reader, with.from.registry.create<ProgramReader>(info.name));
    const auto formats = reader->formats();
    if (std::none_of(formats.begin(), formats.end(),
                     [&](const ReaderFormat& f) { return extension == f.extension; }))
      continue;
    const std::int32_t sure = reader->claims({name, text, {}});
    if (sure <= most) continue;
    most = sure, best = std::move(reader), of = info;
  }
  if (!best) {
    out.not_read = "no reader accepts ." + extension;
    return out;
  }
  RMP_TRY_ASSIGN(const auto params,
                 motion::checked_values(of, settings_for(of, profile, joint_speed),
                                        "reader " + text::quote(of.name)));
  // Readers know files by their names, without the folders that a controller has them in.
  std::vector<std::string> names;
  for (const auto& [file, bytes] : files) names.push_back(file.substr(file.rfind('/') + 1));
  std::vector<SourceFile> sources;
  for (std::size_t i = 0; i < names.size(); ++i) sources.push_back({names[i], files[i].second, {}});
  // Tools and frames of the controller, as in its backup.
  const program_source::ForeignFile places =
      profile ? program_source::places_file(of.name, *profile) : program_source::ForeignFile{};
  if (!places.text.empty()) sources.push_back({places.name, places.text, {}});
  ProgramReaderTask task;
  task.files = sources;
  auto read = best->read(task, *params, with.progress);
  if (!read.ok()) {
    if (read.error().code == ErrorCode::cancelled) return std::move(read).error();
    out.not_read = read.error().sentence();
    return out;
  }
  for (const rmp_code_fault& f : (*read)->faults())
    if (f.severity == RMP_FAULT_ERROR)
      out.not_said.push_back({f.span.file < files.size() ? files[f.span.file].first : "",
                              f.span.line, std::string(f.message)});
  std::vector<std::pair<std::string, std::string>> texts;
  for (const ReadFile& f : (*read)->files()) texts.emplace_back(f.name, f.text);
  auto made = compile_texts(with, texts);
  if (!made.ok()) {
    if (made.error().code == ErrorCode::cancelled) return std::move(made).error();
    out.not_read = "what reader " + of.name + " made of it: " +
                   (out.not_said.empty() ? "" : out.not_said.front().message + "; ") +
                   made.error().sentence();
    return out;
  }
  out.reader = of.name;
  out.program = std::move(*made);
  return out;
}

}  // namespace robomosp::program_post
