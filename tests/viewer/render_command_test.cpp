// SPDX-License-Identifier: GPL-3.0-or-later
// The render commands through the application, the plugin and its engine.
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "ioci/core/application.h"
#include "kernel/base64.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;

class RenderCommand : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / "robomosp-render-command";
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    auto made =
        Application::create({.plugin_path = {ROBOMOSP_PLUGIN_DIR},
                             .library = {fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"}});
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    app_ = std::move(*made);
    run("solid.create",
        {{"name", "block"}, {"root", Map{{"kind", "box"}, {"x", 0.2}, {"y", 0.1}, {"z", 0.1}}}});
  }
  void TearDown() override { fs::remove_all(folder_); }

  Value run(const std::string& command, const Map& args) {
    auto done = app_->dispatch(session_, command, args);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
    return done.ok() ? *done : Value();
  }
  [[nodiscard]] std::string file(const std::string& name) const {
    return (folder_ / name).string();
  }
  Map args(const Map& more = {}) const {
    Map a{{"what", "block"}, {"file", file("a.png")}, {"size", List{64, 48}}, {"quality", "draft"}};
    for (const auto& [name, value] : more) a.set(name, value);
    return a;
  }
  /// The sentence of a refused picture, which leaves no file.
  std::string refused(const Map& more) {
    const auto done = app_->dispatch(session_, "view.render", args(more));
    EXPECT_FALSE(done.ok());
    EXPECT_FALSE(fs::exists(file("a.png")));
    return done.ok() ? "" : done.error().sentence();
  }
  /// Width and height in the header of a PNG file.
  static std::array<int, 2> size_of(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    std::array<unsigned char, 24> head{};
    in.read(reinterpret_cast<char*>(head.data()), head.size());
    return {256 * head[18] + head[19], 256 * head[22] + head[23]};
  }

  fs::path folder_;
  std::unique_ptr<Application> app_;
  Session session_{"test"};
};

TEST_F(RenderCommand, TheEngineIsLoadedWithTheFirstPictureOnly) {
  const auto is_loaded = [] {
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);)
      if (line.find("lazy/render_osg") != std::string::npos) return true;
    return false;
  };
  // Nothing has drawn yet: this is the first test of the program.
  run("version", {});
  EXPECT_FALSE(is_loaded());
  run("view.render", args());
  EXPECT_TRUE(is_loaded());
}

TEST_F(RenderCommand, APictureOfTheWantedSizeIsWritten) {
  const Value done = run("view.render", args());
  EXPECT_EQ(size_of(file("a.png")), (std::array{64, 48}));
  EXPECT_EQ(done.as_map()->find("items")->number(), 1);
  EXPECT_EQ(done.as_map()->find("width")->number(), 64);
  // Nothing else is left behind.
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}), 1);
}

TEST_F(RenderCommand, APictureInTheAnswerIsTheFileWithoutAFile) {
  run("view.render", args());
  std::ifstream in(file("a.png"), std::ios::binary);
  const std::string written(std::istreambuf_iterator<char>(in), {});
  fs::remove(file("a.png"));
  Map asked = args();
  asked.erase("file");
  session_.deny(Effect::files_write);
  session_.deny(Effect::files_read);
  session_.deny(Effect::processes);
  const Value done = run("view.picture", asked);
  const std::string text = *done.as_map()->find("png")->as_string();
  std::string bytes(base64::decoded_size(text).value_or(0), '\0');
  ASSERT_TRUE(base64::decode(text, bytes.data()));
  EXPECT_EQ(bytes, written);
  EXPECT_EQ(done.as_map()->find("width")->number(), 64);
  EXPECT_EQ(done.as_map()->find("items")->number(), 1);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(RenderCommand, APlotInTheAnswerNeedsNoFile) {
  const auto plot = [&](const Map& more) {
    Map a{{"id", "stroke"}, {"width", 300}};
    for (const auto& [name, value] : more) a.set(name, value);
    return app_->dispatch(session_, "trajectory.plot", a);
  };
  const List first{0.5, 0, 0.3, 0, 0, 0}, last{0.5, 0.2, 0.3, 0, 0, 0};
  const Map line{{"shape", "line"}, {"points", List{first, last}}};
  run("trajectory.create", {{"name", "stroke"}, {"segments", List{line}}});
  run("trajectory.plot", {{"id", "stroke"}, {"file", file("a.svg")}, {"width", 300}});
  std::ifstream in(file("a.svg"), std::ios::binary);
  const std::string written(std::istreambuf_iterator<char>(in), {});
  const auto both = plot({{"file", file("b.svg")}, {"as", "svg"}});
  ASSERT_FALSE(both.ok());
  EXPECT_NE(both.error().sentence().find("both are requested"), std::string::npos);
  EXPECT_FALSE(fs::exists(file("b.svg")));
  const auto png = plot({{"as", "png"}});
  ASSERT_TRUE(png.ok()) << png.error().sentence();
  EXPECT_EQ(png->as_string()->substr(0, 11), "iVBORw0KGgo");
  session_.deny(Effect::files_write);
  session_.deny(Effect::processes);
  const auto svg = plot({{"as", "svg"}});
  ASSERT_TRUE(svg.ok()) << svg.error().sentence();
  EXPECT_EQ(*svg->as_string(), written);
  const auto refused_png = plot({{"as", "png"}});
  ASSERT_FALSE(refused_png.ok());
  EXPECT_EQ(refused_png.error().code, ErrorCode::permission);
  EXPECT_NE(plot({})->as_string()->find("time"), std::string::npos);
}

TEST_F(RenderCommand, WrongArgumentsAreToldBeforeAnyFileIsMade) {
  const auto expect = [&](const Map& more, const std::string& part) {
    const std::string sentence = refused(more);
    EXPECT_NE(sentence.find(part), std::string::npos) << sentence;
  };
  expect({{"file", file("a.jpg")}}, "does not end with .png");
  expect({{"file", file("none/a.png")}}, "there is no folder");
  expect({{"what", "blok"}}, "block");
  expect({{"size", List{64}}}, "two whole numbers of pixels in 16..8192");
  expect({{"size", List{64, 9000}}}, "two whole numbers of pixels in 16..8192");
  expect({{"style", "cartoon"}}, "hidden_line");
  expect({{"eye", List{1, 2, 3}}}, "eye and target must be given together");
  expect({{"eye", List{1, 2, 3}}, {"target", List{1, 2, 3}}}, "no direction to look");
  expect({{"section", "w"}}, "is not an axis");
  expect({{"section", Map{{"normal", List{0, 0, 0}}}}}, "zero");
  expect({{"section", Map{{"axis", "x"}, {"normal", List{0, 0, 1}}}}},
         "either an axis or a normal");
  expect({{"section", Map{{"offset", 0.1}}}}, "either an axis or a normal");
  expect({{"background", "mauve"}}, "is not studio, dark, white, transparent or a colour");
  expect({{"explode", -1}}, "explode");
  expect({{"q", List{0, 0}}}, "has no joints");
  expect({{"at", 1.0}}, "needs a recording");
}

TEST_F(RenderCommand, WithoutARendererOneSentenceSaysSo) {
  for (const auto& info : app_->registry.list("robomosp.renderer/2"))
    app_->registry.remove("robomosp.renderer/2", info.name);
  EXPECT_EQ(refused({}),
            "cannot draw a picture, because no renderer is installed. Install the desktop package "
            "of this program, which contains the plugin render_osg.");
}

TEST_F(RenderCommand, AMarkOfMassNeedsAMassAndSaysSo) {
  const Value done = run("view.render", args({{"com", true}}));
  const List& left_out = *done.as_map()->find("left_out")->as_list();
  ASSERT_EQ(left_out.size(), 1U);
  EXPECT_EQ(*left_out[0].as_string(),
            "solid \"block\" has no mass, so its centre of mass is not shown.");
}

TEST_F(RenderCommand, ASectionThatTakesEverythingAwayIsRemarkedOn) {
  const auto left_out = [&](double offset) {
    const Value done =
        run("view.render", args({{"section", Map{{"axis", "x"}, {"offset", offset}}}}));
    return *done.as_map()->find("left_out")->as_list();
  };
  EXPECT_TRUE(left_out(0.09).empty());
  EXPECT_TRUE(left_out(0.5).empty()) << "nothing is taken away";
  const List remarks = left_out(-0.2);
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_NE(remarks[0].as_string()->find("takes everything away"), std::string::npos);
}

TEST_F(RenderCommand, EveryOptionTogetherDraws) {
  run("material.create", {{"name", "steel"}, {"density", 7850}});
  run("solid.set", {{"id", "block"}, {"path", "material"}, {"value", "steel"}});
  run("view.render", args({{"style", "hidden_line"},
                           {"hidden", true},
                           {"com", true},
                           {"frames", true},
                           {"section", Map{{"axis", "-y"}, {"offset", 0.01}, {"hatch", false}}},
                           {"projection", "orthographic"},
                           {"view", "isometric"},
                           {"background", "#e8eef4"},
                           {"caption", "block"},
                           {"edges", false},
                           {"zoom", 0.9}}));
  EXPECT_EQ(size_of(file("a.png")), (std::array{64, 48}));
}

TEST_F(RenderCommand, ARecordingOfARobotAloneIsDrawnFilmedAndReplayed) {
  const Value robot = run("robot.get", {{"name", "planar2rods"}});
  const Value made = run("robot.simulate", {{"id", robot},
                                            {"q", List{0, 0.5}},
                                            {"duration", 0.4},
                                            {"sample_time", 0.05},
                                            {"friction", false},
                                            {"limits", "ignore"}});
  const std::string before = app_->document.content_digest();
  const auto steps = app_->document.undo_labels().size();
  const List size{96, 64};
  const auto picture = [&](const std::string& name, double at) {
    run("robot.render", {{"id", robot},
                         {"recording", made},
                         {"at", at},
                         {"file", file(name)},
                         {"size", size},
                         {"quality", "draft"}});
    std::ifstream in(file(name), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string start = picture("start.png", 0), end = picture("end.png", 0.4);
  EXPECT_GT(start.size(), 500U);
  EXPECT_NE(start, end);

  double furthest = 0;
  session_.show_progress = [&](double fraction, std::string_view) {
    EXPECT_GE(fraction, furthest - 1e-9);
    furthest = fraction;
  };
  const Value film =
      run("recording.video", {{"id", made}, {"file", file("a.gif")}, {"fps", 10}, {"size", size}});
  session_.show_progress = {};
  EXPECT_GT(furthest, 0.9);
  EXPECT_EQ(*film.as_map()->find("frames")->as_int(), 5);
  std::ifstream in(file("a.gif"), std::ios::binary);
  const std::string gif(std::istreambuf_iterator<char>(in), {});
  EXPECT_EQ(gif.substr(0, 6), "GIF89a");
  EXPECT_EQ(gif.back(), ';');
  EXPECT_EQ(static_cast<unsigned char>(gif[6]), 96);
  EXPECT_EQ(*run("recording.replay", {{"id", made}, {"file", file("a.html")}})
                 .as_map()
                 ->find("frames")
                 ->as_int(),
            9);
  // Nothing of it is in the document.
  EXPECT_EQ(app_->document.content_digest(), before);
  EXPECT_EQ(app_->document.undo_labels().size(), steps);
  EXPECT_TRUE(run("world.list", {}).as_list()->empty());

  const auto fails = [&](const std::string& command, const Map& given) {
    const auto done = app_->dispatch(session_, command, given);
    EXPECT_FALSE(done.ok());
    return done.ok() ? "" : done.error().sentence();
  };
  EXPECT_NE(fails("recording.video", {{"id", made}, {"file", file("b.gif")}, {"fps", 60}})
                .find("at most 50 pictures a second"),
            std::string::npos);
  EXPECT_NE(fails("recording.video", {{"id", made}, {"file", file("b.webm")}}).find(".mp4 or .gif"),
            std::string::npos);
  const Value other = run("robot.get", {{"name", "twolink"}});
  EXPECT_NE(fails("robot.render", {{"id", other}, {"recording", made}, {"file", file("b.png")}})
                .find("is not one of"),
            std::string::npos);
  // A film that is cancelled leaves nothing.
  session_.show_progress = [&](double, std::string_view) { session_.interrupt(); };
  const auto cancelled = app_->dispatch(
      session_, "recording.video",
      {{"id", made}, {"file", file("c.gif")}, {"fps", 50}, {"speed", 0.01}, {"size", size}});
  session_.show_progress = {};
  session_.clear_interrupt();
  ASSERT_FALSE(cancelled.ok());
  EXPECT_EQ(cancelled.error().code, ErrorCode::cancelled);
  EXPECT_FALSE(fs::exists(file("c.gif")));
  run("robot.remove", {{"id", robot}});
  EXPECT_NE(fails("recording.video", {{"id", made}, {"file", file("d.gif")}})
                .find("which no longer exists"),
            std::string::npos);
}

TEST_F(RenderCommand, MembersAreLeftOutAndPlacesFaded) {
  run("material.create", {{"name", "red"}, {"density", 1000}, {"colour", "#d00000"}});
  run("solid.create", {{"name", "cube"},
                       {"material", "red"},
                       {"root", Map{{"kind", "box"}, {"x", 0.2}, {"y", 0.2}, {"z", 0.2}}}});
  run("object.create",
      {{"name", "pair"},
       {"parts", List{Map{{"what", "cube"}, {"name", "left"}},
                      Map{{"what", "cube"}, {"name", "right"}, {"position", List{0.3, 0, 0}}}}}});
  const Value cell = run("world.create", {{"name", "cell"}});
  run("world.add_object", {{"id", cell}, {"what", "pair"}, {"name", "near"}});
  run("world.add_object",
      {{"id", cell}, {"what", "pair"}, {"name", "far"}, {"position", List{0, 2, 0}}});
  const Value arm = run("robot.get", {{"name", "planar2rods"}});
  run("world.add_robot", {{"id", cell}, {"robot", arm}, {"name", "arm"}});
  int pictures = 0;
  const auto drawn = [&](const Map& more, const std::string& command = "view.render") {
    Map a = args(more);
    a.set("file", file("v" + std::to_string(++pictures) + ".png"));
    if (command == "view.render") a.set("what", "cell");
    else a.erase("what");
    const Value done = run(command, a);
    const Map* m = done.as_map();
    return m ? m->find("items")->number() : -1;
  };
  const auto bytes = [&](int picture) {
    std::ifstream in(file("v" + std::to_string(picture) + ".png"), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const double all = drawn({});
  EXPECT_EQ(drawn({{"without", List{"objects.near"}}}), all - 2);
  EXPECT_EQ(drawn({{"without", List{"objects.near", "objects.far"}}}), all - 4);
  const double objects = drawn({{"without", List{"robots.arm"}}});
  EXPECT_EQ(objects, 4);
  // Opacity takes no item away, and changes the picture. The last entry of a place counts.
  EXPECT_EQ(drawn({{"fade", List{Map{{"path", "objects.near"}, {"opacity", 0.3}}}}}), all);
  const std::string faded = bytes(pictures);
  EXPECT_NE(faded, bytes(1));
  (void)drawn({{"fade", List{Map{{"path", "objects.near"}, {"opacity", 0.9}},
                             Map{{"path", "objects.near"}, {"opacity", 0.3}}}}});
  EXPECT_EQ(bytes(pictures), faded);
  // A part of a record, wherever it is in the world; and in a picture of that record alone.
  EXPECT_EQ(drawn({{"fade", List{Map{{"what", "pair"}, {"path", "parts.left"}, {"opacity", 0}}}}}),
            all);
  EXPECT_NE(bytes(pictures), bytes(1));
  (void)drawn({{"fade", List{Map{{"what", arm}, {"opacity", 0.2}}}}});
  EXPECT_NE(bytes(pictures), bytes(1));
  const Map alone{{"id", "pair"}};
  EXPECT_EQ(drawn(alone, "object.render"), 2);
  const std::string whole = bytes(pictures);
  EXPECT_EQ(drawn({{"id", "pair"}, {"fade", List{Map{{"path", "parts.left"}, {"opacity", 0.1}}}}},
                  "object.render"),
            2);
  EXPECT_NE(bytes(pictures), whole);
  // Overlays as a window shows them.
  (void)drawn({{"layers", List{"labels", "centres_of_mass"}}});
  EXPECT_NE(bytes(pictures), bytes(1));
  // A section by an axis goes through the middle of what is left, here y = 0.
  const List others{"robots.arm", "objects.far"};
  EXPECT_EQ(drawn({{"without", others}, {"section", "y"}}), 2);
  const std::string cut = bytes(pictures);
  (void)drawn({{"without", others}, {"section", Map{{"axis", "y"}, {"offset", 0}}}});
  EXPECT_EQ(bytes(pictures), cut);
  (void)drawn({{"without", others}, {"section", Map{{"axis", "y"}, {"offset", 0.05}}}});
  EXPECT_NE(bytes(pictures), cut);
  // The label of the member that is left out goes, not an equal one.
  (void)drawn({{"layers", List{"dimensions"}}, {"without", others}});
  const std::string measured = bytes(pictures);
  (void)drawn({{"layers", List{"dimensions"}}, {"without", List{"robots.arm", "objects.near"}}});
  EXPECT_NE(bytes(pictures), measured);
  EXPECT_NE(refused({{"what", "cell"}, {"without", others}, {"explode", 1}})
                .find("an exploded picture shows all members"),
            std::string::npos);
  EXPECT_NE(refused({{"what", "pair"}, {"fade", List{Map{{"path", "left"}, {"opacity", 0.5}}}}})
                .find("the picture has nothing of \"left\" of object \"pair\""),
            std::string::npos);
  EXPECT_NE(refused({{"what", "cell"}, {"without", List{"objects.nears"}}})
                .find("Did you mean \"objects.near\"?"),
            std::string::npos);
  EXPECT_NE(
      refused({{"what", "cell"}, {"fade", List{Map{{"path", "objects.door"}, {"opacity", 0.5}}}}})
          .find("the picture has nothing of \"objects.door\" of world \"cell\""),
      std::string::npos);
  EXPECT_NE(
      refused({{"what", "cell"}, {"fade", List{Map{{"path", "objects.near"}, {"opacity", 1.5}}}}})
          .find("0 to 1"),
      std::string::npos);
  run("world.add_light", {{"id", cell}, {"name", "lamp"}});
  EXPECT_NE(refused({{"what", "cell"}, {"without", List{"lights.lamp"}}})
                .find("without[1]: \"lights.lamp\" is a light"),
            std::string::npos);
  EXPECT_NE(refused({{"what", "cell"}, {"layers", List{"label"}}}).find("labels"),
            std::string::npos);
  EXPECT_NE(refused({{"without", List{"objects.near"}}}).find("member"), std::string::npos);
  // A film, too, also of a robot alone.
  const auto film = [&](const Value& recording, const Map& more) {
    Map a{{"id", recording}, {"file", file("f.gif")}, {"fps", 10}, {"size", List{64, 48}}};
    for (const auto& [name, value] : more) a.set(name, value);
    run("recording.video", a);
    std::ifstream in(file("f.gif"), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const Value lone = run("robot.simulate", {{"id", arm},
                                            {"q", List{0.0, 0.5}},
                                            {"duration", 0.2},
                                            {"friction", false},
                                            {"limits", "ignore"}});
  const std::string moved = film(lone, {});
  EXPECT_NE(film(lone, {{"fade", List{Map{{"opacity", 0.1}}}}}), moved);
  EXPECT_NE(film(lone, {{"fade", List{Map{{"path", "links.lower"}, {"opacity", 0.1}}}}}), "");
}

TEST_F(RenderCommand, MapsStandAroundTheirRobot) {
  const Value arm = run("robot.get", {{"name", "planar2rods"}});
  const Value made = run("robot.workspace", {{"id", arm}, {"samples", 5000}, {"voxel", 0.1}});
  const Value recording = *made.as_map()->find("recording");
  Map a{{"id", arm}, {"file", file("a.png")}, {"size", List{64, 48}}, {"quality", "draft"}};
  const auto items = [&](const Map& map) {
    a.set("map", map);
    return run("robot.render", a).as_map()->find("items")->number();
  };
  const double all = items({{"recording", recording}});
  EXPECT_GT(all, 10);
  EXPECT_LT(items({{"recording", recording}, {"bands", 3}, {"opacity", 0.5}}), all);
  // In a world, where the robot has another name there; and what does not fit is reported.
  const Value cell = run("world.create", {{"name", "cell"}});
  run("world.add_robot", {{"id", cell}, {"robot", arm}, {"name", "left"}});
  a.set("id", cell);
  a.set("map", recording);
  EXPECT_GT(run("world.render", a).as_map()->find("items")->number(), 10);
  const auto told = [&](const Value& map, const std::string& part) {
    a.set("map", map);
    const auto done = app_->dispatch(session_, "world.render", a);
    ASSERT_FALSE(done.ok()) << part;
    EXPECT_NE(done.error().sentence().find(part), std::string::npos) << done.error().sentence();
  };
  told(Map{{"recording", recording}, {"robot", "right"}}, "left");
  told(Map{{"recording", recording}, {"cut", "w"}}, "is not an axis");
  told(Map{{"recording", recording}, {"cut", Map{{"axis", "x"}, {"offset", -9}}}},
       "no visible voxel");
  told(Map{{"recording", recording}, {"column", "manipulabilty"}}, "manipulability");
  told(Map{{"recording", recording}, {"low", 2}, {"high", 1}}, "low and high");
  a.set("section", "x");
  told(recording, "section");
}

}  // namespace
}  // namespace robomosp::ioci
