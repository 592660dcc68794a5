// SPDX-License-Identifier: Apache-2.0
// Importers and exporters of CAD and mesh files. What reads foreign files, and Open CASCADE and
// Assimp with it, is in worker programs, one of which is run for each file: a file that crashes,
// hangs or floods it ends as a sentence (layer: plugin).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <robomosp/sdk/io.h>
#include <robomosp/sdk/names.h>
#include <robomosp/sdk/plugin.h>

#include "records.h"
#include "scene.h"
#include "writers.h"

namespace robomosp::cad_exchange {
namespace {

const rmp_param kImportParams[] = {
    {"name", "string", "", "Name of the new record; empty = that of the file.", "", nullptr, 1, 0},
    {"unit", "enum", "", "Length unit of a file that does not state one; auto = mm, with a note.",
     "auto", "auto|mm|cm|m|in|ft", 1, 0},
    {"heal", "bool", "", "Repair faulty geometry, and report it.", "true", nullptr, 1, 0},
    {"materials", "bool", "", "Make a material for each colour.", "true", nullptr, 1, 0},
    {"density", "real", "kg/m^3", "Density of these materials; 0 = that of aluminium, with a note.",
     "0", nullptr, 0, 1e6},
    {"seconds", "real", "s", "Time limit for reading.", "600", nullptr, 1, 86400},
    {"memory", "int", "", "Memory limit for reading, in GiB.", "8", nullptr, 1, 1024},
};
const rmp_param kCadExportParams[] = {
    {"unit", "enum", "", "Length unit of the file.", "mm", "mm|m|in", 1, 0},
    {"schema", "enum", "", "Application protocol of STEP files.", "ap214", "ap203|ap214|ap242", 1,
     0},
    {"seconds", "real", "s", "Time limit for writing.", "600", nullptr, 1, 86400},
};
const rmp_param kMeshExportParams[] = {
    {"unit", "enum", "", "Length unit of the file; GLB is always in metres.", "mm", "mm|cm|m|in|ft",
     1, 0},
};

double metres(std::string_view unit) {
  if (unit == "cm") return 1e-2;
  if (unit == "m") return 1;
  if (unit == "in") return 0.0254;
  if (unit == "ft") return 0.3048;
  return 1e-3;
}

std::string extension_of(std::string_view path) {
  std::string e = std::filesystem::path(path).extension().string();
  if (!e.empty()) e.erase(0, 1);
  std::transform(e.begin(), e.end(), e.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return e;
}

bool is_one_of(std::string_view word, std::string_view list) {
  while (!list.empty()) {
    const auto comma = std::min(list.find(','), list.size());
    if (list.substr(0, comma) == word) return true;
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
  return false;
}

std::string upper(std::string s) {
  for (char& c : s) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c;
  return s;
}

/// The worker program for a format (worker/formats.h).
const char* program_for(std::string_view format) {
  if (is_one_of(format, "stl,dxf")) return "robomosp-exchange-plain";
  if (is_one_of(format, "obj,ply,gltf,glb,dae,3mf")) return "robomosp-exchange-mesh";
  return "robomosp-exchange";
}

/// One run of a worker program.
class Worker {
 public:
  Worker(const rmp_host* host, const char* program, Progress& progress)
      : host_(host), program_(program), progress_(progress) {}

  Result<Answer> run(const std::vector<std::string>& words, std::string_view input, double seconds,
                     std::uint64_t memory, const std::string& doing) {
    if (!host_ || !RMP_HAS(host_, run) || !host_->run)
      return error(ErrorCode::unsupported, "this program cannot run helper programs",
                   "Update it; the plugin is newer.");
    std::vector<const char*> arguments;
    for (const std::string& w : words) arguments.push_back(w.c_str());
    rmp_program program{};
    program.struct_size = sizeof program;
    program.name = program_;
    program.arguments = arguments.data();
    program.argument_count = static_cast<std::uint32_t>(arguments.size());
    program.input = input.data();
    program.input_size = input.size();
    program.seconds = seconds;
    program.memory = memory;
    program.most_output = std::uint64_t{2} << 30;
    program.context = this;
    program.output = [](void* self, const char* bytes, std::uint64_t size) {
      static_cast<Worker*>(self)->output_.assign(bytes, static_cast<std::size_t>(size));
    };
    program.line = [](void* self, const char* text, std::uint64_t size) {
      static_cast<Worker*>(self)->hear({text, static_cast<std::size_t>(size)});
    };
    program.cancelled = [](void* self) {
      return std::int32_t{static_cast<Worker*>(self)->progress_.cancelled() ? 1 : 0};
    };
    std::array<char, 512> why{};
    const std::int32_t ended = host_->run(&program, why.data(), why.size());
    if (ended == 1) return error(ErrorCode::cancelled, "stopped");
    if (ended != 0)
      return error(ErrorCode::plugin_failed,
                   doing + " failed in a separate process, so nothing was changed: " + why.data(),
                   "Check the file in the program it comes from.");
    return decode(output_);
  }

 private:
  /// `progress 40 building solids`; libraries print other lines.
  void hear(std::string_view line) {
    constexpr std::string_view kWord = "progress ";
    if (!line.starts_with(kWord)) return;
    line.remove_prefix(kWord.size());
    const auto blank = std::min(line.find(' '), line.size());
    const double percent = std::strtod(std::string(line.substr(0, blank)).c_str(), nullptr);
    line.remove_prefix(std::min(blank + 1, line.size()));
    if (percent >= 0 && percent <= 100) progress_.report(percent / 100, line);
  }

  const rmp_host* host_;
  const char* program_;
  Progress& progress_;
  std::string output_;
};

// --- in ----------------------------------------------------------------------------------------

class FileImporter : public Importer {
 public:
  explicit FileImporter(const rmp_host* host) : host_(host) {}

  Result<Imported> read(std::string_view path, const Params& params,
                        Progress& progress) const override {
    const std::string format = extension_of(path);
    if (!is_one_of(format, extensions()))
      return error(ErrorCode::invalid_argument,
                   "\"" + format + "\" is not an extension of this importer");
    // An absolute path cannot be taken for an option, nor does the folder matter.
    std::error_code failed;
    const std::string full = std::filesystem::absolute(std::string(path), failed).string();
    if (failed || !std::filesystem::is_regular_file(full, failed))
      return error(ErrorCode::not_found, "there is no file \"" + std::string(path) + "\"",
                   "Check the path.");
    const bool has_no_unit = is_one_of(format, "stl,obj,ply");
    const bool may_lack_unit = has_no_unit || format == "dxf";
    const std::string_view unit = params.text("unit");
    const bool is_given = unit != "auto" && !unit.empty();
    char size[40];
    std::snprintf(size, sizeof size, "unit=%.17g",
                  is_given      ? metres(unit)
                  : has_no_unit ? 1e-3
                                : 0);
    std::string size_text = size;
    std::replace(size_text.begin(), size_text.end(), ',', '.');  // whatever the locale
    Worker worker(host_, program_for(format), progress);
    auto answer = worker.run(
        {"read", full, "format=" + format,
         std::string("heal=") + (params.boolean("heal") ? "1" : "0"), size_text},
        {}, params.real("seconds"), static_cast<std::uint64_t>(params.integer("memory")) << 30,
        "reading " + upper(format));
    if (!answer.ok()) return std::move(answer).in("file \"" + std::string(path) + "\"").error();
    Scene scene = std::move(answer->scene);
    if (has_no_unit && !is_given) {
      std::string note = upper(format) + " files state no unit; this one was read as millimetres.";
      const double extent = largest_extent(scene);
      if (extent > 0 && extent < 2e-3) {
        char text[120];
        std::snprintf(text, sizeof text,
                      " It is only %.2g mm large: give unit=\"m\" if it is in metres.",
                      extent * 1e3);
        note += text;
      } else {
        note += " Give unit= if it differs.";
      }
      scene.notes.insert(scene.notes.begin(), note);
    } else if (is_given && !may_lack_unit) {
      scene.notes.insert(scene.notes.begin(), upper(format) +
                                                  " files state their unit, so unit=\"" +
                                                  std::string(unit) + "\" was not used.");
    }
    RecordOptions options;
    const std::filesystem::path file{std::string(path)};
    options.name = params.text("name");
    if (options.name.empty()) options.name = file.stem().string();
    options.source = file.filename().string();
    options.materials = params.boolean("materials");
    options.density = params.real("density");
    return records(std::move(scene), options);
  }

 private:
  static double largest_extent(const Scene& scene) {
    double most = 0;
    for (const Shape& s : scene.shapes)
      for (std::size_t k = 0; k < 3; ++k) {
        double low = INFINITY, high = -INFINITY;
        for (std::size_t i = k; i < s.points.size(); i += 3) {
          low = std::min(low, s.points[i]);
          high = std::max(high, s.points[i]);
        }
        most = std::max(most, high - low);
      }
    return most;
  }
  const rmp_host* host_;
};

class CadImporter final : public FileImporter {
 public:
  using FileImporter::FileImporter;
  std::string_view extensions() const override { return "step,stp,iges,igs"; }
};
class MeshImporter final : public FileImporter {
 public:
  using FileImporter::FileImporter;
  std::string_view extensions() const override { return "stl,obj,ply,gltf,glb,dae,3mf"; }
};
class DrawingImporter final : public FileImporter {
 public:
  using FileImporter::FileImporter;
  std::string_view extensions() const override { return "dxf"; }
};

// --- out ---------------------------------------------------------------------------------------

Result<void> check_items(std::span<const ExportItem> items) {
  for (std::size_t i = 0; i < items.size(); ++i)
    if (items[i].parent < -1 || items[i].parent >= static_cast<std::int32_t>(i))
      return error(ErrorCode::invalid_argument, "an item precedes its parent");
  return {};
}

std::vector<ExportedFile> alone(const ExportTask& task, std::string bytes) {
  std::vector<ExportedFile> files(1);
  files[0].name = task.name;
  files[0].bytes = std::move(bytes);
  return files;
}

class CadExporter final : public Exporter {
 public:
  explicit CadExporter(const rmp_host* host) : host_(host) {}
  std::string_view extensions() const override { return "step,stp,iges,igs"; }
  bool is_exact(std::string_view) const override { return true; }

  Result<std::vector<ExportedFile>> write(const ExportTask& task, const Params& params,
                                          Progress& progress) const override {
    RMP_TRY(check_items(task.items));
    RMP_TRY_ASSIGN(Scene scene, scene_of(task.items));
    const bool is_iges = task.extension.starts_with("ig");
    if (is_iges) name_in_ascii(scene, task.report);
    const std::string input = encode(scene);
    Worker worker(host_, program_for(task.extension), progress);
    RMP_TRY_ASSIGN(Answer answer, worker.run({"write", is_iges ? "format=iges" : "format=step",
                                              "unit=" + std::string(params.text("unit")),
                                              "schema=" + std::string(params.text("schema"))},
                                             input, params.real("seconds"), std::uint64_t{8} << 30,
                                             is_iges ? "writing IGES" : "writing STEP"));
    return alone(task, std::move(answer.file));
  }

 private:
  static Result<Scene> scene_of(std::span<const ExportItem> items) {
    Scene scene;
    std::map<std::uint64_t, std::int32_t> parts;
    for (const ExportItem& item : items) {
      Node n;
      n.name = item.name;
      n.parent = item.parent;
      n.pose = item.pose;
      if (item.geometry || item.mesh) {
        if (!item.geometry || item.geometry->form != CsgGeometry::Form::brep)
          return error(ErrorCode::unsupported,
                       "\"" + item.name + "\" is a mesh, not an exact solid",
                       "Export it to a mesh format such as STL, OBJ, GLB or 3MF.");
        const auto next = static_cast<std::int32_t>(scene.shapes.size());
        n.shape = item.definition ? parts.try_emplace(item.definition, next).first->second : next;
        const Paint paint{true, item.colour};
        if (n.shape == next) {
          Shape s;
          s.name = item.name;
          s.brep = item.geometry->brep;
          s.paint = paint;
          scene.shapes.push_back(std::move(s));
        } else if (!same(paint.colour,
                         scene.shapes[static_cast<std::size_t>(n.shape)].paint.colour)) {
          n.paint = paint;
        }
      }
      scene.nodes.push_back(std::move(n));
    }
    if (scene.shapes.empty())
      return error(ErrorCode::invalid_argument, "there is no solid to write",
                   "Export a solid or an object with parts.");
    return scene;
  }
  /// IGES names are ASCII (version 5.3, section 2.2.3): "_" stands for other letters, which is
  /// told.
  static void name_in_ascii(Scene& scene, ExportReport* report) {
    std::set<std::string> changed;
    const auto make_plain = [&](std::string& name) {
      std::string plain;
      for (std::size_t i = 0; i < name.size();) {
        const std::size_t bytes = std::max<std::size_t>(name_rules::code_point(name, i).second, 1);
        plain += static_cast<unsigned char>(name[i]) < 0x80 ? name[i] : '_';
        i += bytes;
      }
      if (plain != name) changed.insert("\"" + name + "\"");
      name = std::move(plain);
    };
    for (Node& n : scene.nodes) make_plain(n.name);
    for (Shape& s : scene.shapes) make_plain(s.name);
    if (changed.empty() || !report || report->struct_size < sizeof(ExportReport)) return;
    const std::size_t others = changed.size() - 1;
    report->notes.push_back("IGES stores names in ASCII only: in " + *changed.begin() +
                            (others > 0 ? " and " + std::to_string(others) + " more" : "") +
                            " other letters were written as \"_\". STEP keeps them.");
  }
  static bool same(const Colour& a, const Colour& b) {
    return a.r == b.r && a.g == b.g && a.b == b.b && a.a == b.a;
  }
  const rmp_host* host_;
};

class MeshExporter final : public Exporter {
 public:
  explicit MeshExporter(const rmp_host*) {}
  std::string_view extensions() const override { return "stl,obj,ply,glb,3mf,dxf"; }
  bool is_exact(std::string_view) const override { return false; }

  Result<std::vector<ExportedFile>> write(const ExportTask& task, const Params& params,
                                          Progress& progress) const override {
    RMP_TRY(check_items(task.items));
    progress.report(0.1, "writing");
    MeshOptions options;
    options.unit_name = params.text("unit").empty() ? "mm" : params.text("unit");
    options.unit = metres(options.unit_name);
    RMP_TRY_ASSIGN(std::string bytes, written(task.extension, task.items, options));
    return alone(task, std::move(bytes));
  }

 private:
  static Result<std::string> written(std::string_view extension, std::span<const ExportItem> items,
                                     const MeshOptions& options) {
    if (extension == "stl") return write_stl(items, options);
    if (extension == "obj") return write_obj(items, options);
    if (extension == "ply") return write_ply(items, options);
    if (extension == "glb") return write_glb(items);
    if (extension == "3mf") return write_3mf(items, options);
    if (extension == "dxf") return write_dxf(items, options);
    return error(ErrorCode::invalid_argument,
                 "\"" + std::string(extension) + "\" is not an extension of this exporter");
  }
};

template <class T>
void* make(const rmp_host* host, char* error, std::uint32_t error_size) {
  try {
    return static_cast<typename T::Interface*>(new T(host));
  } catch (const std::exception& e) {
    if (error && error_size) std::snprintf(error, error_size, "%s", e.what());
  }
  return nullptr;
}

template <class T>
constexpr rmp_provider provider(const char* name, const char* summary, const char* tags,
                                std::span<const rmp_param> params) {
  return {T::Interface::kInterfaceId,
          name,
          summary,
          tags,
          params.data(),
          static_cast<std::uint32_t>(params.size()),
          sizeof(rmp_param),
          &make<T>};
}

}  // namespace
}  // namespace robomosp::cad_exchange

using namespace robomosp::cad_exchange;

RMP_PLUGIN("org.robomosp.cad_exchange", "0.1.0", "Apache-2.0",
           "Reads and writes CAD and mesh files; reads in a separate process",
           provider<CadImporter>("cad", "STEP and IGES: exact solids, names, colours, assemblies.",
                                 "exact,confined", kImportParams),
           provider<MeshImporter>("mesh", "STL, OBJ, PLY, glTF, GLB, COLLADA, 3MF: closed meshes.",
                                  "mesh,confined", kImportParams),
           provider<DrawingImporter>("dxf", "DXF: outlines as profiles, and meshes.",
                                     "profile,mesh,confined", kImportParams),
           provider<CadExporter>("cad", "STEP AP203/214/242 and IGES: exact solids.", "exact",
                                 kCadExportParams),
           provider<MeshExporter>("mesh", "STL, OBJ, PLY, GLB, 3MF; DXF with outlines or meshes.",
                                  "mesh,profile", kMeshExportParams))
