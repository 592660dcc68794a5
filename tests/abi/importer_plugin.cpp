// SPDX-License-Identifier: Apache-2.0
// An importer that asks for a process of its own; what it does is the name of the file.
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include <robomosp/sdk/host.h>
#include <robomosp/sdk/io.h>
#include <robomosp/sdk/plugin.h>

namespace {

using namespace robomosp;

class Reckless final : public Importer {
 public:
  explicit Reckless(const rmp_host* host) : host_(host) {}
  std::string_view extensions() const override { return "reckless"; }
  Result<Imported> read(std::string_view path, const Params& params,
                        Progress& progress) const override {
    const std::string what(path.substr(0, path.find('.')));
    if (what == "crash") {
      std::signal(SIGSEGV, SIG_DFL);  // of a sanitizer, which would end it otherwise
      std::raise(SIGSEGV);
    }
    if (what == "leave") std::exit(0);
    if (what == "half") {
      std::fputs("some of the answer", stdout);
      std::fflush(stdout);
      ::_exit(0);
    }
    if (what == "hang")
      for (;;) ::pause();
    if (what == "throw") throw std::runtime_error("no such thing");
    if (what == "refuse")
      return error(ErrorCode::syntax, "it is no drawing", "Try another.", "line 7");
    progress.report(0.5, "half of it");
    host_.log(Host::Severity::warning, "reckless", "a log\nof two lines");
    std::puts("what a library prints");
    Imported out;
    out.records = {{"a.mtr", "robomosp material 1\n"}, {"b.csg", std::string("with \0 in it", 12)}};
    ImportedGeometry mesh{"m", {}};
    mesh.geometry.form = CsgGeometry::Form::mesh;
    mesh.geometry.points = {0, 0.1, 1e300, -5, 1.0 / 3, 0};
    mesh.geometry.triangles = {0, 1, 4294967295U};
    mesh.geometry.digest = {1, ~0ULL};
    mesh.geometry.deviation = params.real("chord");
    ImportedGeometry exact{"e", {}};
    exact.geometry.brep = "DBRep";
    exact.geometry.source = params.text("word");
    out.geometries = {mesh, exact};
    out.notes = {std::to_string(params.integer("count")), params.boolean("flag") ? "yes" : "no",
                 std::to_string(params.reals("list").size()), params.has("none") ? "has" : "lacks",
                 std::to_string(::getpid())};
    CsgLoop loop;
    loop.start = {1, 2};
    loop.curves = {{CsgCurve::Kind::arc, {{3, 4}, {5, 6}}}};
    out.profile.loops = {loop};
    out.foreign = {{"f", "/a b.stl", {1, -1, 2}, "mm"}};
    return out;
  }

 private:
  Host host_;
};

const rmp_param kParams[] = {
    {"chord", "real", "m", "A length.", "2 mm", nullptr, 0, 1},
    {"count", "int", "", "A number.", "7", nullptr, 0, 100},
    {"flag", "bool", "", "A choice.", "true", nullptr, 1, 0},
    {"word", "string", "", "A word.", "hello", nullptr, 1, 0},
    {"list", "real[]", "", "Numbers.", "{1, 2, 3}", nullptr, 1, 0},
    {"none", "string", "", "Left out.", nullptr, nullptr, 1, 0, RMP_OPTIONAL},
};

}  // namespace

RMP_PLUGIN("org.example.reckless", "1", "MIT", "Reads what nobody should",
           RMP_PROVIDER(Reckless, "reckless", "Reads in a process of its own.", "drawing,process",
                        kParams))
