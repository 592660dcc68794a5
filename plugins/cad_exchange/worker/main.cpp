// SPDX-License-Identifier: Apache-2.0
// robomosp-exchange, robomosp-exchange-mesh, robomosp-exchange-plain: read and write foreign files
// in a process of their own, each with the libraries of its formats (formats.h). Not for users to
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
#include <map>
#include <new>
#include <string>

#include "../mesh_repair.h"
#include "formats.h"

#include <fcntl.h>
#include <unistd.h>

namespace robomosp::cad_exchange {
namespace {

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

Result<Scene> read(const std::string& path, const Options& given, Progress& progress) {
  ReadOptions o;
  o.format = word(given, "format");
  o.heal = word(given, "heal") != "0";
  o.unit = number(given, "unit");
  RMP_TRY_ASSIGN(Scene scene, read_format(path, o, progress));
  progress.report(0.9, "checking");
  finish_meshes(scene, o.heal);
  RMP_TRY(check(scene));
  if (scene.shapes.empty() && scene.profile.loops.empty()) {
    std::string why;
    for (const std::string& n : scene.notes) why += (why.empty() ? "" : " ") + n;
    return error(ErrorCode::unsupported, "the file contains no solid", why);
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
  return write_format(in.scene, o, progress);
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
  } catch (const std::bad_alloc&) {
    what = "it needs more memory than allowed";
  } catch (const std::exception& e) {
    what = e.what();
  } catch (...) {
    what = thrown_by_library();
  }
  return encode(error(ErrorCode::plugin_failed, "the library for this format failed: " + what,
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
