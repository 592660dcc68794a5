// SPDX-License-Identifier: Apache-2.0
// Importers with the tag "process": what they read arrives whole, and whatever they do to their
// process ends in a sentence.
#include "kernel/import_process.h"

#include <unistd.h>

#include <chrono>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "kernel/import_wire.h"
#include "kernel/plugin_loader.h"

namespace robomosp {
namespace {

class Heard final : public Progress {
 public:
  explicit Heard(double seconds = 1e9) : seconds_(seconds) {}
  void report(double share, std::string_view what) override {
    shares.push_back(share);
    words.emplace_back(what);
  }
  bool cancelled() const override {
    return std::chrono::steady_clock::now() - start_ > std::chrono::duration<double>(seconds_);
  }
  std::vector<double> shares;
  std::vector<std::string> words;

 private:
  double seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

class ImportProcesses : public testing::Test {
 protected:
  ImportProcesses() : loader_(registry_, &messages_) {
    const auto report = loader_.load(std::string(ABI_PLUGIN_DIR) + "/abi_importer.so");
    EXPECT_TRUE(report.loaded) << (report.refusal ? report.refusal->sentence() : "");
  }
  Result<Imported> read(const std::string& file, Progress& progress) {
    RMP_TRY_ASSIGN(const auto info, registry_.find(Importer::kInterfaceId, "reckless"));
    RMP_TRY_ASSIGN(const auto importer, registry_.create<Importer>("reckless"));
    RMP_TRY_ASSIGN(Map checked, check(info.schema, {}));
    const auto params = make_params(std::move(checked));
    return importer->read(file, *params, progress);
  }
  std::string fault(const std::string& file) {
    Heard progress;
    const auto r = read(file, progress);
    return r.ok() ? "it was read" : r.error().sentence();
  }
  Registry registry_;
  Messages messages_;
  PluginLoader loader_;
};

TEST_F(ImportProcesses, WhatIsReadArrivesWhole) {
  Heard progress;
  const auto r = read("good.reckless", progress);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  ASSERT_EQ(r->records.size(), 2U);
  EXPECT_EQ(r->records[1].name, "b.csg");
  EXPECT_EQ(r->records[1].text, std::string("with \0 in it", 12));
  ASSERT_EQ(r->geometries.size(), 2U);
  const CsgGeometry& mesh = r->geometries[0].geometry;
  EXPECT_EQ(mesh.form, CsgGeometry::Form::mesh);
  EXPECT_EQ(mesh.points, (std::vector<double>{0, 0.1, 1e300, -5, 1.0 / 3, 0}));
  EXPECT_EQ(mesh.triangles, (std::vector<std::uint32_t>{0, 1, 4294967295U}));
  EXPECT_EQ(mesh.digest[1], ~0ULL);
  EXPECT_EQ(mesh.deviation, 0.002) << "a parameter, in SI";
  EXPECT_EQ(r->geometries[1].geometry.brep, "DBRep");
  EXPECT_EQ(r->geometries[1].geometry.source, "hello");
  ASSERT_EQ(r->notes.size(), 5U);
  EXPECT_EQ(r->notes[0], "7");
  EXPECT_EQ(r->notes[1], "yes");
  EXPECT_EQ(r->notes[2], "3");
  EXPECT_EQ(r->notes[3], "lacks");
  EXPECT_NE(r->notes[4], std::to_string(::getpid())) << "it ran in this process";
  ASSERT_EQ(r->profile.loops.size(), 1U);
  EXPECT_EQ(r->profile.loops[0].curves[0].points[1], (std::array<double, 2>{5, 6}));
  ASSERT_EQ(r->foreign.size(), 1U);
  EXPECT_EQ(r->foreign[0].path, "/a b.stl");
  EXPECT_EQ(r->foreign[0].scale, (Vec3{1, -1, 2}));
  EXPECT_EQ(progress.shares, (std::vector<double>{0.5}));
  EXPECT_EQ(progress.words, (std::vector<std::string>{"half of it"}));
  bool is_logged = false;
  for (const Message& m : messages_.recent())
    is_logged = is_logged || m.text == "a log of two lines";
  EXPECT_TRUE(is_logged) << "what it logs";
}

TEST_F(ImportProcesses, WhateverItDoesEndsInASentence) {
  EXPECT_NE(fault("crash.reckless").find("importer \"reckless\", file \"crash.reckless\""),
            std::string::npos)
      << fault("crash.reckless");
  EXPECT_NE(fault("crash.reckless").find("crashed"), std::string::npos) << fault("crash.reckless");
  EXPECT_NE(fault("leave.reckless").find("exited without a reply"), std::string::npos)
      << fault("leave.reckless");
  EXPECT_NE(fault("half.reckless").find("exited without a reply"), std::string::npos)
      << fault("half.reckless");
  EXPECT_NE(fault("throw.reckless").find("no such thing"), std::string::npos)
      << fault("throw.reckless");
  EXPECT_EQ(fault("refuse.reckless"), "line 7: it is no drawing. Try another.");
}

TEST_F(ImportProcesses, OneThatHangsIsCancelled) {
  Heard progress(0.3);
  const auto start = std::chrono::steady_clock::now();
  const auto r = read("hang.reckless", progress);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::cancelled);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST(ImportWire, WhatIsCutOffOrTooLongIsRefused) {
  import_wire::Answer answer;
  answer.is_ok = true;
  answer.imported.records = {{"a", "text"}};
  answer.imported.geometries.resize(1);
  answer.imported.geometries[0].geometry.points = {1, 2, 3};
  answer.imported.notes = {"note"};
  const std::string whole = import_wire::encode(answer);
  import_wire::Answer back;
  ASSERT_TRUE(import_wire::decode(whole, back));
  EXPECT_EQ(back.imported.geometries[0].geometry.points, (std::vector<double>{1, 2, 3}));
  for (std::size_t n = 0; n < whole.size(); ++n) {
    import_wire::Answer cut;
    EXPECT_FALSE(import_wire::decode(std::string_view(whole).substr(0, n), cut)) << n;
  }
  import_wire::Answer more;
  EXPECT_FALSE(import_wire::decode(whole + "x", more));
  // Lengths that no memory holds: every byte of the message made great in turn.
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string broken = whole;
    broken[i] = '\xff';
    import_wire::Answer any;
    (void)import_wire::decode(broken, any);
  }
}

}  // namespace
}  // namespace robomosp
