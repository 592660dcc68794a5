// SPDX-License-Identifier: Apache-2.0
// Plugin irl: the Industrial Robot Language (DIN 66312) behind robomosp.language/1.
#include <string_view>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/language_editing.h>
#include <robomosp/sdk/plugin.h>

#include "compile.h"
#include "editing.h"

namespace robomosp::irl {
namespace {

class Editing final : public LanguageEditing {
 public:
  Result<std::unique_ptr<EditedProgram>> open(const LanguageTask& task) const override {
    return edit(task.files);
  }
};

class Irl final : public Language {
 public:
  [[nodiscard]] const void* extension(const char* id) const override {
    if (id && std::string_view(id) == kGivenValues) return this;
    return id && std::string_view(id) == LanguageEditing::kExtensionId
               ? static_cast<const LanguageEditing*>(&editing_)
               : nullptr;
  }
  [[nodiscard]] std::string_view extensions() const override { return "irl"; }
  Result<std::vector<std::string>> needs(const SourceFile& file) const override {
    return irl::needs(file);
  }
  Result<std::unique_ptr<CompiledProgram>> compile(const LanguageTask& task, const Params&,
                                                   Progress& progress) const override {
    const auto values = RMP_HAS(&task, values) ? task.values : std::span<const GivenValue>();
    RMP_TRY_ASSIGN(auto tables, irl::compile(task.files, progress, values));
    return std::unique_ptr<CompiledProgram>(std::move(tables));
  }

 private:
  Editing editing_;
};

}  // namespace
}  // namespace robomosp::irl

RMP_PLUGIN("org.robomosp.irl", "1.0.0", "Apache-2.0", "The Industrial Robot Language, IRL.",
           RMP_PROVIDER_NO_PARAMS(robomosp::irl::Irl, "irl",
                                  "Industrial Robot Language (DIN 66312).", ""))
