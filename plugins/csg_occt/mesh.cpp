// SPDX-License-Identifier: Apache-2.0
// Display meshes: OCCT's triangulation joined by topology, so that neighbouring faces share the
// same positions to the bit, with surface normals and the sharp edges.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <span>
#include <unordered_map>

#include "engine.h"
#include "face_mesher.h"
#include "grid_mesher.h"
#include "touching.h"

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepBuilderAPI_Copy.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <IMeshTools_Parameters.hxx>
#include <NCollection_DataMap.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <Poly_TriangulationParameters.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopTools_ShapeMapHasher.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Iterator.hxx>

namespace robomosp::csg_occt {
namespace {

// Finer than this share of the solid's size a mesh would have tens of millions of triangles.
constexpr double kFinestChordShare = 1e-7;
constexpr double kFinestAngle = 0.005;
constexpr int kParallelFromFaces = 48;
// Faces that meet at less than this angle [rad] are drawn as one smooth surface.
constexpr double kSmoothAngle = 0.01;
constexpr double kSurfaceKeyQuantum = 1e-6;  // [mm] and [-]

using NodeIds = std::vector<std::uint32_t>;

IMeshTools_Parameters parameters(const MeshQuality& quality, bool delabella, int faces) {
  IMeshTools_Parameters p;
  p.Deflection = quality.chord * kMillimetresPerMetre;
  p.Angle = quality.angle;
  p.InParallel = faces >= kParallelFromFaces;
  p.MeshAlgo = delabella ? IMeshTools_MeshAlgoType_Delabella : IMeshTools_MeshAlgoType_Watson;
  return p;
}

bool is_unmeshed(const TopoDS_Face& face) {
  TopLoc_Location location;
  const auto& mesh = BRep_Tool::Triangulation(face, location);
  return mesh.IsNull() || mesh->NbTriangles() == 0;
}

/// Faces that have no triangles yet.
struct Unmeshed {
  std::vector<TopoDS_Face> faces;
  bool has_other_quality = false;  ///< some face was meshed for another one
};

Unmeshed find_unmeshed(const TopoDS_Shape& shape, const MeshQuality& quality) {
  const double deflection = quality.chord * kMillimetresPerMetre;
  Unmeshed out;
  for (TopExp_Explorer e(shape, TopAbs_FACE); e.More(); e.Next()) {
    const TopoDS_Face& face = TopoDS::Face(e.Current());
    TopLoc_Location location;
    const auto& mesh = BRep_Tool::Triangulation(face, location);
    if (!mesh.IsNull()) {
      const auto& made = mesh->Parameters();
      if (made.IsNull() || made->Deflection() != deflection || made->Angle() != quality.angle)
        out.has_other_quality = true;
    }
    if (mesh.IsNull() || mesh->NbTriangles() == 0) out.faces.push_back(face);
  }
  return out;
}

// Delabella is ten times faster than Watson but now and then leaves a face empty. `own` lets
// the project's own meshers do what they can.
Result<void> triangulate(const TopoDS_Shape& shape, const std::vector<TopoDS_Face>& faces,
                         const MeshQuality& quality, bool own, bool delabella, Progress& progress) {
  if (faces.empty()) return {};
  BRep_Builder builder;
  TopoDS_Compound fresh;
  builder.MakeCompound(fresh);
  int others = 0;
  std::vector<TopoDS_Face> plain;
  for (const TopoDS_Face& face : faces) {
    if (!is_unmeshed(face)) continue;  // it stands at several places
    if (own && is_plain_face(face)) {
      plain.push_back(face);
    } else if (!own || !mesh_grid_face(face, quality)) {
      builder.Add(fresh, face);
      ++others;
    }
  }
  // Only the new faces: OCCT discretises an edge by its curve alone, so that they fit the old
  // ones; the caller checks that they do.
  if (others > 0) {
    const Handle(ProgressBridge) bridge = new ProgressBridge(progress, 0, 0.8, "meshing");
    const BRepMesh_IncrementalMesh mesher(fresh, parameters(quality, delabella, others),
                                          bridge->Start());
  }
  for (const TopoDS_Face& face : plain) {
    if (progress.cancelled()) break;
    // A face that stands at several places is one face: its mesh is that of them all, and another
    // one would only leave the polygons of the first on its edges.
    if (is_unmeshed(face)) mesh_plain_face(face, quality);
  }
  if (progress.cancelled()) {
    BRepTools::Clean(shape);
    return cancelled_error();
  }
  for (const TopoDS_Face& face : faces) {
    if (!is_unmeshed(face)) continue;
    const BRepMesh_IncrementalMesh again(face, parameters(quality, false, 1));
  }
  const Handle(Poly_TriangulationParameters) made =
      new Poly_TriangulationParameters(quality.chord * kMillimetresPerMetre, quality.angle);
  for (const TopoDS_Face& face : faces) {
    TopLoc_Location location;
    const auto& mesh = BRep_Tool::Triangulation(face, location);
    if (!mesh.IsNull()) mesh->Parameters(made);
  }
  return {};
}

/// Identity of a surface, so that a face keeps its number while others change.
std::uint64_t surface_key(const BRepAdaptor_Surface& surface, bool reversed) {
  Key key;
  const auto put = [&](double x) {
    key.mix(static_cast<std::uint64_t>(std::llround(x / kSurfaceKeyQuantum)));
  };
  const auto put_xyz = [&](const gp_XYZ& v) {
    for (int i = 1; i <= 3; ++i) put(v.Coord(i));
  };
  // An axis has no preferred sign or point: take the direction with its first component positive
  // and the point nearest to the origin.
  const auto put_axis = [&](const gp_Ax1& axis) {
    gp_XYZ d = axis.Direction().XYZ();
    for (int i = 1; i <= 3; ++i) {
      if (std::abs(d.Coord(i)) < kSurfaceKeyQuantum) continue;
      if (d.Coord(i) < 0) d.Reverse();
      break;
    }
    const gp_XYZ p = axis.Location().XYZ();
    put_xyz(d);
    put_xyz(p - d * p.Dot(d));
  };
  key.mix(static_cast<std::uint64_t>(surface.GetType()));
  key.mix(static_cast<std::uint64_t>(reversed));
  switch (surface.GetType()) {
    case GeomAbs_Plane: {
      const gp_Pln plane = surface.Plane();
      const gp_XYZ n =
          plane.Position().XDirection().XYZ().Crossed(plane.Position().YDirection().XYZ());
      put_xyz(n);
      put(n.Dot(plane.Location().XYZ()));
      break;
    }
    case GeomAbs_Cylinder:
      put_axis(surface.Cylinder().Axis());
      put(surface.Cylinder().Radius());
      break;
    case GeomAbs_Cone:
      put_axis(surface.Cone().Axis());
      put_xyz(surface.Cone().Apex().XYZ());
      put(surface.Cone().SemiAngle());
      break;
    case GeomAbs_Sphere:
      put_xyz(surface.Sphere().Location().XYZ());
      put(surface.Sphere().Radius());
      break;
    case GeomAbs_Torus:
      put_axis(surface.Torus().Axis());
      put_xyz(surface.Torus().Location().XYZ());
      put(surface.Torus().MajorRadius());
      put(surface.Torus().MinorRadius());
      break;
    default: break;
  }
  return key.a;
}

/// The mesh of solids that may share edges. Those that lie apart have one each: what topology is
/// looked up in then stays in the processor's caches, however many there are.
class MeshBuilder {
 public:
  MeshBuilder(const TopoDS_Shape& shape, const gp_Trsf& pose, double chord)
      : shape_(shape), pose_(pose), chord_(chord) {}

  /// False when the triangulation does not close.
  bool run() {
    TopExp::MapShapesAndUniqueAncestors(shape_, TopAbs_EDGE, TopAbs_FACE, edge_faces_);
    for (TopExp_Explorer e(shape_, TopAbs_FACE); e.More(); e.Next())
      if (!add_face(TopoDS::Face(e.Current()))) return false;
    if (has_empty_face_ || !is_closed()) {
      if (!close_faces() || !is_closed()) return false;
    }
    add_edges();
    return true;
  }
  /// What run() made, behind what `mesh` holds; `centres` of faces as in mesh.faces.
  void append_to(Mesh& mesh, std::vector<gp_XYZ>& centres) {
    if (mesh.vertex_count() == 0 && mesh.faces.empty()) {
      mesh = std::move(mesh_);
      centres = std::move(face_centres_);
      return;
    }
    const auto vertices = static_cast<std::uint32_t>(mesh.vertex_count()),
               triangles = static_cast<std::uint32_t>(mesh.triangle_count());
    for (std::uint32_t& v : mesh_.triangles) v += vertices;
    for (Mesh::Face& f : mesh_.faces) f.first_triangle += triangles;
    const auto append = [](auto& to, const auto& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    append(mesh.positions, mesh_.positions);
    append(mesh.normals, mesh_.normals);
    append(mesh.triangles, mesh_.triangles);
    append(mesh.faces, mesh_.faces);
    append(mesh.edge_points, mesh_.edge_points);
    append(mesh.edge_sizes, mesh_.edge_sizes);
    append(centres, face_centres_);
  }

 private:
  std::uint32_t new_id(const gp_Pnt& p) {
    points_.push_back(p.Transformed(pose_));
    return static_cast<std::uint32_t>(points_.size() - 1);
  }

  std::uint32_t vertex_id(const TopoDS_Vertex& vertex) {
    const TopoDS_Shape key = vertex.Oriented(TopAbs_FORWARD);
    if (const std::uint32_t* id = vertex_ids_.Seek(key)) return *id;
    const std::uint32_t id = new_id(BRep_Tool::Pnt(vertex));
    vertex_ids_.Bind(key, id);
    return id;
  }

  /// Ids of the nodes along an edge, from its first to its last parameter.
  const NodeIds* edge_ids(const TopoDS_Edge& edge, const TColStd_Array1OfInteger& nodes,
                          const Handle(Poly_Triangulation) & mesh, const gp_Trsf& location) {
    const TopoDS_Edge key = TopoDS::Edge(edge.Oriented(TopAbs_FORWARD));
    if (const NodeIds* ids = edge_ids_.Seek(key))
      return ids->size() == static_cast<std::size_t>(nodes.Length()) ? ids : nullptr;
    NodeIds ids;
    const TopoDS_Vertex first = TopExp::FirstVertex(key), last = TopExp::LastVertex(key);
    const bool degenerated = BRep_Tool::Degenerated(key);
    for (int i = nodes.Lower(); i <= nodes.Upper(); ++i) {
      if (degenerated || (i == nodes.Lower() && !first.IsNull())) ids.push_back(vertex_id(first));
      else if (i == nodes.Upper() && !last.IsNull()) ids.push_back(vertex_id(last));
      else ids.push_back(new_id(mesh->Node(nodes(i)).Transformed(location)));
    }
    edge_ids_.Bind(key, ids);
    return edge_ids_.Seek(key);
  }

  bool add_face(const TopoDS_Face& face) {
    faces_.push_back(face);
    TopLoc_Location place;
    const Handle(Poly_Triangulation) mesh = BRep_Tool::Triangulation(face, place);
    if (mesh.IsNull() || mesh->NbTriangles() == 0) {
      has_empty_face_ = true;
      Mesh::Face none;
      none.first_triangle = static_cast<std::uint32_t>(mesh_.triangle_count());
      none.id =
          surface_key(BRepAdaptor_Surface(face, false), face.Orientation() == TopAbs_REVERSED);
      mesh_.faces.push_back(none);
      face_centres_.emplace_back(0, 0, 0);
      return true;
    }
    const gp_Trsf location = place.Transformation();
    const bool reversed = face.Orientation() == TopAbs_REVERSED;
    constexpr std::uint32_t kNone = ~std::uint32_t{0};
    NodeIds ids(static_cast<std::size_t>(mesh->NbNodes()), kNone);
    for (TopExp_Explorer e(face.Oriented(TopAbs_FORWARD), TopAbs_EDGE); e.More(); e.Next()) {
      const TopoDS_Edge& edge = TopoDS::Edge(e.Current());
      const auto polygon = BRep_Tool::PolygonOnTriangulation(edge, mesh, place);
      if (polygon.IsNull()) continue;
      const auto& nodes = polygon->Nodes();
      const NodeIds* shared = edge_ids(edge, nodes, mesh, location);
      if (!shared) return false;
      for (int i = nodes.Lower(); i <= nodes.Upper(); ++i)
        ids[static_cast<std::size_t>(nodes(i) - 1)] =
            (*shared)[static_cast<std::size_t>(i - nodes.Lower())];
    }
    for (int i = 1; i <= mesh->NbNodes(); ++i)
      if (std::uint32_t& id = ids[static_cast<std::size_t>(i - 1)]; id == kNone)
        id = new_id(mesh->Node(i).Transformed(location));

    const auto base = static_cast<std::uint32_t>(mesh_.vertex_count());
    const auto grow = [](auto& list, std::size_t more) {
      if (list.capacity() < list.size() + more)
        list.reserve(std::max(list.size() + more, 2 * list.capacity()));
    };
    grow(mesh_.positions, 3 * ids.size());
    grow(mesh_.normals, 3 * ids.size());
    grow(mesh_.triangles, 3 * static_cast<std::size_t>(mesh->NbTriangles()));
    Mesh::Face run;
    run.first_triangle = static_cast<std::uint32_t>(mesh_.triangle_count());
    for (const std::uint32_t id : ids) {
      for (int k = 1; k <= 3; ++k)
        mesh_.positions.push_back(static_cast<float>(points_[id].Coord(k) / kMillimetresPerMetre));
      point_of_vertex_.push_back(id);
    }
    gp_XYZ centre(0, 0, 0);
    double area = 0;
    std::vector<gp_XYZ> average(ids.size(), gp_XYZ(0, 0, 0));
    for (int t = 1; t <= mesh->NbTriangles(); ++t) {
      int a = 0, b = 0, c = 0;
      mesh->Triangle(t).Get(a, b, c);
      if (reversed) std::swap(b, c);
      const std::array<std::size_t, 3> local{static_cast<std::size_t>(a - 1),
                                             static_cast<std::size_t>(b - 1),
                                             static_cast<std::size_t>(c - 1)};
      const std::array<std::uint32_t, 3> id{ids[local[0]], ids[local[1]], ids[local[2]]};
      if (same_place(id[0], id[1]) || same_place(id[1], id[2]) || same_place(id[2], id[0]))
        continue;
      const gp_XYZ pa = points_[id[0]].XYZ(), pb = points_[id[1]].XYZ(), pc = points_[id[2]].XYZ();
      const gp_XYZ n = (pb - pa).Crossed(pc - pa);
      for (const std::size_t k : local) {
        average[k] += n;
        mesh_.triangles.push_back(base + static_cast<std::uint32_t>(k));
      }
      centre += (pa + pb + pc) * (n.Modulus() / 3);
      area += n.Modulus();
      ++run.triangle_count;
    }
    const BRepAdaptor_Surface surface(face, false);
    add_normals(surface, *mesh, reversed, average);
    run.id = surface_key(surface, reversed);
    mesh_.faces.push_back(run);
    face_centres_.push_back(area > 0 ? centre / area : centre);
    return true;
  }

  using Side = std::pair<std::uint32_t, std::uint32_t>;  // from one point to the next

  // Where solids nearly touch, faces remain that are thinner than the mesh is fine, or that end in
  // such a tip; OCCT leaves them empty or meshes them past their edges. When they are thin or
  // plane, the points on their edges are enough to fill them.
  bool close_faces() {
    std::vector<std::vector<Side>> boundaries;
    for (const TopoDS_Face& face : faces_) {
      boundaries.emplace_back();
      if (!boundary_of(face, boundaries.back())) return false;
    }
    const NodeIds place = by_position();
    const std::vector<std::uint32_t> old = std::move(mesh_.triangles);
    mesh_.triangles.clear();
    const auto triangles_of = [&](std::size_t f) {
      return std::span<const std::uint32_t>(
          old.data() + 3 * std::size_t{mesh_.faces[f].first_triangle},
          3 * std::size_t{mesh_.faces[f].triangle_count});
    };
    std::vector<bool> is_good(faces_.size());
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      for (const auto& [a, b] : boundaries[f]) used_.insert(std::minmax(place[a], place[b]));
      const auto own = triangles_of(f);
      is_good[f] = is_bounded_by(own, boundaries[f], place);
      for (std::size_t t = 0; is_good[f] && t < own.size(); ++t)
        used_.insert(std::minmax(place[point_of_vertex_[own[t]]],
                                 place[point_of_vertex_[own[t % 3 == 2 ? t - 2 : t + 1]]]));
    }
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      const auto own = triangles_of(f);
      Mesh::Face& run = mesh_.faces[f];
      run.first_triangle = static_cast<std::uint32_t>(mesh_.triangle_count());
      if (is_good[f]) {
        mesh_.triangles.insert(mesh_.triangles.end(), own.begin(), own.end());
      } else if (!fill_face(f, boundaries[f], place)) {
        return false;
      }
      run.triangle_count = static_cast<std::uint32_t>(mesh_.triangle_count()) - run.first_triangle;
    }
    return true;
  }

  bool boundary_of(const TopoDS_Face& face, std::vector<Side>& sides) {
    const bool turned = face.Orientation() == TopAbs_REVERSED;
    for (TopExp_Explorer e(face.Oriented(TopAbs_FORWARD), TopAbs_EDGE); e.More(); e.Next()) {
      const TopoDS_Edge& edge = TopoDS::Edge(e.Current());
      const bool forward = edge.Orientation() == TopAbs_FORWARD;
      if (BRep_Tool::Degenerated(edge) || (!forward && edge.Orientation() != TopAbs_REVERSED))
        continue;
      const TopoDS_Edge key = TopoDS::Edge(edge.Oriented(TopAbs_FORWARD));
      if (!edge_ids_.IsBound(key)) {  // all its faces are empty
        if (BRepAdaptor_Curve(key).GetType() != GeomAbs_Line) return false;
        edge_ids_.Bind(key,
                       {vertex_id(TopExp::FirstVertex(key)), vertex_id(TopExp::LastVertex(key))});
      }
      const NodeIds& ids = *edge_ids_.Seek(key);
      for (std::size_t i = 1; i < ids.size(); ++i)
        sides.push_back(forward != turned ? Side{ids[i - 1], ids[i]} : Side{ids[i], ids[i - 1]});
    }
    return true;
  }

  // Triangles reach exactly to the boundary: along it and between themselves all sides cancel.
  bool is_bounded_by(std::span<const std::uint32_t> triangles, const std::vector<Side>& boundary,
                     const NodeIds& place) const {
    std::map<Side, int> balance;
    const auto count = [&](std::uint32_t a, std::uint32_t b, int by) {
      const std::uint32_t p = place[a], q = place[b];
      if (p < q) balance[{p, q}] += by;
      if (q < p) balance[{q, p}] -= by;
    };
    for (std::size_t t = 0; t < triangles.size(); t += 3)
      for (std::size_t k = 0; k < 3; ++k)
        count(point_of_vertex_[triangles[t + k]], point_of_vertex_[triangles[t + (k + 1) % 3]], 1);
    for (const auto& [a, b] : boundary) count(a, b, -1);
    return std::all_of(balance.begin(), balance.end(),
                       [](const auto& entry) { return entry.second == 0; });
  }

  struct Corner {
    std::uint32_t id = 0, vertex = 0;
    double x = 0, y = 0;
  };
  using Loop = std::vector<Corner>;
  static double twice_area(const Corner& a, const Corner& b, const Corner& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  }
  static double square_distance(const Corner& a, const Corner& b) {
    return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
  }

  bool fill_face(std::size_t f, const std::vector<Side>& boundary, const NodeIds& place) {
    std::multimap<std::uint32_t, std::uint32_t> next;  // several where the boundary pinches
    for (const auto& [a, b] : boundary)
      if (place[a] != place[b]) next.emplace(place[a], place[b]);
    const gp_XYZ normal = middle_normal(f);
    const gp_Ax2 frame{gp_Pnt(), gp_Dir(normal)};
    std::vector<std::pair<double, Loop>> loops;  // with twice the area
    double area = 0, length = 0;
    while (!next.empty()) {
      Loop loop;
      std::uint32_t at = next.begin()->first;
      for (auto side = next.begin(); side != next.end(); side = next.find(at)) {
        const gp_XYZ p = points_[at].XYZ();
        loop.push_back({at, static_cast<std::uint32_t>(mesh_.vertex_count()),
                        p.Dot(frame.XDirection().XYZ()), p.Dot(frame.YDirection().XYZ())});
        point_of_vertex_.push_back(at);
        for (int k = 1; k <= 3; ++k) {
          mesh_.positions.push_back(static_cast<float>(p.Coord(k) / kMillimetresPerMetre));
          mesh_.normals.push_back(static_cast<float>(normal.Coord(k)));
        }
        at = side->second;
        next.erase(side);
      }
      if (at != loop.front().id) return false;
      double twice = 0;
      for (std::size_t i = 0; i < loop.size(); ++i) {
        const Corner& to = loop[(i + 1) % loop.size()];
        twice += twice_area(loop[0], loop[i], to);
        length += std::sqrt(square_distance(loop[i], to));
      }
      area += twice / 2;
      loops.emplace_back(twice, std::move(loop));
    }
    if (loops.empty()) return true;
    const bool is_plane = BRepAdaptor_Surface(faces_[f], false).GetType() == GeomAbs_Plane;
    if (!is_plane && 2 * std::abs(area) > chord_ * length) return false;
    face_centres_[f] = points_[loops[0].second[0].id].XYZ();
    return cut_ears(joined(std::move(loops)), area, length);
  }

  // Holes become part of the outer loop by a bridge to its nearest corner.
  static Loop joined(std::vector<std::pair<double, Loop>> loops) {
    std::stable_sort(loops.begin(), loops.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    Loop all = std::move(loops.front().second);
    for (std::size_t done = 1; done < loops.size(); ++done) {
      std::size_t nearest = done, from = 0, to = 0;
      double shortest = RealLast();
      for (std::size_t l = done; l < loops.size(); ++l)
        for (std::size_t i = 0; i < all.size(); ++i)
          for (std::size_t j = 0; j < loops[l].second.size(); ++j)
            if (const double d = square_distance(all[i], loops[l].second[j]); d < shortest) {
              shortest = d;
              nearest = l;
              from = i;
              to = j;
            }
      std::swap(loops[done], loops[nearest]);
      Loop& hole = loops[done].second;
      std::rotate(hole.begin(), hole.begin() + static_cast<std::ptrdiff_t>(to), hole.end());
      hole.push_back(hole.front());
      hole.push_back(all[from]);
      all.insert(all.begin() + static_cast<std::ptrdiff_t>(from) + 1, hole.begin(), hole.end());
    }
    return all;
  }

  // Ears with short cuts first, which joins the sides of a sliver as a zip does. The triangles
  // close in any case; they lie in the face when their areas add up to its area.
  bool cut_ears(Loop loop, double area, double length) {
    double covered = 0;
    std::vector<std::pair<double, std::size_t>> cuts;
    while (loop.size() >= 3) {
      const std::size_t n = loop.size();
      const auto before = [&](std::size_t i) -> const Corner& { return loop[(i + n - 1) % n]; };
      const auto after = [&](std::size_t i) -> const Corner& { return loop[(i + 1) % n]; };
      cuts.clear();
      for (std::size_t i = 0; i < n; ++i)
        if (twice_area(before(i), loop[i], after(i)) >= 0)
          cuts.emplace_back(square_distance(before(i), after(i)), i);
      std::sort(cuts.begin(), cuts.end());
      const auto is_free = [&](const auto& cut) {
        const Corner &a = before(cut.second), &b = loop[cut.second], &c = after(cut.second);
        if (n > 3 && used_.contains(std::minmax(a.id, c.id))) return false;
        return std::none_of(loop.begin(), loop.end(), [&](const Corner& p) {
          return p.id != a.id && p.id != b.id && p.id != c.id && twice_area(a, b, p) > 0 &&
                 twice_area(b, c, p) > 0 && twice_area(c, a, p) > 0;
        });
      };
      const auto ear = std::find_if(cuts.begin(), cuts.end(), is_free);
      const std::size_t i = ear != cuts.end() ? ear->second : cuts.empty() ? 0 : cuts[0].second;
      if (n > 3) used_.insert(std::minmax(before(i).id, after(i).id));
      covered += std::abs(twice_area(before(i), loop[i], after(i))) / 2;
      // A cut to the same place, across a bridge or a pinch, is no triangle.
      if (before(i).id != after(i).id && before(i).id != loop[i].id && loop[i].id != after(i).id)
        for (const std::uint32_t vertex : {before(i).vertex, loop[i].vertex, after(i).vertex})
          mesh_.triangles.push_back(vertex);
      loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(i));
    }
    return covered - std::abs(area) <= 0.5 * chord_ * length;
  }

  gp_XYZ middle_normal(std::size_t f) const {
    const BRepAdaptor_Surface surface(faces_[f]);
    gp_Pnt p;
    gp_Vec du, dv;
    surface.D1((surface.FirstUParameter() + surface.LastUParameter()) / 2,
               (surface.FirstVParameter() + surface.LastVParameter()) / 2, p, du, dv);
    gp_XYZ n = du.XYZ().Crossed(dv.XYZ());
    if (faces_[f].Orientation() == TopAbs_REVERSED) n.Reverse();
    n.Multiply(pose_.VectorialPart());
    return n.Modulus() > 0 ? n / n.Modulus() : gp_XYZ(0, 0, 1);
  }

  // In the mesh's single precision two nodes can fall together; a triangle on them is no triangle.
  bool same_place(std::uint32_t a, std::uint32_t b) const {
    if (a == b) return true;
    for (int k = 1; k <= 3; ++k)
      if (static_cast<float>(points_[a].Coord(k) / kMillimetresPerMetre) !=
          static_cast<float>(points_[b].Coord(k) / kMillimetresPerMetre))
        return false;
    return true;
  }

  /// Of the last `count` vertices, on a plane or a cylinder; false for other surfaces.
  bool add_plain_normals(const BRepAdaptor_Surface& surface, const gp_Mat& turn, bool reversed,
                         std::size_t count) {
    const auto put = [&](const gp_XYZ& n) {
      for (int k = 1; k <= 3; ++k) mesh_.normals.push_back(static_cast<float>(n.Coord(k)));
    };
    if (surface.GetType() == GeomAbs_Plane) {
      const gp_Ax3 frame = surface.Plane().Position();
      gp_XYZ n = frame.XDirection().XYZ().Crossed(frame.YDirection().XYZ());
      n.Multiply(turn);
      if (reversed) n.Reverse();
      for (std::size_t i = 0; i < count; ++i) put(n);
      return true;
    }
    if (surface.GetType() != GeomAbs_Cylinder) return false;
    const gp_Ax3 frame = surface.Cylinder().Position();
    gp_XYZ axis = frame.Direction().XYZ(), origin = frame.Location().XYZ();
    axis.Multiply(turn);
    pose_.Transforms(origin);
    const double sign = reversed == frame.Direct() ? -1 : 1;
    for (std::size_t i = point_of_vertex_.size() - count; i < point_of_vertex_.size(); ++i) {
      gp_XYZ n = points_[point_of_vertex_[i]].XYZ() - origin;
      n -= axis * n.Dot(axis);
      put(n * (sign / n.Modulus()));
    }
    return true;
  }

  void add_normals(const BRepAdaptor_Surface& surface, const Poly_Triangulation& mesh,
                   bool reversed, const std::vector<gp_XYZ>& average) {
    const gp_Mat turn = pose_.VectorialPart();
    if (add_plain_normals(surface, turn, reversed, average.size())) return;
    for (int i = 1; i <= mesh.NbNodes(); ++i) {
      gp_XYZ n(0, 0, 0);
      if (mesh.HasUVNodes()) {
        const gp_Pnt2d uv = mesh.UVNode(i);
        gp_Pnt p;
        gp_Vec du, dv;
        surface.D1(uv.X(), uv.Y(), p, du, dv);
        const double scale = du.Magnitude() * dv.Magnitude();
        n = du.XYZ().Crossed(dv.XYZ());
        // At a pole or an apex one derivative vanishes and so does the product.
        if (scale < 1e-9 || n.Modulus() < 1e-9 * scale) n = gp_XYZ(0, 0, 0);
        if (reversed) n.Reverse();
        n.Multiply(turn);
      }
      if (n.Modulus() == 0) n = average[static_cast<std::size_t>(i - 1)];
      const double length = n.Modulus();
      n = length > 0 ? n / length : gp_XYZ(0, 0, 1);
      for (int k = 1; k <= 3; ++k) mesh_.normals.push_back(static_cast<float>(n.Coord(k)));
    }
  }

  // Closed: every directed edge between two positions has as many opposite ones.
  bool is_closed() const {
    // Sides by their lower end, in one array: those of point i are from start[i] to start[i + 1].
    const NodeIds place = by_position();
    const std::size_t n = mesh_.triangles.size();
    std::vector<std::uint32_t> at(n), start(points_.size() + 1, 0);
    for (std::size_t k = 0; k < n; ++k) at[k] = place[point_of_vertex_[mesh_.triangles[k]]];
    const auto after = [](std::size_t k) { return k % 3 == 2 ? k - 2 : k + 1; };
    for (std::size_t k = 0; k < n; ++k) ++start[std::min(at[k], at[after(k)]) + 1];
    for (std::size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
    std::vector<std::uint64_t> sides(n);
    std::vector<std::uint32_t> filled(start.begin(), start.end() - 1);
    for (std::size_t k = 0; k < n; ++k) {
      const std::uint64_t a = at[k], b = at[after(k)];
      sides[filled[std::min(a, b)]++] = a < b ? b << 1 : (a << 1 | 1);
    }
    for (std::size_t i = 0; i + 1 < start.size(); ++i) {
      std::sort(sides.begin() + start[i], sides.begin() + start[i + 1]);
      for (std::size_t k = start[i]; k < start[i + 1];) {
        long balance = 0;
        const std::uint64_t other = sides[k] >> 1;
        for (; k < start[i + 1] && sides[k] >> 1 == other; ++k) balance += (sides[k] & 1) ? 1 : -1;
        if (balance != 0) return false;
      }
    }
    return true;
  }

  // Points that single precision makes equal count as one.
  NodeIds by_position() const {
    struct PlaceHash {
      std::size_t operator()(const std::array<float, 3>& p) const {
        std::uint64_t h = 0;
        for (const float x : p) {
          std::uint32_t bits = 0;
          std::memcpy(&bits, &x, sizeof bits);
          h = (h ^ bits) * 0x9e3779b97f4a7c15ULL;
          h ^= h >> 29;
        }
        return h;
      }
    };
    std::unordered_map<std::array<float, 3>, std::uint32_t, PlaceHash> first;
    first.reserve(points_.size());
    NodeIds place(points_.size());
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
      std::array<float, 3> p{};
      for (int k = 0; k < 3; ++k)
        p[static_cast<std::size_t>(k)] =
            static_cast<float>(points_[i].Coord(k + 1) / kMillimetresPerMetre) + 0.0F;
      place[i] = first.try_emplace(p, i).first->second;
    }
    return place;
  }

  static bool normal_at(const TopoDS_Edge& edge, const TopoDS_Face& face, double share,
                        gp_XYZ& normal) {
    double first = 0, last = 0;
    const Handle(Geom2d_Curve) curve = BRep_Tool::CurveOnSurface(edge, face, first, last);
    if (curve.IsNull()) return false;
    const gp_Pnt2d uv = curve->Value(first + share * (last - first));
    const BRepAdaptor_Surface surface(face, false);
    gp_Pnt p;
    gp_Vec du, dv;
    surface.D1(uv.X(), uv.Y(), p, du, dv);
    normal = du.XYZ().Crossed(dv.XYZ());
    const double length = normal.Modulus();
    if (length < 1e-12) return false;
    normal /= face.Orientation() == TopAbs_REVERSED ? -length : length;
    return true;
  }

  static bool is_smooth(const TopoDS_Edge& edge, const TopoDS_Face& a, const TopoDS_Face& b) {
    for (const double share : {0.23, 0.5, 0.81}) {
      gp_XYZ na, nb;
      if (!normal_at(edge, a, share, na) || !normal_at(edge, b, share, nb)) return false;
      if (na.Crossed(nb).Modulus() > kSmoothAngle || na.Dot(nb) < 0) return false;
    }
    return true;
  }

  void add_edges() {
    for (int i = 1; i <= edge_faces_.Extent(); ++i) {
      const TopoDS_Edge edge = TopoDS::Edge(edge_faces_.FindKey(i).Oriented(TopAbs_FORWARD));
      const NodeIds* ids = edge_ids_.Seek(edge);
      if (!ids || BRep_Tool::Degenerated(edge)) continue;
      const auto& faces = edge_faces_(i);
      if (faces.Extent() == 1) continue;  // a seam: the same face on both sides
      if (faces.Extent() == 2 &&
          is_smooth(edge, TopoDS::Face(faces.First()), TopoDS::Face(faces.Last())))
        continue;
      for (const std::uint32_t id : *ids)
        for (int k = 1; k <= 3; ++k)
          mesh_.edge_points.push_back(
              static_cast<float>(points_[id].Coord(k) / kMillimetresPerMetre));
      mesh_.edge_sizes.push_back(static_cast<std::uint32_t>(ids->size()));
    }
  }

  const TopoDS_Shape& shape_;
  gp_Trsf pose_;
  double chord_;  // [mm]
  bool has_empty_face_ = false;
  std::set<Side> used_;             // sides of triangles, so that no two faces make the same one
  std::vector<TopoDS_Face> faces_;  // as in mesh_.faces
  Mesh mesh_;
  std::vector<gp_Pnt> points_;  // [mm], one per position that topology tells apart
  NodeIds point_of_vertex_;
  std::vector<gp_XYZ> face_centres_;
  TopTools_IndexedDataMapOfShapeListOfShape edge_faces_;
  NCollection_DataMap<TopoDS_Shape, std::uint32_t, TopTools_ShapeMapHasher> vertex_ids_;
  NCollection_DataMap<TopoDS_Shape, NodeIds, TopTools_ShapeMapHasher> edge_ids_;
};

/// Several faces on one surface are told apart by the order of their centres.
void number_equal_surfaces(Mesh& mesh, const std::vector<gp_XYZ>& centres) {
  std::map<std::uint64_t, std::vector<std::size_t>> same;
  for (std::size_t i = 0; i < mesh.faces.size(); ++i) same[mesh.faces[i].id].push_back(i);
  for (auto& [id, faces] : same) {
    const auto before = [&](std::size_t a, std::size_t b) {
      for (int k = 1; k <= 3; ++k) {
        const double d = centres[a].Coord(k) - centres[b].Coord(k);
        if (std::abs(d) > 1e-6) return d < 0;
      }
      return a < b;
    };
    std::stable_sort(faces.begin(), faces.end(), before);
    for (std::size_t n = 1; n < faces.size(); ++n) {
      Key key;
      key.mix(id);
      key.mix(static_cast<std::uint64_t>(n));
      mesh.faces[faces[n]].id = key.a;
    }
  }
}

TopoDS_Compound compound_of(const std::vector<TopoDS_Shape>& shapes) {
  BRep_Builder builder;
  TopoDS_Compound compound;
  builder.MakeCompound(compound);
  for (const TopoDS_Shape& s : shapes) builder.Add(compound, s);
  return compound;
}

/// A compound for each set of solids that touch; what touches nothing is as it is.
TopoDS_Compound compound_of_sets(const std::vector<Solid>& solids, const Progress& progress) {
  std::vector<const Bnd_Box*> boxes;
  for (const Solid& s : solids) boxes.push_back(&s.box);
  std::vector<TopoDS_Shape> sets;
  for (const auto& set : touching_sets(
           boxes, [](std::size_t, std::size_t) { return true; }, progress)) {
    std::vector<TopoDS_Shape> members;
    for (const std::size_t i : set) members.push_back(solids[i].shape);
    sets.push_back(members.size() == 1 ? members[0] : compound_of(members));
  }
  return compound_of(sets);
}

Result<void> check_quality(const MeshQuality& quality, double extent) {
  const auto bad = [](std::string what) {
    return error(ErrorCode::invalid_argument, std::move(what));
  };
  if (!(quality.chord > 0) || !std::isfinite(quality.chord))
    return bad("mesh chord is " + csg_number_text(quality.chord) + " m; it must be greater than 0");
  const double finest = kFinestChordShare * extent / kMillimetresPerMetre;
  if (quality.chord < finest)
    return bad("mesh chord is " + csg_number_text(quality.chord) + " m; for a solid of this size " +
               csg_number_text(finest) + " m is the finest");
  if (!(quality.angle >= kFinestAngle) || !std::isfinite(quality.angle))
    return bad("mesh angle is " + csg_number_text(quality.angle) + " rad; it must be at least " +
               csg_number_text(kFinestAngle) + " rad");
  return {};
}

}  // namespace

Result<Mesh> mesh_solids(const std::vector<Solid>& solids, const gp_Trsf& pose,
                         const MeshQuality& quality, Progress& progress) {
  if (progress.cancelled()) return cancelled_error();
  RMP_TRY(check_quality(quality, extent_of(solids)));
  // First on the shared topology, which keeps the triangles of faces that an edit did not touch;
  // should that not close, on a private copy, by the fast and then by the sturdy algorithm.
  for (int attempt = 0; attempt < 3; ++attempt) {
    TopoDS_Shape shape = compound_of_sets(solids, progress);
    if (progress.cancelled()) return cancelled_error();
    if (attempt > 0) shape = BRepBuilderAPI_Copy(shape, true, false).Shape();
    Unmeshed unmeshed = find_unmeshed(shape, quality);
    if (attempt == 0 && unmeshed.has_other_quality) {
      BRepTools::Clean(shape);
      unmeshed = find_unmeshed(shape, quality);
    }
    RMP_TRY(triangulate(shape, unmeshed.faces, quality, attempt == 0, attempt < 2, progress));
    Mesh mesh;
    std::vector<gp_XYZ> centres;
    bool is_closed = true;
    for (TopoDS_Iterator set(shape); is_closed && set.More(); set.Next()) {
      if (progress.cancelled()) return cancelled_error();
      MeshBuilder builder(set.Value(), pose, quality.chord * kMillimetresPerMetre);
      is_closed = builder.run();
      if (is_closed) builder.append_to(mesh, centres);
    }
    if (is_closed) {
      number_equal_surfaces(mesh, centres);
      progress.report(1, "meshed");
      return mesh;
    }
    if (progress.cancelled()) return cancelled_error();
  }
  return error(ErrorCode::plugin_failed, "the mesh does not close",
               "Request a finer mesh, or move the solid's parts slightly.");
}

}  // namespace robomosp::csg_occt
