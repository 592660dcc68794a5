// SPDX-License-Identifier: Apache-2.0
// robomosp-exchange: reads and writes foreign files in a process of its own. Not for users to
// start:
//   robomosp-exchange read FILE format=step heal=1 unit=0.001      answer on standard output
//   robomosp-exchange write format=step unit=mm schema=ap214       scene on standard input
// Progress goes to standard error as lines `progress FRACTION WORDS`. See scene.h for the answer.
// (layer: plugin)
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <new>
#include <sstream>
#include <string>

#include "../dxf_reader.h"
#include "../mesh_repair.h"
#include "../stl_reader.h"
#include "worker.h"

#include <fcntl.h>
#include <unistd.h>
#include <Standard_Failure.hxx>

namespace robomosp::cad_exchange {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 30;

/// Tells the plugin how far it is; stopping is done by killing this process.
class LineProgress final : public Progress {
 public:
  void report(double fraction, std::string_view what) override {
    const int percent = static_cast<int>(100 * std::clamp(fraction, 0.0, 1.0));
    if (percent == last_ && what == what_) return;
    last_ = percent;
    what_ = what;
    std::fprintf(stderr, "progress %d %s\n", percent, what_.c_str());
  }
  [[nodiscard]] bool cancelled() const override { return false; }

 private:
  int last_ = -1;
  std::string what_;
};

using Options = std::map<std::string, std::string>;

double number(const Options& o, const std::string& name) {
  const auto it = o.find(name);
  double v = 0;
  if (it != o.end()) std::from_chars(it->second.data(), it->second.data() + it->second.size(), v);
  return v;
}
std::string word(const Options& o, const std::string& name, const std::string& otherwise = {}) {
  const auto it = o.find(name);
  return it == o.end() ? otherwise : it->second;
}

Result<std::string> slurp(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in)
    return error(ErrorCode::not_found, "the file cannot be opened", "Check its permissions.");
  std::ostringstream all;
  all << in.rdbuf();
  if (all.str().size() > kMostBytes)
    return error(ErrorCode::unsupported, "the file is larger than 1 GiB", "Split it.");
  return std::move(all).str();
}

/// Meshes become closed where that can be vouched for, and else stay as they are; those without
/// triangles go.
void finish_meshes(Scene& scene, bool heal) {
  std::vector<std::int32_t> to(scene.shapes.size(), -1);
  std::vector<Shape> kept;
  for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
    Shape& s = scene.shapes[i];
    if (s.brep.empty()) {
      const MeshRepair done = repair(s.points, s.triangles, heal);
      for (std::string& note : done.notes(s.name)) scene.notes.push_back(std::move(note));
      if (s.triangles.empty()) {
        scene.notes.push_back(
            (s.name.empty() ? std::string("The mesh") : "The mesh \"" + s.name + "\"") +
            " has no triangles with area; it was left out.");
        continue;
      }
    }
    to[i] = static_cast<std::int32_t>(kept.size());
    kept.push_back(std::move(s));
  }
  scene.shapes = std::move(kept);
  std::vector<std::int32_t> renumbered(scene.nodes.size(), -1);
  std::vector<Node> nodes;
  for (std::size_t i = 0; i < scene.nodes.size(); ++i) {
    Node n = std::move(scene.nodes[i]);
    if (n.shape >= 0) {
      n.shape = to[static_cast<std::size_t>(n.shape)];
      if (n.shape < 0) continue;
    }
    if (n.parent >= 0) n.parent = renumbered[static_cast<std::size_t>(n.parent)];
    renumbered[i] = static_cast<std::int32_t>(nodes.size());
    nodes.push_back(std::move(n));
  }
  scene.nodes = std::move(nodes);
}

Scene scene_of(std::vector<Shape> shapes) {
  Scene s;
  for (Shape& shape : shapes) {
    Node n;
    n.name = shape.name;
    n.shape = static_cast<std::int32_t>(s.shapes.size());
    s.shapes.push_back(std::move(shape));
    s.nodes.push_back(std::move(n));
  }
  return s;
}

Result<Scene> read(const std::string& path, const Options& given, Progress& progress) {
  ReadOptions o;
  o.format = word(given, "format");
  o.heal = word(given, "heal") != "0";
  o.unit = number(given, "unit");
  if (!(o.unit > 0)) o.unit = 1e-3;
  Scene scene;
  if (o.format == "stp" || o.format == "step" || o.format == "igs" || o.format == "iges") {
    RMP_TRY_ASSIGN(scene, read_cad(path, o, progress));
  } else if (o.format == "stl") {
    RMP_TRY_ASSIGN(const std::string bytes, slurp(path));
    progress.report(0.3, "reading");
    RMP_TRY_ASSIGN(auto shapes, read_stl(bytes, o.unit));
    scene = scene_of(std::move(shapes));
  } else if (o.format == "dxf") {
    RMP_TRY_ASSIGN(const std::string bytes, slurp(path));
    progress.report(0.3, "reading");
    RMP_TRY_ASSIGN(scene, read_dxf(bytes, number(given, "unit")));
  } else if (o.format == "3mf") {
    RMP_TRY_ASSIGN(scene, read_3mf(path, progress));
  } else {
    RMP_TRY_ASSIGN(scene, read_meshes(path, o, progress));
  }
  progress.report(0.9, "checking");
  finish_meshes(scene, o.heal);
  RMP_TRY(check(scene));
  if (scene.shapes.empty() && scene.profile.loops.empty()) {
    std::string why;
    for (const std::string& n : scene.notes) why += (why.empty() ? "" : " ") + n;
    return error(ErrorCode::unsupported, "the file holds no solid", why);
  }
  return scene;
}

Result<std::string> write(const Options& given, Progress& progress) {
  std::string bytes;
  char buffer[65536];
  for (ssize_t n = 0; (n = ::read(0, buffer, sizeof buffer)) > 0;)
    bytes.append(buffer, static_cast<std::size_t>(n));
  RMP_TRY_ASSIGN(const Answer in, decode(bytes));
  WriteOptions o;
  o.format = word(given, "format");
  o.unit = word(given, "unit", "mm");
  o.schema = word(given, "schema", "ap214");
  return write_cad(in.scene, o, progress);
}

std::string answer_to(int argc, char** argv, Progress& progress) {
  const std::string verb = argc > 1 ? argv[1] : "";
  Options options;
  for (int i = 2; i < argc; ++i) {
    const std::string pair = argv[i];
    if (const auto at = pair.find('='); at != std::string::npos)
      options[pair.substr(0, at)] = pair.substr(at + 1);
  }
  if (verb == "write") {
    const auto r = write(options, progress);
    return r.ok() ? encode_file(*r) : encode(r.error());
  }
  if (verb == "read" && argc > 2) {
    const auto r = read(argv[2], options, progress);
    return r.ok() ? encode(*r) : encode(r.error());
  }
  return encode(error(ErrorCode::usage, "robomosp-exchange is started by robomosp only"));
}

std::string guarded_answer(int argc, char** argv, Progress& progress) {
  std::string what;
  try {
    return answer_to(argc, argv, progress);
  } catch (const Standard_Failure& e) {
    what = e.GetMessageString() && *e.GetMessageString() ? e.GetMessageString()
                                                         : e.DynamicType()->Name();
  } catch (const std::bad_alloc&) {
    what = "it needs more memory than it may have";
  } catch (const std::exception& e) {
    what = e.what();
  }
  return encode(error(ErrorCode::plugin_failed, "the library for this format gave up: " + what,
                      "Check the file in the program it comes from."));
}

}  // namespace
}  // namespace robomosp::cad_exchange

int main(int argc, char** argv) {
  // Libraries print on standard output, so that the answer needs a way of its own.
  const int answer = ::dup(1);
  const int nowhere = ::open("/dev/null", O_WRONLY);
  if (answer < 0 || nowhere < 0 || ::dup2(nowhere, 1) < 0) return 1;
  robomosp::cad_exchange::LineProgress progress;
  const std::string bytes = robomosp::cad_exchange::guarded_answer(argc, argv, progress);
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t n = ::write(answer, bytes.data() + at, bytes.size() - at);
    if (n <= 0) return 1;
    at += static_cast<std::size_t>(n);
  }
  // Without destructors of libraries, which may stumble over what a damaged file left behind.
  std::fflush(nullptr);
  ::_exit(0);
}
