// SPDX-License-Identifier: Apache-2.0
// Records put into a document by tests.
#pragma once

#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "document/document.h"

namespace robomosp::test {

/// Adds a record in a separate undo step; a refusal fails the test.
template <class R>
Id<model::kind_of<R>> make(document::Document& d, const std::string& name, R content) {
  auto tx = d.begin("add " + name);
  const auto id = tx->add(name, std::move(content));
  EXPECT_TRUE(id.ok()) << (id.ok() ? "" : id.error().sentence());
  const auto commit = tx->commit();
  EXPECT_TRUE(commit.ok()) << (commit.ok() ? "" : commit.error().sentence());
  return id.ok() ? *id : Id<model::kind_of<R>>{};
}

}  // namespace robomosp::test
