// SPDX-License-Identifier: Apache-2.0
// A kind of record of its own, of this file alone: a struct and its declaration. It is saved,
// loaded, edited, undone, described, referred to and refers, and nothing else knows of it.
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>

#include "document/digest.h"
#include "document/document.h"
#include "io/native.h"
#include "ioci/core/application.h"
#include "model/data.h"
#include "model/declare.h"
#include "model/field_path.h"
#include "model/parametric.h"

namespace robomosp {
namespace recipes {

enum class Colouring : std::uint8_t { none, dipped, sprayed };
constexpr std::array<std::string_view, 3> kColouringWords{"none", "dipped", "sprayed"};
constexpr std::span<const std::string_view> words(model::Of<Colouring>) { return kColouringWords; }

struct Ingredient {
  std::string name;
  AnyId what;  ///< material, or another recipe
  double share = 1;
  Vec3 place{};
};
template <class V>
constexpr void fields(V& v, model::Of<Ingredient>) {
  v("name", &Ingredient::name).needed().doc("Unique in the recipe.");
  v("what", &Ingredient::what).doc("Material or recipe.");
  v("share", &Ingredient::share).range(0, 1).doc("Of the whole.");
  v("place", &Ingredient::place).unit("m").doc("Where it is poured in.");
}

struct Recipe {
  std::string description;
  double weight = 300;
  bool is_stirred = false;
  std::int64_t rounds = 3;
  Colouring colouring = Colouring::none;
  Colour colour;
  std::vector<double> times;
  std::optional<double> rest;
  std::optional<model::Placement> mixer;
  model::Placement stand;
  std::vector<Ingredient> ingredients;
  std::int32_t first = -1;
  model::ProviderChoice controller;
  std::map<std::string, double> limits;
  MaterialId pot;
  model::Parametric parametric;
};
template <class V>
constexpr void fields(V& v, model::Of<Recipe>) {
  v("description", &Recipe::description).doc("What it makes.");
  v("parametric", &Recipe::parametric).flat().doc("Parameters.");
  v("weight", &Recipe::weight).unit("kg").above(0).needed().doc("Of all.");
  v("is_stirred", &Recipe::is_stirred).doc("Whether it is stirred.");
  v("rounds", &Recipe::rounds).range(1, 10).doc("How often.");
  v("colouring", &Recipe::colouring).doc("How it gets its colour.");
  v("colour", &Recipe::colour).doc("The colour.");
  v("times", &Recipe::times).unit("s").doc("Of the steps.");
  v("rest", &Recipe::rest).unit("s").at_least(0).doc("At the end.");
  v("mixer", &Recipe::mixer).doc("Where the mixer is.");
  v("stand", &Recipe::stand).flat().doc("Where the pot is.");
  v("ingredients", &Recipe::ingredients).by_names().doc("What goes in.");
  v("first", &Recipe::first).index_of("ingredients").doc("Goes in first.");
  v("controller", &Recipe::controller).doc("Of the mixer.");
  v("limits", &Recipe::limits).doc("By name.");
  v("pot", &Recipe::pot).doc("What the pot is made of.");
}

Kind kind() { return model::register_kind_of<Recipe>("recipe", ".rcp", "recipes"); }

}  // namespace recipes

namespace {

namespace fs = std::filesystem;
using document::Document;
using recipes::Recipe;

struct OwnKind : testing::Test {
  Document document;
  fs::path folder = fs::temp_directory_path() / ("recipes-" + std::to_string(::getpid()));
  AnyId salt, brine, soup;

  void SetUp() override {
    fs::create_directories(folder);
    auto tx = document.begin("add");
    salt = *tx->add("salt", model::Material{});
    Recipe simple;
    simple.ingredients.push_back({"grains", salt, 0.5, {}});
    brine = add(*tx, "brine", simple);
    Recipe r;
    r.description = "hot";
    r.weight = 350;
    r.is_stirred = true;
    r.rounds = 5;
    r.colouring = recipes::Colouring::sprayed;
    r.colour = {0.5F, 0.25F, 0.125F, 1};
    r.times = {1.5, 60};
    r.rest = 30;
    r.mixer.emplace().position = {0.1, 0.2, 0.3};
    r.stand.position = {0, 0, 0.5};
    r.ingredients = {{"water", {}, 0.75, {0.1, 0, 0}}, {"brine", brine, 0.25, {}}};
    r.first = 1;
    r.controller.name = "slow";
    r.controller.params["gain"] = 0.5;
    r.limits = {{"low", 1}, {"high", 2}};
    r.pot = MaterialId{salt.number};
    r.parametric.parameters = {{"depth", "", "m", 0.2, ""}};
    r.parametric.expressions["water.place.x"] = "depth/2";
    soup = add(*tx, "soup", r);
    const auto commit = tx->commit();
    ASSERT_TRUE(commit.ok()) << commit.error().sentence();
  }
  void TearDown() override { fs::remove_all(folder); }

  static AnyId add(document::Transaction& tx, const std::string& name, const Recipe& r) {
    auto id = tx.add({name, "", model::OtherContent(recipes::kind(), r)});
    EXPECT_TRUE(id.ok()) << (id.ok() ? "" : id.error().sentence());
    return id.ok() ? *id : AnyId{};
  }
  [[nodiscard]] const Recipe& recipe(AnyId id) const {
    return std::get<model::OtherContent>(document.now()->find(id)->body).as<Recipe>();
  }
  Result<document::Commit> edit(AnyId id, const std::function<void(Recipe&)>& change) {
    auto tx = document.begin("edit");
    RMP_TRY(tx->edit(id, [&](model::Record& r) -> Result<void> {
      change(std::get<model::OtherContent>(r.body).as<Recipe>());
      return {};
    }));
    return tx->commit();
  }
};

TEST_F(OwnKind, IsKnownByNameAndKeepsItsNumber) {
  EXPECT_EQ(to_string(recipes::kind()), "recipe");
  EXPECT_EQ(kind_from("recipe"), recipes::kind());
  EXPECT_EQ(recipes::kind(), recipes::kind());
  EXPECT_EQ(io::extension(recipes::kind()), ".rcp");
}

TEST_F(OwnKind, IsEditedCheckedUndoneAndReferredTo) {
  EXPECT_EQ(recipe(soup).ingredients[0].place[0], 0.1) << "depth/2";
  auto commit = edit(soup, [](Recipe& r) { r.weight = 400; });
  ASSERT_TRUE(commit.ok());
  EXPECT_EQ(recipe(soup).weight, 400);
  ASSERT_TRUE(document.undo().ok());
  EXPECT_EQ(recipe(soup).weight, 350);
  EXPECT_EQ(edit(soup, [](Recipe& r) { r.weight = -1; }).error().sentence(),
            "recipe \"soup\": the weight is -1 kg; it must be greater than 0.");
  EXPECT_EQ(edit(soup, [](Recipe& r) { r.ingredients[1].share = 2; }).error().sentence(),
            "recipe \"soup\": the share of ingredient \"brine\" is 2; it must be from 0 to 1.");
  EXPECT_EQ(edit(soup, [](Recipe& r) { r.ingredients[1].name = "water"; }).error().message,
            "there are two ingredients named \"water\"");
  EXPECT_EQ(edit(brine, [&](Recipe& r) { r.ingredients[0].what = soup; }).error().sentence(),
            "recipe \"brine\" cannot refer to recipe \"soup\", which refers to it in turn (soup > "
            "brine). Remove one of these references first.");
  EXPECT_EQ(document.now()->referrers(brine), std::vector<AnyId>{soup});
  commit = edit(brine, [](Recipe& r) { r.weight = 310; });
  EXPECT_EQ(commit->affected, (std::vector<AnyId>{brine, soup}));
}

TEST_F(OwnKind, IsSavedWithWhatItRefersToAndReadBack) {
  auto tx = document.begin("save");
  const auto saved = io::save(*tx, soup, folder / "soup.rcp", {});
  ASSERT_TRUE(saved.ok()) << saved.error().sentence();
  EXPECT_EQ(saved->size(), 3U);
  ASSERT_TRUE(tx->commit().ok());
  const std::string text = io::read_file(folder / "soup.rcp").value();
  EXPECT_EQ(text, R"(robomosp recipe 1
name soup
description "hot"
parameter depth 0.2 m
weight 350
is_stirred true
rounds 5
colouring sprayed
colour (0.5, 0.25, 0.125)
times (1.5, 60)
rest 30
mixer { at (0.1, 0.2, 0.3) }
at (0, 0, 0.5)
ingredient water { share 0.75  place (0.1 = "depth/2", 0, 0) }
ingredient brine { what "brine.rcp"  share 0.25 }
first brine
controller slow {
  gain 0.5
}
limits { high 2  low 1 }
pot "salt.mtr"
)");
  Document other;
  auto again = other.begin("load");
  const auto loaded = io::load(*again, folder / "soup.rcp", {});
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence() << text;
  ASSERT_TRUE(again->commit().ok());
  EXPECT_EQ(other.content_digest(), document.content_digest());
  EXPECT_EQ(io::print(*other.now(), loaded->id, folder / "soup.rcp", {}).value(), text);

  const auto refusal = [&](const std::string& content) {
    Document d;
    auto t = d.begin("load");
    const auto read = io::load_text(*t, content, "s.rcp", folder, {});
    return read.ok() ? std::string() : read.error().sentence();
  };
  EXPECT_EQ(refusal("robomosp recipe 1\nname s\nweight 1 m\n").substr(0, 11), "s.rcp:3:8: ");
  EXPECT_EQ(refusal("robomosp recipe 1\nname s\nweight 1\nfirst salt\n"),
            "s.rcp:4:7: \"salt\" is not one of the ingredients.");
  EXPECT_EQ(refusal("robomosp recipe 1\nname s\nweight 1\ncolouring red\n"),
            "s.rcp:4:11: \"colouring\" must be none, dipped or sprayed.");
  EXPECT_EQ(refusal("robomosp recipe 1\nname s\nwieght 1\n"),
            "s.rcp:3:1: \"wieght\" is not a field of a recipe. Did you mean \"weight\"?");
}

TEST_F(OwnKind, IsMadeDescribedAndSetByCommands) {
  auto made_app = ioci::Application::create({});
  ASSERT_TRUE(made_app.ok());
  ioci::Application& app = **made_app;
  auto session = std::make_shared<ioci::Session>("test");
  const auto run = [&](const std::string& command, Map args) {
    auto result = app.dispatch(*session, command, std::move(args));
    EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().sentence());
    return result.ok() ? *result : Value();
  };
  run("material.create", {{"name", "salt"}, {"density", 2000}});
  const Value made = run(
      "record.create",
      {{"kind", "recipe"},
       {"name", "broth"},
       {"fields",
        Map{{"weight", "80 kg"},
            {"ingredients", List{Map{{"name", "grains"}, {"what", "salt"}, {"share", 0.5}}}}}}});
  run("record.set", {{"id", made}, {"path", "grains.place.y"}, {"value", "20 mm"}});
  run("record.set", {{"id", made}, {"path", "first"}, {"value", "grains"}});
  run("record.set", {{"id", made}, {"path", "rest"}, {"value", "2 min"}});
  const Value all = run("record.describe", {{"id", made}});
  const Map& m = *all.as_map();
  EXPECT_EQ(m.find("kind")->text(), "recipe");
  EXPECT_EQ(m.find("weight")->number(), 80);
  EXPECT_EQ(m.find("first")->text(), "grains");
  EXPECT_EQ(m.find("rest")->number(), 120);
  const Map& grains = *(*m.find("ingredients")->as_list())[0].as_map();
  EXPECT_EQ(grains.find("what")->text(), "salt");
  EXPECT_EQ(grains.find("place")->as_array()->data(), (std::vector<double>{0, 0.02, 0}));
  run("document.undo", {});
  EXPECT_EQ(run("record.describe", {{"id", made}}).as_map()->find("rest"), nullptr);

  const auto refused =
      app.dispatch(*session, "record.set", {{"id", made}, {"path", "grians.share"}, {"value", 1}});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().sentence().find("grains.share"), std::string::npos)
      << refused.error().sentence();
  const Value schema = run("record.schema", {{"kind", "recipe"}});
  std::vector<std::string> names;
  for (const Value& f : *schema.as_map()->find("fields")->as_list())
    names.push_back(f.as_map()->find("name")->text());
  EXPECT_EQ(names.size(), 16U);
  EXPECT_EQ(names[2], "weight");
}

}  // namespace
}  // namespace robomosp
