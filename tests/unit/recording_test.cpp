// SPDX-License-Identifier: Apache-2.0
// Recordings in files, columns by expressions, comparison. Columns that need a robot are tested
// with its simulations below.
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "kernel/process.h"
#include "model/placement.h"
#include "recording/compare.h"
#include "recording/file.h"
#include "sim/forward_simulation.h"
#include "sim/recording_columns.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using recording::Recording;
using sim::Watch;
using test::unwrap;
using test::Workbench;

auto from_text(std::string_view text) {
  NoProgress progress;
  return recording::recording_from_text(text, progress);
}
auto from_csv(std::string_view text) {
  NoProgress progress;
  return recording::recording_from_csv(text, progress);
}
std::string to_text(const Recording& r, std::string_view world) {
  NoProgress progress;
  return unwrap(recording::to_text(r, world, progress));
}
std::string to_csv(const Recording& r) {
  NoProgress progress;
  return unwrap(recording::to_csv(r, progress));
}

Recording awkward_recording() {
  Recording r;
  r.title = "a \"quoted\" \\ one\nof two lines";
  r.robot = "mild arm";
  r.trajectory = "stroke";
  r.dof = 1;
  r.notes = {"joint 1 met its limit"};
  const double inf = INFINITY;
  r.columns = {
      {"time", "s", "time", {0, 0.1, 0.30000000000000004}},
      {"tau1", "N m", "torque of \"elbow\"", {5e-324, -0.0, 1.7976931348623157e308}, -2, 2},
      {"x", "", "", {NAN, inf, -inf}}};
  return r;
}

Recording table(std::vector<double> time, std::vector<double> x, std::string unit = "m") {
  Recording r;
  r.columns = {{"time", "s", "", std::move(time)}, {"x", std::move(unit), "", std::move(x)}};
  return r;
}

TEST(RecordingFiles, TextReadsBackToTheSameBits) {
  const Recording r = awkward_recording();
  const auto back = unwrap(from_text(to_text(r, "cell")));
  EXPECT_EQ(back.world, "cell");
  EXPECT_EQ(back.recording.title, r.title);
  EXPECT_EQ(back.recording.robot, r.robot);
  EXPECT_EQ(back.recording.trajectory, r.trajectory);
  EXPECT_EQ(back.recording.notes, r.notes);
  ASSERT_EQ(back.recording.columns.size(), r.columns.size());
  for (std::size_t c = 0; c < r.columns.size(); ++c) {
    const auto &is = back.recording.columns[c], &was = r.columns[c];
    EXPECT_EQ(is.name, was.name);
    EXPECT_EQ(is.unit, was.unit);
    EXPECT_EQ(is.doc, was.doc);
    EXPECT_EQ(is.lower, was.lower);
    EXPECT_EQ(is.upper, was.upper);
    ASSERT_EQ(is.values.size(), was.values.size());
    for (std::size_t i = 0; i < was.values.size(); ++i)
      EXPECT_EQ(std::bit_cast<std::uint64_t>(is.values[i]),
                std::bit_cast<std::uint64_t>(was.values[i]))
          << was.name << " row " << i;
  }
}

TEST(RecordingFiles, EveryCutOffFileIsRefused) {
  const std::string whole = to_text(awkward_recording(), "cell");
  for (std::size_t n = 0; n + 1 < whole.size(); ++n)
    EXPECT_FALSE(from_text(whole.substr(0, n)).ok() && n + 4 < whole.size()) << n;
  const auto cut = from_text(whole.substr(0, whole.find("0.1 ")));
  ASSERT_FALSE(cut.ok());
  EXPECT_NE(cut.error().sentence().find("the file ends after row 1 of 3"), std::string::npos)
      << cut.error().sentence();
  const auto huge =
      from_text("robomosp recording 1\ncolumn \"time\" \"s\" -inf inf \"\"\nrows 999999999999\n");
  EXPECT_FALSE(huge.ok());
  const auto newer = from_text("robomosp recording 2\n");
  ASSERT_FALSE(newer.ok());
  EXPECT_NE(newer.error().sentence().find("newer version"), std::string::npos);
}

TEST(RecordingFiles, TablesAreBroughtToSi) {
  const auto r =
      unwrap(from_csv("\xef\xbb\xbftime [ms];q1 (deg);x [mm]\r\n0;90;1,5\r\n10;-180;\r\n"));
  ASSERT_EQ(r.columns.size(), 3U);
  EXPECT_EQ(r.columns[0].unit, "s");
  EXPECT_EQ(r.columns[0].values[1], 0.01);
  EXPECT_EQ(r.columns[1].unit, "rad");
  EXPECT_NEAR(r.columns[1].values[0], 1.5707963267948966, 1e-15);
  EXPECT_EQ(r.columns[2].values[0], 0.0015);
  EXPECT_TRUE(std::isnan(r.columns[2].values[1]));
}

TEST(RecordingFiles, ManyColumnsOfACsvFileTakeTimeInProportionAndTooManyAreRefused) {
  const auto csv = [](std::size_t columns) {
    std::string names, values;
    for (std::size_t i = 0; i < columns; ++i) {
      names += "c" + std::to_string(i) + ",";
      values += "1,";
    }
    return names + "last\n" + values + "2\n";
  };
  const auto many = from_csv(csv(99'999));
  ASSERT_TRUE(many.ok()) << many.error().sentence();
  EXPECT_EQ(many->columns.size(), 100'000U);
  const auto refused = from_csv(csv(200'000));
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("more than 100000 columns"), std::string::npos)
      << refused.error().sentence();
  EXPECT_FALSE(from_csv("a,b,a\n1,2,3\n").ok());
}

TEST(RecordingFiles, ManyRowsAreWrittenAndReadByAllCoresInOrder) {
  // More than a group of blocks, of lines of unlike length.
  Recording r = table({}, {});
  r.columns.push_back({"tau1", "N m", "", {}});
  for (std::size_t i = 0; i < 700'000; ++i) {
    const auto t = static_cast<double>(i);
    r.columns[0].values.push_back(t);
    r.columns[1].values.push_back(i % 7 == 0 ? -0.0 : std::sin(t) * std::exp(i % 700));
    r.columns[2].values.push_back(i % 1000 == 3 ? NAN : -t / 3);
  }
  const auto same = [&](const Recording& back, bool keeps_sign) {
    ASSERT_EQ(back.columns.size(), 3U);
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_EQ(back.columns[c].values.size(), r.rows());
      for (std::size_t i = 0; i < r.rows(); ++i) {
        const double is = back.columns[c].values[i], was = r.columns[c].values[i];
        ASSERT_TRUE(keeps_sign
                        ? std::bit_cast<std::uint64_t>(is) == std::bit_cast<std::uint64_t>(was)
                        : is == was || (std::isnan(is) && std::isnan(was)))
            << c << " " << i << " " << is << " " << was;
      }
    }
  };
  const std::string text = to_text(r, "cell");
  same(unwrap(from_text(text)).recording, true);
  std::string csv = to_csv(r);
  same(unwrap(from_csv(csv)), false);
  // Faults far in, and blank lines, count as a reader from the top would.
  const std::size_t place = csv.find("\r\n600001,") + 2;
  const std::string blank = csv.substr(0, place) + "\n\n" + csv.substr(place);
  same(unwrap(from_csv(blank)), false);
  const auto broken = from_csv(blank.substr(0, place + 2) + "x" + blank.substr(place + 2));
  ASSERT_FALSE(broken.ok());
  EXPECT_NE(broken.error().sentence().find("line 600005: \"x600001\" of column"), std::string::npos)
      << broken.error().sentence();
  const auto cut = from_text(text.substr(0, text.find("\n650000 ") + 1));
  ASSERT_FALSE(cut.ok());
  EXPECT_NE(cut.error().sentence().find("after row 650000 of 700000"), std::string::npos)
      << cut.error().sentence();
  // Blank lines by the million ask for no memory, wide as the table may be.
  std::string wide = "a";
  for (int i = 1; i < 3000; ++i) wide += ",a" + std::to_string(i);
  EXPECT_FALSE(from_csv(wide + std::string(3'000'000, '\n')).ok());
}

TEST(RecordingFiles, WorkOnAFileStopsWhenAsked) {
  struct Stopped final : Progress {
    void report(double, std::string_view) override {}
    [[nodiscard]] bool cancelled() const override { return true; }
  } stopped;
  const Recording r = table({0, 1}, {2, 3});
  EXPECT_EQ(recording::to_csv(r, stopped).error().code, ErrorCode::cancelled);
  EXPECT_EQ(recording::to_text(r, "", stopped).error().code, ErrorCode::cancelled);
  EXPECT_EQ(recording::recording_from_csv(to_csv(r), stopped).error().code, ErrorCode::cancelled);
  EXPECT_EQ(recording::recording_from_text(to_text(r, ""), stopped).error().code,
            ErrorCode::cancelled);
}

TEST(RecordingFiles, FaultsOfTablesTellTheirLine) {
  const auto sentence = [](const char* csv) {
    const auto r = from_csv(csv);
    return r.ok() ? std::string("accepted") : r.error().sentence();
  };
  EXPECT_NE(sentence("time [s],x\n0,1\n1,a\n").find("line 3: \"a\" of column \"x\""),
            std::string::npos)
      << sentence("time [s],x\n0,1\n1,a\n");
  EXPECT_NE(sentence("time [s],x\n0\n").find("it has 1 fields, but the header has 2"),
            std::string::npos);
  EXPECT_NE(sentence("0,1\n2,3\n").find("is not the name of a column"), std::string::npos);
  EXPECT_NE(sentence("time [s],x [nonsense]\n0,1\n").find("nonsense"), std::string::npos);
  EXPECT_NE(sentence("time [s],x\n1,1\n0,1\n").find("the time does not increase"),
            std::string::npos);
  EXPECT_NE(sentence("x,x\n1,1\n").find("two columns"), std::string::npos);
}

TEST(RecordingFiles, CsvAndBackIsTheSame) {
  Recording r = awkward_recording();
  r.columns.pop_back();
  const auto back = unwrap(from_csv(to_csv(r)));
  ASSERT_EQ(back.columns.size(), 2U);
  EXPECT_EQ(back.columns[1].values, r.columns[1].values);
  EXPECT_EQ(back.columns[1].unit, "N m");
}

std::uint32_t little(const std::string& s, std::size_t at, std::size_t bytes) {
  std::uint32_t v = 0;
  for (std::size_t i = 0; i < bytes; ++i)
    v |= static_cast<std::uint32_t>(static_cast<unsigned char>(s.at(at + i))) << (8 * i);
  return v;
}

/// CRC-32 bit by bit, as in ITU-T V.42.
std::uint32_t slow_crc(const std::string& s) {
  std::uint32_t c = 0xffffffffU;
  for (const char b : s)
    for (unsigned k = 0; k < 8; ++k) {
      const std::uint32_t bit = (c ^ (static_cast<unsigned char>(b) >> k)) & 1U;
      c = c >> 1 ^ (bit ? 0xedb88320U : 0U);
    }
  return ~c;
}

TEST(RecordingFiles, NumpyArchivesHoldTheArrays) {
  EXPECT_EQ(slow_crc("123456789"), 0xcbf43926U);  // the check value of CRC-32/ISO-HDLC
  const Recording r = awkward_recording();
  const std::string zip = unwrap(recording::to_npz(r));
  // The end record, then the directory, then each file by what the directory says.
  const std::size_t end = zip.size() - 22;
  ASSERT_EQ(zip.substr(end, 4), "PK\x05\x06");
  ASSERT_EQ(little(zip, end + 10, 2), 7U);
  std::size_t at = little(zip, end + 16, 4);
  EXPECT_EQ(at + little(zip, end + 12, 4), end);
  std::vector<std::string> names;
  for (int i = 0; i < 7; ++i) {
    ASSERT_EQ(zip.substr(at, 4), std::string("PK\x01\x02"));
    const std::uint32_t crc = little(zip, at + 16, 4), size = little(zip, at + 24, 4),
                        length = little(zip, at + 28, 2), local = little(zip, at + 42, 4);
    EXPECT_EQ(little(zip, at + 10, 2), 0U);  // stored
    names.push_back(zip.substr(at + 46, length));
    EXPECT_EQ(zip.substr(local, 4), std::string("PK\x03\x04"));
    EXPECT_EQ(zip.substr(local + 30, length), names.back());
    const std::string file = zip.substr(local + 30 + length, size);
    EXPECT_EQ(slow_crc(file), crc) << names.back();
    EXPECT_EQ(file.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
    const std::uint32_t head = 10 + little(file, 8, 2);
    EXPECT_EQ(head % 64, 0U);
    if (names.back() == "tau1.npy") {
      EXPECT_NE(file.find("'descr': '<f8', 'fortran_order': False, 'shape': (3,)"),
                std::string::npos);
      double v[3];
      ASSERT_EQ(file.size(), head + sizeof v);
      std::memcpy(v, file.data() + head, sizeof v);
      for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(v[k], r.columns[1].values[k]);
    }
    if (names.back() == "columns.npy") {
      EXPECT_NE(file.find("'<U4'"), std::string::npos);
      EXPECT_EQ(file.size(), head + 3 * 4 * 4);
      EXPECT_EQ(file[head + 16], 't');  // tau1, after the four letters of time
    }
    at += 46 + length;
  }
  EXPECT_EQ(names, (std::vector<std::string>{"time.npy", "tau1.npy", "x.npy", "columns.npy",
                                             "units.npy", "docs.npy", "title.npy"}));
}

TEST(RecordingFiles, PythonAndNumpyReadTheSameBits) {
  namespace fs = std::filesystem;
  const fs::path python = program_on_path("python3");
  if (python.empty()) GTEST_SKIP() << "python3 is not installed";
  const fs::path folder = fs::path(testing::TempDir()) / "robomosp-recording-check";
  fs::create_directories(folder);
  const Recording r = awkward_recording();
  std::ofstream(folder / "run.npz", std::ios::binary) << unwrap(recording::to_npz(r));
  std::ofstream(folder / "run.json", std::ios::binary) << recording::to_json(r);
  std::ofstream expected(folder / "expected.txt");
  for (const recording::Column& c : r.columns) {
    expected << c.name << std::hex;
    for (const double v : c.values) expected << ' ' << std::bit_cast<std::uint64_t>(v);
    expected << '\n';
  }
  expected.close();
  ProcessSpec run;
  run.program = python;
  run.arguments = {std::string(ROBOMOSP_SOURCE_DIR) + "/tests/unit/recording_check.py",
                   folder.string()};
  std::string said;
  run.line = [&](std::string_view line) { said += std::string(line) + "\n"; };
  NoProgress progress;
  const auto done = run_process(run, progress);
  ASSERT_TRUE(done.ok()) << done.error().sentence() << "\n" << said;
  EXPECT_TRUE(*done == "with NumPy\n" || *done == "without NumPy\n") << *done;
  fs::remove_all(folder);
}

TEST(RecordingFiles, JsonHasNoNumbersThatAreNone) {
  const std::string json = recording::to_json(awkward_recording());
  EXPECT_NE(json.find("\"values\": [null,null,null]"), std::string::npos);
  EXPECT_NE(json.find("\"a \\\"quoted\\\" \\\\ one\\nof two lines\""), std::string::npos);
  EXPECT_NE(json.find("\"lower\": -2"), std::string::npos);
  EXPECT_EQ(json.find("inf"), std::string::npos);
}

TEST(Watch, ValuesRatesAndIntegralsAreThoseOfACubic) {
  std::vector<double> t, x;
  for (int i = 0; i <= 20; ++i) {
    t.push_back(0.05 * i + 0.01 * std::sin(i));
    x.push_back(1 - 2 * t.back() + 3 * t.back() * t.back() * t.back());
  }
  const Recording r = table(t, x);
  const auto squared = unwrap(sim::with_watch(r, "square", "x^2 + 1 mm^2", "", Watch::value));
  const auto rate = unwrap(sim::with_watch(r, "speed", "x", "m/s", Watch::rate));
  const auto integral = unwrap(sim::with_watch(r, "way", "x", "", Watch::integral));
  EXPECT_EQ(squared->find("square")->unit, "m^2");
  EXPECT_EQ(integral->find("way")->unit, "m s");
  for (std::size_t i = 0; i < t.size(); ++i) {
    EXPECT_NEAR(squared->find("square")->values[i], x[i] * x[i] + 1e-6, 1e-15);
    EXPECT_NEAR(rate->find("speed")->values[i], -2 + 9 * t[i] * t[i], 1e-11);
    const auto primitive = [](double u) { return u - u * u + 0.75 * u * u * u * u; };
    EXPECT_NEAR(integral->find("way")->values[i], primitive(t[i]) - primitive(t[0]), 1e-13);
  }
}

TEST(Watch, FaultsAreOneSentence) {
  const Recording r = table({0, 1}, {0, 2});
  const auto sentence = [&](const char* name, const char* expression, const char* unit) {
    const auto w = sim::with_watch(r, name, expression, unit, Watch::value);
    return w.ok() ? std::string("accepted") : w.error().sentence();
  };
  EXPECT_NE(sentence("made", "x*x", "m").find("gives an area, not a length"), std::string::npos)
      << sentence("made", "x*x", "m");
  EXPECT_NE(sentence("made", "x", "mm").find("columns are in SI units, not in \"mm\""),
            std::string::npos);
  EXPECT_NE(sentence("made", "x1", "").find("no column \"x1\""), std::string::npos);
  EXPECT_NE(sentence("made", "1/x", "").find("t = 0 s"), std::string::npos)
      << sentence("made", "1/x", "");
  EXPECT_NE(sentence("time", "x", "").find("cannot be replaced"), std::string::npos);
  EXPECT_NE(sentence("a b", "x", ""), "accepted");
}

TEST(Compare, FiguresAreThoseWorkedByHand) {
  // Differences -1, 0, 1, 0 over 4 samples; correlation by Pearson's formula: the deviations are
  // (-1.5, -0.5, 0.5, 1.5) and (-2.5, -0.5, 1.5, 1.5), so 7 / sqrt(5 * 11).
  const auto d = unwrap(
      recording::compare(table({0, 1, 2, 3}, {1, 2, 3, 4}), table({0, 1, 2, 3}, {0, 2, 4, 4}), {}));
  ASSERT_EQ(d.size(), 1U);
  EXPECT_EQ(d[0].greatest, 1);
  EXPECT_EQ(d[0].at, 0);
  EXPECT_NEAR(d[0].rms, std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(d[0].mean, 0, 1e-15);
  ASSERT_TRUE(d[0].correlation);
  EXPECT_NEAR(*d[0].correlation, 7 / std::sqrt(55.0), 1e-15);
}

TEST(Compare, OtherTimesAreInterpolatedWhereBothHaveThem) {
  const auto d = unwrap(recording::compare(table({0, 1, 2, 3}, {0, 2, 4, 6}),
                                           table({0.5, 1.5, 2.75}, {1.25, 3.25, 5.75}), {}));
  EXPECT_EQ(d[0].samples, 2U);  // t = 1 and 2
  EXPECT_NEAR(d[0].greatest, 0.25, 1e-15);
  EXPECT_NEAR(d[0].mean, 0.25, 1e-15);
  EXPECT_NEAR(d[0].deviation, 0, 1e-15);
  EXPECT_NEAR(*d[0].correlation, 1, 1e-15);
}

TEST(Compare, WhatDoesNotVaryHasNoCorrelation) {
  EXPECT_FALSE(unwrap(recording::compare(table({0, 1}, {0.1, 0.1}), table({0, 1}, {1, 2}), {}))[0]
                   .correlation);
  const auto apart = recording::compare(table({0, 1}, {0, 0}), table({2, 3}, {1, 2}), {});
  ASSERT_FALSE(apart.ok());
  EXPECT_NE(apart.error().sentence().find("do not overlap"), std::string::npos);
  const auto units = recording::compare(table({0, 1}, {0, 0}), table({0, 1}, {1, 2}, "rad"), {});
  ASSERT_FALSE(units.ok());
  EXPECT_NE(units.error().sentence().find("\"m\" and in \"rad\""), std::string::npos);
}

/// A six-joint arm of the library that falls under its weight while something pushes its tool.
class PushedArm : public ::testing::Test {
 protected:
  Workbench bench;
  NoProgress progress;
  static constexpr Vec3 kForce{12, -7, 5}, kMoment{0.6, 0.3, -0.9};

  recording::RecordingPtr pushed(std::vector<std::string> quantities, bool friction = false) {
    const AnyId robot = bench.load("robots/puma560.rbt");
    const auto snapshot = bench.document.now();
    const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
    sim::ForwardRun run;
    run.record = RobotId{robot.number};
    run.duration = 0.2;
    run.sample_time = 0.002;
    run.q = {0.3, -0.6, 0.4, 0.5, 0.7, 0.2};
    run.tau = {5, -30, 8, 0.5, 0.2, 0.1};
    run.load.constant = {kForce[0], kForce[1], kForce[2], kMoment[0], kMoment[1], kMoment[2]};
    run.friction = friction;  // without it and without stops all is smooth
    run.at_limit = sim::AtLimit::ignore;
    const auto r = unwrap(sim::forward_dynamics(simulator, run, progress));
    return r ? unwrap(sim::with_quantities(simulator, *r, quantities, progress)) : nullptr;
  }
};

TEST_F(PushedArm, TheForceOnTheToolIsFoundFromTheTorques) {
  const auto r = pushed({"force"}, true);
  ASSERT_TRUE(r);
  const char* names[] = {"fx", "fy", "fz", "mx", "my", "mz"};
  for (std::size_t i = 0; i < r->rows(); i += 10)
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_NEAR(r->find(names[k])->values[i], k < 3 ? kForce[k] : kMoment[k - 3], 1e-6)
          << names[k] << " row " << i;
}

TEST_F(PushedArm, TheToolMovesAsItsRecordedPlacesSay) {
  const auto r = pushed({"velocity", "pose", "manipulability"});
  ASSERT_TRUE(r);
  const auto& t = r->find("time")->values;
  for (const auto& [place, velocity] : {std::pair{"x", "vx"}, {"y", "vy"}, {"z", "vz"}}) {
    const auto rate = sim::rate_of(t, r->find(place)->values);
    for (std::size_t i = 2; i + 2 < r->rows(); ++i)
      EXPECT_NEAR(rate[i], r->find(velocity)->values[i], 1e-6) << velocity << " row " << i;
  }
  for (const double m : r->find("manipulability")->values) EXPECT_GT(m, 0);
}

TEST_F(PushedArm, WorkOfMotorsAndToolAndFrictionIsTheChangeOfEnergy) {
  auto r = pushed({"work", "velocity", "limits"});
  ASSERT_TRUE(r);
  // What the push does: F v + M w; what friction takes: tau_friction qd (as a motor would give it).
  r = unwrap(sim::with_watch(*r, "push",
                             "12 N*vx - 7 N*vy + 5 N*vz + 0.6 N m*wx + 0.3 N m*wy - 0.9 N m*wz",
                             "W", Watch::value));
  const auto& t = r->find("time")->values;
  std::vector<double> rest = r->find("push")->values;
  for (std::size_t j = 1; j <= 6; ++j)
    if (const auto* f = r->find("tau_friction" + std::to_string(j)))
      for (std::size_t i = 0; i < rest.size(); ++i)
        rest[i] -= f->values[i] * r->find("qd" + std::to_string(j))->values[i];
  const auto other = sim::integral_of(t, rest);
  const auto& e = r->find("energy")->values;
  for (std::size_t i = 0; i < r->rows(); i += 10)
    EXPECT_NEAR(r->find("work")->values[i] + other[i], e[i] - e[0], 1e-3) << "row " << i;
  EXPECT_GT(std::fabs(e.back() - e[0]), 0.5);
  // q1 = 0.3 of limits that the robot's file gives.
  const recording::Column* q1 = r->find("q1");
  ASSERT_TRUE(std::isfinite(q1->upper));
  EXPECT_NEAR(r->find("used_q1")->values[0],
              std::fabs(0.3 - (q1->lower + q1->upper) / 2) / ((q1->upper - q1->lower) / 2), 1e-15);
  EXPECT_GE(r->find("limits_used")->values[0], r->find("used_q1")->values[0]);
}

TEST_F(PushedArm, RatesThatARecordingLacksAreDerivativesOfItsValues) {
  const auto whole = pushed({"jerk", "torque"});
  ASSERT_TRUE(whole);
  Recording bare = *whole;
  std::erase_if(bare.columns, [](const recording::Column& c) {
    return c.name != "time" && !(c.name.size() == 2 && c.name[0] == 'q') &&
           !c.name.starts_with("wrench");
  });
  for (recording::Column& c : bare.columns) c.lower = -INFINITY, c.upper = INFINITY;
  ASSERT_EQ(bare.columns.size(), 13U);
  const auto snapshot = bench.document.now();
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  const std::vector<std::string> asked{"torque", "power", "limits"};
  const auto r = unwrap(sim::with_quantities(simulator, bare, asked, progress));
  ASSERT_TRUE(r);
  EXPECT_EQ(r->find("qd1")->unit, "rad/s");
  EXPECT_EQ(r->find("qdd1")->unit, "rad/s^2");
  EXPECT_TRUE(std::isfinite(r->find("q1")->upper));
  EXPECT_GT(r->find("used_q1")->values[0], 0);
  for (std::size_t i = 4; i + 4 < r->rows(); ++i)
    for (const char* name : {"qd2", "qdd2", "tau2"})
      EXPECT_NEAR(r->find(name)->values[i], whole->find(name)->values[i],
                  1e-4 * (1 + std::fabs(whole->find(name)->values[i])))
          << name << " row " << i;
  Recording several = bare;
  several.robot.clear();
  several.columns[1].name = "left.q1";
  const std::vector<std::string> power{"power"};
  const auto unclear = sim::with_quantities(simulator, several, power, progress);
  ASSERT_FALSE(unclear.ok());
  EXPECT_NE(unclear.error().sentence().find("such as \"left\""), std::string::npos);
  const std::vector<std::string> around{"clearance"};
  const auto alone = sim::with_quantities(simulator, bare, around, progress);
  ASSERT_FALSE(alone.ok());
  EXPECT_NE(alone.error().sentence().find("does not belong to a world"), std::string::npos);
}

TEST_F(PushedArm, JerkIsTheRateOfTheAccelerationsAndUnknownQuantitiesAreTold) {
  const auto r = pushed({"jerk"});
  ASSERT_TRUE(r);
  const auto &t = r->find("time")->values, &qdd = r->find("qdd2")->values,
             &jerk = r->find("qddd2")->values;
  EXPECT_EQ(r->find("qddd2")->unit, "rad/s^3");
  for (std::size_t i = 3; i + 3 < r->rows(); ++i)
    EXPECT_NEAR((qdd[i + 1] - qdd[i - 1]) / (t[i + 1] - t[i - 1]), jerk[i],
                0.02 * (1 + std::fabs(jerk[i])));
  const auto snapshot = bench.document.now();
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  const std::vector<std::string> wrong{"jork"};
  const auto refused = sim::with_quantities(simulator, *r, wrong, progress);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().sentence(), "there is no quantity \"jork\". Did you mean \"jerk\"?");
  Recording moved = *r;
  moved.columns[1].values[5] += 0.01;  // q1
  const std::vector<std::string> velocity{"velocity"};
  const auto stale = sim::with_quantities(simulator, moved, velocity, progress);
  ASSERT_FALSE(stale.ok());
  EXPECT_NE(stale.error().sentence().find("in row 6 the recorded tool is"), std::string::npos);
}

}  // namespace
}  // namespace robomosp
