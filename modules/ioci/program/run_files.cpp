// SPDX-License-Identifier: Apache-2.0
#include "ioci/program/run_files.h"

#include <filesystem>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "kernel/file_root.h"
#include "kernel/permit.h"

namespace robomosp::ioci {
namespace {

constexpr std::size_t kMostBytes = std::size_t{64} << 20;  ///< of a file

/// Through the door for files, as who began the run may use it: also on the threads of live runs.
class Folder final : public task::ProgramFolder {
 public:
  Folder(std::filesystem::path folder, std::shared_ptr<const Permit> permit)
      : folder_(std::move(folder)), permit_(std::move(permit)) {}

  Result<std::string> read(std::string_view name) const override {
    return as_owner<std::string>(Effect::files_read, [&]() -> Result<std::string> {
      RMP_TRY_ASSIGN(const auto path, of(name));
      return io::read_file(path, kMostBytes);
    });
  }
  Result<void> write(std::string_view name, std::string_view bytes, bool adds) const override {
    return as_owner<void>(Effect::files_write, [&]() -> Result<void> {
      RMP_TRY_ASSIGN(const auto path, of(name));
      if (!adds) return io::write_file(path, bytes);
      RMP_TRY(append_to(path, bytes));
      return {};
    });
  }

 private:
  template <class T, class Do>
  Result<T> as_owner(Effect effect, Do&& what) const {
    if (!permit_) return what();
    if (permit_->denied.has(effect)) return not_permitted(permit_->session, permit_->work, effect);
    Permit own = *permit_;
    own.declared = own.declared | effect;
    const PermitScope scope(&own);
    return what();
  }
  [[nodiscard]] Result<std::filesystem::path> of(std::string_view name) const {
    const std::filesystem::path given{std::string(name)};
    bool leaves = name.empty() || given.is_absolute();
    for (const auto& part : given) leaves = leaves || part == "..";
    if (leaves)
      return error(
          ErrorCode::permission,
          "the file " + text::quote(std::string(name)) + " is not in the folder of the run",
          "Name a file in it, without a root and \"..\".");
    return folder_ / given;
  }

  std::filesystem::path folder_;
  std::shared_ptr<const Permit> permit_;
};

}  // namespace

std::shared_ptr<const task::ProgramFolder> program_folder(const Map& args) {
  if (has(args, "files")) return std::make_shared<Folder>(text_of(args, "files"), keep_permit());
  if (const FileRoot* root = current_file_root())
    return std::make_shared<Folder>(root->folder(), keep_permit());
  return nullptr;
}

ParamSpec files_field() {
  return optional("files", "path", "",
                  "The folder in which programs open, write and close files. If omitted, the "
                  "folder of the session is used; if it has none, programs cannot open files.");
}

}  // namespace robomosp::ioci
