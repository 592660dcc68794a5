// SPDX-License-Identifier: Apache-2.0
// Overlapping parts: every part loses what earlier parts already hold. Only parts whose boxes
// overlap by more than the kernel's tolerance pay for a boolean operation.
#include <algorithm>

#include "engine.h"
#include "plain_bounds.h"

#include <BRepBndLib.hxx>

namespace robomosp::csg_occt {
namespace {

// Parts that merely touch (boxes overlapping by no more than this [mm]) share no volume.
constexpr double kTouch = 1e-6;

struct Piece {
  Solid solid;    // in the common frame
  Bnd_Box tight;  // without tolerance
};

bool overlap(const Bnd_Box& a, const Bnd_Box& b) {
  const gp_Pnt al = a.CornerMin(), ah = a.CornerMax(), bl = b.CornerMin(), bh = b.CornerMax();
  for (int i = 1; i <= 3; ++i)
    if (std::min(ah.Coord(i), bh.Coord(i)) - std::max(al.Coord(i), bl.Coord(i)) <= kTouch)
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

}  // namespace

Result<CsgEngine::Partition> partition_solids(const std::vector<PlacedSolids>& parts,
                                              FaceMemory& faces, Progress& progress) {
  std::vector<std::vector<Piece>> pieces(parts.size());
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
  std::vector<std::vector<std::vector<const Piece*>>> rivals(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) rivals[i].resize(pieces[i].size());
  std::sort(order.begin(), order.end(), [](const Low& a, const Low& b) { return a.x < b.x; });
  std::vector<Low> active;
  for (const Low& now : order) {
    const Piece& mine = pieces[now.part][now.piece];
    std::erase_if(active, [&](const Low& other) {
      return pieces[other.part][other.piece].tight.CornerMax().X() <= now.x;
    });
    for (const Low& other : active) {
      const Piece& theirs = pieces[other.part][other.piece];
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
    Integrals whole, moved;  // untouched pieces in the part's frame, cut ones in the common frame
    for (std::size_t k = 0; k < pieces[i].size(); ++k) {
      if (progress.cancelled()) return cancelled_error();
      if (rivals[i][k].empty()) {
        whole.add(faces.of(parts[i].solids[k].shape));
        continue;
      }
      BooleanCall call;
      call.kind = CsgKind::difference;
      call.objects.push_back(pieces[i][k].solid);
      for (const Piece* p : rivals[i][k]) call.tools.push_back(p->solid);
      RMP_TRY_ASSIGN(const BooleanOutcome outcome,
                     run_boolean(call, faces, progress, at, at + step)
                         .in("overlap of part " + std::to_string(i) + " with earlier parts"));
      lost += pieces[i][k].solid.volume;
      for (const Solid& s : outcome.solids) {
        lost -= s.volume;
        moved.add(faces.of(s.shape));
      }
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
    result.parts.push_back(total);
  }
  result.overlap = std::max(0.0, lost) / 1e9;
  return result;
}

}  // namespace robomosp::csg_occt
