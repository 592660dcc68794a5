// SPDX-License-Identifier: Apache-2.0
// Programs for editors, of any language: by what the language gives to editors, or else by the
// tables of its compiler (layer: data processing,
// program).
#pragma once

#include <memory>
#include <span>
#include <string>

#include <robomosp/sdk/language_editing.h>

namespace robomosp::program {

/// A program of these texts, which may change and go afterwards. A language without the extension
/// robomosp.language.editing/1 has faults, and, of programs without errors, names with their
/// places, hover, definitions, references and an outline; the rest is refused with a sentence.
/// `name` is the provider's. `params` are those of its compiler, checked.
Result<std::unique_ptr<EditedProgram>> open_editing(std::shared_ptr<Language> language,
                                                    std::string name,
                                                    std::shared_ptr<const Params> params,
                                                    std::span<const SourceFile> files);

}  // namespace robomosp::program
