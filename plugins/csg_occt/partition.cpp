// SPDX-License-Identifier: Apache-2.0
// Overlapping parts: every part loses what earlier parts already hold. Only parts whose boxes
// overlap by more than the kernel's tolerance pay for a boolean operation. What no boolean
// operation can cut, or none in a reasonable time, is measured along lines and bounded.
#include <algorithm>
#include <chrono>
#include <cmath>

#include "engine.h"
#include "overlap_estimate.h"
#include "plain_bounds.h"

#include <BRepAdaptor_Surface.hxx>
#include <BRepBndLib.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>

namespace robomosp::csg_occt {
namespace {

// Parts that merely touch (boxes overlapping by no more than this [mm]) share no volume.
constexpr double kPartitionTouch = 1e-6;

struct CutPiece {
  Solid solid;    // in the common frame
  Bnd_Box tight;  // without tolerance
};

bool overlap(const Bnd_Box& a, const Bnd_Box& b) {
  const gp_Pnt al = a.CornerMin(), ah = a.CornerMax(), bl = b.CornerMin(), bh = b.CornerMax();
  for (int i = 1; i <= 3; ++i)
    if (std::min(ah.Coord(i), bh.Coord(i)) - std::max(al.Coord(i), bl.Coord(i)) <= kPartitionTouch)
      return false;
  return true;
}

Bnd_Box tight_box(const TopoDS_Shape& shape) {
  Bnd_Box box;
  try {
    BRepBndLib::AddOptimal(shape, box, false, false);
  } catch (const Standard_Failure&) {
    box.SetVoid();
  }
  if (box.IsVoid()) BRepBndLib::Add(shape, box, false);
  box.SetGap(0);
  return box;
}

/// How long one boolean operation may take before its overlap is measured instead.
constexpr std::chrono::seconds kPatience{15};

/// Ends when it is cancelled or patience does.
class Patience final : public Progress {
 public:
  explicit Patience(Progress& to) : to_(to), end_(std::chrono::steady_clock::now() + kPatience) {}
  void report(double fraction, std::string_view what) override { to_.report(fraction, what); }
  [[nodiscard]] bool cancelled() const override {
    return to_.cancelled() || std::chrono::steady_clock::now() > end_;
  }

 private:
  Progress& to_;
  std::chrono::steady_clock::time_point end_;
};

/// True when freeform faces of one solid come near faces of the other. Of two that touch, boolean
/// operations take seconds to find a sliver or nothing, and their integrals are approximations.
bool freeform_meet(const Solid& a, const std::vector<const CutPiece*>& others) {
  struct Near {
    Bnd_Box box;
    bool is_freeform;
  };
  const auto near = [](const TopoDS_Shape& shape, const Bnd_Box& to) {
    std::vector<Near> out;
    for (TopExp_Explorer e(shape, TopAbs_FACE); e.More(); e.Next()) {
      Bnd_Box box;
      BRepBndLib::Add(e.Current(), box, false);
      if (box.IsOut(to)) continue;
      const BRepAdaptor_Surface surface(TopoDS::Face(e.Current()), false);
      out.push_back({box, surface.GetType() >= GeomAbs_BezierSurface});
    }
    return out;
  };
  for (const CutPiece* p : others)
    for (const Near& mine : near(a.shape, p->solid.box))
      for (const Near& theirs : near(p->solid.shape, a.box))
        if ((mine.is_freeform || theirs.is_freeform) && !mine.box.IsOut(theirs.box)) return true;
  return false;
}

/// What is left of a piece: by measuring where cutting fails. `deviation` grows by what the volume
/// may be off [mm^3].
Result<Integrals> remainder(const CutPiece& piece, const std::vector<const CutPiece*>& rivals,
                            FaceMemory& faces, Progress& progress, double from, double to,
                            double& deviation) {
  std::vector<const Solid*> others;
  for (const CutPiece* p : rivals) others.push_back(&p->solid);
  const auto measured_rest = [&](const SharedVolume& shared) {
    Integrals rest = faces.of(piece.solid.shape);
    const Integrals& m = shared.moments;
    rest.volume -= m.volume;
    for (std::size_t i = 0; i < 3; ++i) rest.first[i] -= m.first[i];
    for (std::size_t i = 0; i < 6; ++i) rest.second[i] -= m.second[i];
    deviation += shared.deviation;
    return rest;
  };
  if (freeform_meet(piece.solid, rivals)) {
    RMP_TRY_ASSIGN(SharedVolume shared, measure_shared(piece.solid, others, progress));
    if (shared.is_contact()) return measured_rest(shared);
  }
  BooleanCall call;
  call.kind = CsgKind::difference;
  call.objects.push_back(piece.solid);
  for (const Solid* s : others) call.tools.push_back(*s);
  Patience patience(progress);
  const auto outcome = guarded("separating overlapping parts",
                               [&] { return run_boolean(call, faces, patience, from, to); });
  if (progress.cancelled()) return cancelled_error();
  if (!outcome.ok()) {
    RMP_TRY_ASSIGN(const SharedVolume shared, measure_shared(piece.solid, others, progress));
    return measured_rest(shared);
  }
  Integrals rest;
  for (const Solid& s : outcome->solids) rest.add(faces.of(s.shape));
  return rest;
}

}  // namespace

Result<CsgEngine::Partition> partition_solids(const std::vector<PlacedSolids>& parts,
                                              FaceMemory& faces, Progress& progress) {
  std::vector<std::vector<CutPiece>> pieces(parts.size());
  struct Low {
    double x;
    std::size_t part, piece;
  };
  std::vector<Low> order;
  PlainBounds plain;
  for (std::size_t i = 0; i < parts.size(); ++i)
    for (const Solid& s : parts[i].solids) {
      const TopoDS_Shape shape = placed(s.shape, parts[i].pose);
      Bnd_Box tight;
      if (!plain.widen(tight, s.shape, parts[i].pose)) tight = tight_box(shape);
      order.push_back({tight.CornerMin().X(), i, pieces[i].size()});
      pieces[i].push_back({{shape, s.box.Transformed(parts[i].pose), s.volume}, tight});
    }

  // Sweep along x; rivals[i][k] are the earlier pieces that may take volume from piece k of i.
  std::vector<std::vector<std::vector<const CutPiece*>>> rivals(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) rivals[i].resize(pieces[i].size());
  std::sort(order.begin(), order.end(), [](const Low& a, const Low& b) { return a.x < b.x; });
  std::vector<Low> active;
  for (const Low& now : order) {
    const CutPiece& mine = pieces[now.part][now.piece];
    std::erase_if(active, [&](const Low& other) {
      return pieces[other.part][other.piece].tight.CornerMax().X() <= now.x;
    });
    for (const Low& other : active) {
      const CutPiece& theirs = pieces[other.part][other.piece];
      if (other.part == now.part || !overlap(mine.tight, theirs.tight)) continue;
      if (other.part < now.part) rivals[now.part][now.piece].push_back(&theirs);
      else rivals[other.part][other.piece].push_back(&mine);
    }
    active.push_back(now);
  }

  CsgEngine::Partition result;
  double lost = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const double at = static_cast<double>(i) / static_cast<double>(parts.size());
    const double step = 1.0 / static_cast<double>(parts.size());
    progress.report(at, "separating overlapping parts");
    double deviation = 0;    // of the volume, where it was measured [mm^3]
    Integrals whole, moved;  // untouched pieces in the part's frame, cut ones in the common frame
    for (std::size_t k = 0; k < pieces[i].size(); ++k) {
      if (progress.cancelled()) return cancelled_error();
      if (rivals[i][k].empty()) {
        whole.add(faces.of(parts[i].solids[k].shape));
        continue;
      }
      RMP_TRY_ASSIGN(const Integrals rest, remainder(pieces[i][k], rivals[i][k], faces, progress,
                                                     at, at + step, deviation));
      lost += pieces[i][k].solid.volume - rest.volume;
      moved.add(rest);
    }
    const double extent = extent_of(parts[i].solids);
    Moments total = to_moments(whole, parts[i].pose, extent);
    const Moments cut = to_moments(moved, gp_Trsf(), extent);
    total.volume += cut.volume;
    total.area += cut.area;
    for (std::size_t k = 0; k < 3; ++k) total.first[k] += cut.first[k];
    total.second.xx += cut.second.xx;
    total.second.yy += cut.second.yy;
    total.second.zz += cut.second.zz;
    total.second.xy += cut.second.xy;
    total.second.yz += cut.second.yz;
    total.second.xz += cut.second.xz;
    total.exact = total.exact && cut.exact;
    total.relative_error = std::max(total.relative_error, cut.relative_error);
    if (deviation > 0) {
      total.exact = false;
      total.relative_error += total.volume > 0 ? deviation / 1e9 / total.volume : 1;
    }
    result.parts.push_back(total);
  }
  result.overlap = std::max(0.0, lost) / 1e9;
  return result;
}

}  // namespace robomosp::csg_occt
