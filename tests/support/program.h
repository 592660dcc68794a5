// SPDX-License-Identifier: Apache-2.0
// Fixtures on the whole program without front ends: one application for all tests of a file, each
// of which starts with an empty document.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <gtest/gtest.h>

#include "ioci/core/application.h"

namespace robomosp::test {

class ProgramTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto made = ioci::Application::create(
        {.plugin_path = {ROBOMOSP_PLUGIN_DIR},
         .library = {std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"}});
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    app_ = std::move(*made);
  }
  static void TearDownTestSuite() { app_.reset(); }
  void SetUp() override { app().document.clear(); }
  static ioci::Application& app() { return *app_; }

 private:
  inline static std::unique_ptr<ioci::Application> app_;
};

/// The same, with commands called as front ends do.
class CommandTest : public ProgramTest {
 protected:
  Value call(std::string_view name, const Map& args = {}) {
    auto r = app().dispatch(session_, name, args);
    EXPECT_TRUE(r.ok()) << name << ": " << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? std::move(*r) : Value();
  }
  /// The error of a command that must fail and must leave the document as it was.
  Error fails(std::string_view name, const Map& args = {}) {
    const std::string before = app().document.content_digest();
    const auto steps = app().document.undo_labels().size();
    auto r = app().dispatch(session_, name, args);
    EXPECT_FALSE(r.ok()) << name << " should have failed";
    EXPECT_EQ(app().document.content_digest(), before) << name;
    EXPECT_EQ(app().document.undo_labels().size(), steps) << name;
    return r.ok() ? Error{} : r.error();
  }
  static const Value& at(const Value& v, std::string_view key) {
    static const Value none;
    const Map* m = v.as_map();
    const Value* found = m ? m->find(key) : nullptr;
    EXPECT_NE(found, nullptr) << "no field " << key << " in " << v.text();
    return found ? *found : none;
  }

  ioci::Session session_{"test"};
};

}  // namespace robomosp::test
