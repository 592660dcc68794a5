// SPDX-License-Identifier: Apache-2.0
// Requests of the debug adapter about the sources of programs.
#include "io/native.h"
#include "ioci/program/program_files.h"
#include "kernel/file_root.h"
#include "program/source_bytes.h"
#include "remote/debug_adapter_parts.h"

namespace robomosp::remote::adapter {

fs::path Adapter::path_of(const std::string& given) const {
  constexpr std::string_view kFile = "file://";
  if (!given.starts_with(kFile)) return given;
  std::string out;
  for (std::size_t i = kFile.size(); i < given.size(); ++i) {
    const auto digit = [](char c) {
      return c >= '0' && c <= '9'   ? c - '0'
             : c >= 'a' && c <= 'f' ? c - 'a' + 10
             : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                    : -1;
    };
    if (given[i] == '%' && i + 2 < given.size() && digit(given[i + 1]) >= 0 &&
        digit(given[i + 2]) >= 0) {
      out += static_cast<char>(digit(given[i + 1]) * 16 + digit(given[i + 2]));
      i += 2;
    } else {
      out += given[i];
    }
  }
  return out;
}

const Adapter::Lines& Adapter::program_lines(const std::string& program, const std::string& file) {
  const auto [it, is_new] = texts_.try_emplace({program, file});
  Lines& out = it->second;
  if (!is_new) return out;
  const auto text = ask("run.program_text", Map{{"program", program}, {"source", file}});
  if (text.ok() && text->as_string()) out.text = *text->as_string();
  out.starts.push_back(0);
  for (std::size_t i = 0; i < out.text.size(); ++i)
    if (out.text[i] == '\n') out.starts.push_back(i + 1);
  return out;
}

bool Adapter::has_text(const fs::path& path, const std::string& program, const std::string& file) {
  if (file_kind(path) != FileKind::file) return false;
  const auto bytes = io::read_file(path, kMostSource);
  if (!bytes.ok()) return false;
  std::string on_disk = program::as_utf8(*bytes), runs = program_lines(program, file).text;
  for (std::string* s : {&on_disk, &runs}) {
    std::erase(*s, '\r');
    while (!s->empty() && s->back() == '\n') s->pop_back();
  }
  return on_disk == runs;
}

Json Adapter::source_of(const std::string& program, const std::string& file) {
  const auto [it, is_new] = sources_.try_emplace({program, file});
  if (!is_new) return it->second;
  Json out{{"name", file}};
  std::vector<fs::path> candidates;
  if (const fs::path folder = debuggee_->folder(); !folder.empty())
    candidates.push_back(folder / file);
  for (const std::string& path : paths_)
    if (same(fs::path(path).filename().string(), file)) candidates.emplace_back(path);
  for (const fs::path& path : candidates)
    if (has_text(path, program, file)) {
      out["path"] = path.string();
      return it->second = out;
    }
  std::int64_t reference = 0;
  for (const auto& [number, of] : references_to_sources_)
    if (of.first == program && of.second == file) reference = number;
  if (reference == 0) {
    reference = static_cast<std::int64_t>(references_to_sources_.size()) + 1;
    references_to_sources_[reference] = {program, file};
  }
  out["sourceReference"] = reference;
  out["origin"] = "program " + program;
  return it->second = out;
}

std::int64_t Adapter::column_of(const std::string& program, const std::string& file,
                                std::int64_t line, std::int64_t column) {
  if (line < 1) return first_column_;
  return units(program_lines(program, file).at(line), column) - 1 + first_column_;
}

Answer Adapter::loaded_sources(const Json&) {
  Json out = Json::array();
  for (const Known& p : programs_)
    for (const std::string& f : p.files) out.push_back(source_of(p.name, f));
  return Json{{"sources", std::move(out)}};
}

Answer Adapter::source(const Json& a) {
  std::int64_t reference = 0;
  if (const auto r = number_member(a, "sourceReference")) reference = *r;
  if (const auto r = number_member(member(a, "source"), "sourceReference"); r && *r > 0)
    reference = *r;
  const auto found = references_to_sources_.find(reference);
  if (found == references_to_sources_.end())
    return AdapterFailure{"There is no source " + std::to_string(reference) + "."};
  const auto text = ask("run.program_text",
                        Map{{"program", found->second.first}, {"source", found->second.second}});
  if (!text.ok()) return failed(text.error());
  return Json{{"content", text->as_string() ? *text->as_string() : ""}};
}

}  // namespace robomosp::remote::adapter
