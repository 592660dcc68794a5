// SPDX-License-Identifier: Apache-2.0
// STEP and IGES in: assemblies, names and colours from the XDE document; every solid is checked
// and, if asked for, repaired; the report names each repair (layer: plugin).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <sstream>
#include <unordered_map>

#include "cad_common.h"
#include "sewing.h"
#include "spatial/pose.h"
#include "worker.h"

#include <BRepBndLib.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepGProp.hxx>
#include <BRepLib.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <GProp_GProps.hxx>
#include <IGESCAFControl_Reader.hxx>
#include <Quantity_ColorRGBA.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <ShapeFix_Shape.hxx>
#include <ShapeFix_Shell.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDF_Tool.hxx>
#include <TDataStd_Name.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_ListOfShape.hxx>
#include <TopTools_ShapeMapHasher.hxx>
#include <TopTools_ShapeSet.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Iterator.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>

namespace robomosp::cad_exchange {
namespace {

/// No solid of a machine is smaller [mm^3].
constexpr double kLeastVolume = 1e-9;
constexpr double kRigid = 1e-9;
/// A repair that changes a volume by less is not worth a word.
constexpr double kSameVolume = 1e-6;

std::string name_of(const TDF_Label& label) {
  Handle(TDataStd_Name) name;
  if (label.IsNull() || !label.FindAttribute(TDataStd_Name::GetID(), name)) return {};
  const TCollection_AsciiString text(name->Get());  // UTF-8
  return text.ToCString();
}

std::string entry_of(const TDF_Label& label) {
  TCollection_AsciiString entry;
  TDF_Tool::Entry(label, entry);
  return entry.ToCString();
}

Paint paint_from(const Quantity_ColorRGBA& c) {
  Standard_Real r = 0, g = 0, b = 0;
  c.GetRGB().Values(r, g, b, Quantity_TOC_sRGB);
  Paint p;
  p.known = true;
  p.colour = {static_cast<float>(r), static_cast<float>(g), static_cast<float>(b), c.Alpha()};
  return p;
}

double signed_volume_of(const TopoDS_Shape& s) {
  GProp_GProps g;
  BRepGProp::VolumeProperties(s, g);
  return g.Mass();
}

bool is_valid(const TopoDS_Shape& s) { return BRepCheck_Analyzer(s).IsValid(); }

std::string quote(const std::string& s) { return "\"" + s + "\""; }

std::string short_text(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", v);
  return text;
}

class CadReader {
 public:
  CadReader(const Handle(TDocStd_Document) & document, bool heal, Progress& progress)
      : shapes_(XCAFDoc_DocumentTool::ShapeTool(document->Main())),
        colours_(XCAFDoc_DocumentTool::ColorTool(document->Main())),
        heal_(heal),
        progress_(progress) {}

  Result<Scene> run() {
    TDF_LabelSequence roots;
    shapes_->GetFreeShapes(roots);
    struct Open {
      TDF_Label label;
      std::int32_t parent;
    };
    std::vector<Open> stack;
    for (Standard_Integer i = roots.Length(); i >= 1; --i) stack.push_back({roots.Value(i), -1});
    std::size_t done = 0;
    while (!stack.empty()) {
      if (progress_.cancelled()) return error(ErrorCode::cancelled, "stopped");
      progress_.report(
          0.6 + 0.4 * static_cast<double>(done) / static_cast<double>(done + stack.size()),
          "checking solids");
      ++done;
      if (done > kMostNodes)
        return error(ErrorCode::unsupported, "the assembly has more than 100000 parts",
                     "Split it in the program it comes from.");
      const Open open = stack.back();
      stack.pop_back();
      TDF_Label definition = open.label;
      if (XCAFDoc_ShapeTool::IsReference(open.label))
        XCAFDoc_ShapeTool::GetReferredShape(open.label, definition);
      Node node;
      node.parent = open.parent;
      node.name = name_of(open.label);
      if (node.name.empty() || is_generated(node.name)) node.name = name_of(definition);
      node.paint = paint_of(open.label);
      gp_Trsf at = XCAFDoc_ShapeTool::GetLocation(open.label).Transformation();
      if (XCAFDoc_ShapeTool::IsAssembly(definition)) {
        if (!set_pose(node, at)) {
          note("The assembly " + quote(node.name) +
               " is placed mirrored or scaled; it was left out.");
          continue;
        }
        if (!node.paint.known) node.paint = paint_of(definition);
        scene_.nodes.push_back(node);
        const auto self = static_cast<std::int32_t>(scene_.nodes.size() - 1);
        TDF_LabelSequence parts;
        XCAFDoc_ShapeTool::GetComponents(definition, parts);
        for (Standard_Integer i = parts.Length(); i >= 1; --i)
          stack.push_back({parts.Value(i), self});
        continue;
      }
      place(node, definition, at);
    }
    inherit_paint();
    join_left_over();
    if (count_faces_only_ > 0)
      note(std::to_string(count_faces_only_) +
           (count_faces_only_ == 1 ? " item that is" : " items that are") +
           " only points, curves or texts " + (count_faces_only_ == 1 ? "was" : "were") +
           " left out.");
    return std::move(scene_);
  }

 private:
  static constexpr std::size_t kMostNodes = 100000;

  [[nodiscard]] Paint paint_of(const TDF_Label& label) const {
    Quantity_ColorRGBA c;
    for (const XCAFDoc_ColorType type : {XCAFDoc_ColorSurf, XCAFDoc_ColorGen})
      if (!label.IsNull() && colours_->GetColor(label, type, c)) return paint_from(c);
    return {};
  }

  void note(std::string text) { scene_.notes.push_back(std::move(text)); }

  /// Names that stand for a place in an assembly when there is none: `NAUO12`, `=>[0:1]`, and the
  /// place's number, which Open CASCADE also takes where no byte of the name is ASCII.
  static bool is_generated(const std::string& name) {
    if (name.starts_with("=>[")) return true;
    const std::size_t digits = name.starts_with("NAUO") ? 4 : 0;
    return name.size() > digits &&
           name.find_first_not_of("0123456789", digits) == std::string::npos;
  }

  /// Of a node that is not in the scene yet [mm].
  [[nodiscard]] gp_Trsf world_of(const Node& node) const {
    Pose t = node.pose;
    for (std::int32_t up = node.parent; up >= 0;) {
      const Node& n = scene_.nodes[static_cast<std::size_t>(up)];
      t = spatial::compose(n.pose, t);
      up = n.parent;
    }
    gp_Trsf out;
    out.SetValues(t.R[0], t.R[1], t.R[2], kMillimetresPerMetre * t.p[0], t.R[3], t.R[4], t.R[5],
                  kMillimetresPerMetre * t.p[1], t.R[6], t.R[7], t.R[8],
                  kMillimetresPerMetre * t.p[2]);
    return out;
  }

  /// False when it is no rigid motion.
  static bool set_pose(Node& node, const gp_Trsf& t) {
    if (t.IsNegative() || std::abs(t.ScaleFactor() - 1) > kRigid) return false;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j)
        node.pose.R[static_cast<std::size_t>(3 * i + j)] = t.Value(i + 1, j + 1);
      node.pose.p[static_cast<std::size_t>(i)] = t.Value(i + 1, 4) / kMillimetresPerMetre;
    }
    return true;
  }

  /// The solids of a part's definition, made once for all its copies.
  struct LeftOver {
    TopoDS_Face face;
    std::string name;  ///< of the part that it is in
    Paint paint;
  };
  struct Part {
    std::vector<std::int32_t> shapes;
    std::vector<LeftOver> open;  ///< faces that close to nothing by themselves
  };

  void place(Node node, const TDF_Label& definition, const gp_Trsf& at) {
    std::string key = entry_of(definition);
    std::optional<gp_Trsf> baked;
    if (!set_pose(node, at)) {
      baked = at;
      node.pose = {};
      key += "/" + std::to_string(++baked_count_);
      note("The part " + quote(node.name) +
           " is placed mirrored or scaled; this copy became a separate part.");
    }
    auto [it, is_new] = parts_.try_emplace(key);
    if (is_new) it->second = make_part(definition, node.name, baked);
    if (!it->second.open.empty()) {
      const TopLoc_Location where(world_of(node));
      for (LeftOver l : it->second.open) {
        l.face = TopoDS::Face(l.face.Located(where * l.face.Location()));
        left_over_.push_back(std::move(l));
      }
    }
    const std::vector<std::int32_t>& made = it->second.shapes;
    if (made.empty()) return;
    if (made.size() == 1) {
      node.shape = made[0];
      scene_.nodes.push_back(std::move(node));
      return;
    }
    // A part of several bodies becomes an assembly of them.
    const Paint paint = node.paint;
    scene_.nodes.push_back(std::move(node));
    const auto self = static_cast<std::int32_t>(scene_.nodes.size() - 1);
    for (const std::int32_t s : made) {
      Node body;
      body.name = scene_.shapes[static_cast<std::size_t>(s)].name;
      body.parent = self;
      body.shape = s;
      body.paint = paint;
      scene_.nodes.push_back(std::move(body));
    }
  }

  Part make_part(const TDF_Label& definition, const std::string& fallback,
                 const std::optional<gp_Trsf>& baked) {
    TopoDS_Shape shape = XCAFDoc_ShapeTool::GetShape(definition);
    if (shape.IsNull()) return {};
    std::string name = name_of(definition);
    if (name.empty()) name = fallback;
    std::vector<TopoDS_Shape> bodies = bodies_of(shape, name);
    Part part;
    for (TopoDS_Face& f : open_) {
      if (baked) f = TopoDS::Face(BRepBuilderAPI_Transform(f, *baked, Standard_True).Shape());
      Paint paint = paint_of(definition);
      if (!paint.known) paint = paint_of(label_of(definition, f));
      part.open.push_back({f, name, paint});
    }
    open_.clear();
    for (TopoDS_Shape& body : bodies) {
      Shape out;
      const TDF_Label sub = label_of(definition, body);
      out.name = name_of(sub);
      if (out.name.empty() || bodies.size() == 1)
        out.name = bodies.size() == 1 ? name : name + " " + std::to_string(part.shapes.size() + 1);
      out.paint = paint_of(definition);
      if (!out.paint.known) out.paint = paint_of(sub);
      if (!out.paint.known) out.paint = paint_of_faces(body, out.name);
      if (baked) body = BRepBuilderAPI_Transform(body, *baked, Standard_True).Shape();
      for (const TopoDS_Shape& s : finished(body, out.name))
        part.shapes.push_back(add_shape(s, out.name, out.paint));
    }
    return part;
  }

  [[nodiscard]] TDF_Label label_of(const TDF_Label& definition, const TopoDS_Shape& body) const {
    TDF_Label sub;
    if (!shapes_->FindSubShape(definition, body, sub)) shapes_->Search(body, sub);
    return sub;
  }

  /// The most common colour of a body's faces.
  Paint paint_of_faces(const TopoDS_Shape& body, const std::string& name) {
    std::map<std::array<float, 4>, std::size_t> seen;
    for (TopExp_Explorer f(body, TopAbs_FACE); f.More(); f.Next()) {
      Quantity_ColorRGBA c;
      if (!colours_->GetColor(f.Current(), XCAFDoc_ColorSurf, c) &&
          !colours_->GetColor(f.Current(), XCAFDoc_ColorGen, c))
        continue;
      const Paint p = paint_from(c);
      ++seen[{p.colour.r, p.colour.g, p.colour.b, p.colour.a}];
    }
    if (seen.empty()) return {};
    const auto most = std::max_element(
        seen.begin(), seen.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    if (seen.size() > 1)
      note("The faces of " + quote(name) + " have " + std::to_string(seen.size()) +
           " colours; the most common one is used.");
    Paint p;
    p.known = true;
    p.colour = {most->first[0], most->first[1], most->first[2], most->first[3]};
    return p;
  }

  /// Solids of a shape; loose faces and shells are joined to solids where they close. Those that do
  /// not, wait for the loose faces of other parts.
  std::vector<TopoDS_Shape> bodies_of(const TopoDS_Shape& shape, const std::string& name) {
    std::vector<TopoDS_Shape> found;
    for (TopExp_Explorer e(shape, TopAbs_SOLID); e.More(); e.Next()) found.push_back(e.Current());
    std::size_t loose = 0;
    for (TopExp_Explorer e(shape, TopAbs_FACE, TopAbs_SOLID); e.More(); e.Next()) ++loose;
    if (loose == 0) {
      if (found.empty()) ++count_faces_only_;
      return found;
    }
    if (!heal_) {
      note(quote(name) + " has " + faces(loose) +
           " that do not belong to a solid; they were left out.");
      return found;
    }
    Sewn sewn = sew_groups(shape);
    found.insert(found.end(), sewn.solids.begin(), sewn.solids.end());
    tell_joined(sewn, quote(name));
    open_ = std::move(sewn.open);
    return found;
  }

  static std::string faces(std::size_t n) {
    return std::to_string(n) + (n == 1 ? " face" : " faces");
  }

  void tell_joined(const Sewn& sewn, const std::string& of) {
    const std::size_t solids = sewn.solids.size();
    if (solids == 0) return;
    note(faces(sewn.joined) + " of " + of + (sewn.joined == 1 ? " was" : " were") + " joined to " +
         (solids == 1 ? "a solid" : std::to_string(solids) + " solids") +
         ", closing gaps of up to " + short_text(sewn.gap) + " mm" +
         (sewn.cavities == 0   ? "."
          : sewn.cavities == 1 ? "; a shell inside another became its cavity."
                               : "; " + std::to_string(sewn.cavities) +
                                     " shells inside others became their cavities."));
  }

  /// Files may place each face by itself; those are joined where they lie, without regard to parts.
  void join_left_over() {
    if (left_over_.empty()) return;
    std::vector<TopoDS_Face> all;
    for (const LeftOver& l : left_over_) all.push_back(l.face);
    const double area = area_of(all);
    const Sewn sewn = sew(all);
    tell_joined(sewn, "the file");
    TopTools_IndexedMapOfShape open;
    for (const TopoDS_Face& f : sewn.open) open.Add(f);
    Paint paint;
    std::string name;
    std::map<std::string, std::size_t> lost;
    for (const LeftOver& l : left_over_) {
      if (open.Contains(l.face)) {
        ++lost[l.name];
        continue;
      }
      if (!paint.known) paint = l.paint;
      if (name.empty() || name == l.name) name = l.name;
      else name = "body";
    }
    if (name.empty() || name == "FACE" || name == "COMPOUND") name = "body";
    for (const TopoDS_Solid& solid : sewn.solids) {
      for (TopoDS_Shape& body : finished(solid, name)) {
        Node node;
        node.name = name;
        node.shape = add_shape(body, name, paint);
        scene_.nodes.push_back(std::move(node));
      }
    }
    if (sewn.open.empty()) return;
    std::string where;
    if (lost.size() <= 3)
      for (const auto& [part, count] : lost)
        where += (where.empty() ? " (" : ", ") + std::to_string(count) + " of " + quote(part);
    char share[32];
    std::snprintf(share, sizeof share, "%.3g", area > 0 ? 100 * area_of(sewn.open) / area : 0.0);
    note(faces(sewn.open.size()) + (sewn.open.size() == 1 ? " does" : " do") +
         " not close to a solid" + where + (where.empty() ? "" : ")") + ", with " + share +
         " % of the area of "
         "all faces that no part closes with by itself; " +
         (sewn.open.size() == 1 ? "it was" : "they were") + " left out.");
  }

  std::int32_t add_shape(const TopoDS_Shape& body, const std::string& name, const Paint& paint) {
    Shape out;
    out.name = name;
    out.paint = paint;
    std::ostringstream text;
    BRepTools::Write(body, text, Standard_False, Standard_False, TopTools_FormatVersion_VERSION_1);
    out.brep = text.str();
    Bnd_Box box;
    BRepBndLib::Add(body, box, Standard_False);
    if (!box.IsVoid() && !box.IsOpen()) out.size = std::sqrt(box.SquareExtent()) / 1000;
    scene_.shapes.push_back(std::move(out));
    return static_cast<std::int32_t>(scene_.shapes.size() - 1);
  }

  /// Checks and repairs a body; what comes of it may be several, or none.
  std::vector<TopoDS_Shape> finished(TopoDS_Shape body, const std::string& name) {
    std::vector<TopoDS_Shape> all{body};
    if (!is_valid(body)) {
      const double before = std::abs(signed_volume_of(body));
      if (heal_) {
        const Handle(ShapeFix_Shape) fix = new ShapeFix_Shape(body);
        fix->Perform();
        std::vector<TopoDS_Shape> fixed;
        double after = 0;
        if (!fix->Shape().IsNull())
          for (TopExp_Explorer e(fix->Shape(), TopAbs_SOLID); e.More(); e.Next()) {
            fixed.push_back(e.Current());
            after += std::abs(signed_volume_of(e.Current()));
          }
        const bool mended = !fixed.empty() && std::all_of(fixed.begin(), fixed.end(), is_valid);
        const double change = before > 0 ? after / before - 1 : 0;
        const bool is_same = std::abs(change) <= kSameVolume;
        // What a repair that failed made of it is no better than what the file says.
        if (mended || (is_same && !fixed.empty())) all = fixed;
        std::string text = "The solid " + quote(name) +
                           " is faulty and could not be repaired; "
                           "operations on it may fail.";
        if (mended) {
          text = "The solid " + quote(name) + " was faulty and was repaired";
          if (fixed.size() > 1) text += ", as " + std::to_string(fixed.size()) + " solids";
          if (!is_same)
            text += "; its volume is " + short_text(100 * std::abs(change)) + " % " +
                    (change > 0 ? "more" : "less") + " than before, check its shape";
          text += ".";
        }
        note(text);
      } else {
        note("The solid " + quote(name) + " is faulty; operations on it may fail.");
      }
    }
    std::erase_if(all, [&](TopoDS_Shape& s) { return !is_solid(s, name); });
    return all;
  }

  /// Turns it outwards; false when it encloses nothing.
  bool is_solid(TopoDS_Shape& body, const std::string& name) {
    double volume = signed_volume_of(body);
    if (volume < 0) {
      if (body.ShapeType() == TopAbs_SOLID) {
        TopoDS_Solid solid = TopoDS::Solid(body);
        if (BRepLib::OrientClosedSolid(solid)) body = solid;
        else body.Reverse();
      } else {
        body.Reverse();
      }
      volume = signed_volume_of(body);
      note("The solid " + quote(name) + " was inside out and was flipped.");
    }
    if (!(volume > kLeastVolume) || !std::isfinite(volume)) {
      note("The solid " + quote(name) + " encloses no volume; it was left out.");
      return false;
    }
    return true;
  }

  /// A colour given to an assembly is that of its parts without one.
  void inherit_paint() {
    for (Node& n : scene_.nodes) {
      if (n.paint.known || n.parent < 0) continue;
      const bool has_own =
          n.shape >= 0 && scene_.shapes[static_cast<std::size_t>(n.shape)].paint.known;
      if (!has_own) n.paint = scene_.nodes[static_cast<std::size_t>(n.parent)].paint;
    }
  }

  Handle(XCAFDoc_ShapeTool) shapes_;
  Handle(XCAFDoc_ColorTool) colours_;
  bool heal_;
  Progress& progress_;
  Scene scene_;
  std::unordered_map<std::string, Part> parts_;
  std::vector<TopoDS_Face> open_;  ///< what bodies_of() left
  std::vector<LeftOver> left_over_;
  std::size_t count_faces_only_ = 0, baked_count_ = 0;
};

Error not_read(IFSelect_ReturnStatus status, const char* format) {
  if (status == IFSelect_RetVoid)
    return error(ErrorCode::syntax,
                 std::string("the file contains nothing readable by ") + format + " knows",
                 "Check that it is complete.");
  return error(ErrorCode::syntax, std::string("the file is not readable as ") + format,
               "Check that it is complete and really of this format.");
}

template <class Reader>
Result<Scene> read_with(Reader& reader, const std::string& path, const char* format,
                        const ReadOptions& options, Progress& progress) {
  progress.report(0, "reading");
  reader.SetNameMode(Standard_True);
  reader.SetColorMode(Standard_True);
  const IFSelect_ReturnStatus status = reader.ReadFile(path.c_str());
  if (status != IFSelect_RetDone) return not_read(status, format);
  Handle(TDocStd_Document) document = new_document();
  const Handle(ProgressBridge) bridge = new ProgressBridge(progress, 0.3, 0.6, "building solids");
  if (!reader.Transfer(document, bridge->Start()))
    return progress.cancelled() ? error(ErrorCode::cancelled, "stopped")
                                : not_read(IFSelect_RetVoid, format);
  return CadReader(document, options.heal, progress).run();
}

}  // namespace

Result<Scene> read_cad(const std::string& path, const ReadOptions& options, Progress& progress) {
  prepare_occt();
  if (options.format == "igs" || options.format == "iges") {
    IGESCAFControl_Reader reader;
    return read_with(reader, path, "IGES", options, progress);
  }
  STEPCAFControl_Reader reader;
  return read_with(reader, path, "STEP", options, progress);
}

}  // namespace robomosp::cad_exchange
