// SPDX-License-Identifier: Apache-2.0
// Measuring: distances, angles, radii and axes against numbers worked out by hand, for boxes,
// cylinders, meshes, turned and moved objects, links of robots, recordings, and places where there
// is nothing to measure.
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp {
namespace {

class MeasureTest : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run(R"lua(
      function near(a, b, tolerance)
        if math.abs(a - b) > (tolerance or 1e-9) then
          error(string.format("%.12g instead of %.12g", a, b), 2)
        end
      end
      function at(v, x, y, z, tolerance)
        near(v[1], x, tolerance) near(v[2], y, tolerance) near(v[3], z, tolerance)
      end
      -- Boxes stand on z = 0, in the middle of x and y; so do cylinders.
      box = solid.create{name = "box", root = {kind = "box", x = 0.2, y = 0.1, z = 0.04}}
      rod = solid.create{name = "rod", root = {kind = "cylinder", radius = 0.03, height = 0.2}}
      cell = world.create{name = "cell"}
      function faces(a, p, b, q)
        return cell:measure{a = {body = a, as = "face", place = p}, b = {body = b, as = "face", place = q}}
      end
    )lua");
  }
};

TEST_F(MeasureTest, FacesEdgesAndCornersOfOneBox) {
  run(R"lua(
    local top = box:measure{a = {as = "face", place = {0.02, 0.01, 0.04}}}.a
    assert(top.kind == "plane" and not top.is_of_mesh)
    near(top.area, 0.2 * 0.1, 1e-12) at(top.point, 0, 0, 0.04) at(top.direction, 0, 0, 1)
    local edge = box:measure{a = {as = "edge", place = {0.03, -0.05, 0.04}}}.a
    assert(edge.kind == "line")
    near(edge.length, 0.2, 1e-12) at(edge.point, 0, -0.05, 0.04) near(math.abs(edge.direction[1]), 1)
    local corner = box:measure{a = {as = "corner", place = {0.09, 0.04, 0.05}}}.a
    assert(corner.kind == "corner") at(corner.point, 0.1, 0.05, 0.04, 1e-12)
    -- Opposite corners, and an edge beside the face that it does not bound.
    local d = box:measure{a = {as = "corner", place = {0.1, 0.05, 0.04}},
                          b = {as = "corner", place = {-0.1, -0.05, 0}}}
    near(d.distance, math.sqrt(0.2^2 + 0.1^2 + 0.04^2), 1e-12)
    near(d.centre_distance, d.distance, 1e-15) at(d.offset, -0.2, -0.1, -0.04, 1e-12)
    assert(d.bound == 0)
    local m = box:measure{a = {as = "edge", place = {0, -0.05, 0.04}},
                          b = {as = "face", place = {0, 0, 0}}}
    near(m.distance, 0.04, 1e-12) near(m.angle, 0) near(m.plane_distance, 0.04, 1e-12)
    local touching = box:measure{a = {as = "face", place = {0, 0, 0.04}},
                                 b = {as = "face", place = {0.1, 0, 0.02}}}
    near(touching.distance, 0, 1e-12) near(touching.angle, math.pi / 2)
    assert(touching.plane_distance == nil)
  )lua");
}

TEST_F(MeasureTest, TurnedAndMovedObjects) {
  run(R"lua(
    cell:add_object{name = "a", what = box, position = {1, 2, 3}, rpy = {0, 0, 0}}
    -- Turned by 30 degrees about z, 1 m along x.
    cell:add_object{name = "b", what = box, position = {2, 2, 3}, rpy = {0, 0, "30 deg"}}
    -- The front of a looks along x; that of b is turned by 30 degrees.
    local r = faces("a", {1.1, 2, 3.02}, "b", {2 - 0.1 * math.cos(math.pi / 6),
                                               2 - 0.1 * math.sin(math.pi / 6), 3.02})
    near(r.angle, math.pi / 6, 1e-12)
    assert(r.plane_distance == nil)
    -- The nearest place of b is a corner (-0.1, 0.05) of it, turned by 30 degrees.
    local c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
    local x = 2 - 0.1 * c - 0.05 * s
    near(r.distance, x - 1.1, 1e-9)
    near(r.to[1], x, 1e-9) near(r.to[2], 2 - 0.1 * s + 0.05 * c, 1e-9)
    near(r.from[1], 1.1, 1e-9)
    -- Tops are in one plane, and 20 mm apart after a move of one.
    local level = faces("a", {1, 2, 3.04}, "b", {2, 2, 3.04})
    near(level.plane_distance, 0, 1e-12) near(level.angle, 0, 1e-12)
    cell:place{member = "b", position = {2, 2, 3.02}, rpy = {0, 0, "30 deg"}}
    near(faces("a", {1, 2, 3.04}, "b", {2, 2, 3.06}).plane_distance, 0.02, 1e-12)
    -- Frames: where the objects are, and how they are turned.
    local f = cell:measure{a = {body = "a", as = "frame"}, b = {body = "b", as = "frame"}}
    near(f.distance, math.sqrt(1 + 0.02^2), 1e-12) near(f.angle, math.pi / 6, 1e-12)
    -- A point of the world, and a corner of a.
    local p = cell:measure{a = {place = {0, 0, 0}}, b = {body = "a", as = "corner", place = {1.1, 2.05, 3.04}}}
    near(p.distance, math.sqrt(1.1^2 + 2.05^2 + 3.04^2), 1e-12)
    assert(p.a.kind == "point" and p.b.body == "a")
    -- The world's own frame.
    local o = cell:measure{a = {as = "frame"}, b = {body = "a", as = "frame"}}
    near(o.distance, math.sqrt(14), 1e-12)
    cell:add_frame{name = "fixture", position = {1, 2, 2}, rpy = {"90 deg", 0, 0}}
    local t = cell:measure{a = {body = "fixture", as = "frame"}, b = {body = "a", as = "frame"}}
    near(t.distance, 1, 1e-12) near(t.angle, math.pi / 2, 1e-12)
  )lua");
}

TEST_F(MeasureTest, CylindersHaveRadiiAxesAndCentres) {
  run(R"lua(
    cell:add_object{name = "up", what = rod}
    -- Its axis runs along -y through (0.5, *, 0.3).
    cell:add_object{name = "across", what = rod, position = {0.5, 0, 0.3}, rpy = {"90 deg", 0, 0}}
    local wall = cell:measure{a = {body = "up", as = "face", place = {0.03, 0, 0.1}}}.a
    assert(wall.kind == "cylinder" and wall.is_inward == nil)
    near(wall.radius, 0.03, 1e-12) near(wall.area, 2 * math.pi * 0.03 * 0.2, 1e-9)
    near(math.abs(wall.direction[3]), 1, 1e-12)
    local rim = cell:measure{a = {body = "up", as = "edge", place = {0, 0.03, 0.2}}}.a
    assert(rim.kind == "circle")
    near(rim.radius, 0.03, 1e-12) at(rim.point, 0, 0, 0.2, 1e-12)
    near(rim.length, 2 * math.pi * 0.03, 1e-12) near(rim.angle, 2 * math.pi, 1e-12)
    -- Skew axes at right angles: z through the origin, -y through x = 0.5.
    local r = faces("up", {0.03, 0, 0.1}, "across", {0.47, -0.1, 0.3})
    near(r.axis_distance, 0.5, 1e-12) near(r.angle, math.pi / 2, 1e-12)
    -- The walls come nearest at the rim of the one, which is at z = 0.2, and at z = 0.3 of the other;
    -- to within what is stated, since curved faces are measured by their triangles.
    local exact = math.sqrt((0.5 - 0.03)^2 + 0.1^2) - 0.03
    assert(r.bound > 0 and r.bound < 1e-3)
    near(r.distance, exact, r.bound)
    -- The same between whole bodies, by the engine of collisions.
    local whole = cell:measure{a = {body = "up"}, b = {body = "across"}}
    assert(whole.a.kind == "body") near(whole.distance, exact, 1e-6)
    -- Parallel rods 0.4 m apart, and the centre of a rim over the other's lid.
    cell:add_object{name = "beside", what = rod, position = {0, 0.4, 0.5}}
    local p = faces("up", {0.03, 0, 0.1}, "beside", {0.03, 0.4, 0.6})
    near(p.axis_distance, 0.4, 1e-12) near(p.angle, 0, 1e-12)
    local over = cell:measure{a = {body = "up", as = "face", place = {0, 0, 0.2}},
                              b = {body = "beside", as = "edge", place = {0, 0.43, 0.7}}}
    near(over.plane_distance, 0.5, 1e-12) near(over.angle, math.pi / 2, 1e-12)
    local rims = cell:measure{a = {body = "up", as = "edge", place = {0, 0.03, 0.2}},
                              b = {body = "beside", as = "edge", place = {0, 0.43, 0.7}}}
    near(rims.centre_distance, math.sqrt(0.4^2 + 0.5^2), 1e-12)
    near(rims.distance, math.sqrt(0.34^2 + 0.5^2), 1e-6)
    near(rims.axis_distance, 0.4, 1e-12)
  )lua");
}

TEST_F(MeasureTest, SpheresConesAndToriOfOneSolid) {
  run(R"lua(
    local ball = solid.create{name = "ball", root = {kind = "sphere", radius = 0.05}}
    local f = ball:measure{a = {as = "face", place = {0.05, 0, 0}}}.a
    assert(f.kind == "sphere") near(f.radius, 0.05, 1e-12) at(f.point, 0, 0, 0, 1e-12)
    local ring = solid.create{name = "ring", root = {kind = "torus", ring_radius = 0.1, tube_radius = 0.02}}
    local t = ring:measure{a = {as = "face", place = {0.12, 0, 0}}}.a
    assert(t.kind == "torus") near(t.radius, 0.1, 1e-12)
    near(t.area, 4 * math.pi^2 * 0.1 * 0.02, 1e-9)
    local tip = solid.create{name = "tip", root = {kind = "cone", base_radius = 0.05, top_radius = 0.02, height = 0.1}}
    local c = tip:measure{a = {as = "face", place = {0.035, 0, 0.05}}}.a
    assert(c.kind == "cone") near(math.abs(c.direction[3]), 1, 1e-12)
    -- Of a point 1 m from the middle of a ball, by its centre and by its surface.
    local far = ball:measure{a = {place = {0, 0, 1}}, b = {as = "face", place = {0, 0, 0.05}}}
    near(far.centre_distance, 1, 1e-12) near(far.distance, 0.95, far.bound)
  )lua");
}

TEST_F(MeasureTest, LinksAndToolsOfRobotsByTheirJoints) {
  run(R"lua(
    -- Two links of 0.5 m in the plane: (cos q1 + cos(q1 + q2)) / 2 and the sines.
    local two = robot.create{name = "two", links = {
      {name = "upper", a = 0.5, parts = {{what = box}}}, {name = "lower", a = 0.5}}}
    local q = {0.3, 0.9}
    local tool = two:measure{a = {body = "base", as = "frame"}, b = {as = "tool"}, q = q}
    at(tool.offset, 0.5 * (math.cos(0.3) + math.cos(1.2)), 0.5 * (math.sin(0.3) + math.sin(1.2)), 0, 1e-12)
    near(tool.angle, 1.2, 1e-12)
    local elbow = two:measure{a = {body = "base", as = "frame"}, b = {body = "upper", as = "frame"}, q = q}
    at(elbow.offset, 0.5 * math.cos(0.3), 0.5 * math.sin(0.3), 0, 1e-12)
    -- In a world, on a mounting that is turned by 90 degrees; the box is on the upper link.
    cell:add_robot{name = "arm", robot = two, position = {1, 0, 0}, rpy = {0, 0, "90 deg"}, q = {0, 0}}
    local at_rest = cell:measure{a = {as = "frame"}, b = {body = "arm", as = "tool"}}
    at(at_rest.offset, 1, 1, 0, 1e-12)
    -- The link's frame is at (1, 0.5, 0), its x along y of the world: the end of the box at y = 0.6.
    local face = cell:measure{a = {body = "arm.upper", as = "face", place = {1, 0.6, 0.02}}}.a
    assert(face.kind == "plane" and face.body:sub(1, 9) == "arm.upper", face.body)
    at(face.direction, 0, 1, 0, 1e-9) at(face.point, 1, 0.6, 0.02, 1e-9)
    cell:set_robot_q{robot = "arm", q = {"90 deg", 0}}
    at(cell:measure{a = {as = "frame"}, b = {body = "arm", as = "tool"}}.offset, 0, 0, 0, 1e-12)
    -- A generated body has no solid behind it: its triangles are measured.
    local lower = cell:measure{a = {place = {0, 0, 5}}, b = {body = "arm.lower"}}
    assert(lower.b.is_of_mesh and lower.distance > 4 and lower.distance < 5)
  )lua");
}

TEST_F(MeasureTest, WhereARecordingHasTheMembers) {
  run(R"lua(
    cell:add_object{name = "a", what = box}
    local r = recording.create{columns = {{name = "time", unit = "s", values = {0, 2}},
      {name = "a.x", values = {0, 1}}, {name = "a.y", values = {0, 0}}, {name = "a.z", values = {0, 0}},
      {name = "a.qw", values = {1, 1}}, {name = "a.qx", values = {0, 0}},
      {name = "a.qy", values = {0, 0}}, {name = "a.qz", values = {0, 0}}}}
    local half = cell:measure{a = {as = "frame"}, b = {body = "a", as = "frame"}, recording = r, at = 1}
    near(half.distance, 0.5, 1e-12)
    local face = cell:measure{a = {body = "a", as = "face", place = {1.1, 0, 0.02}}, recording = r, at = 2}.a
    at(face.point, 1.1, 0, 0.02, 1e-9)
    near(cell:measure{a = {as = "frame"}, b = {body = "a", as = "frame"}}.distance, 0, 1e-12)
  )lua");
  EXPECT_EQ(eval("return cell:measure{a = {as = 'frame'}, at = 1}"),
            "world.measure, at: a time needs a recording. Give recording too.");
}

TEST_F(MeasureTest, ImportedMeshesByTheirTriangles) {
  const auto file = std::filesystem::temp_directory_path() / "robomosp_measure_wedge.stl";
  // A wedge: 0.4 along x, 0.3 along z, 1 along y; its slope has the sides 0.4, 0.3 and 0.5.
  std::ofstream out(file);
  out << "solid wedge\n";
  const double v[6][3] = {{0, 0, 0}, {0.4, 0, 0}, {0, 0, 0.3}, {0, 1, 0}, {0.4, 1, 0}, {0, 1, 0.3}};
  const int t[8][3] = {{0, 1, 2}, {3, 5, 4}, {0, 3, 4}, {0, 4, 1},
                       {0, 2, 5}, {0, 5, 3}, {1, 4, 5}, {1, 5, 2}};
  for (const auto& each : t) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (const int i : each)
      out << "vertex " << v[i][0] << " " << v[i][1] << " " << v[i][2] << "\n";
    out << "endloop\nendfacet\n";
  }
  out << "endsolid wedge\n";
  out.close();
  run("import{file = '" + file.string() + "', unit = 'm', density = 1000, name = 'wedge'}");
  run(R"lua(
    local wedge = solid "wedge"
    local slope = wedge:measure{a = {as = "face", place = {0.2, 0.5, 0.15}}}.a
    assert(slope.kind == "plane") near(slope.area, 0.5, 1e-6)
    at(slope.direction, 0.6, 0, 0.8, 1e-6)
    local angle = wedge:measure{a = {as = "face", place = {0.2, 0.5, 0.15}},
                                b = {as = "face", place = {0.2, 0.5, 0}}}
    near(angle.angle, math.atan(3 / 4), 1e-6)
    local edge = wedge:measure{a = {as = "edge", place = {0.2, 0, 0.15}}}.a
    assert(edge.kind == "line") near(edge.length, 0.5, 1e-6)
    -- From a point above the middle of the slope.
    local p = wedge:measure{a = {place = {0.2 + 0.6, 0.5, 0.15 + 0.8}}, b = {as = "face", place = {0.2, 0.5, 0.15}}}
    near(p.distance, 1, 1e-6) near(p.plane_distance, 1, 1e-6)
  )lua");
  std::filesystem::remove(file);
}

TEST_F(MeasureTest, BodiesThatMeetAndPartsOfObjects) {
  run(R"lua(
    local group = object.create{name = "group"}
    group:add_part{what = box, name = "low"}
    group:add_part{what = box, name = "high", position = {0, 0, 0.1}}
    local d = group:measure{a = {body = "low"}, b = {body = "high"}}
    near(d.distance, 0.06, 1e-12) assert(d.bound == 0)
    cell:add_object{name = "stack", what = group}
    local low = cell:measure{a = {body = "stack.low", as = "face", place = {0, 0, 0.04}},
                             b = {body = "stack.high", as = "face", place = {0, 0, 0.1}}}
    near(low.distance, 0.06, 1e-12) assert(low.a.body == "stack.low" and low.b.body == "stack.high")
    -- A box that is half in the other: their surfaces cross.
    cell:add_object{name = "in", what = box, position = {0.05, 0.02, 0.01}}
    near(cell:measure{a = {body = "stack.low"}, b = {body = "in"}}.distance, 0, 1e-12)
    -- The same body twice.
    near(cell:measure{a = {body = "in"}, b = {body = "in"}}.distance, 0, 1e-12)
  )lua");
}

TEST_F(MeasureTest, RefusalsNameTheArgumentAndWhatToDo) {
  run("cell:add_object{name = 'a', what = box}"
      " cell:add_object{name = 'nothing', what = object.create{name = 'nothing'}}"
      " ball = solid.create{name = 'ball', root = {kind = 'sphere', radius = 0.05}}");
  EXPECT_EQ(eval("return cell:measure{a = {body = 'b'}}"),
            "world.measure, a.body: nothing in the picture is named \"b\". Names are \"a\" and "
            "\"nothing\".");
  EXPECT_EQ(eval("return cell:measure{a = {body = 'a', as = 'edge'}}"),
            "world.measure, a: no place is given. Give place = {x, y, z}, near which the "
            "measurement takes it.");
  EXPECT_EQ(eval("return cell:measure{a = {body = 'nothing'}}"),
            "world.measure, a.body: \"nothing\" has no surface. Measure to its frame, or to a "
            "point.");
  EXPECT_EQ(eval("return ball:measure{a = {as = 'corner', place = {0, 0, 0}}}"),
            "solid.measure, a: it has no corners. Measure to a face or an edge.");
  EXPECT_EQ(eval("return cell:measure{a = {body = 'a', as = 'tool'}}").substr(0, 16),
            "world.measure, a");
  EXPECT_EQ(eval("return world.create{name = 'void'}:measure{a = {as = 'body'}}").substr(0, 16),
            "world.measure, a");
  EXPECT_EQ(eval("return cell:measure{a = {place = {-1e200, 0, 0}}, b = {place = {1e200, 0, 0}}}"),
            "the two places are too far apart to measure. Give places less than 1e150 m apart.");
}

TEST_F(MeasureTest, FollowsEditsAndUndo) {
  run(R"lua(
    cell:add_object{name = "a", what = box}
    local place = {a = {body = "a", as = "face", place = {0.2, 0, 0.02}}, b = {place = {1, 0, 0.02}}}
    near(cell:measure(place).distance, 0.9, 1e-12)
    box:set("box.x", 0.4)
    near(cell:measure(place).distance, 0.8, 1e-12)
    document.undo()
    near(cell:measure(place).distance, 0.9, 1e-12)
  )lua");
}

}  // namespace
}  // namespace robomosp
