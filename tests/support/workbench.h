// SPDX-License-Identifier: Apache-2.0
// Workbench: document, registry with the project's plugins and derived values, for tests of higher
// layers.
#pragma once

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "document/document.h"
#include "evaluation/derived.h"
#include "io/native.h"
#include "kernel/plugin_loader.h"
#include "kernel/registry.h"

namespace robomosp::test {

struct Workbench {
  Workbench() : loader(registry), derived(registry) {
    loader.set_search_path({ROBOMOSP_PLUGIN_DIR});
    loader.load_all();
    for (const auto& report : loader.reports())
      EXPECT_TRUE(report.loaded) << (report.refusal ? report.refusal->sentence()
                                                    : report.file.string());
  }
  /// Loads a file of scripts/library, such as "worlds/pa10_circle.wld".
  AnyId load(const std::string& file) {
    auto transaction = document.begin("load " + file);
    if (!transaction.ok()) {
      ADD_FAILURE() << transaction.error().sentence();
      return {};
    }
    auto loaded = io::load(*transaction, library() / file, {library()});
    if (!loaded.ok()) {
      ADD_FAILURE() << loaded.error().sentence();
      return {};
    }
    auto commit = transaction->commit();
    EXPECT_TRUE(commit.ok()) << (commit.ok() ? "" : commit.error().sentence());
    return loaded->id;
  }
  static std::filesystem::path library() {
    return std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "scripts/library";
  }

  Registry registry;
  PluginLoader loader;
  document::Document document;
  evaluation::Derived derived;
};

/// The value, or a failed test and a default one.
template <class T>
T unwrap(Result<T> r) {
  if (r.ok()) return std::move(r).value();
  ADD_FAILURE() << r.error().sentence();
  return T{};
}

}  // namespace robomosp::test
