// SPDX-License-Identifier: Apache-2.0
// Guard of posts: what they hand to the sink is looked at, and what they say of themselves.
#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/post_files.h>
#include <robomosp/sdk/program_tables.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"

namespace robomosp {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 28;
constexpr std::size_t kMostWords = std::size_t{1} << 20;  ///< bytes of a title, of reserved words
constexpr std::int32_t kMostCount = 1'000'000'000;
constexpr std::size_t kMostFiles = 100'000;
constexpr std::size_t kMostFaults = 10'000;

/// Whether text can be read at all: a view of nothing with a length is none.
bool is_text(std::string_view s, std::size_t most) {
  return s.size() <= most && (s.data() || s.empty());
}

/// The last byte of each file of the source that the program stands in.
std::vector<std::uint32_t> ends_of(const rmp_code& code) {
  std::vector<std::uint32_t> ends(code.files.count, 0);
  const auto look = [&](const rmp_span& s) {
    if (s.file < ends.size()) ends[s.file] = std::max(ends[s.file], s.end);
  };
  for (std::uint32_t i = 0; i < code.routines.count; ++i)
    look(row<rmp_code_routine>(code.routines, i).span);
  for (std::uint32_t i = 0; i < code.symbols.count; ++i)
    look(row<rmp_code_symbol>(code.symbols, i).span);
  for (std::uint32_t i = 0; i < code.expressions.count; ++i)
    look(row<rmp_code_expression>(code.expressions, i).span);
  for (std::uint32_t i = 0; i < code.statements.count; ++i)
    look(row<rmp_code_statement>(code.statements, i).span);
  for (std::uint32_t i = 0; i < code.motions.count; ++i)
    look(row<rmp_code_motion>(code.motions, i).span);
  for (std::uint32_t i = 0; i < code.attributes.count; ++i)
    look(row<rmp_code_attribute>(code.attributes, i).span);
  return ends;
}

/// Hands on what can be used.
class HeardOutput final : public PostOutput {
 public:
  HeardOutput(PostOutput& to, const rmp_code& code) : to_(to), ends_(ends_of(code)) {}
  [[nodiscard]] const void* extension(const char* id) const override { return to_.extension(id); }
  void file(std::string_view name, std::string_view bytes) override {
    if (!is_text(bytes, kMostBytes - bytes_) || lines_.size() >= kMostFiles)
      return blame("wrote more than can be stored");
    std::string bad(post::file_name_fault(name));
    if (bad.empty() &&
        !lines_.try_emplace(std::string(name), std::count(bytes.begin(), bytes.end(), '\n') + 1)
             .second)
      bad = "wrote the file " + heard(name) + " twice";
    if (!bad.empty()) return blame(std::move(bad));
    bytes_ += bytes.size();
    to_.file(name, bytes);
  }
  void from(std::string_view file, std::uint32_t line, const rmp_span& span) override {
    const auto it = is_text(file, kMostBytes) ? lines_.find(file) : lines_.end();
    if (it == lines_.end() || line == 0 || line > it->second || !is_of_program(span) ||
        ++told_ > bytes_ + lines_.size())
      return blame("mapped a line that it has not written");
    to_.from(file, line, span);
  }
  void fault(std::uint32_t severity, const rmp_span& span, std::string_view message,
             std::string_view hint) override {
    if (severity > RMP_FAULT_NOTE || !is_of_program(span) || message.empty() ||
        !is_text(message, kMostBytes) || !is_text(hint, kMostBytes))
      return blame("reported a fault outside the program");
    has_error_ = has_error_ || severity == RMP_FAULT_ERROR;
    if (++faults_ > kMostFaults) return;
    to_.fault(severity, span, heard(message), hint.empty() ? std::string() : heard(hint));
  }
  [[nodiscard]] const std::string& fault_of_post() const { return fault_; }
  [[nodiscard]] bool has_answer() const { return !lines_.empty() || has_error_; }

 private:
  /// A line begins behind as many bytes at least as there are lines before it.
  [[nodiscard]] bool is_of_program(const rmp_span& s) const {
    return s.file < ends_.size() && s.begin <= s.end && s.end <= ends_[s.file] &&
           (ends_[s.file] == 0 ||  // the language counts no bytes
            (s.line <= std::uint64_t{s.begin} + 1 && s.column <= std::uint64_t{s.begin} + 1));
  }
  void blame(std::string what) {
    if (fault_.empty()) fault_ = std::move(what);
  }
  PostOutput& to_;
  const std::vector<std::uint32_t> ends_;
  std::map<std::string, std::ptrdiff_t, std::less<>> lines_;  ///< of the files
  std::size_t bytes_ = 0, faults_ = 0, told_ = 0;
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
      for (const std::string_view text : {c.reserved, c.extensions, c.title})
        if (!is_text(text, kMostWords)) {
          wrong_ = "has capabilities that are not text";
          return;
        }
      caps_ = c;
      // Texts that stay, whatever becomes of the post's own.
      texts_ = {std::string(c.reserved), std::string(c.extensions), heard(c.title)};
      caps_.reserved = texts_[0];
      caps_.extensions = texts_[1];
      caps_.title = texts_[2];
      if ((caps_.forms & (kPostStructured | kPostFlat)) == 0)
        wrong_ = "accepts no form of a program";
      if (caps_.max_name < 4) wrong_ = "has names of less than four letters";
      if (c.title.empty()) wrong_ = "has no title";
      for (const char e : caps_.extensions)
        if (!((e >= 'a' && e <= 'z') || (e >= '0' && e <= '9') || e == ',' || e == '_'))
          wrong_ = "has invalid extensions";
      const auto within = [&](auto value, auto last) {
        if (static_cast<int>(value) < 0 || value > last) wrong_ = "has invalid capabilities";
      };
      within(c.circle, PostCircle::centre);
      within(c.blending, PostBlending::accuracy);
      within(c.speed, PostSpeed::time);
      within(c.name_case, PostCase::lower);
      within(c.charset, PostCharset::utf8);
      for (const std::int32_t n :
           {c.external_axes, c.max_name, c.max_points, c.max_lines, c.max_nesting})
        within(n, kMostCount);
    } catch (...) {
      wrong_ = "failed to return its capabilities";
    }
    if (!wrong_.empty()) caps_ = {};
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
      return error(ErrorCode::invalid_argument, "there is no complete program to post");
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
