// SPDX-License-Identifier: Apache-2.0
#include "program_post/packs.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <system_error>

#include "kernel/messages.h"
#include "kernel/registry.h"
#include "kernel/text.h"

namespace robomosp::program_post {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostPack = std::uint64_t{4} << 20;
constexpr std::size_t kMostSaid = 5;  ///< faults of a pack at the start

Result<std::string> read_plain(const fs::path& file, std::uint64_t most) {
  std::error_code failed;
  const auto size = fs::file_size(file, failed);
  if (failed)
    return error(ErrorCode::io, "it is not a readable file", "Check its name and permissions.");
  if (size > most)
    return error(ErrorCode::unsupported,
                 "it is larger than " + std::to_string(most >> 20U) + " MiB",
                 "A pack contains one template per construct; programs do not belong in it.");
  std::ifstream in(file, std::ios::binary);
  std::string all{std::istreambuf_iterator<char>(in), {}};
  if (!in.good() && !in.eof())
    return error(ErrorCode::io, "it cannot be read", "Check its permissions.");
  return all;
}

/// "acme.post", and "acme/pack.post" of a pack that is a folder.
std::string brief(const fs::path& file) {
  if (file.filename() != kPackFile || !file.has_parent_path()) return file.filename().string();
  return (file.parent_path().filename() / file.filename()).string();
}

}  // namespace

Result<std::shared_ptr<const TemplatePack>> read_pack(const fs::path& file, const ReadPack& read,
                                                      std::vector<PackFault>* faults) {
  RMP_TRY_ASSIGN(const std::string text, read(file, kMostPack));
  const PackFiles beside = [&](const std::string& name) {
    return read(file.parent_path() / name, kMostPack);
  };
  return read_templates(text, brief(file), beside, faults);
}

std::vector<PackFault> pack_faults(fs::path file) {
  std::error_code none;
  if (fs::is_directory(file, none)) file /= kPackFile;
  std::vector<PackFault> faults;
  (void)read_pack(file, read_plain, &faults);
  return faults;
}

Result<std::string> add_pack(Registry& registry, const fs::path& file,
                             std::shared_ptr<const TemplatePack> pack, bool replaces) {
  ProviderInfo info;
  info.interface_id = Post::kInterfaceId;
  info.name = pack_name(*pack);
  info.summary = pack_title(*pack) + ", by templates.";
  info.tags = {kByTemplates};
  info.origin = file.string();
  bool is_again = false;
  for (const ProviderInfo& other : registry.list(Post::kInterfaceId)) {
    if (other.name != info.name) continue;
    is_again = replaces &&
               std::find(other.tags.begin(), other.tags.end(), kByTemplates) != other.tags.end();
    if (!is_again)
      return error(ErrorCode::conflict,
                   "there is a target " + text::quote(info.name) + " already, from " +
                       text::quote(other.origin),
                   "Give the pack another name.", brief(file));
  }
  RMP_TRY(registry.add(
      info, [pack]() -> Result<void*> { return make_template_post(pack).release(); }, is_again));
  return info.name;
}

void load_packs(Registry& registry, Messages& messages, std::span<const fs::path> folders) {
  const auto refuse = [&](const fs::path& file, const std::string& what) {
    messages.post(Severity::warning, "pack_refused",
                  "the pack " + text::quote(file.string()) + " was left out: " + what, "packs");
  };
  std::set<fs::path> seen;
  for (const fs::path& folder : folders) {
    std::vector<fs::path> files;
    std::error_code failed;
    for (fs::directory_iterator it(folder, failed), end; !failed && it != end;
         it.increment(failed)) {
      std::error_code none;
      const fs::path& file = it->path();
      const bool is_called_so = file.extension() == ".post";
      const fs::file_type is = fs::status(file, none).type();
      if (is == fs::file_type::directory && fs::is_regular_file(file / kPackFile, none))
        files.push_back(file / kPackFile);
      else if (is == fs::file_type::regular && is_called_so) files.push_back(file);
      else if (is == fs::file_type::directory && is_called_so)
        refuse(file, std::string("it is a folder without a file ") + kPackFile + ".");
      else if (is_called_so)
        refuse(file, fs::is_symlink(file, none) && is != fs::file_type::fifo
                         ? "it does not lead to a readable file."
                         : "it is not a file.");
    }
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) {
      const bool is_folder = file.filename() == kPackFile && file.parent_path() != folder;
      const fs::path name = is_folder ? file.parent_path().filename() : file.stem();
      if (!seen.insert(name).second) {
        messages.post(Severity::info, "plugin_hidden",
                      "the pack " + text::quote(file.string()) +
                          " is not loaded: a pack of its name comes before it.",
                      "packs");
        continue;
      }
      const auto warn = [&](const std::string& what) { refuse(file, what); };
      std::vector<PackFault> faults;
      auto pack = read_pack(file, read_plain, &faults);
      if (!pack.ok()) {
        if (faults.empty()) warn(pack.error().sentence());
        for (std::size_t i = 0; i < std::min(faults.size(), kMostSaid); ++i)
          warn((faults[i].file == brief(file) ? "line " + std::to_string(faults[i].line) +
                                                    ", column " + std::to_string(faults[i].column)
                                              : faults[i].place()) +
               ": " + faults[i].message + "." +
               (faults[i].hint.empty() ? "" : " " + faults[i].hint));
        if (faults.size() > kMostSaid)
          warn(std::to_string(faults.size() - kMostSaid) +
               " more; program.add_target lists all of them.");
        continue;
      }
      if (const auto added = add_pack(registry, file, *pack, false); !added.ok())
        warn(added.error().message + "." +
             (added.error().hint.empty() ? "" : " " + added.error().hint));
    }
  }
}

}  // namespace robomosp::program_post
