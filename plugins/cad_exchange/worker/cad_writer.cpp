// SPDX-License-Identifier: Apache-2.0
// STEP and IGES out: exact solids with names, colours and, in STEP, assemblies whose copies share
// one definition (layer: plugin).
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <robomosp/sdk/names.h>

#include "cad_common.h"
#include "worker.h"

#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <IGESCAFControl_Writer.hxx>
#include <Interface_Static.hxx>
#include <Quantity_ColorRGBA.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <TCollection_ExtendedString.hxx>
#include <TDataStd_Name.hxx>
#include <TopoDS_Shape.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <gp_Trsf.hxx>

namespace robomosp::cad_exchange {
namespace {

gp_Trsf trsf_of(const Pose& t) {
  const auto& r = t.R;
  const double s = kMillimetresPerMetre;
  gp_Trsf out;
  out.SetValues(r[0], r[1], r[2], s * t.p[0], r[3], r[4], r[5], s * t.p[1], r[6], r[7], r[8],
                s * t.p[2]);
  return out;
}

void set_name(const TDF_Label& label, const std::string& name) {
  if (!name.empty())
    TDataStd_Name::Set(label, TCollection_ExtendedString(name.c_str(), Standard_True));
}

/// STEP is ASCII: other letters are written as ISO 10303-21 (section 6.4.3) says, \X2\ and four
/// digits each for the first plane of Unicode, \X4\ and eight for the others.
std::string with_step_letters(std::string_view bytes) {
  std::string out;
  out.reserve(bytes.size());
  for (std::size_t i = 0; i < bytes.size();) {
    const auto [c, size] = name_rules::code_point(bytes, i);
    if (c < 0x80 || size == 0) {
      out += bytes[i++];
      continue;
    }
    char text[24];
    std::snprintf(text, sizeof text, c < 0x10000 ? "\\X2\\%04X\\X0\\" : "\\X4\\%08X\\X0\\", c);
    out += text;
    i += size;
  }
  return out;
}

class CadWriter {
 public:
  explicit CadWriter(const Scene& scene)
      : scene_(scene),
        document_(new_document()),
        shapes_(XCAFDoc_DocumentTool::ShapeTool(document_->Main())),
        colours_(XCAFDoc_DocumentTool::ColorTool(document_->Main())) {
    XCAFDoc_ShapeTool::SetAutoNaming(Standard_False);
  }

  Result<Handle(TDocStd_Document)> run() {
    for (const Shape& s : scene_.shapes) {
      if (s.brep.empty())
        return error(ErrorCode::unsupported, "\"" + s.name + "\" is a mesh, not an exact solid",
                     "Export it to a mesh format such as STL, OBJ, GLB or 3MF.");
      std::istringstream text(s.brep);
      TopoDS_Shape shape;
      BRep_Builder builder;
      BRepTools::Read(shape, text, builder);
      if (shape.IsNull())
        return error(ErrorCode::internal, "the solid \"" + s.name + "\" was transferred damaged");
      const TDF_Label label = shapes_->AddShape(shape, Standard_False);
      set_name(label, s.name);
      paint(label, s.paint);
      parts_.push_back(label);
    }
    // A part at the top that does not stand at the origin needs an assembly to stand in.
    for (std::size_t i = 0; i < scene_.nodes.size(); ++i) {
      const Node& n = scene_.nodes[i];
      TDF_Label definition;
      if (n.shape >= 0) {
        definition = parts_[static_cast<std::size_t>(n.shape)];
      } else {
        definition = shapes_->NewShape();
        set_name(definition, n.name);
        paint(definition, n.paint);
      }
      definitions_.push_back(definition);
      if (n.parent < 0) continue;
      const TDF_Label place =
          shapes_->AddComponent(definitions_[static_cast<std::size_t>(n.parent)], definition,
                                TopLoc_Location(trsf_of(n.pose)));
      set_name(place, n.name);
      if (n.shape >= 0) paint(place, n.paint);
    }
    shapes_->UpdateAssemblies();
    return document_;
  }

 private:
  void paint(const TDF_Label& label, const Paint& p) {
    if (!p.known) return;
    const Quantity_ColorRGBA colour(
        Quantity_Color(static_cast<double>(p.colour.r), static_cast<double>(p.colour.g),
                       static_cast<double>(p.colour.b), Quantity_TOC_sRGB),
        p.colour.a);
    colours_->SetColor(label, colour, XCAFDoc_ColorSurf);
  }

  const Scene& scene_;
  Handle(TDocStd_Document) document_;
  Handle(XCAFDoc_ShapeTool) shapes_;
  Handle(XCAFDoc_ColorTool) colours_;
  std::vector<TDF_Label> parts_, definitions_;
};

/// A scene whose top is one assembly when anything at the top does not stand at the origin.
Scene with_one_top(const Scene& s) {
  bool needed = false;
  for (const Node& n : s.nodes)
    needed = needed || (n.parent < 0 && (n.pose.p != Vec3{} || n.pose.R != Pose{}.R));
  if (!needed) return s;
  Scene out = s;
  Node top;
  top.name = s.nodes.size() == 1 ? s.nodes[0].name : "assembly";
  for (Node& n : out.nodes) n.parent = n.parent < 0 ? 0 : n.parent + 1;
  out.nodes.insert(out.nodes.begin(), std::move(top));
  return out;
}

/// OCCT writes to files only; this one is gone when it goes out of scope.
class TemporaryFile {
 public:
  TemporaryFile() {
    std::string pattern = (std::filesystem::temp_directory_path() / "robomosp-XXXXXX").string();
    if (const char* made = ::mkdtemp(pattern.data())) folder_ = made;
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    std::error_code ignored;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
  }
  [[nodiscard]] bool ok() const { return !folder_.empty(); }
  [[nodiscard]] std::string path() const { return (folder_ / "file").string(); }
  [[nodiscard]] std::string bytes() const {
    std::ifstream in(path(), std::ios::binary);
    std::ostringstream all;
    all << in.rdbuf();
    return all.str();
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace

Result<std::string> write_cad(const Scene& given, const WriteOptions& options, Progress& progress) {
  prepare_occt();
  const Scene scene = with_one_top(given);
  const char* unit = options.unit == "m" ? "M" : options.unit == "in" ? "INCH" : "MM";
  progress.report(0.1, "building the file");
  CadWriter writer(scene);
  RMP_TRY_ASSIGN(const Handle(TDocStd_Document) document, writer.run());
  const TemporaryFile file;
  if (!file.ok())
    return error(ErrorCode::io, "there is no space for a temporary file", "Free some disk space.");
  bool written = false;
  if (options.format == "iges") {
    // Solids (entity 186); the default would be loose faces.
    Interface_Static::SetIVal("write.iges.brep.mode", 1);
    Interface_Static::SetCVal("write.iges.unit", unit);
    IGESCAFControl_Writer iges;
    iges.SetColorMode(Standard_True);
    iges.SetNameMode(Standard_True);
    written = iges.Transfer(document) && iges.Write(file.path().c_str());
  } else {
    Interface_Static::SetCVal("write.step.unit", unit);
    Interface_Static::SetCVal("write.step.schema", options.schema == "ap203"   ? "AP203"
                                                   : options.schema == "ap242" ? "AP242DIS"
                                                                               : "AP214IS");
    STEPCAFControl_Writer step;
    step.SetColorMode(Standard_True);
    step.SetNameMode(Standard_True);
    const Handle(ProgressBridge) bridge = new ProgressBridge(progress, 0.2, 0.9, "writing");
    written = step.Transfer(document, STEPControl_AsIs, nullptr, bridge->Start()) &&
              step.Write(file.path().c_str()) == IFSelect_RetDone;
  }
  if (progress.cancelled()) return error(ErrorCode::cancelled, "stopped");
  std::string bytes = file.bytes();
  if (!written || bytes.empty())
    return error(ErrorCode::plugin_failed, "Open CASCADE could not write the file",
                 "Check the disk space, or export to another format.");
  if (options.format != "iges") return with_step_letters(bytes);
  return bytes;
}

}  // namespace robomosp::cad_exchange
