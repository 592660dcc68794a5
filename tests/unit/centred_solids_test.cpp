// SPDX-License-Identifier: Apache-2.0
// Primitives that are centred, through every door: each answers as the same primitive that stands
// on z = 0 within a node that is half its height lower.
#include <unistd.h>

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

namespace fs = std::filesystem;

class CentredSolids : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    folder_ = fs::temp_directory_path() / ("robomosp-centred-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    run("folder = '" + folder_.string() + "/'");
    run(R"(
      function near(a, b, e, what)
        assert(math.abs(a - b) <= (e or 1e-12), (what or "") .. ": " .. a .. " is not " .. b)
      end
      function alike(a, b, e, what)
        if type(a) == "number" then return near(a, b, e, what) end
        assert(#a == #b, what)
        for i = 1, #a do alike(a[i], b[i], e, what) end
      end
      material.create{name = "steel", density = 7850}
      high = 0.3
      kinds = {
        {kind = "box", x = 0.1, y = 0.2, z = high},
        {kind = "box", x = 0.1, y = 0.2, z = high, fillet = 0.01},
        {kind = "cylinder", radius = 0.1, height = high},
        {kind = "cone", base_radius = 0.1, top_radius = 0.03, height = high},
        {kind = "frustum", base_x = 0.2, base_y = 0.1, top_x = 0.1, top_y = 0.05, height = high},
        {kind = "wedge", x = 0.2, y = 0.1, z = high, top_x = 0.05},
        {kind = "pyramid", sides = 5, radius = 0.1, height = high},
        {kind = "prism", height = high, profile = {{polygon = {{0, 0}, {0.1, 0}, {0.1, 0.05}, {0, 0.2}}}}}}
      place, turn = {0.4, -0.2, 0.7}, {0.3, -0.5, 1.1}
      function with(fields, more)
        local t = {}
        for k, v in pairs(fields) do t[k] = v end
        for k, v in pairs(more) do t[k] = v end
        return t
      end
      -- Of each kind one that is centred, and its twin.
      pairs_of = {}
      for i, fields in ipairs(kinds) do
        pairs_of[i] = {
          solid.create{name = "centred" .. i, material = "steel",
            root = with(fields, {name = "body", position = place, rpy = turn, centred = true})},
          solid.create{name = "twin" .. i, material = "steel", root = {kind = "union", position = place, rpy = turn,
            children = {with(fields, {name = "body", position = {0, 0, -high / 2}})}}}}
      end)");
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(CentredSolids, HaveTheMassBoundsEdgesAndMeshOfTheirTwins) {
  run(R"(
    for i, pair in ipairs(pairs_of) do
      local a, b, what = pair[1], pair[2], "kind " .. i
      alike(a:mass().com, b:mass().com, 1e-9, what) alike(a:mass().inertia, b:mass().inertia, 1e-9, what)
      alike(a:bounds().min, b:bounds().min, 1e-6, what) alike(a:bounds().max, b:bounds().max, 1e-6, what)
      local e, f = a:edges(), b:edges()
      assert(#e == #f and #e > 0, what)
      for k = 1, #e do
        near(e[k].length, f[k].length, 1e-9, what)
        alike(e[k].start, f[k].start, 1e-9, what)
      end
      local m, n = a:mesh_info(), b:mesh_info()
      assert(m.triangles == n.triangles and m.vertices == n.vertices, what)
    end)");
}

TEST_F(CentredSolids, AreAsFarAndTouchAsTheirTwinsDo) {
  run(R"(
    solid.create{name = "ball", root = {kind = "sphere", radius = 0.02}}
    for i, pair in ipairs(pairs_of) do
      local far = {}
      for k, body in ipairs(pair) do
        local cell = world.create{name = "cell" .. i .. k}
        cell:add_object{what = body, name = "body"}
        for j, p in ipairs{{0.9, 0, 0.5}, {0, -0.6, 0.4}, {0.4, -0.2, 1.2}, {0.4, -0.2, 0}} do
          cell:add_object{what = "ball", name = "ball" .. j, position = p}
          far[k] = far[k] or {}
          far[k][j] = cell:distances{a = "body", b = "ball" .. j}[1].distance
        end
      end
      alike(far[1], far[2], 2e-4, "kind " .. i)
    end)");
}

TEST_F(CentredSolids, RestOnTheFloorHalfTheirHeightAboveIt) {
  run(R"(
    local cell = world.create{name = "floor"}
    solid.create{name = "ground", root = {kind = "box", x = 4, y = 4, z = 0.2, centred = true}}
    cell:add_object{what = "ground", name = "ground", position = {0, 0, -0.1}}
    for i = 1, 4 do
      local root = with(kinds[i], {centred = true})
      solid.create{name = "free" .. i, material = "steel", root = root}
      cell:add_object{what = "free" .. i, name = "b" .. i, position = {i * 0.5 - 1.2, 0, high / 2 + 0.002}}
    end
    local r = cell:simulate_physics{duration = 0.6}
    for i = 1, 4 do
      local z = r:values("b" .. i .. ".z")
      near(z[#z], high / 2, 5e-4, "kind " .. i)
    end)");
}

TEST_F(CentredSolids, StayCentredInFilesTreesCopiesAndExpressions) {
  run(R"(
    for i, pair in ipairs(pairs_of) do
      local a, what = pair[1], "kind " .. i
      local com = a:mass().com
      local copy = solid.create{name = "copy" .. i, material = "steel", root = a:tree()}
      alike(copy:mass().com, com, 1e-12, what)
      record.save{id = copy, file = folder .. "copy" .. i .. ".csg"}
      copy:remove()
      local read = solid.load{file = folder .. "copy" .. i .. ".csg"}
      alike(read:mass().com, com, 1e-12, what)
      assert(read:tree().centred == true, what)
    end
    local post = solid.create{name = "post", material = "steel", parameters = {tall = "0.4 m"},
      root = {kind = "cylinder", name = "body", radius = 0.1, height = "tall", centred = true}}
    near(post:mass().com[3], 0) near(post:bounds().max[3], 0.2, 1e-6)
    post:set_parameter{name = "tall", value = 1} near(post:mass().com[3], 0) near(post:bounds().max[3], 0.5, 1e-6)
    post:set("body.centred", false) near(post:mass().com[3], 0.5)
    document.undo() near(post:mass().com[3], 0)
    -- Placed by names of the record, scaled, mirrored and repeated: the middle stays the origin.
    for _, of in ipairs{{kind = "scale", x = 2, y = 2, z = 2}, {kind = "mirror", normal_x = 0, normal_z = 1, keep = 0},
                        {kind = "circular_pattern", count = 3}} do
      local s = solid.create{name = "in_" .. of.kind, material = "steel", root = with(of, {children = {kinds[3]}})}
      assert(s:mass().com[3] ~= 0)
      local t = solid.create{name = "at_" .. of.kind, material = "steel",
        root = with(of, {children = {with(kinds[3], {centred = true})}})}
      near(t:mass().com[3], 0, 1e-9, of.kind)
    end)");
}

TEST_F(CentredSolids, OfKindsWithoutABaseAreRefused) {
  for (const char* node :
       {"kind = 'sphere', radius = 1", "kind = 'torus', ring_radius = 1, tube_radius = 0.1",
        "kind = 'ellipsoid', x = 1, y = 1, z = 1"}) {
    const std::string said =
        eval(std::string("solid.create{name = 'x', root = {") + node + ", centred = true}}");
    EXPECT_NE(said.find("centred"), std::string::npos) << said;
  }
  run("solid.create{name = 'ball', root = {kind = 'sphere', name = 'body', radius = 1}}");
  const std::string said =
      eval("record.set{id = solid.get('ball'), path = 'body.is_centred', value = true}");
  EXPECT_NE(said.find("centred"), std::string::npos) << said;
}

}  // namespace
}  // namespace robomosp::lua
