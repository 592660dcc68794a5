// SPDX-License-Identifier: Apache-2.0
#include "kernel/known_provider.h"
#include "kernel/registry.h"

#include <stdexcept>

#include <gtest/gtest.h>

namespace robomosp {
namespace {

/// A small interface of its own.
class Greeter {
 public:
  using Interface = Greeter;
  static constexpr const char* kInterfaceId = "robomosp.greeter/1";
  virtual ~Greeter() { ++destroyed; }
  virtual std::string greet() const { return "hello"; }
  static inline int destroyed = 0;
};

ProviderInfo named(std::string name) {
  ProviderInfo info;
  info.interface_id = Greeter::kInterfaceId;
  info.name = std::move(name);
  info.origin = "test";
  info.shipped = true;  // what is only found is another test: tests/abi/guard_test.cpp
  return info;
}

Registry::Create factory() {
  return []() -> Result<void*> { return static_cast<void*>(new Greeter); };
}

TEST(Registry, CreatesWhatWasRegisteredAndDeletesIt) {
  Registry registry;
  ASSERT_TRUE(registry.add(named("polite"), factory()).ok());
  const int before = Greeter::destroyed;
  {
    auto made = registry.create<Greeter>("polite");
    ASSERT_TRUE(made.ok());
    EXPECT_EQ((*made)->greet(), "hello");
    EXPECT_TRUE(registry.create<Greeter>("").ok());
  }
  EXPECT_EQ(Greeter::destroyed, before + 2);
}

TEST(Registry, AbsenceNamesThoseAvailable) {
  Registry registry;
  EXPECT_EQ(registry.create<Greeter>("").error().sentence(),
            "there is no provider of greeter. Load a plugin that offers \"robomosp.greeter/1\"; "
            "plugin.list lists those found. In the source tree ./bootstrap build makes all shipped "
            "plugins.");
  ASSERT_TRUE(registry.add(named("polite"), factory()).ok());
  ASSERT_TRUE(registry.add(named("rude"), factory()).ok());
  EXPECT_EQ(registry.create<Greeter>("polit").error().sentence(),
            "there is no greeter provider \"polit\". Did you mean \"polite\"? Available: polite "
            "and rude.");
}

TEST(Registry, ASecondProviderOfTheSameNameIsRefusedUnlessItReplaces) {
  Registry registry;
  ASSERT_TRUE(registry.add(named("a"), factory()).ok());
  const auto again = registry.add(named("a"), factory());
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::conflict);
  EXPECT_TRUE(registry.add(named("a"), factory(), true).ok());
  EXPECT_EQ(registry.list().size(), 1U);
  EXPECT_FALSE(registry.add(named(""), factory()).ok());
  EXPECT_FALSE(registry.add(named("b"), {}).ok());
}

TEST(Registry, TheDefaultIsTheChosenElseTheFirstEnabled) {
  Registry registry;
  for (const char* name : {"a", "b", "c"}) ASSERT_TRUE(registry.add(named(name), factory()).ok());
  const std::string_view id = Greeter::kInterfaceId;
  EXPECT_EQ(registry.find(id, "")->name, "a");
  ASSERT_TRUE(registry.set_default(id, "c").ok());
  EXPECT_EQ(registry.find(id, "")->name, "c");
  ASSERT_TRUE(registry.set_enabled(id, "c", false).ok());
  ASSERT_TRUE(registry.set_enabled(id, "a", false).ok());
  EXPECT_EQ(registry.find(id, "")->name, "b");
  EXPECT_EQ(registry.create<Greeter>("a").error().sentence(),
            "provider \"greeter a\" is disabled. provider.enable(\"greeter\", \"a\") enables it "
            "again; or "
            "choose another one.");
  EXPECT_EQ(registry.find(id, "a").error().sentence(),
            registry.create<Greeter>("a").error().sentence());
  EXPECT_FALSE(registry.set_default(id, "a").ok());
  EXPECT_FALSE(known_provider(registry, id, "a")->enabled);
  EXPECT_FALSE(registry.set_default(id, "zzz").ok());
  EXPECT_FALSE(registry.set_enabled(id, "zzz", true).ok());
}

TEST(Registry, AnApproximateOrPartialProviderIsTheDefaultOnlyWhenChosenOrAlone) {
  for (const char* tag : {"approximate", "partial"}) {
    Registry registry;
    ProviderInfo rough = named("rough");
    rough.tags = {"mesh", tag};
    ASSERT_TRUE(registry.add(rough, factory()).ok());
    EXPECT_EQ(registry.find(Greeter::kInterfaceId, "")->name, "rough");
    ASSERT_TRUE(registry.add(named("fine"), factory()).ok());
    EXPECT_EQ(registry.find(Greeter::kInterfaceId, "")->name, "fine");
    ASSERT_TRUE(registry.set_default(Greeter::kInterfaceId, "rough").ok());
    EXPECT_EQ(registry.find(Greeter::kInterfaceId, "")->name, "rough");
  }
}

TEST(Registry, TheRevisionCountsEveryChange) {
  Registry registry;
  const std::string_view id = Greeter::kInterfaceId;
  std::uint64_t last = registry.revision();
  const auto changed = [&] { return std::exchange(last, registry.revision()) != last; };
  ASSERT_TRUE(registry.add(named("a"), factory()).ok());
  EXPECT_TRUE(changed());
  ASSERT_TRUE(registry.set_enabled(id, "a", false).ok());
  EXPECT_TRUE(changed());
  ASSERT_TRUE(registry.set_enabled(id, "a", false).ok());
  EXPECT_FALSE(changed());
  ASSERT_FALSE(registry.set_default(id, "a").ok());
  EXPECT_FALSE(changed());
  ASSERT_TRUE(registry.set_enabled(id, "a", true).ok());
  EXPECT_TRUE(changed());
  ASSERT_TRUE(registry.set_default(id, "a").ok());
  EXPECT_TRUE(changed());
  EXPECT_TRUE(registry.remove(id, "a"));
  EXPECT_TRUE(changed());
  EXPECT_FALSE(registry.remove(id, "a"));
  EXPECT_FALSE(changed());
}

TEST(Registry, AProviderThatThrowsOrGivesNothingIsAnErrorThatNamesIt) {
  Registry registry;
  ASSERT_TRUE(
      registry
          .add(named("thrower"), []() -> Result<void*> { throw std::runtime_error("no licence"); })
          .ok());
  ASSERT_TRUE(registry.add(named("odd"), []() -> Result<void*> { throw 5; }).ok());
  ASSERT_TRUE(
      registry.add(named("empty"), []() -> Result<void*> { return static_cast<void*>(nullptr); })
          .ok());
  const auto thrown = registry.create<Greeter>("thrower");
  ASSERT_FALSE(thrown.ok());
  EXPECT_EQ(thrown.error().code, ErrorCode::plugin_failed);
  EXPECT_EQ(thrown.error().message, "provider \"greeter thrower\" threw: no licence");
  EXPECT_EQ(registry.create<Greeter>("odd").error().message,
            "provider \"greeter odd\" threw an unknown exception");
  EXPECT_EQ(registry.create<Greeter>("empty").error().message,
            "provider \"greeter empty\" could not be made and gave no reason");
}

TEST(Registry, ACreateFunctionMayUseTheRegistry) {
  Registry registry;  // a lock held during create would hang here
  ASSERT_TRUE(registry
                  .add(named("a"),
                       [&]() -> Result<void*> {
                         EXPECT_EQ(registry.list().size(), 1U);
                         return static_cast<void*>(new Greeter);
                       })
                  .ok());
  EXPECT_TRUE(registry.create<Greeter>("a").ok());
}

}  // namespace
}  // namespace robomosp
