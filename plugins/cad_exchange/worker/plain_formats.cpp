// SPDX-License-Identifier: Apache-2.0
// robomosp-exchange-plain: STL and DXF in, by readers of our own (layer: plugin).
#include <fstream>
#include <sstream>
#include <utility>

#include "../dxf_reader.h"
#include "../stl_reader.h"
#include "formats.h"

namespace robomosp::cad_exchange {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 30;

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

}  // namespace

Result<Scene> read_format(const std::string& path, const ReadOptions& o, Progress& progress) {
  if (o.format != "stl" && o.format != "dxf") return not_here(o.format);
  RMP_TRY_ASSIGN(const std::string bytes, slurp(path));
  progress.report(0.3, "reading");
  if (o.format == "dxf") return read_dxf(bytes, o.unit);
  std::vector<std::string> notes;
  RMP_TRY_ASSIGN(auto shapes, read_stl(bytes, with_unit(o).unit, notes));
  Scene scene = scene_of(std::move(shapes));
  scene.notes = std::move(notes);
  return scene;
}

Result<std::string> write_format(const Scene&, const WriteOptions& o, Progress&) {
  return not_here(o.format);
}

std::string thrown_by_library() { return "it threw an unknown exception"; }

}  // namespace robomosp::cad_exchange
