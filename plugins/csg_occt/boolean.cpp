// SPDX-License-Identifier: Apache-2.0
#include "boolean.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <memory>

#include <BOPAlgo_Builder.hxx>
#include <BOPAlgo_CellsBuilder.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepAlgoAPI_Common.hxx>
#include <BRepAlgoAPI_Cut.hxx>
#include <BRepAlgoAPI_Fuse.hxx>
#include <BRepBndLib.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepCheck_ListOfStatus.hxx>
#include <BRepCheck_Shell.hxx>
#include <BRepCheck_Solid.hxx>
#include <BRepClass3d_SolidClassifier.hxx>
#include <BRepTools.hxx>
#include <BRepTopAdaptor_FClass2d.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <NCollection_DataMap.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_ListOfShape.hxx>
#include <TopTools_ShapeMapHasher.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>

namespace robomosp::csg_occt {
namespace {

// From this many operands on OCCT's own threads pay (solids of 100 holes: 1.3 times).
constexpr std::size_t kParallelFrom = 24;
// Slack of the volume bounds, relative to the operands; wrong results miss by percents.
constexpr double kVolumeSlack = 1e-6;
// Taking surfaces as touching moves them by up to 1e-5 of the size.
constexpr double kFuzzyVolumeSlack = 1e-4;
// An edge blurred by more than this share of the size would blur the mass properties.
constexpr double kEdgeBlur = 1e-4;

// A point nearer to a surface than this [mm] says nothing about sides: a hundred tolerances.
constexpr double kOnSurface = 1e-5;

constexpr const char* kNotComputed = "Open CASCADE could not compute the operation";

double diagonal(const std::vector<Solid>& solids) {
  Bnd_Box box;
  for (const Solid& s : solids) box.Add(s.box);
  return box.IsVoid() ? 0 : std::sqrt(box.SquareExtent());
}

double largest_edge_tolerance(const TopoDS_Shape& shape) {
  double largest = 0;
  for (TopExp_Explorer e(shape, TopAbs_EDGE); e.More(); e.Next())
    largest = std::max(largest, BRep_Tool::Tolerance(TopoDS::Edge(e.Current())));
  return largest;
}

struct Trial {
  std::vector<Solid> solids;
  std::string fault;  ///< empty = valid
  bool blurred = false;
};

class Runner {
 public:
  Runner(const BooleanCall& call, FaceMemory& faces, Progress& progress, double from, double to)
      : call_(call), faces_(faces), progress_(progress), from_(from), to_(to) {
    for (const Solid& s : call.objects) objects_.Append(s.shape);
    for (const Solid& s : call.tools) tools_.Append(s.shape);
    size_ = std::max(diagonal(call.objects), diagonal(call.tools));
  }

  Result<BooleanOutcome> run() {
    Trial first = attempt(objects_, tools_, 0);
    if (progress_.cancelled()) return cancelled_error();
    if (first.fault.empty() && !first.blurred) return BooleanOutcome{std::move(first.solids), {}};
    for (const BooleanCall::Turned& turn : call_.turned) {
      TopTools_ListOfShape objects, tools;
      for (const TopoDS_Shape& s : turn.objects) objects.Append(s);
      for (const TopoDS_Shape& s : turn.tools) tools.Append(s);
      Trial turned = attempt(objects, tools, 0);
      if (progress_.cancelled()) return cancelled_error();
      if (turned.fault.empty() && !turned.blurred)
        return BooleanOutcome{std::move(turned.solids), "poles and seams were moved aside"};
    }
    if (first.fault.empty())
      return BooleanOutcome{std::move(first.solids),
                            "intersection curves are less accurate than usual"};
    Trial pieced = attempt(objects_, tools_, 0, true);
    if (progress_.cancelled()) return cancelled_error();
    if (pieced.fault.empty() && !pieced.blurred)
      return BooleanOutcome{
          std::move(pieced.solids),
          "the result was assembled from the parts into which its solids cut each other"};
    for (const double share : {1e-6, 1e-5}) {
      Trial healed = attempt(objects_, tools_, share * size_);
      if (progress_.cancelled()) return cancelled_error();
      if (healed.fault.empty())
        return BooleanOutcome{std::move(healed.solids),
                              "surfaces nearer than " +
                                  csg_number_text(share * size_ / kMillimetresPerMetre) +
                                  " m were taken as touching"};
    }
    return error(ErrorCode::plugin_failed, first.fault,
                 "Faces that nearly but not quite coincide are the usual cause: move or resize an "
                 "operand slightly, or make them coincide exactly.");
  }

 private:
  Trial attempt(const TopTools_ListOfShape& objects, const TopTools_ListOfShape& tools,
                double fuzzy, bool from_cells = false) {
    Trial trial;
    used_objects_ = &objects;
    used_tools_ = &tools;
    try {
      const Handle(ProgressBridge) bridge =
          new ProgressBridge(progress_, from_, to_, "combining solids");
      if (from_cells) take_cells(objects, tools, bridge->Start(), trial);
      else operate(objects, tools, fuzzy, bridge->Start(), trial);
    } catch (const Standard_Failure& e) {
      trial.fault =
          std::string(kNotComputed) + ": " + (e.GetMessageString() ? e.GetMessageString() : "");
    }
    return trial;
  }

  void operate(const TopTools_ListOfShape& objects, const TopTools_ListOfShape& tools, double fuzzy,
               const Message_ProgressRange& range, Trial& trial) {
    std::unique_ptr<BRepAlgoAPI_BooleanOperation> op;
    switch (call_.kind) {
      case CsgKind::union_: op = std::make_unique<BRepAlgoAPI_Fuse>(); break;
      case CsgKind::difference: op = std::make_unique<BRepAlgoAPI_Cut>(); break;
      default: op = std::make_unique<BRepAlgoAPI_Common>(); break;
    }
    op->SetArguments(objects);
    op->SetTools(tools);
    op->SetNonDestructive(true);
    op->SetToFillHistory(false);
    op->SetFuzzyValue(fuzzy);
    // Every operand has been measured: its volume is positive, so it is not inside out.
    op->SetCheckInverted(false);
    op->SetRunParallel(is_big());
    op->Build(range);
    if (progress_.cancelled()) return;
    if (!op->IsDone() || op->HasErrors()) trial.fault = kNotComputed;
    else inspect(op->Shape(), *op->Builder(), fuzzy, trial);
  }

  // OCCT's operations build shells from all faces left over and take two solids that touch along a
  // line, as a cylinder and a plane tangent to it, for a solid with a void. The cells that the
  // operands cut each other into are sound then.
  void take_cells(const TopTools_ListOfShape& objects, const TopTools_ListOfShape& tools,
                  const Message_ProgressRange& range, Trial& trial) {
    BOPAlgo_CellsBuilder cells;
    cells.SetArguments(objects);
    for (const TopoDS_Shape& tool : tools) cells.AddArgument(tool);
    cells.SetNonDestructive(true);
    cells.SetToFillHistory(false);
    cells.SetCheckInverted(false);
    cells.SetRunParallel(is_big());
    cells.Perform(range);
    if (progress_.cancelled()) return;
    if (cells.HasErrors()) {
      trial.fault = kNotComputed;
      return;
    }
    constexpr int kMaterial = 1;  // cells of one material become one solid
    const auto take = [&](std::initializer_list<TopoDS_Shape> within,
                          const TopTools_ListOfShape& outside) {
      TopTools_ListOfShape inside;
      for (const TopoDS_Shape& s : within) inside.Append(s);
      cells.AddToResult(inside, outside, kMaterial);
    };
    const TopTools_ListOfShape nothing;
    if (call_.kind == CsgKind::union_) cells.AddAllToResult(kMaterial);
    else
      for (const TopoDS_Shape& object : objects) {
        if (call_.kind == CsgKind::difference) take({object}, tools);
        else
          for (const TopoDS_Shape& tool : tools) take({object, tool}, nothing);
      }
    cells.RemoveInternalBoundaries();
    if (cells.HasErrors()) trial.fault = kNotComputed;
    else inspect(cells.Shape(), cells, 0, trial);
  }

  void inspect(const TopoDS_Shape& shape, const BOPAlgo_Builder& splits, double fuzzy,
               Trial& trial) {
    if (shape.IsNull()) {
      trial.fault = kNotComputed;
      return;
    }
    if (TopExp_Explorer(shape, TopAbs_FACE, TopAbs_SOLID).More()) {
      trial.fault = "the result has faces that enclose no volume";
      return;
    }
    double volume = 0;
    for (TopExp_Explorer e(shape, TopAbs_SOLID); e.More(); e.Next()) {
      Solid solid = measured(e.Current(), faces_, progress_);
      if (solid.volume <= 0) {
        trial.fault = "the result has a piece that is inside out";
        return;
      }
      volume += solid.volume;
      trial.solids.push_back(std::move(solid));
    }
    check_volume(volume, splits, fuzzy, trial);
    if (trial.fault.empty() && has_missed_crossing(splits))
      trial.fault = "Open CASCADE missed an intersection of two operands";
    if (!trial.fault.empty() || trial.solids.empty()) return;
    if (!is_valid(trial.solids)) {
      trial.fault = "the result is not a valid solid";
      return;
    }
    for (const Solid& solid : trial.solids) faces_.set_verified(solid.shape);
    trial.blurred = largest_edge_tolerance(shape) > kEdgeBlur * size_;
  }

  // What BRepCheck_Analyzer does for a solid, without checking again the faces that came unchanged
  // out of a solid that has passed.
  bool is_valid(const std::vector<Solid>& solids) {
    BRep_Builder builder;
    TopoDS_Compound fresh;
    builder.MakeCompound(fresh);
    for (const Solid& solid : solids) {
      for (TopExp_Explorer e(solid.shape, TopAbs_FACE); e.More(); e.Next())
        if (!faces_.is_verified(e.Current())) builder.Add(fresh, e.Current());
      for (TopExp_Explorer e(solid.shape, TopAbs_SHELL); e.More(); e.Next()) {
        const Handle(BRepCheck_Shell) shell = new BRepCheck_Shell(TopoDS::Shell(e.Current()));
        if (shell->Closed() != BRepCheck_NoError || shell->Orientation() != BRepCheck_NoError)
          return false;
      }
      const Handle(BRepCheck_Solid) whole = new BRepCheck_Solid(TopoDS::Solid(solid.shape));
      whole->Minimum();
      for (const BRepCheck_Status status : whole->Status())
        if (status != BRepCheck_NoError) return false;
    }
    return BRepCheck_Analyzer(fresh, true, is_big()).IsValid();
  }
  bool is_big() const { return call_.objects.size() + call_.tools.size() >= kParallelFrom; }

  // The operation splits its operands into cells. Those of one operand must fill it, and the
  // result must have the volume of the cells it is made of. Of 600 operations on grid-snapped
  // solids one passes every other check here with a quarter of its volume missing.
  void check_volume(double volume, const BOPAlgo_Builder& splits, double fuzzy,
                    Trial& trial) const {
    struct Cell {
      double volume = 0;
      bool in_object = false, in_tool = false;
    };
    NCollection_DataMap<TopoDS_Shape, Cell, TopTools_ShapeMapHasher> cells;
    double operands = 0;
    for (const Solid& s : call_.objects) operands += s.volume;
    for (const Solid& s : call_.tools) operands += s.volume;
    const double slack = (fuzzy > 0 ? kFuzzyVolumeSlack : kVolumeSlack) * operands;
    const auto enter = [&](const TopTools_ListOfShape& list, const std::vector<Solid>& solids,
                           bool is_object) {
      std::size_t i = 0;
      for (const TopoDS_Shape& operand : list) {
        TopTools_ListOfShape whole;
        whole.Append(operand);
        const TopTools_ListOfShape* parts = splits.Images().Seek(operand);
        double filled = 0;
        for (const TopoDS_Shape& part : parts ? *parts : whole) {
          const TopoDS_Shape* same = splits.ShapesSD().Seek(part);
          const TopoDS_Shape& shape = same ? *same : part;
          Cell* cell = cells.ChangeSeek(shape);
          if (!cell) {
            cells.Bind(shape, {std::abs(faces_.of(shape, progress_).volume)});
            cell = cells.ChangeSeek(shape);
          }
          (is_object ? cell->in_object : cell->in_tool) = true;
          filled += cell->volume;
        }
        if (std::abs(filled - solids[i++].volume) > slack)
          trial.fault = "an operand was split into pieces that do not fill it";
      }
    };
    enter(*used_objects_, call_.objects, true);
    enter(*used_tools_, call_.tools, false);
    double expected = 0;
    for (decltype(cells)::Iterator it(cells); it.More(); it.Next()) {
      const Cell& cell = it.Value();
      const bool wanted = call_.kind == CsgKind::union_       ? true
                          : call_.kind == CsgKind::difference ? cell.in_object && !cell.in_tool
                                                              : cell.in_object && cell.in_tool;
      if (wanted) expected += cell.volume;
    }
    if (std::abs(volume - expected) > slack)
      trial.fault = "the result has a volume of " + csg_number_text(volume / 1e9) +
                    " m^3, but its pieces have " + csg_number_text(expected / 1e9) + " m^3";
    double low = 0, high = operands;
    for (const Solid& s : call_.objects) low = std::max(low, s.volume);
    if (call_.kind == CsgKind::union_ && volume < low - slack)
      trial.fault = "the union is smaller than one of its solids";
    if (call_.kind != CsgKind::union_) {
      high = 0;
      for (const Solid& s : call_.objects) high += s.volume;
      if (volume > high + slack)
        trial.fault = "the result is larger than the solid it was cut from";
    }
  }

  struct Operand {
    TopoDS_Shape shape;
    const Solid* solid;
    bool is_whole;  ///< came out of the operation in one piece
  };

  // Operands that no other one divides are either apart from it or wholly inside it. Now and then
  // OCCT loses an intersection without a word and takes two that cross for two that are apart; all
  // volumes agree then, so that only points tell.
  bool has_missed_crossing(const BOPAlgo_Builder& splits) const {
    std::vector<Operand> operands;
    const auto enter = [&](const TopTools_ListOfShape& list, const std::vector<Solid>& solids) {
      std::size_t i = 0;
      for (const TopoDS_Shape& shape : list) {
        const TopTools_ListOfShape* parts = splits.Images().Seek(shape);
        operands.push_back({shape, &solids[i++], !parts || parts->Extent() == 1});
      }
    };
    enter(*used_objects_, call_.objects);
    enter(*used_tools_, call_.tools);
    for (const Operand& a : operands) {
      if (!a.is_whole) continue;
      for (const Operand& b : operands) {
        if (&a == &b || (b.is_whole && &b < &a) || !boxes_meet(a.solid->box, b.solid->box))
          continue;
        const Sides of_a = sides(a, b), of_b = sides(b, a);
        const bool cross = of_a.cross() || of_b.cross();
        const bool inside = b.is_whole && (of_a.inside >= kWitnesses || of_b.inside >= kWitnesses);
        if (cross || inside) return true;
      }
    }
    return false;
  }

  // One point could be misjudged.
  static constexpr int kWitnesses = 2;
  struct Sides {
    int inside = 0, outside = 0, on = 0;
    bool cross() const { return inside >= kWitnesses && outside >= kWitnesses; }
  };

  /// Points on the surface of `a`, by where they are in `b`.
  Sides sides(const Operand& a, const Operand& b) const {
    constexpr int kPerFace = 5, kMostFaces = 40;
    int faces = 0;
    for (TopExp_Explorer e(a.shape, TopAbs_FACE); e.More(); e.Next()) ++faces;
    const int stride = faces / kMostFaces + 1;
    Sides count;
    std::unique_ptr<BRepClass3d_SolidClassifier> solid;
    int number = 0;
    for (TopExp_Explorer e(a.shape, TopAbs_FACE); e.More(); e.Next()) {
      if (number++ % stride != 0) continue;
      const TopoDS_Face& face = TopoDS::Face(e.Current());
      double u0 = 0, u1 = 0, v0 = 0, v1 = 0;
      BRepTools::UVBounds(face, u0, u1, v0, v1);
      const BRepAdaptor_Surface surface(face, false);
      const BRepTopAdaptor_FClass2d trim(face, BRep_Tool::Tolerance(face));
      for (int i = 0; i < kPerFace; ++i)
        for (int k = 0; k < kPerFace; ++k) {
          const gp_Pnt2d uv(u0 + (u1 - u0) * (i + 0.47) / kPerFace,
                            v0 + (v1 - v0) * (k + 0.53) / kPerFace);
          if (trim.Perform(uv) != TopAbs_IN) continue;
          const gp_Pnt p = surface.Value(uv.X(), uv.Y());
          if (b.solid->box.IsOut(p)) {
            ++count.outside;
            continue;
          }
          if (!solid) solid = std::make_unique<BRepClass3d_SolidClassifier>(b.shape);
          solid->Perform(p, kOnSurface);
          if (solid->State() == TopAbs_IN) ++count.inside;
          else if (solid->State() == TopAbs_OUT) ++count.outside;
          else ++count.on;
          if (count.cross()) return count;
        }
    }
    return count;
  }

  const BooleanCall& call_;
  FaceMemory& faces_;
  Progress& progress_;
  double from_, to_, size_ = 0;
  TopTools_ListOfShape objects_, tools_;
  const TopTools_ListOfShape *used_objects_ = nullptr, *used_tools_ = nullptr;
};

}  // namespace

Solid measured(const TopoDS_Shape& shape, FaceMemory& faces) {
  return measured(shape, faces, NoProgress());
}

Solid measured(const TopoDS_Shape& shape, FaceMemory& faces, const Progress& progress) {
  Solid solid{shape, {}, faces.of(shape, progress).volume};
  BRepBndLib::Add(shape, solid.box, false);
  return solid;
}

bool boxes_meet(const Bnd_Box& a, const Bnd_Box& b) {
  return !a.IsVoid() && !b.IsVoid() && !a.IsOut(b);
}

Result<BooleanOutcome> run_boolean(const BooleanCall& call, FaceMemory& faces, Progress& progress,
                                   double from, double to) {
  return Runner(call, faces, progress, from, to).run();
}

}  // namespace robomosp::csg_occt
