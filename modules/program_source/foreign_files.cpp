// SPDX-License-Identifier: Apache-2.0
#include "program_source/foreign_files.h"

#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <set>
#include <utility>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/reader_offers.h>

#include "io/native.h"
#include "kernel/file_root.h"
#include "kernel/letters.h"
#include "kernel/text.h"
#include "motion/provider_params.h"
#include "program/source_bytes.h"

namespace robomosp::program_source {
namespace {

constexpr std::size_t kMostFiles = 2000;
/// Of a backup, files whose names are looked at, and levels of folders below its root.
constexpr std::size_t kMostOffering = 10'000;
constexpr int kMostFoldersBelow = 8;
constexpr std::size_t kMostForeignNames = 100'000;
/// How many folders above the program's a folder such as System is looked for in.
constexpr int kMostFoldersAbove = 8;

std::string extension_of(const std::filesystem::path& path) {
  const std::string e = text::lower(path.extension().string());
  return e.empty() ? e : e.substr(1);
}

/// Files of controllers that hold no text of a program, or one of a language without a reader.
struct OtherFile {
  std::string_view extension, is, hint;
};
constexpr std::string_view kUnpack =
    "Unpack it, and give the program's own file, with what belongs to it beside it.";
constexpr std::string_view kProjectHint = "Export the program from it as text, and give that file.";
constexpr std::string_view kNoReader =
    "No reader takes that language; program.targets lists those that programs can be written in.";
constexpr OtherFile kOtherFiles[] = {
    {"urp", "a program of PolyScope (Universal Robots), packed XML of its tree",
     "Give the .script of the same name, which PolyScope saves beside it: it is what runs."},
    {"urpx", "a program of PolyScope X (Universal Robots), which keeps the tree and no script",
     "Export the program as .script, and give that."},
    {"installation", "an installation of PolyScope (Universal Robots), and no program",
     "Give the .script of the program."},
    {"variables", "a file of PolyScope's variables (Universal Robots), and no program",
     "Give the .script of the program."},
    {"tp", "a TP program of FANUC in the controller's binary form",
     "Give its listing .ls: save the programs as ASCII on the pendant, or print them by PRINTTP or "
     "ROBOGUIDE."},
    {"mr", "a mirrored TP program of FANUC in the controller's binary form",
     "Give its listing .ls."},
    {"pc", "a compiled KAREL program of FANUC", kNoReader},
    {"kl", "a KAREL program of FANUC", kNoReader},
    {"va", "the variables of a FANUC backup, and no program",
     "Leave it beside the listing .ls, and give that: POSREG.VA, NUMREG.VA and SYSFRAME.VA are "
     "read "
     "with it."},
    {"vr", "variables of FANUC in the controller's binary form",
     "Save them as ASCII (.va) beside the listing .ls, and give that."},
    {"sv", "system variables of FANUC in the controller's binary form",
     "Save them as ASCII (.va) beside the listing .ls, and give that."},
    {"sysvars", "system variables of a controller, and no program",
     "Save them as ASCII (.va) beside the listing .ls, and give that."},
    {"rgx", "a packed cell of ROBOGUIDE (FANUC)",
     "Open it there, save the programs as ASCII, and give the listing .ls."},
    {"frw", "a cell of ROBOGUIDE (FANUC)",
     "Open it there, save the programs as ASCII, and give the listing .ls."},
    {"kop", "a package of options for KUKA controllers", kUnpack},
    {"sub", "the program of a submit interpreter (KUKA), which runs beside the robot's",
     "Give the .src of the robot's program."},
    {"wvs", "a project of WorkVisual (KUKA)",
     "Export the programs, and give the .src with its .dat beside it."},
    {"rspag", "a station of RobotStudio (ABB), packed",
     "Unpack it in RobotStudio, save the modules of the task, and give the .mod or .pgf."},
    {"rsstn", "a station of RobotStudio (ABB)",
     "Save the modules of its task, and give the .mod or .pgf."},
    {"rslib", "a library of RobotStudio (ABB), and no program",
     "Save the modules of the task, and give the .mod or .pgf."},
    {"dtx", "the data of a VAL 3 application (Staubli), and no program",
     "Leave it beside its project .pjx, and give that."},
    {"cod", "a compiled PDL2 program of Comau", kNoReader},
    {"pac", "a PAC program of Denso", kNoReader},
    {"wpj", "a project of WINCAPS (Denso)", kProjectHint},
    {"drl", "a DRL program of Doosan", kNoReader},
    {"zip", "an archive", kUnpack},
    {"7z", "an archive", kUnpack},
    {"rar", "an archive", kUnpack},
    {"tar", "an archive", kUnpack},
    {"tgz", "an archive", kUnpack},
    {"gz", "a packed file", kUnpack}};

/// The entry of a folder with this name, letter case apart; empty where there is none, or where the
/// folder may not be read.
std::filesystem::path entry_named(const std::filesystem::path& folder, const std::string& low,
                                  FileKind kind) {
  const auto listed = list_folder(folder, kMostForeignNames);
  if (!listed.ok()) return {};
  for (const FolderEntry& e : listed.value())
    if (e.kind == kind && text::lower(e.name) == low) return folder / e.name;
  return {};
}

/// "System/$config.dat": the file of a folder of this name beside the program, or beside a folder
/// above it, the nearest one.
std::filesystem::path found_above(const std::filesystem::path& program, const std::string& wanted) {
  const std::filesystem::path name(wanted);
  if (!name.has_parent_path() || name.is_absolute()) return {};
  const std::string folder = text::lower(name.parent_path().filename().string());
  if (folder.empty() || folder == "." || folder == "..") return {};
  std::error_code failed;
  std::filesystem::path at = std::filesystem::absolute(program, failed).parent_path();
  for (int i = 0; !failed && i <= kMostFoldersAbove && !at.empty(); ++i) {
    const auto inside = entry_named(at, folder, FileKind::folder);
    if (!inside.empty()) {
      const auto found = entry_named(inside, text::lower(name.filename().string()), FileKind::file);
      if (!found.empty()) return found;
    }
    if (at == at.parent_path()) break;
    at = at.parent_path();
  }
  return {};
}

/// Steps from one folder to another, up and down.
std::size_t steps_between(const std::filesystem::path& a, const std::filesystem::path& b) {
  auto i = a.begin(), k = b.begin();
  while (i != a.end() && k != b.end() && *i == *k) {
    ++i;
    ++k;
  }
  return static_cast<std::size_t>(std::distance(i, a.end()) + std::distance(k, b.end()));
}

/// Files of a backup by the names of routines and data that they offer.
class Backup {
 public:
  Backup(const ReadingPlace& at, const ProgramReader& reader, const std::filesystem::path& program)
      : at_(at), reader_(reader), program_(program) {}

  /// The file that offers a name to a file in `folder`: one that is read already, else the nearest
  /// one; empty = none does. Where two are equally near, the first by name, and a warning. Errors:
  /// cancelled.
  Result<std::filesystem::path> offering(const std::string& name,
                                         const std::filesystem::path& folder,
                                         const std::vector<std::filesystem::path>& read) {
    RMP_TRY(look());
    const auto it = files_.find(name);
    if (it == files_.end()) return std::filesystem::path();
    const auto& all = it->second;
    for (const auto& each : all)
      if (std::find(read.begin(), read.end(), each) != read.end()) return each;
    std::size_t best = 0, least = 0, equal = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const std::size_t steps = steps_between(all[i].parent_path(), folder);
      if (i == 0 || steps < least) {
        best = i;
        least = steps;
      } else if (steps == least) {
        equal = i;
      }
    }
    if (equal > best && steps_between(all[equal].parent_path(), folder) == least &&
        told_.insert(name).second)
      at_.messages.post(Severity::warning, "offered_twice",
                        text::quote(name) + " is declared in " + all[best].string() + " and in " +
                            all[equal].string() +
                            "; the program is read with "
                            "the first. Move the file that is not meant out of the folder.",
                        "program");
    return all[best];
  }

 private:
  /// The root of the backup that the program lies in, else its folder.
  std::filesystem::path root(const ReaderOffers& offers) const {
    std::error_code failed;
    const auto folder =
        std::filesystem::absolute(program_, failed).lexically_normal().parent_path();
    std::filesystem::path at = folder;
    for (int i = 0; !failed && i <= kMostFoldersAbove && !at.empty(); ++i) {
      for (const char* name : offers.folders())
        if (!entry_named(at, name, FileKind::folder).empty()) return at;
      if (at == at.parent_path()) break;
      at = at.parent_path();
    }
    return folder;
  }
  Result<void> look() {
    if (std::exchange(is_looked_at_, true)) return {};
    const auto* offers =
        static_cast<const ReaderOffers*>(reader_.extension(ReaderOffers::kExtensionId));
    if (!offers) return {};
    std::size_t files = 0;
    std::deque<std::pair<std::filesystem::path, int>> folders{{root(*offers), 0}};
    while (!folders.empty()) {
      const auto [folder, depth] = std::move(folders.front());
      folders.pop_front();
      const auto listed = list_folder(folder, kMostForeignNames);
      if (!listed.ok()) continue;
      for (const FolderEntry& e : listed.value()) {
        if (at_.progress.cancelled()) return error(ErrorCode::cancelled, "reading was stopped");
        const std::filesystem::path path = folder / e.name;
        if (e.kind == FileKind::folder && depth < kMostFoldersBelow)
          folders.emplace_back(path, depth + 1);
        const std::string extension = extension_of(path);
        const auto formats = reader_.formats();
        if (e.kind != FileKind::file ||
            std::none_of(formats.begin(), formats.end(),
                         [&](const ReaderFormat& f) { return extension == f.extension; }))
          continue;
        if (++files > kMostOffering) {
          at_.messages.post(
              Severity::warning, "many_files",
              "The folder " + root(*offers).string() + " has more than " +
                  std::to_string(kMostOffering) +
                  " files of programs; routines and data of the others are not found. Copy the "
                  "backup into a separate folder.",
              "program");
          return {};
        }
        const auto bytes = io::read_file(path, kMostSource);
        if (!bytes.ok()) continue;
        const std::string source = program::as_utf8(*bytes);
        const auto names = offers->offers(SourceFile{e.name, source, {}});
        if (!names.ok()) continue;
        for (const std::string& n : names.value()) {
          auto& all = files_[n];
          if (all.empty() || all.back() != path) all.push_back(path);
        }
      }
    }
    return {};
  }

  ReadingPlace at_;
  const ProgramReader& reader_;
  std::filesystem::path program_;
  bool is_looked_at_ = false;
  std::map<std::string, std::vector<std::filesystem::path>> files_;
  std::set<std::string> told_;
};

}  // namespace

Result<std::string> told_source(Messages& messages, const std::string& file,
                                std::string_view bytes) {
  auto made = program::source_of_bytes(bytes);
  if (!made.ok()) return std::move(made).error().in(file);
  if (!made->note.empty())
    messages.post(Severity::warning, "encoding", file + ": " + made->note + ".", "program");
  return std::move(made->text);
}

Result<std::string> reader_of(const ReadingPlace& at, const std::filesystem::path& path,
                              const std::string& name) {
  if (file_kind(path) == FileKind::folder)
    return error(ErrorCode::invalid_argument, "it is a folder, and no program",
                 "Give the file of the program that begins; the files that it names are found from "
                 "there.",
                 path.filename().string());
  const auto all = at.registry.list(ProgramReader::kInterfaceId);
  if (!name.empty()) {
    for (const ProviderInfo& info : all)
      if (info.name == name) return name;
    const auto language = at.registry.find(Language::kInterfaceId, name);
    if (language.ok()) return std::string();
    std::vector<std::string> names;
    for (const ProviderInfo& info : at.registry.list(Language::kInterfaceId))
      names.push_back(info.name);
    for (const ProviderInfo& info : all) names.push_back(info.name);
    return unknown_name("language", name, names);
  }
  const std::string extension = extension_of(path);
  struct Candidate {
    std::string name;
    std::shared_ptr<ProgramReader> reader;
  };
  std::vector<Candidate> candidates;
  for (const ProviderInfo& info : all) {
    RMP_TRY_ASSIGN(auto reader, at.registry.create<ProgramReader>(info.name));
    const auto formats = reader->formats();
    if (std::any_of(formats.begin(), formats.end(),
                    [&](const ReaderFormat& f) { return extension == f.extension; }))
      candidates.push_back({info.name, std::move(reader)});
  }
  if (candidates.empty()) {
    for (const OtherFile& other : kOtherFiles)
      if (other.extension == extension)
        return error(ErrorCode::unsupported, "it is " + std::string(other.is),
                     std::string(other.hint), path.filename().string());
    return std::string();
  }
  if (candidates.size() == 1) return candidates[0].name;
  RMP_TRY_ASSIGN(const std::string bytes, io::read_file(path, kMostSource));
  const std::string source = program::as_utf8(bytes);  // read_foreign reports its encoding
  if (source.starts_with("robomosp program "))
    return error(ErrorCode::invalid_argument, "it is a program saved by program.save",
                 "Read it with program.load.", path.filename().string());
  const std::string file = path.filename().string();
  std::int32_t most = 0;
  std::vector<std::string> best;
  for (const Candidate& c : candidates) {
    const std::int32_t sure = c.reader->claims({file, source, {}});
    if (sure > most) best.clear();
    most = std::max(most, sure);
    if (sure == most) best.push_back(c.name);
  }
  if (most == 0) {
    std::string makers;
    for (const Candidate& c : candidates)
      for (const ReaderFormat& f : c.reader->formats())
        if (extension == f.extension)
          makers += (makers.empty() ? "" : ", ") + std::string(f.controller);
    return error(
        ErrorCode::unsupported,
        "a file ." + extension + " is read as a program of " + makers + ", but this is not one",
        "language = ... selects a reader to read it anyway.", file);
  }
  if (candidates.size() == 1) return candidates[0].name;
  if (best.size() == 1) {
    std::string others;
    for (const Candidate& c : candidates)
      if (c.name != best[0])
        others += (others.empty() ? "" : " or ") + ("language = " + text::quote(c.name));
    at.messages.post(Severity::info, "reader",
                     file + " was taken by the reader " + best[0] +
                         ", since its words are of that language; " + others + " chooses another.",
                     "program");
    return best[0];
  }
  std::string list;
  for (const std::string& b : best) list += (list.empty() ? "" : " or ") + b;
  return error(
      ErrorCode::invalid_argument,
      "its extension is used by several controllers, and the text does not show which one applies",
      "Give language = " + list + ".", file);
}

Result<std::optional<std::string>> source_beside(const ReadingPlace& at,
                                                 const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  const auto bytes = io::read_file(path, kMostSource);
  Result<std::string> text = bytes.ok() ? told_source(at.messages, name, *bytes) : bytes.error();
  if (text.ok()) return std::optional(std::move(*text));
  if (text.error().code == ErrorCode::cancelled) return std::move(text).error();
  Error why = std::move(text).error();
  const std::string hint = std::exchange(why.hint, {});
  if (why.where == name) why.where.clear();
  at.messages.post(Severity::warning, "unreadable_file",
                   "The program is taken without " + text::quote(name) +
                       ", which cannot be read: " + why.message + "." +
                       (hint.empty() ? "" : " " + hint),
                   "program");
  return std::optional<std::string>();
}

Result<Foreign> read_foreign(const ReadingPlace& at, const std::filesystem::path& path,
                             const std::string& name, const Map& given,
                             const model::Controller* controller) {
  Map settings;
  RMP_TRY_ASSIGN(const ProviderInfo info, at.registry.find(ProgramReader::kInterfaceId, name));
  if (controller) settings = reader_settings(info, *controller);
  for (const auto& [key, value] : given) settings.set(key, value);
  RMP_TRY_ASSIGN(const auto reader, at.registry.create<ProgramReader>(name));
  RMP_TRY_ASSIGN(const auto params,
                 motion::checked_values(info, settings, "reader " + text::quote(name)));
  Foreign out;
  out.reader = name;
  RMP_TRY_ASSIGN(const std::string bytes, io::read_file(path, kMostSource));
  RMP_TRY_ASSIGN(std::string text, told_source(at.messages, path.filename().string(), bytes));
  out.files.push_back({path.filename().string(), std::move(text)});
  // What belongs to it lies beside it, in whatever letters, or is in its backup.
  std::error_code failed;
  std::vector<std::filesystem::path> paths{
      std::filesystem::absolute(path, failed).lexically_normal()};
  if (failed) paths[0] = path;
  /// Names of files by the same in lower case; of several the first.
  std::map<std::filesystem::path, std::map<std::string, std::string>> folders;
  const auto entry_beside = [&](const std::filesystem::path& folder,
                                const std::string& low) -> Result<std::filesystem::path> {
    auto it = folders.find(folder);
    if (it == folders.end()) {
      RMP_TRY_ASSIGN(auto listed, list_folder(folder.empty() ? "." : folder, kMostForeignNames));
      it = folders.try_emplace(folder).first;
      for (FolderEntry& e : listed)
        if (e.kind == FileKind::file) it->second.try_emplace(text::lower(e.name), e.name);
    }
    const auto entry = it->second.find(low);
    return entry == it->second.end() ? std::filesystem::path() : folder / entry->second;
  };
  Backup backup(at, *reader, path);
  for (std::size_t i = 0; i < out.files.size(); ++i) {
    RMP_TRY_ASSIGN(const auto wanted,
                   reader->needs(SourceFile{out.files[i].name, out.files[i].text, {}}));
    const std::filesystem::path own = paths[i].parent_path();
    for (const std::string& each : wanted) {
      std::filesystem::path file;
      if (each.starts_with('@')) {
        RMP_TRY_ASSIGN(file, backup.offering(each.substr(1), own, paths));
        if (std::find(paths.begin(), paths.end(), file) != paths.end()) continue;
      } else {
        const std::string base = text::lower(std::filesystem::path(each).filename().string());
        if (base.empty() || base == "." || base == "..") continue;
        // One file of a name: folders of a backup may hold copies.
        if (std::any_of(out.files.begin(), out.files.end(),
                        [&](const ForeignFile& f) { return text::lower(f.name) == base; }))
          continue;
        RMP_TRY_ASSIGN(file, entry_beside(own, base));
        if (file.empty() && own != paths[0].parent_path()) {
          RMP_TRY_ASSIGN(file, entry_beside(paths[0].parent_path(), base));
        }
        if (file.empty()) file = found_above(paths[i], each);
      }
      if (file.empty()) continue;  // the reader says what it misses
      if (out.files.size() >= kMostFiles)
        return error(ErrorCode::unsupported,
                     "it names more than " + std::to_string(kMostFiles) + " files", {},
                     path.filename().string());
      RMP_TRY_ASSIGN(auto more, source_beside(at, file));
      if (!more) continue;
      out.files.push_back({file.filename().string(), std::move(*more)});
      paths.push_back(file);
    }
  }
  std::vector<SourceFile> sources;
  for (const ForeignFile& f : out.files) sources.push_back({f.name, f.text, {}});
  ProgramReaderTask task;
  task.files = sources;
  auto made = reader->read(task, *params, at.progress);
  if (!made.ok()) return std::move(made).error().in(path.filename().string());
  out.program = std::move(made).value();
  return out;
}

}  // namespace robomosp::program_source
