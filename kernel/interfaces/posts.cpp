// SPDX-License-Identifier: Apache-2.0
// Guard of posts: what they hand to the sink is looked at, and what they say of themselves.
#include <array>
#include <memory>
#include <set>
#include <string>

#include <robomosp/sdk/post.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"

namespace robomosp {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 30;
constexpr std::size_t kMostFiles = 100'000;
constexpr std::size_t kMostFaults = 10'000;

/// What is wrong with a file's name; "" = nothing. Folders are allowed, ways out are not.
std::string name_fault(std::string_view name) {
  if (name.empty()) return "named a file \"\"";
  if (name.size() > 1000) return "named a file with more than 1000 bytes";
  std::size_t from = 0;
  while (from <= name.size()) {
    const std::size_t end = std::min(name.find('/', from), name.size());
    const std::string_view part = name.substr(from, end - from);
    if (part.empty() || part == "." || part == "..") return "named a file outside of its folder";
    from = end + 1;
  }
  for (const char c : name)
    if (static_cast<unsigned char>(c) < 32 || c == '\\' || c == ':')
      return "named a file with signs that names of files do not have";
  return {};
}

/// Hands on what can be used.
class HeardOutput final : public PostOutput {
 public:
  HeardOutput(PostOutput& to, const rmp_code& code) : to_(to), files_of_code_(code.files.count) {}
  [[nodiscard]] const void* extension(const char* id) const override { return to_.extension(id); }
  void file(std::string_view name, std::string_view bytes) override {
    std::string bad = name_fault(name);
    if (bad.empty() && !names_.insert(std::string(name)).second)
      bad = "wrote the file " + heard(name) + " twice";
    bytes_ += bytes.size();
    if (bad.empty() && (bytes_ > kMostBytes || names_.size() > kMostFiles))
      bad = "wrote more than can be kept";
    if (!bad.empty()) return blame(std::move(bad));
    to_.file(name, bytes);
  }
  void from(std::string_view file, std::uint32_t line, const rmp_span& span) override {
    if (line == 0 || span.file >= files_of_code_ || names_.find(file) == names_.end())
      return blame("told where a line comes from that is not there");
    to_.from(file, line, span);
  }
  void fault(std::uint32_t severity, const rmp_span& span, std::string_view message,
             std::string_view hint) override {
    if (severity > RMP_FAULT_NOTE || span.file >= files_of_code_ || message.empty())
      return blame("said something that is no fault of the program");
    has_error_ = has_error_ || severity == RMP_FAULT_ERROR;
    if (++faults_ > kMostFaults) return;
    to_.fault(severity, span, heard(message), hint.empty() ? std::string() : heard(hint));
  }
  [[nodiscard]] const std::string& fault_of_post() const { return fault_; }
  [[nodiscard]] bool has_answer() const { return !names_.empty() || has_error_; }

 private:
  void blame(std::string what) {
    if (fault_.empty()) fault_ = std::move(what);
  }
  PostOutput& to_;
  std::uint32_t files_of_code_;
  std::set<std::string, std::less<>> names_;
  std::size_t bytes_ = 0, faults_ = 0;
  bool has_error_ = false;
  std::string fault_;
};

class GuardedPost final : public Post {
 public:
  GuardedPost(const ProviderInfo& info, Post* inner) : name_(info.name), inner_(inner) {
    try {
      const PostCapabilities& c = inner_->capabilities();
      if (c.struct_size < sizeof(PostCapabilities)) {
        wrong_ = "has capabilities of another version";
        return;
      }
      caps_ = c;
      // Texts that stay, whatever becomes of the post's own.
      texts_ = {std::string(c.reserved), std::string(c.extensions), std::string(c.title)};
      caps_.reserved = texts_[0];
      caps_.extensions = texts_[1];
      caps_.title = texts_[2];
      if ((caps_.forms & (kPostStructured | kPostFlat)) == 0) wrong_ = "takes no form of a program";
      if (caps_.max_name < 4) wrong_ = "has names of less than four letters";
      if (caps_.title.empty()) wrong_ = "has no title";
    } catch (...) {
      wrong_ = "could not say what it is capable of";
    }
    caps_.struct_size = sizeof(PostCapabilities);
  }
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  [[nodiscard]] const PostCapabilities& capabilities() const override { return caps_; }
  Result<void> write(const PostTask& task, const Params& params, PostOutput& output,
                     Progress& told) const override {
    if (!wrong_.empty()) return broken_answer(name_, wrong_);
    if (!task.code || !task.profile || task.code->has_errors)
      return error(ErrorCode::invalid_argument, "there is no whole program to be posted");
    HeardProgress progress(told);
    HeardOutput heard_output(output, *task.code);
    RMP_TRY(asked(name_, [&] { return inner_->write(task, params, heard_output, progress); }));
    if (!heard_output.fault_of_post().empty())
      return broken_answer(name_, heard_output.fault_of_post());
    if (!heard_output.has_answer()) return broken_answer(name_, "wrote no file");
    return {};
  }

 private:
  std::string name_;
  std::unique_ptr<Post> inner_;
  PostCapabilities caps_;
  std::array<std::string, 3> texts_;
  std::string wrong_;
};

}  // namespace

RMP_INTERFACES(posts, guarded_interface<Post, GuardedPost>());

}  // namespace robomosp
